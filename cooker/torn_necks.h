// SPDX-License-Identifier: MIT
// Where liquid that hangs together in the source comes apart as decoded.
#pragma once
#include <array>
#include <cmath>
#include <vector>

#include "surface_frame.h"

namespace rill::cooker {

/// Pieces of a decoded mesh, and what tells them apart. Keeps a reference.
struct DecodedPieces {
    DecodedPieces(const Mesh& decoded, int jobs);
    const Mesh& mesh;
    SurfaceIndex index;
    std::vector<uint32_t> label;  ///< of the vertices, by label_components()
    /// The piece that x is nearest to, by its label.
    uint32_t nearest(const glm::vec3& x) const { return label[mesh.triangles[index.closest(x, INFINITY).triangle][0]]; }
};

struct TornNeck {
    glm::vec3 middle;                ///< metres
    std::array<uint32_t, 2> pieces;  ///< that it joins in the source: labels
};
/// The source's necks that join what is decoded as two pieces.
std::vector<TornNeck> find_torn_necks(const SurfaceFrame& frame, const DecodedPieces& decoded);

/// Corners of the runtime's cells round a neck: its two pieces are one where their liquid ones join, along edges of cells.
class NeckCorners {
public:
    /// Those within `radius` of its middle, along every axis; metres.
    NeckCorners(const TornNeck& neck, float cell, float radius, const DecodedPieces& decoded);
    std::vector<float> x, y, z;
    /// `value`: of the field there, negative in the liquid; `before`: while the neck was torn. Where no corner of either piece was near,
    /// nothing tells: false.
    bool is_torn(const std::vector<float>& value, const std::vector<float>& before) const;

private:
    /// Of a piece, nearest to the neck, or none.
    size_t liquid_corner(uint32_t piece, const std::vector<float>& value) const;
    TornNeck neck_;
    std::array<int, 3> size_;
    std::vector<uint32_t> piece_;
};

}  // namespace rill::cooker
