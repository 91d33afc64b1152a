// SPDX-License-Identifier: MIT
#include "frames/split_edges.h"

#include <algorithm>
#include <unordered_map>

namespace rill::cooker {
namespace {

constexpr size_t most_triangles = 2'000'000, most_times = 4;  // or so many times those that there were
constexpr uint32_t whole = ~0u;

/// New vertices in the middle of long edges, by the edge's vertices.
class Middles {
public:
    Middles(Mesh& mesh, float longest) : mesh_(mesh), longest_(longest) {}
    /// Of the edge from a to b; `whole` if it is not too long, or floats know no place between them.
    uint32_t of(uint32_t a, uint32_t b) {
        const glm::vec3 from = mesh_.positions[a], to = mesh_.positions[b], middle = 0.5f * (from + to);
        if (!(glm::distance(from, to) > longest_) || middle == from || middle == to) return whole;
        const auto [at, is_new] = middles_.try_emplace(uint64_t(std::min(a, b)) << 32 | std::max(a, b), uint32_t(mesh_.positions.size()));
        if (is_new) {
            mesh_.positions.push_back(middle);
            if (!mesh_.velocities.empty()) mesh_.velocities.push_back(0.5f * (mesh_.velocities[a] + mesh_.velocities[b]));
        }
        return at->second;
    }
    bool any() const { return !middles_.empty(); }

private:
    Mesh& mesh_;
    float longest_;
    std::unordered_map<uint64_t, uint32_t> middles_;
};

/// What becomes of a triangle whose edges (0 1), (1 2), (2 0) have these middles.
void split(const Mesh& mesh, const Triangle& t, const std::array<uint32_t, 3>& middle, std::vector<Triangle>& out) {
    const auto count = std::count(middle.begin(), middle.end(), whole);
    if (count == 3) return out.push_back(t);
    // Turned so that the first edge is split and, of two, the second as well.
    size_t k = 0;
    while (middle[k] == whole || (count == 1 && middle[(k + 1) % 3] == whole)) ++k;
    const uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3], ab = middle[k], bc = middle[(k + 1) % 3], ca = middle[(k + 2) % 3];
    if (count == 2) {
        out.insert(out.end(), {{a, ab, c}, {ab, b, c}});
    } else if (count == 1) {
        out.push_back({ab, b, bc});
        if (glm::distance(mesh.positions[a], mesh.positions[bc]) < glm::distance(mesh.positions[ab], mesh.positions[c]))
            out.insert(out.end(), {{a, ab, bc}, {a, bc, c}});
        else
            out.insert(out.end(), {{a, ab, c}, {ab, bc, c}});
    } else {
        out.insert(out.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
}

}  // namespace

void split_long_edges(Mesh& mesh, float longest) {
    const size_t most = std::max(most_triangles, most_times * mesh.triangles.size());
    std::vector<Triangle> triangles;
    while (mesh.triangles.size() < most) {
        Middles middles(mesh, longest);
        triangles.clear();
        for (const Triangle& t : mesh.triangles)
            split(mesh, t, {middles.of(t[0], t[1]), middles.of(t[1], t[2]), middles.of(t[2], t[0])}, triangles);
        if (!middles.any()) return;
        mesh.triangles.swap(triangles);
        mesh.normals.clear();
    }
}

}  // namespace rill::cooker
