// SPDX-License-Identifier: MIT
// What others make of the same frames: size against error of meshes coded one by one.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "readers/reader.h"
#include "surface_distance.h"

namespace rill::cooker {

/// One setting of one method, over all frames measured.
struct RatePoint {
    std::string setting;              ///< "10 bits", "12 % of the triangles, 11 bits"
    double bytes_per_frame = 0, triangles_per_frame = 0;
    double mean = 0, p99 = 0, max = 0;  ///< metres
    double normal_degrees = 0;
    double encode_ms = 0, decode_ms = 0;  ///< per frame, one core
};
struct RateCurve {
    std::string method;
    std::vector<RatePoint> points;
    /// Bytes per frame at which the curve reaches an error, between its points on log–log axes; 0 where it does not.
    double bytes_at(double RatePoint::*error, double value) const;
};
/// Full meshes through Draco (8 to 12 bits), and meshes simplified by meshoptimizer, then Draco. Positions
/// only; `source` frames by index.
std::vector<RateCurve> measure_rivals(const SequenceReader& source, const std::vector<size_t>& frames, int jobs,
                                      const std::function<void(uint32_t done, uint32_t total)>& progress);

}  // namespace rill::cooker
