// SPDX-License-Identifier: MIT
// Sources of uneven triangles: adaptive meshing and decimation leave few vertices where a surface is flat. The cooker measures, moves
// and fits at vertices, so they must lie about as close everywhere as the decoded mesh's will.
#pragma once
#include "mesh.h"

namespace rill::cooker {

/// Halves edges, with the triangles beside them, until none is longer than `longest` metres (more on frames of so much area
/// that they would take over four million triangles). The surface stays what it is; velocities are interpolated, normals dropped.
/// Nothing changes where no edge is that long.
void split_long_edges(Mesh& mesh, float longest);

}  // namespace rill::cooker
