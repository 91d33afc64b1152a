// SPDX-License-Identifier: MIT
// The velocity that the runtime gives out against the source's.
#pragma once
#include "measure/surface_distance.h"

namespace rill::cooker {

/// Over the area of the source that moves at a tenth of its root mean square speed or more: what stands has no direction.
struct VelocityError {
    Spread degrees;  ///< angle between the two
    Spread length;   ///< |difference of their lengths| over the source's
    void add(const VelocityError& other) { degrees.add(other.degrees), length.add(other.length); }
};
/// At every vertex of the source, times `factor`, and at the closest point of the decoded surface. Without velocities: nothing.
VelocityError velocity_error(const Mesh& source, double factor, const Mesh& decoded, const SurfaceIndex& decoded_index);

}  // namespace rill::cooker
