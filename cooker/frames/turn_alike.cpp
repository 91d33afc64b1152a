// SPDX-License-Identifier: MIT
#include "frames/turn_alike.h"

#include <algorithm>
#include <utility>

#include "common/mesh_edges.h"

namespace rill::cooker {
namespace {

constexpr uint32_t none = UINT32_MAX;

/// Across each edge of each triangle: the one neighbour there, if there is one, and whether the two face the same way.
struct Neighbour {
    uint32_t triangle = none;
    bool alike = true;
};
using Neighbours = std::vector<std::array<Neighbour, 3>>;

/// Written twice, or the other side of the same.
bool is_same_face(Triangle a, Triangle b) {
    std::sort(a.begin(), a.end()), std::sort(b.begin(), b.end());
    return a == b;
}

Neighbours find_neighbours(const Mesh& mesh) {
    const std::vector<MeshEdge> edges = sorted_edges(mesh.triangles);
    Neighbours neighbours(mesh.triangles.size());
    for (size_t i = 0, next; i < edges.size(); i = next) {
        for (next = i + 1; next < edges.size() && edges[next].ends == edges[i].ends;) ++next;
        if (next - i != 2) continue;
        const MeshEdge &a = edges[i], &b = edges[i + 1];
        const Triangle &one = mesh.triangles[a.triangle], &other = mesh.triangles[b.triangle];
        if (is_same_face(one, other)) continue;
        const bool alike = one[a.corner] != other[b.corner];  // they go opposite ways along it
        neighbours[a.triangle][a.corner] = {b.triangle, alike}, neighbours[b.triangle][b.corner] = {a.triangle, alike};
    }
    return neighbours;
}

double area_of(const Mesh& mesh, uint32_t triangle) {
    const Triangle& t = mesh.triangles[triangle];
    const glm::dvec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
    return glm::length(glm::cross(b - a, c - a));
}

/// All triangles that can be reached from `first`, each with whether it must turn if `first` does not. False: one must and must not.
bool walk_part(const Neighbours& neighbours, uint32_t first, std::vector<uint8_t>& met, std::vector<std::pair<uint32_t, bool>>& part) {
    enum : uint8_t { unmet, stays, turns };
    part.assign(1, {first, false});
    met[first] = stays;
    bool one_sided = false;
    for (size_t i = 0; i < part.size(); ++i) {
        const auto [triangle, turned] = part[i];
        for (const Neighbour& neighbour : neighbours[triangle]) {
            if (neighbour.triangle == none) continue;
            const uint8_t wanted = turned == neighbour.alike ? turns : stays;
            uint8_t& is = met[neighbour.triangle];
            if (is == unmet) part.push_back({neighbour.triangle, wanted == turns});
            else one_sided = one_sided || is != wanted;
            if (is == unmet) is = wanted;
        }
    }
    return !one_sided;
}

}  // namespace

size_t turn_alike(Mesh& mesh) {
    if (is_closed(mesh)) return 0;
    const Neighbours neighbours = find_neighbours(mesh);
    std::vector<uint8_t> met(mesh.triangles.size(), 0);
    std::vector<std::pair<uint32_t, bool>> part;
    size_t count = 0;
    for (uint32_t first = 0; first < mesh.triangles.size(); ++first) {
        if (met[first] || !walk_part(neighbours, first, met, part)) continue;
        double areas[2] = {0, 0};
        for (const auto& [triangle, turns] : part) areas[turns] += area_of(mesh, triangle);
        const bool lesser = areas[1] < areas[0];  // the value of `turns` that turns
        for (const auto& [triangle, turns] : part) {
            if (areas[lesser] == 0 || turns != lesser) continue;
            std::swap(mesh.triangles[triangle][1], mesh.triangles[triangle][2]);
            ++count;
        }
    }
    return count;
}

}  // namespace rill::cooker
