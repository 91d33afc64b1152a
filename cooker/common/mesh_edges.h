// SPDX-License-Identifier: MIT
// Who shares an edge with whom.
#pragma once
#include <cstdint>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {

struct MeshEdge {
    uint64_t ends;              ///< both vertices, the lesser one in the upper half
    uint32_t triangle, corner;  ///< it goes on from that corner
};
/// All edges of all triangles; those of the same two vertices stand together, by triangle and corner.
std::vector<MeshEdge> sorted_edges(const std::vector<Triangle>& triangles);

}  // namespace rill::cooker
