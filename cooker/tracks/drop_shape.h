// SPDX-License-Identifier: MIT
// An ellipsoid that mends what points decode to, and how the runtime's cells draw it.
#pragma once
#include "frames/surface_frame.h"

namespace rill::cooker {

struct DropShape {
    glm::vec3 centre;
    glm::mat3 axes;  ///< unit columns
    glm::vec3 half;  ///< axes, metres
    /// A body of revolution.
    static DropShape spindle(const glm::vec3& centre, const glm::vec3& axis, float along, float across);
    /// Negative inside; about metres along the shortest axis, less along others.
    float value(const glm::vec3& x) const;
    /// As cells of that size draw it, and as much thinner all round.
    DropShape drawn(float cell, float thinner) const;
    Drop drop(bool is_liquid) const;
};

/// Whether none but that piece of the source is near: what joins it must not join others. `label`: of the source's vertices.
bool is_alone(const DropShape& shape, uint32_t piece, const SurfaceFrame& frame, const std::vector<uint32_t>& label);
/// Moves like the source nearest to its centre.
void set_velocity(const SurfaceFrame& frame, Drop& drop);

}  // namespace rill::cooker
