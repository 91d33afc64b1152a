// SPDX-License-Identifier: MIT
// Walls: where liquid stands in a box, half of its surface lies flat in the sides of its bounds, and ends there at an edge. The
// runtime cuts the decoded surface off at these sides, exactly; so points need only say that the liquid goes on to the wall,
// and the free surface goes on through it.
#pragma once
#include <cstdint>

#include "common/mesh.h"
#include "surface/container.h"

namespace rill::cooker {

constexpr float cut_within = 0.005f;  ///< edges, of the plane that liquid was cut off at

/// Of one frame or of many: side 2 axis + (0 lower, 1 upper).
struct WallFacts {
    glm::vec3 lower{1e30f}, upper{-1e30f};  ///< of what its triangles use
    double flat[6] = {}, area = 0;          ///< m² that lie flat in each side, and all there are
    double open[6] = {};                    ///< metres of open edges that lie in each side
    void add(const WallFacts& other, float edge);
    /// Sides that a share of the surface worth telling lies in, as format::Header::walls.
    uint32_t walls(float edge) const;
    /// Of all surface, what lies in these sides.
    double share(uint32_t walls) const;
};
WallFacts wall_facts(const Mesh& mesh, float edge);
/// A triangle that stands across the edge between two walls, as steep to one as to the other.
struct BevelFacet {
    float legs;  ///< metres from the edge, along either wall
    float area;
};
/// Those that are near to an edge between walls that are not sharp, whatever its bevel.
std::vector<BevelFacet> bevel_facets(const Mesh& mesh, surface::Container container, float edge);
/// What most of them have in common: metres. 0: nothing, or there are none.
float bevel_legs(std::vector<BevelFacet> facets, float edge);
/// Edges at which surface leaves a wall, of one frame or of many: metres, and how many of them are creases of more than 60°.
struct RimFacts {
    double all[6] = {}, sharp[6] = {};
    void add(const RimFacts& other);
    /// Walls that surface leaves at once nearly everywhere, not over a bevel or a round, as format::Header::walls.
    uint32_t sharp_walls() const;
};
RimFacts rim_facts(const Mesh& mesh, const surface::Container& container, float edge);
/// The side of a box, among `sides`, that something is missing in beyond an open edge: the edge lies in it. Along an
/// edge of the box, the side that its triangle stands across. -1: there is none. `edge`: the mesh's median edge.
int side_cut_at(const Mesh& mesh, const OpenEdge& e, uint32_t sides, const glm::vec3& lower, const glm::vec3& upper, float edge);

/// What lies flat in a wall goes `by` metres beyond it, and so do the edge where it ends and the bevels to other walls. Walls with sharp rims: four
/// edges, along the free surface. Bytes at equal p99, one
/// window of `dam_break` and of `drop_splash`, and at equal mean error, against surfaces that are not cut: by 0, .15, .25, .35 and .5
/// tolerances −2.1, −2.2, −1.9, −1.3, +.8 and −1.1, −1.6, −.7, −2.3, −.4 %; −9, −18, −19, −19, −19 and −8, −15, −15, −17, −16 %.
void push_through_walls(Mesh& mesh, const surface::Container& container, float edge, float by);
/// Nothing that is cut off, nor the cut.
bool is_inside(const glm::vec3& x, const surface::Container& container);
/// Moves what lies beyond the container onto it: there it encloses no volume any more.
void draw_inside(Mesh& mesh, const surface::Container& container);
/// Of what a closed mesh encloses, as much as lies in the container: m³.
double volume_inside(Mesh mesh, const surface::Container& container);

}  // namespace rill::cooker
