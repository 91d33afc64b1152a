// SPDX-License-Identifier: MIT
#include "common/mesh_edges.h"

#include <algorithm>
#include <tuple>

namespace rill::cooker {

std::vector<MeshEdge> sorted_edges(const std::vector<Triangle>& triangles) {
    std::vector<MeshEdge> edges;
    edges.reserve(3 * triangles.size());
    for (uint32_t i = 0; i < triangles.size(); ++i)
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = triangles[i][k], b = triangles[i][(k + 1) % 3];
            edges.push_back({uint64_t(std::min(a, b)) << 32 | std::max(a, b), i, k});
        }
    std::sort(edges.begin(), edges.end(), [](const MeshEdge& a, const MeshEdge& b) {
        return std::tie(a.ends, a.triangle, a.corner) < std::tie(b.ends, b.triangle, b.corner);
    });
    return edges;
}

}  // namespace rill::cooker
