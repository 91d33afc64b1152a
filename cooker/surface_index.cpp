// SPDX-License-Identifier: MIT
// Closest point on a triangle mesh: a four-wide tree of boxes, split at the median of the longest axis, so
// that its depth is bounded whatever the input. The boxes of a node's children lie side by side in arrays
// of four: the distances to all of them cost one vectorised loop.
#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel.h"
#include "surface_distance.h"

namespace rill::cooker {
namespace {

constexpr uint32_t leaf_size = 4;
constexpr uint32_t worth_sharing = 8192;  // triangles
constexpr uint32_t leaf_bit = 0x80000000u;  // child = leaf_bit | first triangle << 3 | count, else a node
constexpr uint32_t no_child = leaf_bit;     // a leaf of no triangles

struct Node {
    float lower[3][4], upper[3][4];
    uint32_t child[4];
};
struct Corners {
    glm::vec3 a, b, c;
};
struct Box {
    glm::vec3 lower{std::numeric_limits<float>::infinity()}, upper{-std::numeric_limits<float>::infinity()};
    void add(const glm::vec3& x) { lower = glm::min(lower, x), upper = glm::max(upper, x); }
};

/// Closest point to the origin of a triangle as barycentric coordinates (Ericson, Real-Time Collision
/// Detection 5.1.5), falling back to a corner where a degenerate triangle has no interior.
glm::vec3 closest_barycentric(const Corners& t) {
    const glm::vec3 ab = t.b - t.a, ac = t.c - t.a;
    const float d1 = -glm::dot(ab, t.a), d2 = -glm::dot(ac, t.a);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    const float d3 = -glm::dot(ab, t.b), d4 = -glm::dot(ac, t.b);
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) {
        const float v = d1 / (d1 - d3);
        return {1 - v, v, 0};
    }
    const float d5 = -glm::dot(ab, t.c), d6 = -glm::dot(ac, t.c);
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) {
        const float w = d2 / (d2 - d6);
        return {1 - w, 0, w};
    }
    const float va = d3 * d6 - d5 * d4;
    const float along = d4 - d3, back = d5 - d6;
    if (va <= 0 && along >= 0 && back >= 0 && along + back > 0) {
        const float w = along / (along + back);
        return {0, 1 - w, w};
    }
    const float sum = va + vb + vc;
    if (!(sum > 0)) return {1, 0, 0};
    return {va / sum, vb / sum, vc / sum};
}

}  // namespace

struct SurfaceIndex::Impl {
    const Mesh* mesh;
    std::vector<Node> nodes;
    std::vector<Corners> corners;      // in the order of the leaves
    std::vector<uint32_t> triangles;   // corners[i] is triangle triangles[i] of the mesh
    std::vector<glm::vec3> centres;    // of triangles, while building

    Box bounds(uint32_t first, uint32_t last) const {
        Box box;
        for (uint32_t i = first; i < last; ++i)
            for (uint32_t v : mesh->triangles[triangles[i]]) box.add(mesh->positions[v]);
        return box;
    }
    uint32_t split(uint32_t first, uint32_t last) {
        if (last - first <= leaf_size) return last;
        Box box;
        for (uint32_t i = first; i < last; ++i) box.add(centres[triangles[i]]);
        const glm::vec3 size = box.upper - box.lower;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const uint32_t middle = first + (last - first) / 2;
        std::nth_element(triangles.begin() + first, triangles.begin() + middle, triangles.begin() + last,
                         [&](uint32_t i, uint32_t j) {
                             return centres[i][axis] != centres[j][axis] ? centres[i][axis] < centres[j][axis]
                                                                         : i < j;
                         });
        return middle;
    }
    /// Appends the tree over triangles [first, last) to `out`: a node, then its branches; the same whatever `jobs` is.
    uint32_t build(std::vector<Node>& out, uint32_t first, uint32_t last, int jobs) {
        const uint32_t middle = split(first, last);
        const uint32_t cuts[5] = {first, split(first, middle), middle, split(middle, last), last};
        const bool shared = threads_of(jobs) > 1 && last - first >= worth_sharing;
        std::vector<Node> branches[4];
        if (shared) parallel_for(4, jobs, [&](size_t k) { build(branches[k], cuts[k], cuts[k + 1], 1); });
        const uint32_t self = uint32_t(out.size());
        out.emplace_back();
        for (int k = 0; k < 4; ++k) {
            const uint32_t count = cuts[k + 1] - cuts[k];
            const Box box = bounds(cuts[k], cuts[k + 1]);
            const uint32_t child = count == 0           ? no_child
                                   : count <= leaf_size ? leaf_bit | cuts[k] << 3 | count
                                   : shared             ? append(out, branches[k])
                                                        : build(out, cuts[k], cuts[k + 1], 1);
            out[self].child[k] = child;
            for (int a = 0; a < 3; ++a) out[self].lower[a][k] = box.lower[a], out[self].upper[a][k] = box.upper[a];
        }
        return self;
    }
    static uint32_t append(std::vector<Node>& out, const std::vector<Node>& branch) {
        const uint32_t base = uint32_t(out.size());
        for (Node node : branch) {
            for (uint32_t& child : node.child)
                if (!(child & leaf_bit)) child += base;
            out.push_back(node);
        }
        return base;
    }
};

