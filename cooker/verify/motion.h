// SPDX-License-Identifier: MIT
// How the decoded surface moves between frames: meshed at many times a frame step, each moment held against the one before.
#pragma once
#include <functional>
#include <string>

#include "measure/surface_distance.h"

namespace rill::cooker {

/// Symmetric distances between two moments of the surface, weighted by area, metres; infinite when one of them is empty.
struct Displacement {
    double mean = 0, p99 = 0, max = 0;
};
/// A piece of liquid of one moment that lies wholly away from the surface of the other: it came or went at once.
struct LonePiece {
    float away = 0;    ///< its least distance from that surface, metres
    float volume = 0;  ///< m³
};
/// From one frame to the next.
struct IntervalMotion {
    int from = 0, to = 0;                ///< frame numbers
    Displacement frame;                  ///< from frame to frame
    std::vector<Displacement> substeps;  ///< as many as were asked for
    std::vector<LonePiece> lone;         ///< of all substeps; those less than a quarter of a cell away are left out
};
/// Where one window takes over from another: the same moment, as both show it.
struct BorderJump {
    int frame = 0;
    Displacement jump;
};
struct Motion {
    uint32_t substeps = 0;               ///< per frame step; 0: not measured
    std::vector<IntervalMotion> intervals;
    std::vector<BorderJump> borders;
    Spread frame, substep, border;       ///< distances of all of them; moments without surface are left out
    /// A substep that moves the surface farther than this anywhere is a jump, metres.
    double most_smooth() const { return 3 * frame.mean(); }
    uint32_t jumps() const;              ///< substeps with one
    double jump_share() const;           ///< of the area of all substeps, beyond most_smooth()
    std::vector<LonePiece> lone() const; ///< those beyond most_smooth(), largest first
};
/// Two moments against each other; adds to `spread`, and to `lone` if it is not null.
Displacement displacement(const Mesh& a, const SurfaceIndex& a_index, const Mesh& b, const SurfaceIndex& b_index, float cell,
                          Spread& spread, std::vector<LonePiece>* lone);
/// The asset between its frames from `first` to `last` (numbers), and at the window borders among them. Memory follows
/// from the size of a frame, not from their number. Throws InputError when a frame is missing. jobs 0: all cores.
Motion measure_motion(const std::string& asset, int first, int last, uint32_t substeps, int jobs,
                      const std::function<void(uint32_t done, uint32_t total)>& progress = {});

}  // namespace rill::cooker
