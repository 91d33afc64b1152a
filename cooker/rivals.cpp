// SPDX-License-Identifier: MIT
#include "rivals.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>

#include "draco_mesh.h"
#include "parallel.h"

namespace rill::cooker {
namespace {

struct Method {
    size_t curve;
    double keep;  ///< share of the triangles
    int bits;
};
const char* const curve_names[] = {"Draco, full mesh", "meshoptimizer, then Draco"};
const Method methods[] = {{0, 1, 8},      {0, 1, 9},      {0, 1, 10},     {0, 1, 11},     {0, 1, 12},     {1, 0.5, 11},
                          {1, 0.25, 11},  {1, 0.12, 11},  {1, 0.06, 11},  {1, 0.03, 11},  {1, 0.015, 10}, {1, 0.008, 10}};
constexpr size_t method_count = std::size(methods);

Mesh simplify(const Mesh& mesh, double keep) {
    if (keep >= 1 || mesh.triangles.empty()) return mesh;
    std::vector<uint32_t> indices(mesh.triangles.size() * 3);
    const size_t target = size_t(double(mesh.triangles.size()) * keep) * 3;
    indices.resize(meshopt_simplify(indices.data(), mesh.triangles[0].data(), mesh.triangles.size() * 3, &mesh.positions[0].x,
                                    mesh.positions.size(), sizeof(glm::vec3), target, 1.0f, 0, nullptr));
    Mesh result;
    std::vector<uint32_t> place(mesh.positions.size(), UINT32_MAX);
    for (size_t i = 0; i < indices.size(); i += 3) {
        Triangle t;
        for (int k = 0; k < 3; ++k) {
            uint32_t& at = place[indices[i + k]];
            if (at == UINT32_MAX) at = uint32_t(result.positions.size()), result.positions.push_back(mesh.positions[indices[i + k]]);
            t[k] = at;
        }
        result.triangles.push_back(t);
    }
    return result;
}

struct Measured {
    double bytes = 0, triangles = 0, encode_ms = 0, decode_ms = 0;
    SurfaceDistance distance;
};

Measured measure(const Mesh& source, const SurfaceIndex& index, const Method& method, const std::string& name) {
    using clock = std::chrono::steady_clock;
    auto milliseconds = [](clock::time_point a, clock::time_point b) { return std::chrono::duration<double, std::milli>(b - a).count(); };
    Measured result;
    const auto start = clock::now();
    const std::string bytes = draco_encode(simplify(source, method.keep), method.bits);
    const auto encoded = clock::now();
    const Mesh decoded = draco_decode(bytes, name);
    result.decode_ms = milliseconds(encoded, clock::now()), result.encode_ms = milliseconds(start, encoded);
    result.bytes = double(bytes.size()), result.triangles = double(decoded.triangles.size());
    result.distance = surface_distance(source, index, decoded, SurfaceIndex(decoded));
    return result;
}

RatePoint sum_up(const std::vector<std::array<Measured, method_count>>& frames, size_t method) {
    RatePoint point;
    DistanceHistogram all;
    double area = 0;
    for (const auto& frame : frames) {
        const Measured& m = frame[method];
        double frame_area = 0;
        for (double a : m.distance.histogram.area) frame_area += a;
        all.add(m.distance.histogram);
        area += frame_area;
        if (frame_area > 0) point.mean += frame_area * m.distance.mean, point.normal_degrees += frame_area * m.distance.normal_degrees;
        point.max = std::max(point.max, m.distance.max);
        point.bytes_per_frame += m.bytes, point.triangles_per_frame += m.triangles;
        point.encode_ms += m.encode_ms, point.decode_ms += m.decode_ms;
    }
    const double count = std::max<double>(1, double(frames.size()));
    if (area > 0) point.mean /= area, point.normal_degrees /= area;
    for (double* value : {&point.bytes_per_frame, &point.triangles_per_frame, &point.encode_ms, &point.decode_ms}) *value /= count;
    point.p99 = all.quantile(0.99);
    const Method& m = methods[method];
    point.setting = std::to_string(m.bits) + " bits";
    if (m.keep < 1) {
        std::string percent = std::to_string(m.keep * 100);
        percent = percent.substr(0, percent.find('.') + 2);
        point.setting = percent + " % of the triangles, " + point.setting;
    }
    return point;
}

}  // namespace

double RateCurve::bytes_at(double RatePoint::*error, double value) const {
    std::vector<RatePoint> sorted = points;
    std::sort(sorted.begin(), sorted.end(), [](const RatePoint& a, const RatePoint& b) { return a.bytes_per_frame < b.bytes_per_frame; });
    double best = 0;
    for (size_t i = 1; i < sorted.size(); ++i) {
        const double more = sorted[i - 1].*error, less = sorted[i].*error;
        if (!(value <= more && value >= less) || !(less > 0) || !std::isfinite(more)) continue;
        const double share = more > less ? std::log(more / value) / std::log(more / less) : 0;
        const double bytes = sorted[i - 1].bytes_per_frame * std::pow(sorted[i].bytes_per_frame / sorted[i - 1].bytes_per_frame, share);
        best = best == 0 ? bytes : std::min(best, bytes);
    }
    return best;
}

std::vector<RateCurve> measure_rivals(const SequenceReader& source, const std::vector<size_t>& frames, int jobs,
                                      const std::function<void(uint32_t, uint32_t)>& progress) {
    std::vector<std::array<Measured, method_count>> measured(frames.size());
    std::mutex mutex;
    uint32_t done = 0;
    parallel_for(frames.size(), jobs, [&](size_t i) {
        Mesh mesh = source.read(frames[i]);
        mesh.velocities.clear();
        const SurfaceIndex index(mesh);
        for (size_t m = 0; m < method_count; ++m) measured[i][m] = measure(mesh, index, methods[m], source.name(frames[i]));
        const std::lock_guard lock(mutex);
        if (progress) progress(++done, uint32_t(frames.size()));
    });
    std::vector<RateCurve> curves;
    for (const char* name : curve_names) curves.push_back({name, {}});
    for (size_t m = 0; m < method_count; ++m) curves[methods[m].curve].points.push_back(sum_up(measured, m));
    return curves;
}

}  // namespace rill::cooker
