// SPDX-License-Identifier: MIT
// Closest point on a triangle mesh: a four-wide tree of boxes, split at the median of the longest axis, so
// that its depth is bounded whatever the input. The boxes of a node's children lie side by side in arrays
// of four, and so do the triangles of a leaf: the distances to all of them cost one vectorised loop.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/parallel.h"
#include "measure/surface_distance.h"

namespace rill::cooker {
namespace {

constexpr uint32_t lanes = 4;             // children of a node, triangles of a leaf
constexpr uint32_t worth_sharing = 8192;  // triangles
constexpr uint32_t worth_counting = 128;  // triangles,
constexpr float least_counted = 1e-30f;   // metres: where they lie apart at all
constexpr uint32_t leaf_bit = 0x80000000u;  // child = leaf_bit | leaf, else a node
constexpr uint32_t no_child = ~0u;

using Lanes = float __attribute__((vector_size(lanes * sizeof(float))));
struct Node {
    Lanes lower[3], upper[3];
    uint32_t child[lanes];
};
/// Triangles a, a + b, a + c; what is over repeats the last.
struct Leaf {
    Lanes a[3], b[3], c[3];
    uint32_t triangle[lanes];
};
struct Corners {
    glm::vec3 a, b, c;
};
struct Box {
    glm::vec3 lower{std::numeric_limits<float>::infinity()}, upper{-std::numeric_limits<float>::infinity()};
    void add(const Box& b) { lower = glm::min(lower, b.lower), upper = glm::max(upper, b.upper); }
    void add(const glm::vec3& x) { add(Box{x, x}); }
};

/// Closest point to the origin of a triangle as barycentric coordinates: the nearest on its edges or, if that is nearer yet, inside.
/// (Deciding by signs which of them it is, as Ericson, Real-Time Collision Detection 5.1.5, goes wrong on slivers.)
glm::vec3 closest_barycentric(const Corners& t) {
    const glm::vec3 b = t.b - t.a, c = t.c - t.a;
    const float bb = glm::dot(b, b), bc = glm::dot(b, c), cc = glm::dot(c, c), ab = -glm::dot(t.a, b), ac = -glm::dot(t.a, c);
    const auto along = [](float dot, float length2) { return std::clamp(dot / std::max(length2, FLT_MIN), 0.f, 1.f); };
    float best = std::numeric_limits<float>::infinity(), v = 0, w = 0;
    const auto offer = [&](float to_b, float to_c) {
        const glm::vec3 x = t.a + to_b * b + to_c * c;
        if (const float distance2 = glm::dot(x, x); distance2 < best) best = distance2, v = to_b, w = to_c;
    };
    const float across = along(cc - bc + ab - ac, bb - 2 * bc + cc);
    offer(along(ab, bb), 0), offer(0, along(ac, cc)), offer(across, 1 - across);
    const float all = bb * cc - bc * bc, p = cc * ab - bc * ac, q = bb * ac - bc * ab;
    if (p >= 0 && q >= 0 && p + q <= all) offer(p / std::max(all, FLT_MIN), q / std::max(all, FLT_MIN));
    return {1 - v - w, v, w};
}

Lanes lesser(Lanes a, Lanes b) { return a < b ? a : b; }
Lanes greater(Lanes a, Lanes b) { return a > b ? a : b; }

/// Squared distances of x from the boxes of a node.
Lanes squared_distances(const Node& node, const glm::vec3& x) {
    Lanes sum{};
    for (int d = 0; d < 3; ++d) {
        const Lanes out = greater(greater(node.lower[d] - x[d], x[d] - node.upper[d]), Lanes{});
        sum += out * out;
    }
    return sum;
}

/// Squared distances of x from the triangles of a leaf: from the nearest edge or, over the inside, from the plane.
/// Whatever rounding makes of a sliver, some point of the triangle has that distance.
Lanes squared_distances(const Leaf& leaf, const glm::vec3& x) {
    const Lanes ax = leaf.a[0] - x.x, ay = leaf.a[1] - x.y, az = leaf.a[2] - x.z;
    const Lanes bx = leaf.b[0], by = leaf.b[1], bz = leaf.b[2], cx = leaf.c[0], cy = leaf.c[1], cz = leaf.c[2];
    const Lanes bb = bx * bx + by * by + bz * bz, bc = bx * cx + by * cy + bz * cz, cc = cx * cx + cy * cy + cz * cz;
    const Lanes ab = -(ax * bx + ay * by + az * bz), ac = -(ax * cx + ay * cy + az * cz);
    const auto from = [&](Lanes v, Lanes w) {  // a + v b + w c
        const Lanes px = ax + v * bx + w * cx, py = ay + v * by + w * cy, pz = az + v * bz + w * cz;
        return px * px + py * py + pz * pz;
    };
    const Lanes none{}, one = none + 1, least = none + FLT_MIN;
    const auto along = [&](Lanes dot, Lanes length2) { return lesser(greater(dot / greater(length2, least), none), one); };
    const Lanes across = along(cc - bc + ab - ac, bb - 2 * bc + cc);
    const Lanes edges = lesser(lesser(from(along(ab, bb), none), from(none, along(ac, cc))), from(across, one - across));
    const Lanes v = cc * ab - bc * ac, w = bb * ac - bc * ab, all = bb * cc - bc * bc, scale = one / greater(all, least);
    const Lanes inside = from(v * scale, w * scale);
    return ((v >= none) & (w >= none) & (v + w <= all) & (inside < edges)) ? inside : edges;
}

}  // namespace

struct SurfaceIndex::Impl {
    const Mesh* mesh;
    std::vector<Node> nodes;
    std::vector<Leaf> leaves;
    /// While building: of a triangle, in the order of the leaves.
    struct Item {
        glm::vec3 centre;
        uint32_t triangle;
    };
    std::vector<Item> items, spare;

