// SPDX-License-Identifier: MIT
// What less detail looks like: views from ever further away, against the surface at the source's resolution.
#pragma once
#include <vector>

#include "commands/bench_player.h"
#include "measure/surface_distance.h"

namespace rill::cooker {

inline constexpr float pixels_per_radian = 1000;  // about 1080 lines under 62 degrees
inline constexpr float pixel_error_asked = 2;     // size of a cell on the screen: the runtime's own choice when not told

/// Seen from one distance; over the area of both surfaces, each to the other, in pixels at that place.
struct ScreenError {
    float diagonals = 0;                  ///< distance of the eye from the middle of the bounds, in their diagonals
    double mean = 0, p99 = 0, max = 0;    ///< pixels
    double triangles = 0;                 ///< share of those at the source's resolution
    double microseconds = 0;              ///< of processor time a frame
};
/// How far the surface jumps under a camera that moves away, the liquid standing still; over the area of the surfaces before
/// and after a move, each to the other, in pixels at that place. All figures are those of the move where they are worst.
struct CameraJumps {
    uint32_t moves = 0, changes = 0;      ///< of the camera; those that changed the surface
    uint32_t above_cell = 0;              ///< those that moved something of it by more than pixel_error_asked
    double mean = 0, p99 = 0, max = 0;    ///< pixels
    double share_above = 0;               ///< of the area, that jumps by more than pixel_error_asked
    void add(const Spread& pixels);       ///< of one more move
};
/// From 1 to 8 diagonals, by a thirtieth of the distance a move, at most three of the frames.
CameraJumps camera_jumps(BenchPlayer& player, const std::vector<uint32_t>& frames);

/// At 1, 2, 4, 6 and 8 diagonals, on at most eight of the frames.
std::vector<ScreenError> screen_errors(BenchPlayer& player, const std::vector<uint32_t>& frames);

}  // namespace rill::cooker
