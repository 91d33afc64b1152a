// SPDX-License-Identifier: MIT
// What others make of the same frames: size against error of meshes coded one by one.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "measure/surface_distance.h"
#include "readers/reader.h"

namespace rill::cooker {

/// One setting of one method, over all frames measured.
struct RatePoint {
    std::string setting;              ///< "10 bits", "12 % of the triangles, 11 bits"
    double bytes_per_frame = 0, bytes_with_velocity = 0, triangles_per_frame = 0;
    double mean = 0, p99 = 0, max = 0;  ///< metres
    double normal_degrees = 0;
    double encode_ms = 0, decode_ms = 0;  ///< per frame, one core, positions only
};
struct RateCurve {
    std::string method;
    std::vector<RatePoint> points;
    /// Bytes (RatePoint::bytes_per_frame or …_with_velocity) at which the lower convex hull of the curve on log–log
    /// axes reaches an error; 0 where it does not.
    double bytes_at(double RatePoint::*bytes, double RatePoint::*error, double value) const;
};
struct RivalSettings {
    /// Program that simplifies: PROGRAM IN.ply KEEP OUT.ply [KEEP OUT.ply …], KEEP the share of edges; its triangles go
    /// through Draco as meshoptimizer's do. Empty: none. tests/bench builds one, of CGAL's Lindstrom–Turk.
    std::string decimator;
    int jobs = 0;
};
/// Full meshes through Draco (6 to 12 bits) and through meshoptimizer's codec and zstd, and meshes simplified, then
/// Draco. `frames` by index into the source; velocities cost 9 bits a component. Throws InputError.
std::vector<RateCurve> measure_rivals(const SequenceReader& source, const std::vector<size_t>& frames,
                                      const RivalSettings& settings,
                                      const std::function<void(uint32_t, uint32_t)>& progress);

}  // namespace rill::cooker
