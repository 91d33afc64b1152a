// SPDX-License-Identifier: MIT
// Necks that no point mends (points_to_repairs.cpp): thinner than half an edge, the source's mesher drew them, but corners of the runtime's
// cells hardly ever lie in them. A small ellipsoid from one side to the other holds what hangs on them in that frame.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "surface/field_to_mesh.h"
#include "tracks/pipeline.h"
#include "tracks/points_to_mesh.h"
#include "tracks/torn_necks.h"

namespace rill::cooker {
namespace {

// Edges.
constexpr float longest_gap = 3;                    // farther apart, it is no neck
constexpr float radii[] = {0.45f, 0.6f, 0.75f, 0.9f};  // across it, the first that holds; drawn larger, for it touches both sides
constexpr float leans[] = {0, 0.5f};                // of the way to the nearest corner of the cells; a strand just between them would take twice as wide a drop
constexpr float overlap = 0.6f;                     // into either side
constexpr float coded_off = 0.1f;                   // as much thinner it still has to hold
constexpr float apart = 0.8f;                       // from other liquid
constexpr float around_neck = 3;                    // corners that are looked at

/// The vertex of a decoded piece that is nearest to x.
glm::vec3 nearest_of(const MeshPieces& decoded, uint32_t piece, const glm::vec3& x) {
    glm::vec3 best(INFINITY);
    for (uint32_t v = 0; v < decoded.label.size(); ++v)
        if (decoded.label[v] == piece && glm::distance(decoded.mesh.positions[v], x) < glm::distance(best, x)) best = decoded.mesh.positions[v];
    return best;
}

/// A spindle of revolution: half axes along and across.
struct Spindle {
    glm::vec3 centre, axis;
    float along, across;
    float value(const glm::vec3& x) const {
        const glm::vec3 r = x - centre;
        const float up = glm::dot(r, axis) / along, out = glm::length(r - axis * glm::dot(r, axis)) / across;
        return (std::sqrt(up * up + out * out) - 1) * across;
    }
    /// As cells draw it, and as much thinner.
    void draw(float edge, float thinner) {
        const float scale = 1 + most_growth_of_drops * edge / std::cbrt(along * across * across);
        along = scale * along - thinner, across = scale * across - thinner;
    }
    Drop drop() const {
        const glm::mat3 m = glm::mat3(across) + (along - across) * glm::outerProduct(axis, axis);
        Drop drop;
        drop.centre = centre;
        drop.shape = {m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]};
        drop.volume = 4 * std::numbers::pi_v<float> / 3 * along * across * across;
        return drop;
    }
};

/// Whether nothing but that piece of the source is near the spindle: it must not join what is apart.
bool is_alone(const Spindle& spindle, uint32_t piece, const SurfaceFrame& frame, const std::vector<uint32_t>& label) {
    std::vector<VertexTree::Found> found;
    frame.tree.within(spindle.centre, spindle.along + apart * frame.edge, found);
    return std::all_of(found.begin(), found.end(), [&](const auto& f) {
        return label[f.vertex] == piece || spindle.value(frame.mesh.positions[f.vertex]) > apart * frame.edge;
    });
}

/// What holds the neck; nothing where none of the radii does. The thinnest where no corner of cells is near enough to tell.
/// `label`: of the source's vertices.
std::optional<Drop> hold(const SurfaceFrame& frame, const std::vector<uint32_t>& label, const TornNeck& neck, const MeshPieces& decoded, const PointField& field) {
    const glm::vec3 from = nearest_of(decoded, neck.pieces[0], neck.middle), to = nearest_of(decoded, neck.pieces[1], neck.middle);
    const float gap = glm::distance(from, to), edge = frame.edge;
    if (!(gap < longest_gap * edge)) return {};
    std::vector<VertexTree::Found> found;
    const auto piece_at = [&](const glm::vec3& x) {
        frame.tree.nearest(x, 1, found);
        return label[found[0].vertex];
    };
    const uint32_t piece = piece_at(neck.middle);
    if (piece_at(from) != piece || piece_at(to) != piece) return {};
    const NeckCorners corners(neck, edge, around_neck * edge, decoded);
    const std::vector<float> torn = field.values_at(corners.x, corners.y, corners.z);
    const glm::vec3 middle = 0.5f * (from + to), axis = gap > 0 ? (to - from) / gap : glm::vec3(0, 0, 1);
    const glm::vec3 corner = edge * glm::round(middle / edge) - middle, aside = corner - glm::dot(corner, axis) * axis;
    for (const float lean : leans)
        for (const float radius : radii) {
            Spindle spindle{middle + lean * aside, axis, std::max(0.5f * gap + overlap * edge, radius * edge), radius * edge};
            if (!is_alone(spindle, piece, frame, label)) return {};
            const Drop drop = spindle.drop();
            spindle.draw(edge, coded_off * edge);
            std::vector<float> held = torn;
            for (size_t i = 0; i < held.size(); ++i) held[i] = std::min(held[i], spindle.value({corners.x[i], corners.y[i], corners.z[i]}));
            if (!corners.is_amiss(held, torn)) return drop;
        }
    return {};
}

}  // namespace

std::vector<Drop> neck_drops(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points) {
    std::vector<Drop> drops;
    if (points.empty()) return drops;
    const PointField field(points);
    const Mesh mesh = mesh_points(points, frame.edge, 1, frame.mesh.positions.size());
    const MeshPieces decoded(mesh, 1);
    const MeshPieces source(frame);
    std::vector<std::array<uint32_t, 2>> held;
    std::vector<VertexTree::Found> found;
    for (const TornNeck& neck : find_torn_necks(source, decoded, frame.edge)) {
        if (neck.of != TornNeck::Of::liquid) continue;  // a bubble as thin would hardly hold a corner
        if (std::find(held.begin(), held.end(), neck.pieces) != held.end()) continue;
        std::optional<Drop> drop = hold(frame, source.label, neck, decoded, field);
        if (!drop) continue;
        frame.tree.nearest(neck.middle, 1, found);
        if (!frame.mesh.velocities.empty()) drop->velocity = frame.mesh.velocities[found[0].vertex];
        drops.push_back(*drop), held.push_back(neck.pieces);
    }
    return drops;
}

}  // namespace rill::cooker
