// SPDX-License-Identifier: MIT
#include "frames/widen_patch.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace rill::cooker {
namespace {

constexpr float near_share = 0.15f;    // of the bounds' extent: rims go no farther in
constexpr double least_facing = 0.1;   // of all rims: what faces each of the four sides of a patch
constexpr double most_others = 0.005;  // of all rims

struct Bounds {
    glm::vec3 lower, upper;
    float place(int side) const { return side & 1 ? upper[side / 2] : lower[side / 2]; }
    float to(int side, const glm::vec3& x) const { return std::fabs(place(side) - x[side / 2]); }
};

/// The vertices of the one rim that a patch has, counter-clockwise from above; none if there is another, or it crosses itself.
std::vector<uint32_t> rim_of(const std::vector<OpenEdge>& open) {
    std::map<uint32_t, uint32_t> next;
    for (const OpenEdge& e : open)
        if (!next.emplace(e.from, e.to).second) return {};
    std::vector<uint32_t> rim;
    for (auto at = next.begin(); at != next.end() && rim.size() < next.size(); at = next.find(at->second)) {
        rim.push_back(at->first);
        if (at->second == rim.front()) break;
    }
    if (rim.size() != next.size()) rim.clear();
    return rim;
}

/// A side per edge of the rim, of those from each of its vertices to the next: it turns from one to the other at four corners. None: it does not.
std::vector<int> sides_along(const Mesh& mesh, const std::vector<uint32_t>& rim, const Bounds& bounds) {
    constexpr int after_corner[4] = {2, 1, 3, 0};  // counter-clockwise from the lower corner of both
    if (rim.empty()) return {};
    const glm::vec3 extent = bounds.upper - bounds.lower;
    size_t corner[4] = {};
    for (int k = 0; k < 4; ++k) {
        const float x = k == 1 || k == 2 ? 1.f : -1.f, y = k >= 2 ? 1.f : -1.f;
        const auto how_far = [&](size_t i) { return x * mesh.positions[rim[i]].x / extent.x + y * mesh.positions[rim[i]].y / extent.y; };
        for (size_t i = 1; i < rim.size(); ++i)
            if (how_far(i) > how_far(corner[k])) corner[k] = i;
    }
    std::vector<int> sides;
    for (int k = 0; k < 4; ++k) {
        const size_t steps = (corner[(k + 1) % 4] + rim.size() - corner[k]) % rim.size();
        sides.insert(sides.end(), steps, after_corner[k]);
    }
    if (sides.size() != rim.size()) return {};  // more than once round: clockwise
    std::rotate(sides.begin(), sides.end() - std::ptrdiff_t(corner[0]), sides.end());
    return sides;
}

class Widening {
public:
    Widening(Mesh& mesh, uint32_t moving, const Bounds& bounds, float within) : mesh_(mesh), bounds_(bounds), within_(within) {
        const std::vector<uint32_t> rim = rim_of(open_edges(mesh));
        const std::vector<int> sides = sides_along(mesh, rim, bounds);
        for (size_t i = 0; i < sides.size(); ++i) {
            if (!(moving >> sides[i] & 1)) continue;
            const size_t next = (i + 1) % sides.size();
            const uint32_t to = rim[next], before = carried(to, sides[i]);
            add_quad(to, rim[i], carried(rim[i], sides[i]), before);
            if (sides[next] == sides[i] || !(moving >> sides[next] & 1)) continue;
            const uint32_t after = carried(to, sides[next]);
            add_quad(to, before, carried(before, sides[next]), after);
        }
    }

private:
    /// The vertex of a side that a vertex is carried on to.
    uint32_t carried(uint32_t v, int side) {
        const auto [at, is_new] = carried_.try_emplace({v, side}, v);
        if (!is_new) return at->second;
        glm::vec3 x = mesh_.positions[v];
        const bool is_there = bounds_.to(side, x) <= within_;
        x[side / 2] = bounds_.place(side);
        if (is_there) {
            mesh_.positions[v] = x;
            return v;
        }
        mesh_.positions.push_back(x);
        if (!mesh_.velocities.empty()) {
            mesh_.velocities.push_back(mesh_.velocities[v]);
            mesh_.velocities.back()[side / 2] = 0;
        }
        return at->second = uint32_t(mesh_.positions.size() - 1);
    }
    void add_quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
        for (const Triangle& t : {Triangle{a, b, c}, Triangle{a, c, d}})
            if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh_.triangles.push_back(t);
    }

    Mesh& mesh_;
    const Bounds bounds_;
    const float within_;
    std::map<std::pair<uint32_t, int>, uint32_t> carried_;
};

}  // namespace

void RimOfPatch::add(const RimOfPatch& other) {
    for (int s = 0; s < 4; ++s) facing[s] += other.facing[s];
    others += other.others;
}

uint32_t RimOfPatch::sides() const {
    const double all = facing[0] + facing[1] + facing[2] + facing[3] + others;
    const double least = *std::min_element(facing, facing + 4);
    return all > 0 && others <= most_others * all && least >= least_facing * all ? 15 : 0;
}

RimOfPatch rim_of_patch(const Mesh& mesh, const glm::vec3& lower, const glm::vec3& upper) {
    RimOfPatch found;
    const Bounds bounds{lower, upper};
    const std::vector<OpenEdge> open = open_edges(mesh);
    const std::vector<uint32_t> rim = rim_of(open);
    const std::vector<int> sides = sides_along(mesh, rim, bounds);
    for (size_t i = 0; i < sides.size(); ++i) {
        const glm::vec3 from = mesh.positions[rim[i]], to = mesh.positions[rim[(i + 1) % rim.size()]];
        const bool is_near = std::max(bounds.to(sides[i], from), bounds.to(sides[i], to)) < near_share * (upper - lower)[sides[i] / 2];
        (is_near ? found.facing[sides[i]] : found.others) += glm::distance(from, to);
    }
    if (sides.empty())
        for (const OpenEdge& e : open) found.others += glm::distance(mesh.positions[e.from], mesh.positions[e.to]);
    return found;
}

void widen_to_sides(Mesh& mesh, uint32_t sides, const glm::vec3& lower, const glm::vec3& upper, float within) {
    mesh.normals.clear();
    Widening(mesh, sides, {lower, upper}, within);
}

}  // namespace rill::cooker
