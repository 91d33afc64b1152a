// SPDX-License-Identifier: MIT
#include "measure/surface_distance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "common/parallel.h"

namespace rill::cooker {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

struct Sample {
    float distance, weight;
};
/// Everything one direction adds up; two of them pool into the symmetric figures.
struct Sums {
    std::vector<Sample> samples;
    double weight = 0, distance = 0, maximum = 0, degrees = 0, degrees_weight = 0;

    void add(float d, double w) {
        samples.push_back({d, float(w)});
        weight += w, distance += w * d, maximum = std::max(maximum, double(d));
    }
    void add_angle(const glm::vec3& m, const glm::vec3& n, double w) {
        const glm::dvec3 a(m), b(n);
        if (glm::dot(a, a) == 0 || glm::dot(b, b) == 0) return;
        // atan2 keeps its digits near 0 and 180 degrees, where acos loses them.
        degrees += w * std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 57.295779513082320877;
        degrees_weight += w;
    }
    void add(const Sums& other) {
        samples.insert(samples.end(), other.samples.begin(), other.samples.end());
        weight += other.weight, distance += other.distance, maximum = std::max(maximum, other.maximum);
        degrees += other.degrees, degrees_weight += other.degrees_weight;
    }
    /// The distance that 99 % of the area keeps below. Only the farthest are put in order, as many as it takes.
    double p99() {
        const auto farther = [](const Sample& a, const Sample& b) { return a.distance > b.distance; };
        double above = weight * 0.01;
        for (size_t first = 0, run = samples.size() / 32 + 1; first < samples.size(); first += run, run *= 2) {
            const auto begin = samples.begin() + ptrdiff_t(first), end = begin + ptrdiff_t(std::min(run, samples.size() - first));
            std::nth_element(begin, end - 1, samples.end(), farther);
            std::sort(begin, end, farther);
            for (auto sample = begin; sample != end; ++sample)
                if ((above -= sample->weight) < 0) return sample->distance;
        }
        return samples.empty() ? 0 : samples.front().distance;
    }
    DirectedDistance result() {
        return {weight > 0 ? distance / weight : 0, p99(), maximum, degrees_weight > 0 ? degrees / degrees_weight : 0};
    }
};

/// Per triangle, ¾ of the area at the centroid and 1/12 at each corner: exact for quadratic functions.
Sums measure(const Mesh& from, const std::vector<glm::vec3>& from_normals, const SurfaceIndex& to,
             const std::vector<glm::vec3>& to_normals, size_t stride, std::vector<float>* per_vertex) {
    Sums sums;
    sums.samples.reserve(from.positions.size() + from.triangles.size());
    std::vector<double> weights(from.positions.size(), 0.0);
    std::vector<bool> used(from.positions.size(), false);
    SurfaceIndex::Near near;
    auto sample = [&](const glm::vec3& x, const glm::vec3& normal, double weight) {
        const SurfaceIndex::Hit hit = to.closest(x, infinity, &near);
        sums.add(hit.distance, weight);
        sums.add_angle(normal, value_at(hit, to.mesh().triangles[hit.triangle], to_normals), weight);
        return hit.distance;
    };
    for (size_t i = 0; i < from.triangles.size(); ++i) {
        const Triangle& t = from.triangles[i];
        const glm::vec3 a = from.positions[t[0]], b = from.positions[t[1]], c = from.positions[t[2]];
        const double area = 0.5 * glm::length(glm::dvec3(glm::cross(b - a, c - a)));
        for (uint32_t v : t) weights[v] += area / 12, used[v] = true;
        if (i % stride == 0) sample((a + b + c) / 3.0f, from_normals[t[0]] + from_normals[t[1]] + from_normals[t[2]], area * 0.75);
    }
    if (per_vertex) per_vertex->assign(from.positions.size(), 0.0f);
    for (size_t v = 0; v < weights.size(); ++v) {
        if (!used[v] || v % stride) continue;
        const float distance = sample(from.positions[v], from_normals[v], weights[v]);
        if (per_vertex) (*per_vertex)[v] = distance;
    }
    return sums;
}

constexpr int mantissa_bits = 4;                         // 16 bins to the octave
constexpr int shift = 23 - mantissa_bits;                // a float's bits, cut off there, count up with its value
constexpr size_t bins = (0x7f800000u >> shift) + 1;      // up to and with infinity

}  // namespace

std::vector<uint32_t> find_beyond(const SurfaceIndex& surface, const std::vector<glm::vec3>& positions, float beyond, int jobs) {
    std::vector<uint8_t> far(positions.size());
    constexpr size_t batch = 1024;
    parallel_for((far.size() + batch - 1) / batch, jobs, [&](size_t part) {
        SurfaceIndex::Near near;
        for (size_t i = part * batch; i < std::min(far.size(), (part + 1) * batch); ++i) far[i] = !surface.within(positions[i], beyond, &near);
    });
    std::vector<uint32_t> found;
    for (uint32_t i = 0; i < far.size(); ++i)
        if (far[i]) found.push_back(i);
    return found;
}

void DistanceHistogram::add(float distance, double weight) {
    if (area.empty()) area.resize(bins);
    area[std::min<size_t>(std::bit_cast<uint32_t>(std::abs(distance)) >> shift, bins - 1)] += weight;
}

