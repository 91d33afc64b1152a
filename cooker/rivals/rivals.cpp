// SPDX-License-Identifier: MIT
#include "rivals/rivals.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>

#include "common/parallel.h"
#include "readers/draco_mesh.h"
#include "rivals/decimated_meshes.h"
#include "rivals/meshopt_mesh.h"

namespace rill::cooker {
namespace {

enum Curve : size_t { draco_full, meshopt_full, meshopt_draco, decimator_draco, curves };
const char* const curve_names[] = {"Draco, full mesh", "meshoptimizer's codec and zstd, full mesh",
                                   "meshoptimizer's simplifier, then Draco", "decimator, then Draco"};
constexpr int velocity_bits = 9;

struct Method {
    Curve curve;
    size_t keep;  ///< index into `keeps`; 0: all
    int bits;
};
const std::vector<double> keeps = {1, 0.5, 0.3, 0.2, 0.12, 0.08, 0.05, 0.03, 0.02, 0.012, 0.008};

std::vector<Method> all_methods(bool decimator) {
    std::vector<Method> methods;
    for (int bits = 6; bits <= 12; ++bits) methods.push_back({draco_full, 0, bits});
    for (int bits = 8; bits <= 14; bits += 2) methods.push_back({meshopt_full, 0, bits});
    for (const Curve curve : {meshopt_draco, decimator_draco})
        for (size_t keep = 1; keep < keeps.size() && (curve == meshopt_draco || decimator); ++keep)
            for (int bits = 8; bits <= 11; ++bits) methods.push_back({curve, keep, bits});
    return methods;
}

struct Measured {
    double bytes = 0, bytes_with_velocity = 0, triangles = 0, encode_ms = 0, decode_ms = 0;
    SurfaceDistance distance;
};

Measured measure(const Mesh& source, const SurfaceIndex& index, const Mesh& simplified, const Method& method,
                 const std::string& name) {
    using clock = std::chrono::steady_clock;
    const auto milliseconds = [](clock::time_point a, clock::time_point b) {
        return std::chrono::duration<double, std::milli>(b - a).count();
    };
    const auto encode = [&](const Mesh& mesh) {
        return method.curve == meshopt_full ? meshopt_encode(mesh, method.bits, velocity_bits)
                                            : draco_encode(mesh, method.bits, velocity_bits);
    };
    Measured result;
    Mesh bare = simplified;
    bare.velocities.clear();
    const auto start = clock::now();
    const std::string bytes = encode(bare);
    const auto encoded = clock::now();
    const Mesh decoded = method.curve == meshopt_full ? meshopt_decode(bytes) : draco_decode(bytes, name);
    result.decode_ms = milliseconds(encoded, clock::now()), result.encode_ms = milliseconds(start, encoded);
    result.bytes = double(bytes.size()), result.triangles = double(decoded.triangles.size());
    result.bytes_with_velocity = simplified.velocities.empty() ? result.bytes : double(encode(simplified).size());
    result.distance = surface_distance(source, index, decoded, SurfaceIndex(decoded));
    return result;
}

RatePoint sum_up(const std::vector<std::vector<Measured>>& frames, size_t index, const Method& method) {
    RatePoint point;
    DistanceHistogram all;
    double area = 0;
    for (const auto& frame : frames) {
        const Measured& m = frame[index];
        double frame_area = 0;
        for (double a : m.distance.histogram.area) frame_area += a;
        all.add(m.distance.histogram);
        area += frame_area;
        if (frame_area > 0) point.mean += frame_area * m.distance.mean, point.normal_degrees += frame_area * m.distance.normal_degrees;
        point.max = std::max(point.max, m.distance.max);
        point.bytes_per_frame += m.bytes, point.bytes_with_velocity += m.bytes_with_velocity;
        point.triangles_per_frame += m.triangles, point.encode_ms += m.encode_ms, point.decode_ms += m.decode_ms;
    }
    const double count = std::max<double>(1, double(frames.size()));
    if (area > 0) point.mean /= area, point.normal_degrees /= area;
    for (double* value : {&point.bytes_per_frame, &point.bytes_with_velocity, &point.triangles_per_frame, &point.encode_ms, &point.decode_ms})
        *value /= count;
    point.p99 = all.quantile(0.99);
    char text[64];
    if (method.keep == 0) std::snprintf(text, sizeof text, "%d bits", method.bits);
    else std::snprintf(text, sizeof text, "%g %% kept, %d bits", keeps[method.keep] * 100, method.bits);
    point.setting = text;
    return point;
}

}  // namespace

double RateCurve::bytes_at(double RatePoint::*bytes, double RatePoint::*error, double value) const {
    std::vector<std::pair<double, double>> all, hull;  // log error ascending, log bytes
    for (const RatePoint& p : points)
        if (p.*error > 0 && std::isfinite(p.*error) && p.*bytes > 0) all.emplace_back(std::log(p.*error), std::log(p.*bytes));
    std::sort(all.begin(), all.end());
    for (const auto& p : all) {
        const auto above = [&](const auto& a, const auto& b) {  // b lies on or above the line from a to p
            return (b.second - a.second) * (p.first - a.first) >= (p.second - a.second) * (b.first - a.first);
        };
        if (!hull.empty() && hull.back().second <= p.second) continue;  // worse and no smaller
        while (hull.size() >= 2 && above(hull[hull.size() - 2], hull.back())) hull.pop_back();
        hull.push_back(p);
    }
    if (!(value > 0)) return 0;
    const double wanted = std::log(value);
    for (size_t i = 1; i < hull.size(); ++i) {
        const auto [e0, b0] = hull[i - 1];
        const auto [e1, b1] = hull[i];
        if (wanted >= e0 && wanted <= e1) return std::exp(b0 + (b1 - b0) * (wanted - e0) / (e1 - e0));
    }
    return 0;
}

std::vector<RateCurve> measure_rivals(const SequenceReader& source, const std::vector<size_t>& frames,
                                      const RivalSettings& settings,
                                      const std::function<void(uint32_t, uint32_t)>& progress) {
    const std::vector<Method> methods = all_methods(!settings.decimator.empty());
    std::vector<std::vector<Measured>> measured(frames.size());
    std::mutex mutex;
    uint32_t done = 0;
    parallel_for(frames.size(), settings.jobs, [&](size_t i) {
        const Mesh mesh = source.read(frames[i]);
        const SurfaceIndex index(mesh);
        std::vector<Mesh> simplified[curves];
        simplified[meshopt_draco] = decimate_by_meshoptimizer(mesh, keeps);
        if (!settings.decimator.empty()) simplified[decimator_draco] = decimate_by_program(settings.decimator, mesh, keeps);
        for (const Method& method : methods)
            measured[i].push_back(measure(mesh, index, method.keep == 0 ? mesh : simplified[method.curve][method.keep], method,
                                          source.name(frames[i])));
        const std::lock_guard lock(mutex);
        if (progress) progress(++done, uint32_t(frames.size()));
    });
    std::vector<RateCurve> result;
    for (size_t c = 0; c < curves; ++c) {
        RateCurve curve{curve_names[c], {}};
        for (size_t m = 0; m < methods.size(); ++m)
            if (methods[m].curve == c) curve.points.push_back(sum_up(measured, m, methods[m]));
        if (!curve.points.empty()) result.push_back(std::move(curve));
    }
    return result;
}

}  // namespace rill::cooker