SurfaceIndex::SurfaceIndex(const Mesh& mesh, int jobs) : impl_(new Impl{&mesh, {}, {}, {}, {}}) {
    const uint32_t count = uint32_t(mesh.triangles.size());
    if (count >= leaf_bit >> 3)
        throw InputError("a frame of " + std::to_string(count) + " triangles is more than this version can index");
    if (count == 0) return;
    impl_->triangles.resize(count);
    impl_->centres.resize(count);
    for (uint32_t i = 0; i < count; ++i) {
        const Triangle& t = mesh.triangles[i];
        impl_->triangles[i] = i;
        impl_->centres[i] = mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]];
    }
    impl_->nodes.reserve(count / 4 + 4);
    impl_->build(impl_->nodes, 0, count, jobs);
    impl_->centres = {};
    impl_->corners.reserve(count);
    for (uint32_t i : impl_->triangles) {
        const Triangle& t = mesh.triangles[i];
        impl_->corners.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
    }
}
SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
const Mesh& SurfaceIndex::mesh() const { return *impl_->mesh; }

SurfaceIndex::Hit SurfaceIndex::closest(const glm::vec3& x, float at_most) const {
    Hit hit;
    hit.distance = std::numeric_limits<float>::infinity();
    if (impl_->nodes.empty()) return hit;
    struct Entry {
        float distance2;
        uint32_t child;
    } stack[64];  // 3 more than popped at each of at most 15 levels (4^15 leaves)
    uint32_t depth = 0;
    stack[depth++] = {0, 0};
    float best = at_most * at_most;
    bool found = false;
    while (depth > 0) {
        const Entry top = stack[--depth];
        if (top.distance2 > best) continue;
        if (top.child & leaf_bit) {
            const uint32_t first = (top.child & ~leaf_bit) >> 3, count = top.child & 7;
            for (uint32_t i = first; i < first + count; ++i) {
                const Corners& c = impl_->corners[i];
                const Corners local{c.a - x, c.b - x, c.c - x};
                const glm::vec3 weights = closest_barycentric(local);
                const glm::vec3 offset = local.a * weights.x + local.b * weights.y + local.c * weights.z;
                const float distance2 = glm::dot(offset, offset);
                if (found ? distance2 < best : distance2 <= best) {
                    best = distance2;
                    found = true;
                    hit.point = x + offset, hit.triangle = impl_->triangles[i], hit.barycentric = weights;
                }
            }
            continue;
        }
        const Node& node = impl_->nodes[top.child];
        float distance2[4];
        for (int k = 0; k < 4; ++k) {
            float sum = 0;
            for (int a = 0; a < 3; ++a) {
                const float out = std::max(std::max(node.lower[a][k] - x[a], x[a] - node.upper[a][k]), 0.0f);
                sum += out * out;
            }
            distance2[k] = sum;
        }
        const uint32_t base = depth;  // pushed far to near: the nearest child is looked at first
        for (int k = 0; k < 4; ++k) {
            if (!(distance2[k] <= best) || node.child[k] == no_child) continue;
            uint32_t at = depth++;
            for (; at > base && stack[at - 1].distance2 < distance2[k]; --at) stack[at] = stack[at - 1];
            stack[at] = {distance2[k], node.child[k]};
        }
    }
    if (found) hit.distance = std::sqrt(best);
    return hit;
}

}  // namespace rill::cooker