void DistanceHistogram::add(const DistanceHistogram& other) {
    if (area.empty()) area.resize(bins);
    for (size_t i = 0; i < other.area.size(); ++i) area[i] += other.area[i];
}

float DistanceHistogram::distance_of(size_t bin) { return std::bit_cast<float>(uint32_t(std::min(bin, bins - 1)) << shift); }

double DistanceHistogram::quantile(double q) const {
    double total = 0, below = 0;
    for (double a : area) total += a;
    if (total == 0) return 0;
    for (size_t i = 0; i < area.size(); ++i) {
        if (area[i] > 0 && below + area[i] >= q * total) {
            if (i + 1 >= bins) return infinity;
            const double share = (q * total - below) / area[i];
            return distance_of(i) + share * (double(distance_of(i + 1)) - distance_of(i));
        }
        below += area[i];
    }
    return 0;
}

double DistanceHistogram::share_below(double distance) const {
    double total = 0, below = 0;
    for (size_t i = 0; i < area.size(); ++i) total += area[i], below += double(distance_of(i)) < distance ? area[i] : 0;
    return total > 0 ? below / total : 1;
}

void Spread::add(float value, double area) {
    histogram.add(value, area);
    weight += area, sum += area * value, max = std::max(max, double(value));
}
void Spread::add(const SurfaceDistance& distance) {
    double area = 0;
    for (double a : distance.histogram.area) area += a;
    histogram.add(distance.histogram);
    weight += area, sum += area * distance.mean, max = std::max(max, distance.max);
}
void Spread::add(const Spread& other) {
    histogram.add(other.histogram);
    weight += other.weight, sum += other.sum, max = std::max(max, other.max);
}

Topology topology(const Mesh& mesh, double cell) {
    Topology result;
    result.volume = signed_volume(mesh);
    std::vector<std::pair<uint64_t, bool>> edges;  // (lower, higher vertex), whether walked upwards
    edges.reserve(mesh.triangles.size() * 3);
    for (const Triangle& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            const uint32_t a = t[k], b = t[(k + 1) % 3];
            edges.emplace_back(uint64_t(std::min(a, b)) << 32 | std::max(a, b), a < b);
        }
    std::sort(edges.begin(), edges.end());
    for (size_t i = 0, next; i < edges.size(); i = next) {
        for (next = i + 1; next < edges.size() && edges[next].first == edges[i].first;) ++next;
        if (next - i == 1)
            ++result.open_edges;
        else if (next - i > 2 || edges[i].second == edges[i + 1].second)
            ++result.non_manifold_edges;
    }
    const std::vector<double> volumes = component_volumes(mesh);
    result.components = uint32_t(volumes.size());
    for (double volume : volumes) result.large_components += std::abs(volume) > large_cells * cell * cell * cell;
    return result;
}

std::vector<double> component_volumes(const Mesh& mesh) {
    const std::vector<uint32_t> component = label_components(mesh);
    const std::vector<double> of_label = label_volumes(mesh, component);
    std::vector<bool> used(mesh.positions.size(), false);
    for (const Triangle& t : mesh.triangles) used[component[t[0]]] = true;
    std::vector<double> volumes;
    for (size_t v = 0; v < used.size(); ++v)
        if (used[v]) volumes.push_back(of_label[v]);
    std::sort(volumes.begin(), volumes.end(), std::greater<>());
    return volumes;
}

SurfaceDistance surface_distance(const Mesh& source, const SurfaceIndex& source_index, const Mesh& decoded,
                                 const SurfaceIndex& decoded_index, bool keep_per_vertex, size_t stride) {
    SurfaceDistance result;
    if (source.triangles.empty() && decoded.triangles.empty()) return result;
    if (source.triangles.empty() || decoded.triangles.empty()) {
        result.forward = result.backward = {infinity, infinity, infinity, 0};
        result.mean = result.p99 = result.max = infinity;
        const Mesh& there = source.triangles.empty() ? decoded : source;
        for (const Triangle& t : there.triangles) {
            const glm::vec3 a = there.positions[t[0]];
            result.histogram.add(infinity, 0.5 * glm::length(glm::cross(there.positions[t[1]] - a, there.positions[t[2]] - a)));
        }
        if (keep_per_vertex) {
            result.per_source_vertex.assign(source.positions.size(), infinity);
            result.per_decoded_vertex.assign(decoded.positions.size(), infinity);
        }
        return result;
    }
    const std::vector<glm::vec3> source_normals = source.normals.empty() ? vertex_normals(source) : source.normals;
    const std::vector<glm::vec3> decoded_normals = decoded.normals.empty() ? vertex_normals(decoded) : decoded.normals;
    Sums forward = measure(source, source_normals, decoded_index, decoded_normals, stride,
                           keep_per_vertex ? &result.per_source_vertex : nullptr);
    Sums backward = measure(decoded, decoded_normals, source_index, source_normals, stride,
                            keep_per_vertex ? &result.per_decoded_vertex : nullptr);
    result.forward = forward.result(), result.backward = backward.result();
    forward.add(backward);
    for (const Sample& sample : forward.samples) result.histogram.add(sample.distance, sample.weight);
    const DirectedDistance both = forward.result();
    result.mean = both.mean, result.p99 = both.p99, result.max = both.max, result.normal_degrees = both.normal_degrees;
    return result;
}

}  // namespace rill::cooker