    /// Orders [first, last) so that what lies lower along the longest axis comes first, up to about the middle, which is returned.
    uint32_t split(uint32_t first, uint32_t last) {
        if (last - first <= lanes) return last;
        Box box;
        for (uint32_t i = first; i < last; ++i) box.add(items[i].centre);
        const glm::vec3 size = box.upper - box.lower;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const uint32_t middle = first + ((last - first) / 2 + lanes - 1) / lanes * lanes;  // leaves are full
        uint32_t begin = first, end = last;
        if (last - first > worth_counting && size[axis] > least_counted) sift(first, last, axis, box, middle, begin, end);
        std::nth_element(items.begin() + begin, items.begin() + middle, items.begin() + end,
                         [axis](const Item& a, const Item& b) { return a.centre[axis] < b.centre[axis]; });
        return middle;
    }
    /// Puts what is surely below and above `middle` there by counting, in a third of the time that nth_element takes; [begin, end) is
    /// left to that.
    void sift(uint32_t first, uint32_t last, int axis, const Box& box, uint32_t middle, uint32_t& begin, uint32_t& end) {
        constexpr uint32_t slices = 64;
        const float lower = box.lower[axis], scale = (slices - 1) / (box.upper[axis] - lower);
        const auto slice = [&](const Item& item) { return std::min(uint32_t((item.centre[axis] - lower) * scale), slices - 1); };
        uint32_t counts[slices] = {}, chosen = 0;
        for (uint32_t i = first; i < last; ++i) ++counts[slice(items[i])];
        for (begin = first; begin + counts[chosen] <= middle && chosen + 1 < slices; ++chosen) begin += counts[chosen];
        end = begin + counts[chosen];
        uint32_t next[3] = {first, begin, end};
        for (uint32_t i = first; i < last; ++i) {
            const uint32_t at = slice(items[i]);
            spare[next[uint32_t(at >= chosen) + uint32_t(at > chosen)]++] = items[i];
        }
        std::copy(spare.begin() + first, spare.begin() + last, items.begin() + first);
    }
    /// Appends the tree over triangles [first, last) to `out`, without boxes: a node, then its branches; the same whatever
    /// `jobs` is.
    uint32_t build(std::vector<Node>& out, uint32_t first, uint32_t last, int jobs) {
        const uint32_t middle = split(first, last);
        const uint32_t cuts[5] = {first, split(first, middle), middle, split(middle, last), last};
        const bool shared = threads_of(jobs) > 1 && last - first >= worth_sharing;
        std::vector<Node> branches[4];
        if (shared) parallel_for(4, jobs, [&](size_t k) { build(branches[k], cuts[k], cuts[k + 1], 1); });
        const uint32_t self = uint32_t(out.size());
        out.emplace_back();
        for (uint32_t k = 0; k < lanes; ++k) {
            const uint32_t count = cuts[k + 1] - cuts[k];
            const uint32_t child = count == 0       ? no_child
                                   : count <= lanes ? leaf_bit | cuts[k] / lanes
                                   : shared         ? append(out, branches[k])
                                                    : build(out, cuts[k], cuts[k + 1], 1);
            out[self].child[k] = child;
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
    /// Squared distance of the closest triangle that is `at_most` so far, or of any that is nearer than `enough`; else infinity.
    /// `near`: the leaf to look at first, if it is one; afterwards that of the triangle.
    float search(const glm::vec3& x, float at_most, float enough, uint32_t& triangle, uint32_t& near) const;
    void name_triangles() {
        leaves.resize((items.size() + lanes - 1) / lanes);
        for (size_t i = 0; i < leaves.size() * lanes; ++i)
            leaves[i / lanes].triangle[i % lanes] = items[std::min(i, items.size() - 1)].triangle;
        items = {}, spare = {};
    }
    Corners corners(uint32_t triangle) const {
        const Triangle& t = mesh->triangles[triangle];
        return {mesh->positions[t[0]], mesh->positions[t[1]], mesh->positions[t[2]]};
    }
    Box place(Leaf& leaf) const {
        Box box;
        for (uint32_t k = 0; k < lanes; ++k) {
            const Corners t = corners(leaf.triangle[k]);
            box.add(t.a), box.add(t.b), box.add(t.c);
            for (int d = 0; d < 3; ++d)
                leaf.a[d][k] = t.a[d], leaf.b[d][k] = t.b[d] - t.a[d], leaf.c[d][k] = t.c[d] - t.a[d];
        }
        return box;
    }
    /// Where the mesh stands: leaves, then boxes from the last node to the first, as children come after their parents.
    void place_all(int jobs) {
        constexpr size_t run = 1024;
        std::vector<Box> of_leaf(leaves.size()), of_node(nodes.size());
        parallel_for((leaves.size() + run - 1) / run, jobs, [&](size_t r) {
            for (size_t i = r * run; i < std::min(leaves.size(), (r + 1) * run); ++i) of_leaf[i] = place(leaves[i]);
        });
        for (size_t i = nodes.size(); i-- > 0;)
            for (uint32_t k = 0; k < lanes; ++k) {
                const uint32_t child = nodes[i].child[k];
                const Box box = child == no_child ? Box{} : child & leaf_bit ? of_leaf[child & ~leaf_bit] : of_node[child];
                of_node[i].add(box);
                for (int d = 0; d < 3; ++d) nodes[i].lower[d][k] = box.lower[d], nodes[i].upper[d][k] = box.upper[d];
            }
    }
};

SurfaceIndex::SurfaceIndex(const Mesh& mesh, int jobs) : impl_(new Impl{&mesh, {}, {}, {}, {}}) {
    const uint32_t count = uint32_t(mesh.triangles.size());
    if (count >= leaf_bit)
        throw InputError("a frame of " + std::to_string(count) + " triangles is more than this version can index");
    if (count == 0) return;
    impl_->items.resize(count), impl_->spare.resize(count);
    for (uint32_t i = 0; i < count; ++i) {
        const Triangle& t = mesh.triangles[i];
        impl_->items[i] = {mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]], i};
    }
    impl_->nodes.reserve(count / 4 + 4);
    impl_->build(impl_->nodes, 0, count, jobs);
    impl_->name_triangles();
    impl_->place_all(jobs);
}
SurfaceIndex::SurfaceIndex(const Mesh& moved, const SurfaceIndex& before, int jobs) : impl_(new Impl(*before.impl_)) {
    impl_->mesh = &moved;
    impl_->place_all(jobs);
}
SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
const Mesh& SurfaceIndex::mesh() const { return *impl_->mesh; }

float SurfaceIndex::Impl::search(const glm::vec3& x, float at_most, float enough, uint32_t& triangle, uint32_t& near) const {
    constexpr float none = std::numeric_limits<float>::infinity();
    struct Entry {
        float distance2;
        uint32_t child;
    } stack[64];  // 3 more than popped at each of at most 15 levels (4^15 leaves)
    uint32_t depth = 0, at = 0;
    float best = at_most * at_most;
    bool found = false;
    const auto look_at = [&](uint32_t number) {  // false: that is enough
        const Leaf& leaf = leaves[number];
        const Lanes distance2 = squared_distances(leaf, x);
        for (uint32_t k = 0; k < lanes; ++k)
            if (found ? distance2[k] < best : distance2[k] <= best)
                best = distance2[k], found = true, triangle = leaf.triangle[k], near = number;
        return !(found && best < enough * enough);
    };
    if (near < leaves.size() && !look_at(near)) return best;
    for (;;) {
        if (at & leaf_bit) {
            if (!look_at(at & ~leaf_bit)) return best;
        } else {
            // The nearest child is looked at next, the others are pushed far to near: picked by comparing, not by branching, which is
            // guessed wrong half of the time (sorting them in as they come takes a third more).
            const Node& node = nodes[at];
            const Lanes distance2 = squared_distances(node, x);
            const uint32_t a = distance2[1] < distance2[0], b = 2 + (distance2[3] < distance2[2]);  // the nearer ones of two and two
            const uint32_t first = distance2[b] < distance2[a] ? b : a, second = first == a ? b : a;
            const bool swapped = distance2[second ^ 1] < distance2[first ^ 1];
            const uint32_t others[3] = {swapped ? first ^ 1 : second ^ 1, swapped ? second ^ 1 : first ^ 1, second};
            for (const uint32_t k : others) {
                stack[depth] = {distance2[k], node.child[k]};
                depth += (distance2[k] <= best) & (node.child[k] != no_child);
            }
            if (distance2[first] <= best && node.child[first] != no_child) {
                at = node.child[first];
                continue;
            }
        }
        do {
            if (depth == 0) return found ? best : none;
            at = stack[--depth].child;
        } while (stack[depth].distance2 > best);
    }
}

SurfaceIndex::Hit SurfaceIndex::closest(const glm::vec3& x, float at_most, Near* near) const {
    Hit hit;
    Near none;
    hit.distance = std::numeric_limits<float>::infinity();
    if (impl_->nodes.empty() || impl_->search(x, at_most, 0, hit.triangle, (near ? near : &none)->leaf) == hit.distance) return hit;
    const Corners t = impl_->corners(hit.triangle);
    const Corners local{t.a - x, t.b - x, t.c - x};
    hit.barycentric = closest_barycentric(local);
    const glm::vec3 offset = local.a * hit.barycentric.x + local.b * hit.barycentric.y + local.c * hit.barycentric.z;
    hit.point = x + offset, hit.distance = glm::length(offset);
    return hit;
}

bool SurfaceIndex::within(const glm::vec3& x, float distance, Near* near) const {
    uint32_t any;
    Near none;
    return !impl_->nodes.empty() && impl_->search(x, distance, distance, any, (near ? near : &none)->leaf) < distance * distance;
}

}  // namespace rill::cooker
