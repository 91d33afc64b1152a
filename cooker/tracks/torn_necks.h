// SPDX-License-Identifier: MIT
// Where liquid, or the air in it, that hangs together in the source comes apart as decoded, or pieces of liquid that are apart run
// into each other.
#pragma once
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "frames/surface_frame.h"

namespace rill::cooker {

/// Pieces of a mesh, and what tells them apart. Keeps a reference.
class MeshPieces {
    std::unique_ptr<SurfaceIndex> own_;  ///< a frame has one

public:
    MeshPieces(const Mesh& decoded, int jobs);
    explicit MeshPieces(const SurfaceFrame& frame);
    const Mesh& mesh;
    const SurfaceIndex& index;
    std::vector<uint32_t> label;  ///< of the vertices, by label_components()
    /// The piece that x is nearest to, by its label.
    uint32_t nearest(const glm::vec3& x, SurfaceIndex::Near* near = nullptr) const {
        return label[mesh.triangles[index.closest(x, INFINITY, near).triangle][0]];
    }
};

struct TornNeck {
    enum class Of : uint8_t {
        liquid,  ///< it joins two decoded pieces
        air,     ///< of a cavity that is decoded as a bubble: likewise
        none     ///< decoded, but not the source's: it joins two of the source's pieces
    };
    glm::vec3 middle;                ///< metres
    std::array<uint32_t, 2> pieces;  ///< labels: of decoded pieces, or of the source's
    Of of;
};
/// The source's necks that join what is decoded as two pieces. `edge`: metres.
std::vector<TornNeck> find_torn_necks(const MeshPieces& source, const MeshPieces& decoded, float edge);
/// Decoded necks between pieces of the source's liquid that are apart.
std::vector<TornNeck> find_false_necks(const MeshPieces& source, const MeshPieces& decoded, float edge);

/// Corners of the runtime's cells round a neck: its two pieces are one where their liquid ones join (of air: those in the air), along edges
/// of cells.
class NeckCorners {
public:
    /// Those within `radius` of its middle, along every axis; metres. `pieces`: those that the neck tells of.
    NeckCorners(const TornNeck& neck, float cell, float radius, const MeshPieces& pieces);
    std::vector<float> x, y, z;
    /// Whether the pieces are one that should be two, or two that should be one. `value`: of the field there, negative in the liquid;
    /// `before`: as the neck was found. Where no corner of either piece was near, nothing tells: false.
    bool is_amiss(const std::vector<float>& value, const std::vector<float>& before) const;

private:
    bool is_in(float value) const { return (value < 0) != (neck_.of == TornNeck::Of::air); }
    /// In a piece: the nearest to the neck; or, of a false one, all that are not in the neck itself. `value`: as it was found.
    std::vector<size_t> corners_of(uint32_t piece, const std::vector<float>& value) const;
    bool are_joined(std::vector<size_t> from, const std::vector<size_t>& to, const std::vector<float>& value) const;
    TornNeck neck_;
    float cell_;
    std::array<int, 3> size_;
    std::vector<uint32_t> piece_;
};

}  // namespace rill::cooker
