// SPDX-License-Identifier: MIT
// Necks that no point mends (points_to_repairs.cpp), of liquid or of the air between two pieces: thinner than half an edge, the source's
// mesher drew them, but corners of the runtime's cells hardly ever lie in them. A small ellipsoid of liquid from one side to the other holds
// what hangs on a neck in that frame, one of air keeps the mouth of a cavity open; one of air, flat as the gap is, parts what ran together.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tracks/decoded_frame.h"
#include "tracks/drop_shape.h"
#include "tracks/pipeline.h"

namespace rill::cooker {
namespace {

// Edges.
constexpr float radii[] = {0.45f, 0.6f, 0.75f, 0.9f};    // of a spindle across its neck, the first that holds; half the height of a disc
constexpr float coded_off = 0.1f;                        // as much thinner it still has to mend
constexpr float around_neck = 3;                         // corners that are looked at
// Of spindles.
constexpr float longest_gap = 3;                         // farther apart, it is no neck
constexpr float leans[] = {0, 0.5f};                     // of the way to the nearest corner; a strand just between them would take twice as wide a drop
constexpr float overlap = 0.6f;                          // into either side
// Of discs of air.
constexpr float widest_gap = 1.5f;                       // corners of cells lie in wider ones
constexpr float widths[] = {0.75f, 1, 1.5f, 2, 2.5f};    // radii
constexpr float disc_leans[] = {0, 0.4f, 0.8f};          // of the way to the nearest corner
constexpr float behind_gap = 0.6f, least_behind = 0.3f;  // so far beyond the air is liquid, so deep: it opens no thin sheet
constexpr float samples_apart = 0.25f;

/// The vertex of a piece that is nearest to x.
glm::vec3 nearest_of(const MeshPieces& pieces, uint32_t piece, const glm::vec3& x) {
    glm::vec3 best(INFINITY);
    for (uint32_t v = 0; v < pieces.label.size(); ++v)
        if (pieces.label[v] == piece && glm::distance(pieces.mesh.positions[v], x) < glm::distance(best, x)) best = pieces.mesh.positions[v];
    return best;
}

/// The field at corners with the liquid, or the air, of a shape.
std::vector<float> with(std::vector<float> value, const DropShape& shape, bool is_liquid, const NeckCorners& corners) {
    for (size_t i = 0; i < value.size(); ++i) {
        const float there = shape.value({corners.x[i], corners.y[i], corners.z[i]});
        value[i] = is_liquid ? std::min(value[i], there) : std::max(value[i], -there);
    }
    return value;
}

/// What holds the neck; nothing where none of the radii does. The thinnest where no corner of cells is near enough to tell.
/// `label`: of the source's vertices.
std::optional<Drop> hold(const SurfaceFrame& frame, const std::vector<uint32_t>& label, const TornNeck& neck, const DecodedFrame& decoded) {
    const glm::vec3 from = nearest_of(decoded.pieces, neck.pieces[0], neck.middle), to = nearest_of(decoded.pieces, neck.pieces[1], neck.middle);
    const float gap = glm::distance(from, to), edge = frame.edge;
    if (!(gap < longest_gap * edge)) return {};
    std::vector<VertexTree::Found> found;
    const auto piece_at = [&](const glm::vec3& x) {
        frame.tree.nearest(x, 1, found);
        return label[found[0].vertex];
    };
    const uint32_t piece = piece_at(neck.middle);
    if (piece_at(from) != piece || piece_at(to) != piece) return {};
    const NeckCorners corners(neck, edge, around_neck * edge, decoded.pieces);
    const std::vector<float> torn = decoded.field.values_at(corners.x, corners.y, corners.z);
    const glm::vec3 middle = 0.5f * (from + to), axis = gap > 0 ? (to - from) / gap : glm::vec3(0, 0, 1);
    const glm::vec3 corner = edge * glm::round(middle / edge) - middle, aside = corner - glm::dot(corner, axis) * axis;
    const bool is_liquid = neck.of == TornNeck::Of::liquid;
    for (const float lean : leans)
        for (const float radius : radii) {
            const DropShape spindle = DropShape::spindle(middle + lean * aside, axis, std::max(0.5f * gap + overlap * edge, radius * edge), radius * edge);
            if (!is_alone(spindle, piece, frame, label)) return {};
            if (!corners.is_amiss(with(torn, spindle.drawn(edge, coded_off * edge), is_liquid, corners), torn)) return spindle.drop(is_liquid);
        }
    return {};
}

/// Integral of the depth of the source's liquid in a disc of air, edges⁴.
double cut_by(const DropShape& disc, const SurfaceFrame& frame) {
    const int reach = int(std::ceil(disc.half.y / (samples_apart * frame.edge)));
    double sum = 0;
    for (int k = -reach; k <= reach; ++k)
        for (int j = -reach; j <= reach; ++j)
            for (int i = -reach; i <= reach; ++i) {
                const glm::vec3 x = disc.centre + samples_apart * frame.edge * (disc.axes * glm::vec3(k, i, j));
                if (disc.value(x) < 0) sum += std::max(depth_at(frame, x, INFINITY) / frame.edge, 0.f);
            }
    return sum * std::pow(samples_apart, 3);
}

/// The disc of air that parts two pieces of the source that run together there in the field as it is at those corners, and takes
/// least of them; nothing where none does.
std::optional<DropShape> part(const SurfaceFrame& frame, const MeshPieces& source, const TornNeck& neck, const NeckCorners& corners, const std::vector<float>& joined) {
    const glm::vec3 to = nearest_of(source, neck.pieces[1], nearest_of(source, neck.pieces[0], neck.middle)), from = nearest_of(source, neck.pieces[0], to);
    const float gap = glm::distance(from, to), edge = frame.edge;
    if (!(gap > 0 && gap < widest_gap * edge)) return {};
    const glm::vec3 middle = 0.5f * (from + to), axis = (to - from) / gap;
    const glm::vec3 corner = edge * glm::round(middle / edge) - middle;
    std::optional<DropShape> best;
    double least = INFINITY;
    for (const float lean : disc_leans)
        for (const float width : widths)
            for (const float height : radii) {
                const DropShape disc = DropShape::spindle(middle + lean * corner, axis, height * edge, width * edge), drawn = disc.drawn(edge, 0);
                if (corners.is_amiss(with(joined, disc.drawn(edge, coded_off * edge), false, corners), joined)) continue;
                const glm::vec3 behind = (drawn.half.x + behind_gap * edge) * axis;
                if (std::min(depth_at(frame, disc.centre - behind, INFINITY), depth_at(frame, disc.centre + behind, INFINITY)) < least_behind * edge) continue;
                if (const double cut = cut_by(drawn, frame); cut < least) least = cut, best = disc;
            }
    return best;
}

/// Spindles of liquid where a piece of the source has been torn, of air where the mouth of a cavity has closed.
void hold_pieces(const SurfaceFrame& frame, const MeshPieces& source, const DecodedFrame& decoded, std::vector<Drop>& drops) {
    std::set<std::pair<uint32_t, uint32_t>> held;
    for (const TornNeck& neck : find_torn_necks(source, decoded.pieces, frame.edge)) {
        const std::pair<uint32_t, uint32_t> pieces = std::minmax(neck.pieces[0], neck.pieces[1]);  // of two bubbles each tells of the other
        if (held.count(pieces)) continue;
        if (const auto drop = hold(frame, source.label, neck, decoded)) drops.push_back(*drop), held.insert(pieces), set_velocity(frame, drops.back());
    }
}

/// Discs of air where pieces of the source have run together.
void part_pieces(const SurfaceFrame& frame, const MeshPieces& source, const DecodedFrame& decoded, std::vector<Drop>& drops) {
    std::vector<DropShape> parted;
    for (const TornNeck& neck : find_false_necks(source, decoded.pieces, frame.edge)) {
        const NeckCorners corners(neck, frame.edge, around_neck * frame.edge, source);
        std::vector<float> joined = decoded.field.values_at(corners.x, corners.y, corners.z);
        for (const DropShape& disc : parted) joined = with(std::move(joined), disc.drawn(frame.edge, coded_off * frame.edge), false, corners);
        if (!corners.is_amiss(joined, joined)) continue;
        const std::optional<DropShape> disc = part(frame, source, neck, corners, joined);
        if (disc) parted.push_back(*disc), drops.push_back(disc->drop(false)), set_velocity(frame, drops.back());
    }
}

}  // namespace

std::vector<Drop> neck_drops(const SurfaceFrame& frame, const DecodedFrame& decoded) {
    std::vector<Drop> drops;
    if (decoded.mesh.triangles.empty()) return drops;
    const MeshPieces source(frame);
    hold_pieces(frame, source, decoded, drops), part_pieces(frame, source, decoded, drops);
    return drops;
}

}  // namespace rill::cooker
