// SPDX-License-Identifier: MIT
// Vertices in cells that walls come near to. A vertex whose crossings lie in walls and elsewhere goes towards where they meet,
// by `rim_share` of the way from the mean of its crossings, or all of it where rims are sharp. Where the source cuts edges
// between walls off, vertices do (surface/container.h).
#include <algorithm>
#include <cmath>

#include "mesher.h"
#include "vertex_step.h"

namespace rill {
namespace {

// Meshers that march cubes cut rims off, by less than a cell; so do these vertices, then by as much on average. p99 and mean error of two
// splashes at 0.12e and 0.25e with 0 to .7 of the way: the same to a hundredth; edges between walls that are no bevels are better off
// with some of it (volume of a tank -.7 % with 0). Where a source's surface was cut through (cooker/frames/cut_to_closed.h) its rims are
// sharp: a part of a splash .36 edges with .3, .29 with 1.
constexpr float rim_share = 0.3f;
// Where liquid ends before a bevel, by less than this, in cells, it goes on to it. p99 of a tank and of a pour
// cooked to 0.12e, in edges, with 0, .15 and .5: .113, .108, - and .125, .124, .128; without bevels .132 and .134. With no vertices
// put on the lines where bevels end: p99 the same, mean error +6 %; with the bevel's normal alone on these lines 2.20 degrees, not 1.85.
constexpr float nearly = 0.15f;
// Liquid that ends no farther before a wall, in cells, and with a normal whose share along the wall's is as large, ends at it: a degree
// that a wall's normals are off bends all that is seen through it. Mean error of four splashes with .02 to .05: the same, with .1 +1 to +5 %.
constexpr float before_wall = 0.03f, along_wall = 0.99f;
constexpr float same = 1e-3f;  // cells: places so near to each other are one

/// Of the walls near to a tile, those that run through a box of so many cells, from there on in cells.
uint32_t walls_in(const NearWalls& walls, const float (&first)[3], float cells) {
    uint32_t found = 0;
    for_bits(walls.sides, [&](uint32_t side) {
        const float at = walls.place[side] - first[side / 2];
        found |= uint32_t((at >= 0) & (at <= cells)) << side;
    });
    return found;
}

/// What the crossings of a patch lie in.
uint32_t meets(const NearWalls& near, const CellPatches& patches, uint32_t patch, const CellCrossings& crossings, const float (&corner)[3]) {
    const uint32_t walls = walls_in(near, corner, 1);
    if (!walls) return meets_free;
    uint32_t met = 0;
    for_bits(patches.crossed, [&](uint32_t e) {
        if (patches.patch[e] != patch) return;
        const uint32_t axis = e / 4;
        const float at = corner[axis] + crossings.share[e];
        uint32_t wall = 0;
        for (uint32_t side = 2 * axis; side < 2 * axis + 2; ++side)
            if (walls >> side & 1 && std::abs(at - near.place[side]) < same) wall |= 1u << side;
        met |= wall ? wall : meets_free;
    });
    return met ? met : meets_free;  // a patch without crossings
}

/// The box of a cell.
struct CellBox {
    float size, corner[3];  ///< metres; in cells
    CellBox(const Tile& tile, uint32_t cell) : size(tile.cell) {
        const uint32_t at[3] = {cell % 8, cell / 8 % 8, cell / 64};
        for (uint32_t a = 0; a < 3; ++a) corner[a] = float(tile_cells * tile.coord[a] + int32_t(at[a]));
    }
    float low(uint32_t a) const { return corner[a] * size; }
    float high(uint32_t a) const { return (corner[a] + 1) * size; }
    /// Off its faces.
    float clamp(uint32_t a, float place) const { return std::clamp(place, (corner[a] + cell_margin) * size, (corner[a] + 1 - cell_margin) * size); }
};

/// A vertex on a bevel. `normal`: of any length.
struct BevelPlace {
    float at[3], normal[3];
};

/// Moves `place.at` to the bevel's part that is in the cell: to the end at one of its walls, if just one is. With both, to where the
/// mesh, with its neighbours a cell farther, cuts as much off as the bevel does. False where no part is.
bool place_on(const surface::Bevel& bevel, const CellBox& box, BevelPlace& place) {
    float first = 0, last = 1, along = 0;  // of the way from its end at one wall to that at the other
    for (int k = 0; k < 2; ++k) {
        const float from = bevel.end(0, k), way = bevel.end(1, k) - from, to_low = (box.low(uint32_t(bevel.axis[k])) - from) / way, to_high = (box.high(uint32_t(bevel.axis[k])) - from) / way;
        first = std::max(first, std::min(to_low, to_high)), last = std::min(last, std::max(to_low, to_high));
        along += (place.at[bevel.axis[k]] - from) / way / 2;
    }
    if (!(first < last)) return false;
    const bool is_end = (first == 0) != (last == 1), is_all = first == 0 && last == 1;
    const int end = last == 1;
    along = is_end ? float(end) : std::clamp(along, first, last);
    const float off = bevel.legs * bevel.legs / (2 * box.size);
    std::fill(place.normal, place.normal + 3, 0.f);
    for (int k = 0; k < 2; ++k) {
        place.at[bevel.axis[k]] = is_all ? bevel.wall[k] - std::copysign(off, bevel.outward[k]) : bevel.end(0, k) + along * (bevel.end(1, k) - bevel.end(0, k));
        place.normal[bevel.axis[k]] = bevel.outward[k];
    }
    if (is_end) place.normal[bevel.axis[end]] += std::copysign(1.f, bevel.outward[end]);
    return true;
}

/// Onto a bevel in the cell, where the liquid goes on to it, or nearly. False where none does.
bool step_to_bevel(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t i, float (&normal)[3]) {
    const float size = tile.cell, from[3] = {s.x[i], s.y[i], s.z[i]}, gradient[3] = {s.gx[i], s.gy[i], s.gz[i]};
    const CellBox box(tile, s.cell[s.slot[i]]);
    float nearest = HUGE_VALF;
    BevelPlace best{};
    surface::for_bevels(m.input.field->container, [&](const surface::Bevel& bevel) {
        BevelPlace place{{from[0], from[1], from[2]}, {}};
        if (!place_on(bevel, box, place)) return;
        float value = s.value[i], distance2 = 0;
        for (uint32_t a = 0; a < 3; ++a) value += gradient[a] * (place.at[a] - from[a]), distance2 += (place.at[a] - from[a]) * (place.at[a] - from[a]);
        if (value < nearly * size && distance2 < nearest) nearest = distance2, best = place;
    });
    if (nearest == HUGE_VALF) return false;
    float* p[3] = {s.x + i, s.y + i, s.z + i};
    for (uint32_t a = 0; a < 3; ++a) *p[a] = box.clamp(a, best.at[a]);
    std::copy(best.normal, best.normal + 3, normal);
    return normalise(normal);
}

/// How far a vertex goes against its gradient, over that: onto the field.
float share_of_gradient(const MesherScratch& s, uint32_t i, float size) {
    const float g2 = s.gx[i] * s.gx[i] + s.gy[i] * s.gy[i] + s.gz[i] * s.gz[i], k = s.value[i] / std::max(g2, least_slope * least_slope);
    return k * k * g2 < size * size ? k : 0;  // farther than a cell, or no field: stay
}

/// What the crossings of a vertex near a sharp wall lie in, by the field as it is about there. Corner values do not tell: inside liquid they
/// are the distance to what is nearer, field or wall, and so near a rim the wall's crossings seem to come before it.
uint32_t meets_by_field(const Mesher& m, const MesherScratch& s, const Tile& tile, uint32_t i) {
    const uint32_t cell = s.cell[s.slot[i]], met = s.meets[s.slot[i]] & (2 * meets_free - 1);
    const CellPatches& patches = cell_patches[corner_signs(tile, cell)];
    const float from[3] = {s.x[i], s.y[i], s.z[i]}, g[3] = {s.gx[i], s.gy[i], s.gz[i]};
    if (patches.count != 1 || !(std::abs(s.value[i]) < surface::unsupported)) return met;
    const surface::Container& container = m.input.field->container;
    const CellBox box(tile, cell);
    uint32_t found = 0;
    for_bits(patches.crossed, [&](uint32_t e) {
        const uint32_t axis = e / 4, corner = patches_detail::edge_corner(e);
        uint32_t lies_in = meets_free;
        for (uint32_t side = 2 * axis; side < 2 * axis + 2; ++side) {
            const float wall = container.place(int(side));
            if (!(wall > box.low(axis) - same * tile.cell && wall < box.high(axis) + same * tile.cell)) continue;
            float value = s.value[i];
            for (uint32_t a = 0; a < 3; ++a) value += g[a] * ((a == axis ? wall : corner >> a & 1 ? box.high(a) : box.low(a)) - from[a]);
            if (value < before_wall * tile.cell) lies_in = 1u << side;
        }
        found |= lies_in;
    });
    return found;
}

/// A vertex of a sharp rim: onto the field and along it to the walls. Where liquid rises towards a wall, its rim may lie beyond the last cell
/// that it has a corner in: so out of its cell where that has no liquid on that side, for nothing else is there.
void step_to_sharp_rim(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t i, uint32_t walls) {
    constexpr float least_across = 0.3f;  // of the slope, along the walls: with less the surface lies along a wall
    constexpr uint32_t low_corners[3] = {0x55, 0x33, 0x0f};
    const float g[3] = {s.gx[i], s.gy[i], s.gz[i]}, k = share_of_gradient(s, i, tile.cell);
    float* p[3] = {s.x + i, s.y + i, s.z + i};
    float beyond = 0, across = 0, all = 0;
    for (uint32_t a = 0; a < 3; ++a) {
        *p[a] -= k * g[a], all += g[a] * g[a];
        if (walls >> (2 * a) & 3) {
            const float wall = m.input.field->container.place(int(2 * a + (walls >> (2 * a + 1) & 1)));
            beyond += g[a] * (wall - *p[a]), *p[a] = wall;
        } else {
            across += g[a] * g[a];
        }
    }
    const CellBox box(tile, s.cell[s.slot[i]]);
    const uint32_t signs = corner_signs(tile, s.cell[s.slot[i]]);
    const float slide = across > least_across * all && std::abs(beyond) < std::sqrt(across) * tile.cell ? beyond / across : 0;
    for (uint32_t a = 0; a < 3; ++a) {
        if (walls >> (2 * a) & 3) {
            *p[a] = box.clamp(a, *p[a]);
            continue;
        }
        const float to = *p[a] - slide * g[a];
        const bool leaves = to < box.low(a) ? !(signs & low_corners[a]) : to > box.high(a) && !(signs & ~low_corners[a] & 0xff);
        *p[a] = leaves ? std::clamp(to, box.low(a) - tile.cell, box.high(a) + tile.cell) : box.clamp(a, to);
    }
}

/// One step onto the field and the walls that are met, inside the cell. `i`: place in the batch.
void step(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t i) {
    const uint32_t met = s.meets[s.slot[i]] & (2 * meets_free - 1), walls = met & (meets_free - 1);
    const bool is_rim = walls && met & meets_free;
    if (is_rim && !(walls & ~m.input.field->container.sharp)) return step_to_sharp_rim(m, s, tile, i, walls);
    const float k = met & meets_free ? share_of_gradient(s, i, tile.cell) : 0;
    if (k == 0 && !walls) return;
    const CellBox box(tile, s.cell[s.slot[i]]);
    const float g[3] = {s.gx[i], s.gy[i], s.gz[i]};
    const bool is_cut_rim = is_rim && !(walls & m.input.field->container.sharp);
    const surface::Container& container = m.input.field->container;
    float* p[3] = {s.x + i, s.y + i, s.z + i};
    for (uint32_t a = 0; a < 3; ++a) {
        float to = k != 0 ? std::clamp(*p[a] - k * g[a], container.lower[a], container.upper[a]) : *p[a];
        if (walls >> (2 * a) & 3) to = container.place(int(2 * a + (walls >> (2 * a + 1) & 1)));
        if (is_cut_rim) to = *p[a] + rim_share * (to - *p[a]);
        *p[a] = box.clamp(a, to);
    }
}

/// Onto a wall that the liquid ends a little before, along it: its points ended before it.
void snap_to_wall(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t i) {
    const CellBox box(tile, s.cell[s.slot[i]]);
    float* p[3] = {s.x + i, s.y + i, s.z + i};
    const float g[3] = {s.gx[i], s.gy[i], s.gz[i]}, length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    for (uint32_t side = 0; side < 6; ++side) {
        const uint32_t a = side / 2;
        const float outward = side & 1 ? 1.f : -1.f, wall = m.input.field->container.place(int(side));
        if (!(outward * (*p[a] - wall) > -before_wall * tile.cell && outward * g[a] > along_wall * length)) continue;
        *p[a] = box.clamp(a, wall);
        s.meets[s.slot[i]] = uint16_t(1u << side);
        return;
    }
}

/// The normal of a patch: of what it meets, each as much. False where there is none.
bool find_normal(const MesherScratch& s, uint32_t i, float (&normal)[3]) {
    const uint32_t met = s.meets[s.slot[i]] & ~(nears_wall | nears_edge);
    if (met & meets_free) {
        normal[0] = s.gx[i], normal[1] = s.gy[i], normal[2] = s.gz[i];
        if (!(normalise(normal) && std::abs(s.value[i]) < surface::unsupported)) return false;
        if (met == meets_free) return true;
    }
    for_bits(met & (meets_free - 1), [&](uint32_t side) { normal[side / 2] += side & 1 ? 1.f : -1.f; });
    return normalise(normal);
}

}  // namespace

NearWalls walls_near(const Mesher& m, const Tile& tile) noexcept {
    const surface::Container& container = m.input.field->container;
    NearWalls walls{};
    walls.reach = std::max(container.bevel / tile.cell, before_wall);
    float first[3];
    for (uint32_t a = 0; a < 3; ++a) first[a] = float(tile_cells * tile.coord[a]) - walls.reach;
    for (uint32_t side = 0; side < 6; ++side) walls.place[side] = container.place(int(side)) / tile.cell;
    walls.sides = meets_free - 1;
    walls.sides = walls_in(walls, first, tile_cells + 2 * walls.reach);
    walls.sharp = walls.sides & container.sharp;
    return walls;
}

bool start_at_sharp_rim(const NearWalls& walls, const CellPatches& patches, uint32_t patch, const CellCrossings& crossings, const float (&corner)[3],
                        float (&start)[3]) noexcept {
    const float first[3] = {corner[0] - same, corner[1] - same, corner[2] - same};
    const uint32_t cut = walls_in(walls, first, 1 + 2 * same);
    if (!(cut & walls.sharp)) return false;
    uint32_t count = 0;
    float sum[3] = {};
    for_bits(patches.crossed, [&](uint32_t e) {
        const uint32_t axis = e / 4, from = patches_detail::edge_corner(e);
        if (patches.patch[e] != patch || cut >> 2 * axis & 3) return;
        for (uint32_t a = 0; a < 3; ++a) sum[a] += a == axis ? crossings.share[e] : float(from >> a & 1);
        ++count;
    });
    if (!count) return false;
    for (uint32_t a = 0; a < 3; ++a) start[a] = sum[a] / float(count);
    return true;
}

uint32_t walls_met(const NearWalls& walls, const CellPatches& patches, uint32_t patch, const CellCrossings& crossings,
                   const float (&corner)[3]) noexcept {
    const float first[3] = {corner[0] - walls.reach, corner[1] - walls.reach, corner[2] - walls.reach};
    const uint32_t near = walls_in(walls, first, 1 + 2 * walls.reach);
    if (!near) return meets_free;
    return meets(walls, patches, patch, crossings, corner) | nears_wall | (near & (near - 1) ? uint32_t(nears_edge) : 0u);
}

bool step_at_walls(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t i) noexcept {
    const uint32_t slot = s.slot[i];
    float normal[3] = {};
    const bool on_bevel = s.meets[slot] & nears_edge && step_to_bevel(m, s, tile, i, normal);
    bool found = on_bevel;
    if (!on_bevel) {
        if (m.input.field->container.sharp && s.meets[slot] & nears_wall) s.meets[slot] = uint16_t((s.meets[slot] & (nears_wall | nears_edge)) | meets_by_field(m, s, tile, i));
        step(m, s, tile, i);
        if ((s.meets[slot] & ~nears_edge) == (meets_free | nears_wall)) snap_to_wall(m, s, tile, i);
        found = find_normal(s, i, normal);
    }
    s.of_field[i] = !on_bevel && s.meets[slot] & meets_free;
    const float to[3] = {s.x[i], s.y[i], s.z[i]};
    for (uint32_t a = 0; a < 3; ++a) s.to[a][i] = to[a], s.normal[a][i] = normal[a];
    return found;
}

}  // namespace rill
