// SPDX-License-Identifier: MIT
// The box that liquid stands in, as its mesher left it. Within a cell of the edges between its sides, cubes that are marched go
// straight from one side to the other: p99, mean error and normals of a tank cooked to 0.12e with those edges cut off, too, against
// edges that are sharp: -18 %, -16 % and 1.85 for 2.24 degrees.
#pragma once
#include <cmath>

#include "format/layout.h"

namespace rill::surface {

/// The value of what reaches nothing.
inline constexpr float unsupported = 1e30f;

/// Walls that the liquid ends at. Sides are numbered 2 axis + (0 lower, 1 upper).
struct Container {
    float lower[3], upper[3];  ///< ∓unsupported: there is no wall
    uint32_t sharp = 0;        ///< bits of walls that the surface goes on to as it is, and meets at an edge
    float bevel = 0;           ///< metres: edges between other walls are cut off, so far from them along either
    float place(int side) const { return side & 1 ? upper[side / 2] : lower[side / 2]; }
};
inline constexpr Container everywhere{{-unsupported, -unsupported, -unsupported}, {unsupported, unsupported, unsupported}};

/// `walls`, `cell_size`: as format::Header's.
inline Container container_of(const float* lower, const float* upper, uint32_t walls, float cell_size) {
    Container container = everywhere;
    for (int a = 0; a < 3; ++a) {
        if (walls >> (2 * a) & 1) container.lower[a] = lower[a];
        if (walls >> (2 * a + 1) & 1) container.upper[a] = upper[a];
    }
    container.sharp = walls >> format::sharp_rims_shift & format::every_wall, container.bevel = format::bevel_of(walls, cell_size);
    return container;
}

/// A plane across the edge between two walls.
struct Bevel {
    int side[2], axis[2];           ///< of the walls; axis[0] < axis[1]
    float wall[2], outward[2];      ///< outward: of the plane's unit normal, along either axis
    float legs;                     ///< metres, from the edge along either wall
    /// Distance beyond it of a place along axis[0] and axis[1].
    float value(float x, float y) const { return outward[0] * (x - wall[0]) + outward[1] * (y - wall[1]) + legs * std::sqrt(0.5f); }
    /// Where it ends at wall `which`: the place along axis[k].
    float end(int which, int k) const { return which == k ? wall[k] : wall[k] - std::copysign(legs, outward[k]); }
};

/// Calls work(bevel) for all that the container has, in order.
template <typename Work>
void for_bevels(const Container& container, Work work) {
    const auto is_bevelled = [&](int side) { return std::fabs(container.place(side)) < unsupported && !(container.sharp >> side & 1); };
    for (int low = 0; low < 4 && container.bevel > 0; ++low)
        for (int high = (low / 2 + 1) * 2; high < 6; ++high) {
            if (!is_bevelled(low) || !is_bevelled(high)) continue;
            const float along = std::sqrt(0.5f);
            work(Bevel{{low, high}, {low / 2, high / 2}, {container.place(low), container.place(high)}, {low & 1 ? along : -along, high & 1 ? along : -along}, container.bevel});
        }
}

/// Farther than this from one of its walls, a bevel is never what is nearest (1.7 legs).
inline float bevel_reach(const Container& container) { return 2 * container.bevel; }

}  // namespace rill::surface
