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
/// What jumps when cells and layers change under a camera that moves away, the liquid standing still; over the vertices of the
/// surfaces before and after each change, each to the other surface, in pixels at that place.
struct CameraJumps {
    uint32_t moves = 0, changes = 0;      ///< of the camera; those that changed the surface
    double mean = 0, p99 = 0, max = 0;    ///< pixels
    double above = 0;                     ///< share of the vertices that jump by more than pixel_error_asked
};
/// From 1 to 8 diagonals, by a thirtieth of the distance a move, at most three of the frames.
CameraJumps camera_jumps(BenchPlayer& player, const std::vector<uint32_t>& frames);

/// At 1, 2, 4, … diagonals, on at most eight of the frames.
std::vector<ScreenError> screen_errors(BenchPlayer& player, const std::vector<uint32_t>& frames);

}  // namespace rill::cooker
