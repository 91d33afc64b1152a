// SPDX-License-Identifier: MIT
// A thin neck is hardly farther off than any other place when it is torn, but what hung on it is now a piece of its own. So pieces
// tell: a decoded one that lies on a much larger piece of the source has been torn off it, where the source's triangles go from
// vertices nearest to it to others.
#include "torn_necks.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace rill::cooker {
namespace {

constexpr double least_piece = 2;    // cubic edges: less is no piece
constexpr double much_larger = 1.6;  // whatever has been torn in two, the smaller part is that much smaller
constexpr float around_piece = 2;    // edges from it, within which it was torn off
constexpr float neck_width = 2;      // edges: places nearer to each other belong to one neck

/// Vertices of the larger of the pieces but the largest, by the pieces' names.
std::map<uint32_t, std::vector<uint32_t>> pieces_of(const std::vector<uint32_t>& label, const std::vector<double>& volume, double least) {
    const size_t largest = size_t(std::max_element(volume.begin(), volume.end()) - volume.begin());
    std::map<uint32_t, std::vector<uint32_t>> pieces;
    for (uint32_t v = 0; v < label.size(); ++v)
        if (label[v] != largest && volume[label[v]] > least) pieces[label[v]].push_back(v);
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
        groups.push_back({sum / count, places[i].pieces});
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
        if (source_volume[home] < much_larger * volume[piece]) continue;
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
                torn.push_back({(source.positions[t[0]] + source.positions[t[1]] + source.positions[t[2]]) / 3.f, {piece, other}});
        }
        add_groups(torn, neck_width * frame.edge, necks);
    }
    return necks;
}

NeckCorners::NeckCorners(const TornNeck& neck, float cell, float radius, const DecodedPieces& decoded) : neck_(neck) {
    std::array<int, 3> first;
    for (int a = 0; a < 3; ++a) {
        first[size_t(a)] = int(std::ceil((neck.middle[a] - radius) / cell));
        size_[size_t(a)] = int(std::floor((neck.middle[a] + radius) / cell)) - first[size_t(a)] + 1;
    }
    for (int k = 0; k < size_[2]; ++k)
        for (int j = 0; j < size_[1]; ++j)
            for (int i = 0; i < size_[0]; ++i) {
                x.push_back(cell * float(first[0] + i)), y.push_back(cell * float(first[1] + j)), z.push_back(cell * float(first[2] + k));
                piece_.push_back(decoded.nearest({x.back(), y.back(), z.back()}));
            }
}

size_t NeckCorners::liquid_corner(uint32_t piece, const std::vector<float>& value) const {
    size_t best = x.size();
    float least = INFINITY;
    for (size_t i = 0; i < x.size(); ++i) {
        const float away = glm::distance(neck_.middle, glm::vec3(x[i], y[i], z[i]));
        if (piece_[i] == piece && value[i] < 0 && away < least) least = away, best = i;
    }
    return best;
}

bool NeckCorners::is_torn(const std::vector<float>& value, const std::vector<float>& before) const {
    const size_t from = liquid_corner(neck_.pieces[0], before), to = liquid_corner(neck_.pieces[1], before);
    if (from == x.size() || to == x.size()) return false;
    std::vector<bool> reached(x.size(), false);
    std::vector<size_t> next{from};
    reached[from] = value[from] < 0;
    while (!next.empty() && reached[from] && !reached[to]) {
        const size_t at = next.back();
        next.pop_back();
        const std::array<size_t, 3> step{1, size_t(size_[0]), size_t(size_[0]) * size_t(size_[1])};
        for (size_t a = 0; a < 3; ++a) {
            const int place = int(at / step[a]) % size_[a];
            const auto go = [&](size_t other) {
                if (!reached[other] && value[other] < 0) reached[other] = true, next.push_back(other);
            };
            if (place > 0) go(at - step[a]);
            if (place + 1 < size_[a]) go(at + step[a]);
        }
    }
    return !reached[to];
}

}  // namespace rill::cooker
