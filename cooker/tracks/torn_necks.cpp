// SPDX-License-Identifier: MIT
// A thin neck is hardly farther off than any other place when it is torn, but what hung on it is now a piece of its own. So pieces
// tell: a decoded one that lies on a much larger piece of the source has been torn off it, where the source's triangles go from
// vertices nearest to it to others. A bubble that lies on a surface which is none of the source's bubbles' was a cavity: its mouth is torn.
// And the other way round: a piece of the source that lies on a much larger decoded one has run into what else lies there.
#include "tracks/torn_necks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace rill::cooker {
namespace {

constexpr double least_piece = 2;    // cubic edges: less is no piece
constexpr double much_larger = 1.6;  // whatever has been torn in two, the smaller part is that much smaller
constexpr float around_piece = 2;    // edges from it, within which it was torn off
constexpr float neck_width = 2;      // edges: places nearer to each other belong to one neck
constexpr float in_false_neck = 1;   // cells: from its middle; what is farther is the pieces'

/// Vertices of the larger of the pieces and bubbles but the largest, by their names.
std::map<uint32_t, std::vector<uint32_t>> pieces_of(const std::vector<uint32_t>& label, const std::vector<double>& volume, double least) {
    const size_t largest = size_t(std::max_element(volume.begin(), volume.end()) - volume.begin());
    std::map<uint32_t, std::vector<uint32_t>> pieces;
    for (uint32_t v = 0; v < label.size(); ++v)
        if (label[v] != largest && std::fabs(volume[label[v]]) > least) pieces[label[v]].push_back(v);
    return pieces;
}

glm::vec3 middle_of(const Mesh& mesh, const Triangle& t) { return (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.f; }

struct Bounds {
    glm::vec3 lower{INFINITY}, upper{-INFINITY};
    void add(const glm::vec3& x, float around) { lower = glm::min(lower, x - around), upper = glm::max(upper, x + around); }
    bool holds(const glm::vec3& x) const { return glm::all(glm::lessThan(lower, x)) && glm::all(glm::lessThan(x, upper)); }
};

/// The piece of `other` that most of the vertices lie nearest to.
uint32_t home_of(const MeshPieces& own, const std::vector<uint32_t>& vertices, const MeshPieces& other) {
    std::map<uint32_t, size_t> votes;
    SurfaceIndex::Near near;
    for (uint32_t v : vertices) ++votes[other.nearest(own.mesh.positions[v], &near)];
    const auto fewer = [](const auto& a, const auto& b) { return a.second < b.second; };
    return std::max_element(votes.begin(), votes.end(), fewer)->first;
}

/// Groups of places between the same pieces that lie together, as one at their middle each.
void add_groups(const std::vector<TornNeck>& places, float width, std::vector<TornNeck>& groups) {
    std::vector<bool> grouped(places.size(), false);
    for (size_t i = 0; i < places.size(); ++i) {
        if (grouped[i]) continue;
        glm::vec3 sum{};
        float count = 0;
        for (size_t j = i; j < places.size(); ++j) {
            if (grouped[j] || places[i].pieces != places[j].pieces || !(glm::distance(places[i].middle, places[j].middle) < width)) continue;
            grouped[j] = true, sum += places[j].middle, ++count;
        }
        groups.push_back({sum / count, places[i].pieces, places[i].of});
    }
}

/// Pieces of `own` that lie on much larger ones of `other`: where triangles of these go from vertices nearest to the piece to others, as
/// necks between pieces of `own`. `of(volume of the piece, of what it lies on)`: what kind of neck; nothing: none.
template <typename Of>
std::vector<TornNeck> find_necks(const MeshPieces& own, const MeshPieces& other, float edge, Of of) {
    std::vector<TornNeck> necks;
    if (own.mesh.triangles.empty() || other.mesh.triangles.empty()) return necks;
    const std::vector<double> volume = label_volumes(own.mesh, own.label), other_volume = label_volumes(other.mesh, other.label);
    for (const auto& [piece, vertices] : pieces_of(own.label, volume, least_piece * std::pow(double(edge), 3))) {
        const uint32_t home = home_of(own, vertices, other);
        if (std::fabs(other_volume[home]) < much_larger * std::fabs(volume[piece])) continue;
        const std::optional<TornNeck::Of> kind = of(volume[piece], other_volume[home]);
        if (!kind) continue;
        Bounds bounds;
        for (uint32_t v : vertices) bounds.add(own.mesh.positions[v], around_piece * edge);
        std::vector<TornNeck> places;
        SurfaceIndex::Near near;
        for (const Triangle& t : other.mesh.triangles) {
            if (other.label[t[0]] != home || !bounds.holds(other.mesh.positions[t[0]])) continue;
            uint32_t beyond = piece, here = 0;
            for (uint32_t v : t) {
                const uint32_t nearest = own.nearest(other.mesh.positions[v], &near);
                if (nearest == piece) ++here;
                else beyond = nearest;
            }
            const bool joins = here > 0 && beyond != piece && (*kind != TornNeck::Of::none || volume[beyond] > 0);
            if (joins) places.push_back({middle_of(other.mesh, t), {piece, beyond}, *kind});
        }
        add_groups(places, neck_width * edge, necks);
    }
    return necks;
}

}  // namespace

MeshPieces::MeshPieces(const Mesh& decoded, int jobs) : own_(std::make_unique<SurfaceIndex>(decoded, jobs)), mesh(decoded), index(*own_), label(label_components(decoded)) {}
MeshPieces::MeshPieces(const SurfaceFrame& frame) : mesh(frame.mesh), index(frame.index), label(label_components(frame.mesh)) {}

std::vector<TornNeck> find_torn_necks(const MeshPieces& source, const MeshPieces& decoded, float edge) {
    return find_necks(decoded, source, edge, [](double volume, double home) -> std::optional<TornNeck::Of> {
        if (volume < 0) return TornNeck::Of::air;
        if (home < 0) return {};  // a drop in a bubble
        return TornNeck::Of::liquid;
    });
}

std::vector<TornNeck> find_false_necks(const MeshPieces& source, const MeshPieces& decoded, float edge) {
    return find_necks(source, decoded, edge, [](double volume, double home) -> std::optional<TornNeck::Of> {
        if (volume < 0 || home < 0) return {};
        return TornNeck::Of::none;
    });
}

NeckCorners::NeckCorners(const TornNeck& neck, float cell, float radius, const MeshPieces& pieces) : neck_(neck), cell_(cell) {
    std::array<int, 3> first;
    for (int a = 0; a < 3; ++a) {
        first[size_t(a)] = int(std::ceil((neck.middle[a] - radius) / cell_));
        size_[size_t(a)] = int(std::floor((neck.middle[a] + radius) / cell_)) - first[size_t(a)] + 1;
    }
    for (int k = 0; k < size_[2]; ++k)
        for (int j = 0; j < size_[1]; ++j)
            for (int i = 0; i < size_[0]; ++i) {
                x.push_back(cell_ * float(first[0] + i)), y.push_back(cell_ * float(first[1] + j)), z.push_back(cell_ * float(first[2] + k));
                piece_.push_back(pieces.nearest({x.back(), y.back(), z.back()}));
            }
}

std::vector<size_t> NeckCorners::corners_of(uint32_t piece, const std::vector<float>& value) const {
    std::vector<size_t> all, nearest;
    float least = INFINITY;
    for (size_t i = 0; i < x.size(); ++i) {
        const float away = glm::distance(neck_.middle, glm::vec3(x[i], y[i], z[i]));
        if (piece_[i] != piece || !is_in(value[i])) continue;
        if (away > in_false_neck * cell_) all.push_back(i);
        if (away < least) least = away, nearest = {i};
    }
    return neck_.of == TornNeck::Of::none ? all : nearest;
}

bool NeckCorners::are_joined(std::vector<size_t> next, const std::vector<size_t>& to, const std::vector<float>& value) const {
    std::vector<bool> reached(x.size(), false);
    const auto go = [&](size_t corner) {
        if (!reached[corner] && is_in(value[corner])) reached[corner] = true, next.push_back(corner);
    };
    const std::vector<size_t> from = std::exchange(next, {});
    for (const size_t corner : from) go(corner);
    const std::array<size_t, 3> step{1, size_t(size_[0]), size_t(size_[0]) * size_t(size_[1])};
    while (!next.empty()) {
        const size_t at = next.back();
        next.pop_back();
        for (size_t a = 0; a < 3; ++a) {
            const int place = int(at / step[a]) % size_[a];
            if (place > 0) go(at - step[a]);
            if (place + 1 < size_[a]) go(at + step[a]);
        }
    }
    return std::any_of(to.begin(), to.end(), [&](size_t corner) { return reached[corner]; });
}

bool NeckCorners::is_amiss(const std::vector<float>& value, const std::vector<float>& before) const {
    const std::vector<size_t> from = corners_of(neck_.pieces[0], before), to = corners_of(neck_.pieces[1], before);
    if (from.empty() || to.empty()) return false;
    return are_joined(from, to, value) == (neck_.of == TornNeck::Of::none);
}

}  // namespace rill::cooker
