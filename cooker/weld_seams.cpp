// SPDX-License-Identifier: MIT
#include "weld_seams.h"

#include <algorithm>
#include <bit>

#include "surface_distance.h"

namespace rill::cooker {
namespace {

/// Of every vertex the first that stands at its place.
std::vector<uint32_t> first_at_place(const std::vector<glm::vec3>& positions) {
    constexpr uint32_t none = ~0u;
    const size_t slots = std::bit_ceil(2 * positions.size() + 1);
    std::vector<uint32_t> table(slots, none), first(positions.size());
    for (uint32_t v = 0; v < positions.size(); ++v) {
        const glm::vec3 x = positions[v] + 0.f;  // −0 is 0
        uint64_t hash = 0;
        for (int c = 0; c < 3; ++c) hash = (hash ^ std::bit_cast<uint32_t>(x[c])) * 0x9e3779b97f4a7c15u, hash ^= hash >> 32;
        size_t slot = hash & (slots - 1);
        while (table[slot] != none && positions[table[slot]] != x) slot = (slot + 1) & (slots - 1);
        if (table[slot] == none) table[slot] = v;
        first[v] = table[slot];
    }
    return first;
}

}  // namespace

size_t weld_seams(Mesh& mesh) {
    const size_t count = mesh.positions.size();
    const std::vector<uint32_t> first = first_at_place(mesh.positions);
    uint32_t last = 0;
    if (std::all_of(first.begin(), first.end(), [&](uint32_t v) { return v == last++; })) return 0;
    const Topology before = topology(mesh);
    if (before.open_edges == 0) return 0;
    Mesh welded = mesh;
    for (Triangle& t : welded.triangles)
        for (uint32_t& v : t) v = first[v];
    std::erase_if(welded.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    const Topology after = topology(welded);
    if (after.open_edges >= before.open_edges || after.non_manifold_edges > before.non_manifold_edges) return 0;
    if (!mesh.velocities.empty()) {
        std::vector<uint32_t> at(count, 0);
        for (uint32_t v = 0; v < count; ++v)  // ascending: the first of a place comes before the others
            if (++at[first[v]] > 1) welded.velocities[first[v]] += mesh.velocities[v];
        for (uint32_t v = 0; v < count; ++v)
            if (at[v] > 1) welded.velocities[v] /= float(at[v]);
    }
    mesh = part_of(welded, welded.triangles);
    mesh.normals.clear();
    return before.open_edges - after.open_edges;
}

}  // namespace rill::cooker
