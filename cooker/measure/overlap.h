// SPDX-License-Identifier: MIT
// Shells that reach into each other, as of particles that were meshed one by one, or of meshes joined without uniting them.
#pragma once
#include "common/mesh.h"

namespace rill::cooker {

/// Of the vertices, the share that lies inside other liquid: where the surface winds round the air just outside of them (Jacobson, Kavan,
/// Sorkine 2013). By some of them, evenly strided; `edge`: the mesh's median edge. 0 for an empty mesh.
double share_inside(const Mesh& mesh, float edge);

}  // namespace rill::cooker
