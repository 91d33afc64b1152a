// SPDX-License-Identifier: MIT
// A thin neck is hardly farther off than any other place when it is torn, but what hung on it is now a piece of its own. So pieces
// tell: a decoded one that lies on a much larger piece of the source has been torn off it, where the source's triangles go from
// vertices nearest to it to others. A bubble that lies on a surface which is none of the source's bubbles' was a cavity: its mouth is torn.
// And the other way round: a piece of the source that lies on a much larger decoded one has run into what else lies there.
#include "torn_necks.h"

#include <algorithm>
#include <cmath>
#include <map>
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

/// The source's piece that most of the vertices lie nearest to.
uint32_t home_of(const SurfaceFrame& frame, const std::vector<uint32_t>& source_label, const Mesh& decoded, const std::vector<uint32_t>& vertices) {
    std::map<uint32_t, size_t> votes;
    for (uint32_t v : vertices) {
        const SurfaceIndex::Hit hit = frame.index.closest(decoded.positions[v], INFINITY);
        ++votes[source_label[frame.mesh.triangles[hit.triangle][0]]];
    }
    const auto fewer = [](const auto& a, const auto& b) { return a.second < b.second; };
    return std::max_element(votes.begin(), votes.end(), fewer)->first;
}

glm::vec3 middle_of(const Mesh& mesh, const Triangle& t) { return (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.f; }

/// What the source's vertex nearest to x belongs to.
uint32_t nearest_label(const SurfaceFrame& frame, const std::vector<uint32_t>& label, const glm::vec3& x) {
    thread_local std::vector<VertexTree::Found> found;
    frame.tree.nearest(x, 1, found);
    return label[found[0].vertex];
}

struct Bounds {
    glm::vec3 lower{INFINITY}, upper{-INFINITY};
    void add(const glm::vec3& x, float around) { lower = glm::min(lower, x - around), upper = glm::max(upper, x + around); }
    bool holds(const glm::vec3& x) const { return glm::all(glm::lessThan(lower, x)) && glm::all(glm::lessThan(x, upper)); }
};

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

}  // namespace

DecodedPieces::DecodedPieces(const Mesh& decoded, int jobs) : mesh(decoded), index(decoded, jobs), label(label_components(decoded)) {}

std::vector<TornNeck> find_torn_necks(const SurfaceFrame& frame, const DecodedPieces& decoded) {
    std::vector<TornNeck> necks;
    const Mesh& source = frame.mesh;
    if (source.triangles.empty() || decoded.mesh.triangles.empty()) return necks;
    const std::vector<uint32_t> source_label = label_components(source);
    const std::vector<double> volume = label_volumes(decoded.mesh, decoded.label), source_volume = label_volumes(source, source_label);
    for (const auto& [piece, vertices] : pieces_of(decoded.label, volume, least_piece * std::pow(double(frame.edge), 3))) {
        const uint32_t home = home_of(frame, source_label, decoded.mesh, vertices);
        const bool air = volume[piece] < 0;
        if (std::fabs(source_volume[home]) < much_larger * std::fabs(volume[piece]) || (!air && source_volume[home] < 0)) continue;
        Bounds bounds;
        for (uint32_t v : vertices) bounds.add(decoded.mesh.positions[v], around_piece * frame.edge);
        std::vector<TornNeck> torn;
        for (const Triangle& t : source.triangles) {
            if (source_label[t[0]] != home || !bounds.holds(source.positions[t[0]])) continue;
            uint32_t other = piece, own = 0;
            for (uint32_t v : t) {
                const uint32_t nearest = decoded.nearest(source.positions[v]);
                if (nearest == piece) ++own;
                else other = nearest;
            }
            if (own > 0 && other != piece)
                torn.push_back({middle_of(source, t), {piece, other}, air ? TornNeck::Of::air : TornNeck::Of::liquid});
        }
        add_groups(torn, neck_width * frame.edge, necks);
    }
    return necks;
}

std::vector<TornNeck> find_false_necks(const SurfaceFrame& frame, const DecodedPieces& decoded) {
    std::vector<TornNeck> necks;
    const Mesh& source = frame.mesh;
    if (source.triangles.empty() || decoded.mesh.triangles.empty()) return necks;
    const std::vector<uint32_t> label = label_components(source);
    const std::vector<double> volume = label_volumes(source, label), decoded_volume = label_volumes(decoded.mesh, decoded.label);
    for (const auto& [piece, vertices] : pieces_of(label, volume, least_piece * std::pow(double(frame.edge), 3))) {
        if (volume[piece] < 0) continue;
        std::map<uint32_t, size_t> votes;
        for (uint32_t v : vertices) ++votes[decoded.nearest(source.positions[v])];
        const uint32_t home = std::max_element(votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; })->first;
        if (decoded_volume[home] < much_larger * volume[piece]) continue;
        Bounds bounds;
        for (uint32_t v : vertices) bounds.add(source.positions[v], around_piece * frame.edge);
        std::vector<TornNeck> joined;
        for (const Triangle& t : decoded.mesh.triangles) {
            if (decoded.label[t[0]] != home || !bounds.holds(decoded.mesh.positions[t[0]])) continue;
            uint32_t other = piece, own = 0;
            for (uint32_t v : t) {
                const uint32_t nearest = nearest_label(frame, label, decoded.mesh.positions[v]);
                if (nearest == piece) ++own;
                else other = nearest;
            }
            if (own > 0 && other != piece && volume[other] > 0) joined.push_back({middle_of(decoded.mesh, t), {piece, other}, TornNeck::Of::none});
        }
        add_groups(joined, neck_width * frame.edge, necks);
    }
    return necks;
}

NeckCorners::NeckCorners(const TornNeck& neck, const SurfaceFrame& frame, float radius, const DecodedPieces& decoded) : neck_(neck), cell_(frame.edge) {
    std::array<int, 3> first;
    for (int a = 0; a < 3; ++a) {
        first[size_t(a)] = int(std::ceil((neck.middle[a] - radius) / cell_));
        size_[size_t(a)] = int(std::floor((neck.middle[a] + radius) / cell_)) - first[size_t(a)] + 1;
    }
    std::vector<uint32_t> label;
    if (neck.of == TornNeck::Of::none) label = label_components(frame.mesh);
    for (int k = 0; k < size_[2]; ++k)
        for (int j = 0; j < size_[1]; ++j)
            for (int i = 0; i < size_[0]; ++i) {
                x.push_back(cell_ * float(first[0] + i)), y.push_back(cell_ * float(first[1] + j)), z.push_back(cell_ * float(first[2] + k));
                const glm::vec3 at(x.back(), y.back(), z.back());
                piece_.push_back(label.empty() ? decoded.nearest(at) : nearest_label(frame, label, at));
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
