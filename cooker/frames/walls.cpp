// SPDX-License-Identifier: MIT
#include "frames/walls.h"

#include <algorithm>
#include <cmath>

namespace rill::cooker {
namespace {

constexpr float flat_within = 0.05f;     // edges, of a side's plane
constexpr float least_room = 2;          // edges, between two sides: a sheet has none
constexpr double least_share = 0.01;     // of all surface: less are drops and crests that touch a bound now and then

// Of bevels: the normal's share along either wall's, .7 where they are as steep to both; lengths in edges. Of five splashes of one
// mesher 85 to 98 % of what is there is alike, of clips of them 63 and 66 %, of the rounded edges of two particle splashes 51 % and nothing.
constexpr float least_steep = 0.6f, least_legs = 0.1f, most_legs = 2;
constexpr float alike_within = 0.05f, least_alike = 0.6f;

// Rims: the share of them that are creases where they are sharp, and of a normal beyond a crease along the wall's. Of the splashes of one mesher none
// is a crease, of boxes with waves on top all are.
constexpr double least_sharp = 0.8;
constexpr float most_along = 0.5f;
// Edges that liquid goes on through a wall with sharp rims, along its own surface, so that what points round there is out of sight. (.2 tolerances,
// as through other walls, leave rims ragged, 2 edges spikes here and there; 6 are no better than 4.)
constexpr float beyond_rims = 4;

struct Side {
    int axis;
    float place, outward;
};
Side side_of(int side, const glm::vec3& lower, const glm::vec3& upper) {
    const int axis = side / 2;
    return side & 1 ? Side{axis, upper[axis], 1.f} : Side{axis, lower[axis], -1.f};
}
Side side_of(int side, const surface::Container& container) { return {side / 2, container.place(side), side & 1 ? 1.f : -1.f}; }

bool lies_in(const Mesh& mesh, const Triangle& t, const Side& side, float within) {
    for (uint32_t v : t)
        if (!(std::fabs(mesh.positions[v][side.axis] - side.place) <= within)) return false;
    return true;
}

/// Vertices that lie in walls, or on bevels between them: bits of the walls that they are to go through.
std::vector<uint8_t> flat_vertices(const Mesh& mesh, const surface::Container& container, float edge) {
    std::vector<uint8_t> flat(mesh.positions.size(), 0);
    for (int s = 0; s < 6; ++s) {
        const Side side = side_of(s, container);
        if (std::fabs(side.place) >= surface::unsupported) continue;
        for (const Triangle& t : mesh.triangles)
            if (lies_in(mesh, t, side, flat_within * edge))
                for (uint32_t v : t) flat[v] |= uint8_t(1 << s);
    }
    surface::for_bevels(container, [&](const surface::Bevel& bevel) {
        for (size_t v = 0; v < flat.size(); ++v)
            if (bevel.value(mesh.positions[v][bevel.axis[0]], mesh.positions[v][bevel.axis[1]]) > -flat_within * edge) flat[v] |= uint8_t(1 << bevel.side[0] | 1 << bevel.side[1]);
    });
    return flat;
}

}  // namespace

WallFacts wall_facts(const Mesh& mesh, float edge) {
    WallFacts facts;
    for (const Triangle& t : mesh.triangles)
        for (uint32_t v : t) facts.lower = glm::min(facts.lower, mesh.positions[v]), facts.upper = glm::max(facts.upper, mesh.positions[v]);
    for (const Triangle& t : mesh.triangles) {
        const glm::vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
        const double area = 0.5 * glm::length(glm::cross(b - a, c - a));
        facts.area += area;
        for (int s = 0; s < 6; ++s)
            if (lies_in(mesh, t, side_of(s, facts.lower, facts.upper), flat_within * edge)) facts.flat[s] += area;
    }
    for (const OpenEdge& e : open_edges(mesh))
        if (const int side = side_cut_at(mesh, e, 63, facts.lower, facts.upper, edge); side >= 0) facts.open[side] += glm::distance(mesh.positions[e.from], mesh.positions[e.to]);
    return facts;
}

int side_cut_at(const Mesh& mesh, const OpenEdge& e, uint32_t sides, const glm::vec3& lower, const glm::vec3& upper, float edge) {
    const Triangle& t = mesh.triangles[e.triangle];
    const glm::vec3 a = mesh.positions[t[0]], normal = unit_normal(glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
    float least = HUGE_VALF;
    int found = -1;
    for (int s = 0; s < 6; ++s) {
        const Side side = side_of(s, lower, upper);
        const auto off = [&](uint32_t v) { return std::fabs(mesh.positions[v][side.axis] - side.place) / (cut_within * edge); };
        const float farther = std::max(off(e.from), off(e.to)), along = std::fabs(normal[side.axis]);
        if ((sides >> s & 1) && farther <= 1 && farther + along < least) least = farther + along, found = s;
    }
    return found;
}

void WallFacts::add(const WallFacts& other, float edge) {
    for (int s = 0; s < 6; ++s) {
        const Side ours = side_of(s, lower, upper), theirs = side_of(s, other.lower, other.upper);
        const float farther = (theirs.place - ours.place) * ours.outward;
        if (farther > flat_within * edge) flat[s] = open[s] = 0;
        if (farther >= -flat_within * edge) flat[s] += other.flat[s], open[s] += other.open[s];
    }
    lower = glm::min(lower, other.lower), upper = glm::max(upper, other.upper), area += other.area;
}

uint32_t WallFacts::walls(float edge) const {
    uint32_t walls = 0;
    for (int s = 0; s < 6; ++s) {
        const bool has_room = upper[s / 2] - lower[s / 2] > least_room * edge;
        walls |= uint32_t(has_room && flat[s] > least_share * area) << s;
    }
    return walls;
}

double WallFacts::share(uint32_t walls) const {
    double in_walls = 0;
    for (int s = 0; s < 6; ++s) in_walls += walls >> s & 1 ? flat[s] : 0;
    return area > 0 ? std::min(in_walls / area, 1.0) : 0;
}

std::vector<BevelFacet> bevel_facets(const Mesh& mesh, surface::Container container, float edge) {
    container.bevel = most_legs * edge;
    std::vector<BevelFacet> facets;
    for (const Triangle& t : mesh.triangles) {
        const glm::vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]], middle = (a + b + c) / 3.f;
        const glm::vec3 across = glm::cross(b - a, c - a), normal = unit_normal(across);
        surface::for_bevels(container, [&](const surface::Bevel& bevel) {
            const int x = bevel.axis[0], y = bevel.axis[1];
            const float steep = std::min(std::copysign(normal[x], normal[x] * bevel.outward[0]), std::copysign(normal[y], normal[y] * bevel.outward[1]));
            const float legs = bevel.legs - std::sqrt(2.f) * bevel.value(middle[x], middle[y]);
            if (steep > least_steep && legs > least_legs * edge && legs < most_legs * edge) facets.push_back({legs, glm::length(across) / 2});
        });
    }
    return facets;
}

