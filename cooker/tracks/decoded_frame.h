// SPDX-License-Identifier: MIT
// What the points of a frame decode to, as those stages ask for it that mend what is left by drops.
#pragma once
#include "tracks/points_to_mesh.h"
#include "tracks/torn_necks.h"

namespace rill::cooker {

struct DecodedFrame {
    DecodedFrame(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points)
        : field(points), mesh(points.empty() ? Mesh{} : mesh_points(points, frame.edge, 1, frame.mesh.positions.size())), pieces(mesh, 1) {}
    DecodedFrame(const DecodedFrame&) = delete;
    PointField field;
    Mesh mesh;          ///< in cells of the source's size; empty: there are no points
    MeshPieces pieces;
};

}  // namespace rill::cooker
