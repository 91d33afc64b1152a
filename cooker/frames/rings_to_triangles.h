// SPDX-License-Identifier: MIT
// Flat surface: from outlines to triangles of the size that the rest of a mesh has.
#pragma once
#include "common/mesh.h"

namespace rill::cooker {

using Ring = std::vector<uint32_t>;  ///< vertices of a closed outline, the first not named again

/// A plane across an axis of space; u, v and the way it faces are right-handed.
struct FlatPlane {
    int u, v;     ///< its axes
    float place;  ///< along the third axis, metres
};

/// Appends triangles that cover what `rings` go round counter-clockwise in the plane (winding number 1 or more) to the mesh: squares of
/// `pitch` metres, always at the same places, and between them and the rings, whose edges stay as they are, triangles as blunt
/// as can be. New vertices are at rest. Where rings cross, too, there is one, if none of theirs is `within` metres.
void fill_rings(Mesh& mesh, const std::vector<Ring>& rings, const FlatPlane& plane, float pitch, float within);

}  // namespace rill::cooker