float bevel_legs(std::vector<BevelFacet> facets, float edge) {
    double all = 0, below = 0, alike = 0;
    for (const BevelFacet& f : facets) all += f.area;
    std::sort(facets.begin(), facets.end(), [](const BevelFacet& a, const BevelFacet& b) { return a.legs < b.legs; });
    size_t median = 0;
    while (median < facets.size() && (below += facets[median].area) < all / 2) ++median;
    if (median == facets.size()) return 0;
    for (const BevelFacet& f : facets) alike += std::fabs(f.legs - facets[median].legs) < alike_within * edge ? f.area : 0;
    return alike > least_alike * all ? facets[median].legs : 0;
}

void RimFacts::add(const RimFacts& other) {
    for (int s = 0; s < 6; ++s) all[s] += other.all[s], sharp[s] += other.sharp[s];
}

uint32_t RimFacts::sharp_walls() const {
    uint32_t walls = 0;
    for (int s = 0; s < 6; ++s) walls |= uint32_t(all[s] > 0 && sharp[s] > least_sharp * all[s]) << s;
    return walls;
}

RimFacts rim_facts(const Mesh& mesh, const surface::Container& container, float edge) {
    RimFacts facts;
    for (int s = 0; s < 6; ++s) {
        const Side side = side_of(s, container);
        if (std::fabs(side.place) >= surface::unsupported) continue;
        std::vector<uint64_t> rims;  // edges of what lies in the wall, as they go round the triangles beyond
        const auto edge_of = [](uint32_t from, uint32_t to) { return uint64_t(from) << 32 | to; };
        const auto is_in_wall = [&](const Triangle& t) { return lies_in(mesh, t, side, flat_within * edge); };
        for (const Triangle& t : mesh.triangles)
            if (is_in_wall(t))
                for (size_t k = 0; k < 3; ++k) rims.push_back(edge_of(t[(k + 1) % 3], t[k]));
        std::sort(rims.begin(), rims.end());
        for (const Triangle& t : mesh.triangles) {
            if (rims.empty() || is_in_wall(t)) continue;
            const glm::vec3 a = mesh.positions[t[0]], normal = unit_normal(glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
            for (size_t k = 0; k < 3; ++k) {
                if (!std::binary_search(rims.begin(), rims.end(), edge_of(t[k], t[(k + 1) % 3]))) continue;
                const double length = glm::distance(mesh.positions[t[k]], mesh.positions[t[(k + 1) % 3]]);
                facts.all[s] += length, facts.sharp[s] += std::fabs(normal[side.axis]) < most_along ? length : 0;
            }
        }
    }
    return facts;
}

/// Where vertices of sharp rims go, per metre outward: along the free surface, if it does not lie along the wall.
glm::vec3 outward_along(const glm::vec3& normal, const Side& side) {
    constexpr float steepest = 1, least_across = 0.3f;
    glm::vec3 outward(0);
    outward[side.axis] = side.outward;
    const float facing = glm::dot(normal, outward), across = 1 - facing * facing;
    if (!(across > least_across)) return outward;
    glm::vec3 along = glm::clamp((outward - facing * normal) / across, -steepest, steepest);
    along[side.axis] = side.outward;
    return along;
}

void push_through_walls(Mesh& mesh, const surface::Container& container, float edge, float by) {
    const std::vector<uint8_t> flat = flat_vertices(mesh, container, edge);
    std::vector<glm::vec3> free(mesh.positions.size(), glm::vec3(0));  // ∫ n of triangles that lie in no wall
    if (container.sharp)
        for (const Triangle& t : mesh.triangles) {
            if (flat[t[0]] & flat[t[1]] & flat[t[2]]) continue;
            const glm::vec3 a = mesh.positions[t[0]], across = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
            for (uint32_t v : t) free[v] += across;
        }
    for (int s = 0; s < 6; ++s) {
        const Side side = side_of(s, container);
        const bool sharp = container.sharp >> s & 1;
        const float reach = sharp ? beyond_rims * edge : by;
        for (size_t v = 0; v < flat.size(); ++v) {
            if (!(flat[v] >> s & 1)) continue;
            float& x = mesh.positions[v][side.axis];
            if (std::fabs(x - side.place) <= flat_within * edge) x = side.place;
            if (sharp && free[v] != glm::vec3(0)) mesh.positions[v] += reach * outward_along(unit_normal(free[v]), side);
            else x += side.outward * reach;
        }
    }
}

bool is_inside(const glm::vec3& x, const surface::Container& container) {
    bool inside = true;
    for (int a = 0; a < 3; ++a) inside = inside && x[a] > container.lower[a] && x[a] < container.upper[a];
    surface::for_bevels(container, [&](const surface::Bevel& bevel) { inside = inside && bevel.value(x[bevel.axis[0]], x[bevel.axis[1]]) < 0; });
    return inside;
}

void draw_inside(Mesh& mesh, const surface::Container& container) {
    for (glm::vec3& x : mesh.positions) {
        x = glm::clamp(x, glm::vec3(container.lower[0], container.lower[1], container.lower[2]), glm::vec3(container.upper[0], container.upper[1], container.upper[2]));
        surface::for_bevels(container, [&](const surface::Bevel& bevel) {
            const float beyond = bevel.value(x[bevel.axis[0]], x[bevel.axis[1]]);
            for (int k = 0; k < 2 && beyond > 0; ++k) x[bevel.axis[k]] -= beyond * bevel.outward[k];
        });
    }
}

double volume_inside(Mesh mesh, const surface::Container& container) {
    draw_inside(mesh, container);
    return signed_volume(mesh);
}

}  // namespace rill::cooker
