// SPDX-License-Identifier: MIT
// A patch of ocean whose rim goes to and fro sideways, as waves do that are more than heights: no side of its bounds cuts it off. Widened to them
// it is one that is (frames/cut_to_closed.h).
#pragma once
#include "common/mesh.h"

namespace rill::cooker {

/// The open edges of one frame or of many.
struct RimOfPatch {
    double facing[4] = {};  ///< metres of those of a patch that lie along a side of its bounds and near to it: x lower, x upper, y lower, y upper
    double others = 0;      ///< of all others
    void add(const RimOfPatch& other);
    /// All four sides, as bits, if this is the rim of a patch, and nothing else is open; else none.
    uint32_t sides() const;
};
/// `lower`, `upper`: the bounds of its triangles. z is up.
RimOfPatch rim_of_patch(const Mesh& mesh, const glm::vec3& lower, const glm::vec3& upper);

/// Carries the rim on, level, to those sides, bits as above, of these bounds, in strips of triangles that move along with it. Rims nearer than
/// `within` metres are moved there instead. A mesh that is no patch of one rim, or faces down, is left as it is.
void widen_to_sides(Mesh& mesh, uint32_t sides, const glm::vec3& lower, const glm::vec3& upper, float within);

}  // namespace rill::cooker
