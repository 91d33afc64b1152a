// SPDX-License-Identifier: MIT
// Fingers that no point mends (points_to_repairs.cpp): of the source and lost, for most are so thin that corners of cells hardly lie in them,
// an ellipsoid of liquid shows them in that frame; decoded and false, one of air takes them away. Likewise pits. Of some sizes, by trial,
// of those that cells show the one that leaves least liquid and air confused.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "tracks/decoded_frame.h"
#include "tracks/drop_shape.h"
#include "tracks/pipeline.h"

namespace rill::cooker {
namespace {

// Edges.
constexpr float least_off = 0.6f;    // of a spur's vertices, from the other surface,
constexpr float far_off = 1.5f;      // and of its tip
constexpr float longest = 8;         // more is no spur
constexpr float least_half = 0.45f;  // of an axis: corners of cells should lie in it
constexpr float around_spur = 2;     // where samples and corners are,
constexpr float samples_apart = 0.3f;
constexpr float held = 0.5f;         // nearer to a drop, the tip is shown
constexpr float coded_off = 0.15f;   // as much thinner it still has to mend
constexpr float tip_shown = 1.3f;    // from a corner: cells go half an edge beyond it
constexpr float of_spur = 1.2f, in_doubt = 0.6f;  // corners so near to the spur, and no nearer to the source, are to be changed
constexpr double most_spoilt = 0.8;  // ∫ depth of what is confused, edges⁴: of a finger of which no corner is in the source
constexpr size_t most_spurs = 12;    // of a frame, the farthest
// Of the spur's extents; and of the way to the nearest corner.
constexpr float lengths[] = {1, 1.3f, 1.6f, 2}, widths[] = {0.6f, 0.8f, 1, 1.25f, 1.5f, 2, 2.5f}, leans[] = {0, 0.5f, 0.9f};

struct Spur {
    std::vector<glm::vec3> positions;  ///< of one surface, off the other
    glm::vec3 tip{};
    float off = 0;                     ///< metres
};

/// Vertices of the mesh that hang together off the other surface.
void find_spurs(const Mesh& mesh, const SurfaceIndex& other, float edge, std::vector<Spur>& spurs) {
    const std::vector<uint32_t> beyond = find_beyond(other, mesh.positions, least_off * edge, 1);
    if (beyond.empty()) return;
    std::vector<bool> is_off(mesh.positions.size(), false);
    for (uint32_t v : beyond) is_off[v] = true;
    Mesh off{mesh.positions, {}, {}, {}};
    for (const Triangle& t : mesh.triangles)
        for (size_t k = 0; k < 3; ++k)
            if (const uint32_t a = t[k], b = t[(k + 1) % 3]; is_off[a] && is_off[b]) off.triangles.push_back({a, b, a});  // an edge
    const std::vector<uint32_t> label = label_components(off);
    std::map<uint32_t, Spur> found;
    for (uint32_t v : beyond) {
        Spur& spur = found[label[v]];
        const glm::vec3& x = mesh.positions[v];
        spur.positions.push_back(x);
        if (const float away = other.closest(x, INFINITY).distance; away > spur.off) spur.off = away, spur.tip = x;
    }
    for (auto& [name, spur] : found)
        if (spur.off > far_off * edge) spurs.push_back(std::move(spur));
}

/// The ellipsoid in the spur's box along its principal axes.
DropShape box_of(const Spur& spur) {
    glm::vec3 mean(0);
    for (const glm::vec3& x : spur.positions) mean += x / float(spur.positions.size());
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const glm::vec3& x : spur.positions) {
        const Eigen::Vector3d r(x.x - mean.x, x.y - mean.y, x.z - mean.z);
        spread += r * r.transpose();
    }
    const Eigen::Matrix3d turn = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
    DropShape shape;
    glm::vec3 lower(INFINITY), upper(-INFINITY);
    for (int a = 0; a < 3; ++a) shape.axes[a] = glm::vec3(turn(0, a), turn(1, a), turn(2, a));
    for (const glm::vec3& x : spur.positions) lower = glm::min(lower, (x - mean) * shape.axes), upper = glm::max(upper, (x - mean) * shape.axes);
    shape.half = 0.5f * (upper - lower), shape.centre = mean + shape.axes * (0.5f * (lower + upper));
    return shape;
}

struct Stretch {
    float longer, wider, lean;
};
/// Longer, the tip's end where it is, wider, and aside towards the nearest corner.
DropShape stretched(DropShape shape, const glm::vec3& tip, const Stretch& by, float edge) {
    const glm::vec3 r = (tip - shape.centre) * shape.axes;
    const glm::vec3 out = glm::abs(r);
    const int along = out.x >= out.y && out.x >= out.z ? 0 : out.y >= out.z ? 1 : 2;
    const glm::vec3 corner = edge * glm::round(shape.centre / edge) - shape.centre, &axis = shape.axes[along];
    shape.centre += by.lean * (corner - glm::dot(corner, axis) * axis) - axis * std::copysign((by.longer - 1) * shape.half[along], r[along]);
    for (int a = 0; a < 3; ++a) shape.half[a] = std::max(shape.half[a] * (a == along ? by.longer : by.wider), least_half * edge);
    return shape;
}

/// Places on a lattice round a spur: how deep in the source's liquid, and what is decoded.
struct Lattice {
    Lattice(const SurfaceFrame& frame, const DecodedFrame& decoded, const Spur& spur, float cell, float phase) {
        glm::vec3 lower(INFINITY), upper(-INFINITY);
        for (const glm::vec3& x : spur.positions) lower = glm::min(lower, x), upper = glm::max(upper, x);
        const glm::vec3 first = glm::floor((lower - around_spur * frame.edge) / cell);
        size = glm::ivec3(glm::ceil((upper + around_spur * frame.edge) / cell) - first);
        for (int k = 0; k < size.z; ++k)
            for (int j = 0; j < size.y; ++j)
                for (int i = 0; i < size.x; ++i) {
                    const glm::vec3 at = cell * (first + glm::vec3(i, j, k) + phase);
                    x.push_back(at.x), y.push_back(at.y), z.push_back(at.z), depth.push_back(depth_at(frame, at, INFINITY));
                }
        value = decoded.field.values_at(x, y, z);
    }
    glm::vec3 at(size_t i) const { return {x[i], y[i], z[i]}; }
    glm::ivec3 size;
    std::vector<float> x, y, z, depth, value;
};

/// Fine samples and the corners of cells round a spur, and what a drop there would do to them.
class Surroundings {
public:
    Surroundings(const SurfaceFrame& frame, const MeshPieces& source, uint32_t piece, const DecodedFrame& decoded, const Spur& spur)
        : spur_(spur), source_(source), piece_(piece), edge_(frame.edge), samples_(frame, decoded, spur, samples_apart * frame.edge, 0.5f), corners_(frame, decoded, spur, frame.edge, 0) {}
    /// ∫ depth of liquid and air that are decoded as the other, with one more drop if any: edges⁴.
    double confused(const DropShape* more, bool is_liquid) const {
        double sum = 0;
        for (size_t i = 0; i < samples_.value.size(); ++i) {
            const bool is_changed = more && more->value(samples_.at(i)) < 0;
            if ((is_changed ? is_liquid : samples_.value[i] < 0) != (samples_.depth[i] > 0)) sum += std::fabs(samples_.depth[i]) / edge_;
        }
        return sum * std::pow(samples_apart, 3);
    }
    /// Whether cells show the tip, and as one with what is decoded of its piece, if that drop is of liquid.
    bool is_shown(const DropShape& drop) const {
        const auto is_liquid = [&](size_t i) { return corners_.value[i] < 0 || drop.value(corners_.at(i)) < 0; };
        std::vector<size_t> tip;
        for (size_t i = 0; i < corners_.value.size(); ++i)
            if (drop.value(corners_.at(i)) < 0 && glm::distance(corners_.at(i), spur_.tip) < tip_shown * edge_) tip.push_back(i);
        std::vector<bool> reached(corners_.value.size(), false);
        bool joins = false;
        flood(tip, is_liquid, reached, [&](size_t i) {
            joins = joins || (corners_.value[i] < 0 && !(drop.value(corners_.at(i)) < 0) && source_.nearest(corners_.at(i)) == piece_);
        });
        return joins;
    }
    /// Whether the spur is gone, if that drop is of air.
    bool is_gone(const DropShape& drop) const {
        bool any = false;
        for (size_t i = 0; i < corners_.value.size(); ++i) {
            const glm::vec3 x = corners_.at(i);
            if (!(corners_.value[i] < 0 && corners_.depth[i] < -in_doubt * edge_)) continue;
            const auto near = [&](const glm::vec3& p) { return glm::distance(p, x) < of_spur * edge_; };
            if (std::none_of(spur_.positions.begin(), spur_.positions.end(), near)) continue;
            if (!(drop.value(x) < 0)) return false;
            any = true;
        }
        return any && pieces_without(&drop) <= pieces_without(nullptr);  // a strand decoded aside of its place is not torn for that
    }

private:
    /// Calls visit(corner) with those that hang together with `next` in the liquid, once each.
    template <typename IsLiquid, typename Visit>
    void flood(std::vector<size_t> next, IsLiquid is_liquid, std::vector<bool>& reached, Visit visit) const {
        for (const size_t i : next) reached[i] = true;
        const int step[3] = {1, corners_.size.x, corners_.size.x * corners_.size.y};
        while (!next.empty()) {
            const size_t at = next.back();
            next.pop_back(), visit(at);
            for (int a = 0; a < 3; ++a)
                for (const int way : {-1, 1}) {
                    const int place = int(at) / step[a] % corners_.size[a] + way;
                    const size_t to = size_t(int(at) + way * step[a]);
                    if (place >= 0 && place < corners_.size[a] && !reached[to] && is_liquid(to)) reached[to] = true, next.push_back(to);
                }
        }
    }
    /// How many pieces of liquid are decoded here, but for a drop of air.
    size_t pieces_without(const DropShape* air) const {
        const auto is_liquid = [&](size_t i) { return corners_.value[i] < 0 && !(air && air->value(corners_.at(i)) < 0); };
        std::vector<bool> reached(corners_.value.size(), false);
        size_t pieces = 0;
        for (size_t i = 0; i < reached.size(); ++i)
            if (!reached[i] && is_liquid(i)) ++pieces, flood({i}, is_liquid, reached, [](size_t) {});
        return pieces;
    }
    const Spur& spur_;
    const MeshPieces& source_;
    uint32_t piece_;
    float edge_;
    Lattice samples_, corners_;
};

std::optional<Drop> mend(const SurfaceFrame& frame, const MeshPieces& source, const DecodedFrame& decoded, const Spur& spur) {
    const DropShape box = box_of(spur);
    if (std::max({box.half.x, box.half.y, box.half.z}) > 0.5f * longest * frame.edge) return {};
    const uint32_t piece = source.nearest(spur.tip);
    const Surroundings around(frame, source, piece, decoded, spur);
    const bool is_liquid = depth_at(frame, box.centre, INFINITY) > 0;
    std::optional<DropShape> best;
    double least = around.confused(nullptr, is_liquid) + (is_liquid ? most_spoilt : 0);
    for (const float lean : leans) {
        if (best) break;  // from frame to frame it stays where the finger is, and is one track
        for (const float longer : lengths)
            for (const float wider : widths) {
                const DropShape shape = stretched(box, spur.tip, {longer, wider, lean}, frame.edge);
                const DropShape drawn = shape.drawn(frame.edge, 0), thinner = shape.drawn(frame.edge, coded_off * frame.edge);
                if (is_liquid ? !around.is_shown(thinner) || !is_alone(shape, piece, frame, source.label) : !around.is_gone(thinner)) continue;
                if (const double confused = around.confused(&drawn, is_liquid); confused < least) least = confused, best = shape;
            }
    }
    return best ? std::optional(best->drop(is_liquid)) : std::nullopt;
}

bool holds(const Drop& drop, const glm::vec3& x, float beyond) {
    const auto& s = drop.shape;
    const glm::mat3 shape(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]);
    const glm::vec3 r = x - drop.centre, u = glm::inverse(shape) * r;
    return glm::length(r) * (1 - 1 / std::max(glm::length(u), 1e-6f)) < beyond;
}

}  // namespace

std::vector<Drop> spur_drops(const SurfaceFrame& frame, const DecodedFrame& decoded, const std::vector<Drop>& shown) {
    std::vector<Drop> drops;
    if (decoded.mesh.triangles.empty() || frame.mesh.triangles.empty()) return drops;
    std::vector<Spur> spurs;
    find_spurs(frame.mesh, decoded.pieces.index, frame.edge, spurs), find_spurs(decoded.mesh, frame.index, frame.edge, spurs);
    if (spurs.empty()) return drops;
    std::stable_sort(spurs.begin(), spurs.end(), [](const Spur& a, const Spur& b) { return a.off > b.off; });
    spurs.resize(std::min(spurs.size(), most_spurs));
    const MeshPieces source(frame);
    for (const Spur& spur : spurs) {
        const auto is_shown = [&](const Drop& drop) { return holds(drop, spur.tip, held * frame.edge); };
        if (std::any_of(shown.begin(), shown.end(), is_shown) || std::any_of(drops.begin(), drops.end(), is_shown)) continue;
        if (const auto drop = mend(frame, source, decoded, spur)) drops.push_back(*drop), set_velocity(frame, drops.back());
    }
    return drops;
}

}  // namespace rill::cooker
