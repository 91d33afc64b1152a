// SPDX-License-Identifier: MIT
// What less detail looks like: views from ever further away, against the surface at the source's resolution.
#pragma once
#include <vector>

#include "commands/bench_player.h"

namespace rill::cooker {

inline constexpr float pixels_per_radian = 1000;  // about 1080 lines under 62 degrees
inline constexpr float pixel_error_asked = 2;     // size of a cell on the screen: the runtime's own choice when not told

/// Seen from one distance; over the vertices of both surfaces, each to the other surface, in pixels at that place.
struct ScreenError {
    float diagonals = 0;                  ///< distance of the eye from the middle of the bounds, in their diagonals
    double mean = 0, p99 = 0, max = 0;    ///< pixels
    double triangles = 0;                 ///< share of those at the source's resolution
};
/// At 1, 2, 4, … diagonals, on at most eight of the frames.
std::vector<ScreenError> screen_errors(BenchPlayer& player, const std::vector<uint32_t>& frames);

}  // namespace rill::cooker
