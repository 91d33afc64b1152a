// SPDX-License-Identifier: MIT
// Sources of uneven triangles: adaptive meshing and decimation leave few vertices where a surface is flat. The cooker measures, moves
// and fits at vertices, so they must lie about as close everywhere as the decoded mesh's will.
#pragma once
#include "common/mesh.h"

namespace rill::cooker {

/// Halves edges, with the triangles beside them, until none is longer than `longest` metres, or there are over two million triangles and
/// four times as many as before. The surface stays what it is; velocities are interpolated, normals dropped. Nothing changes where no
/// edge is that long.
void split_long_edges(Mesh& mesh, float longest);

}  // namespace rill::cooker
