// SPDX-License-Identifier: MIT
// No jump when cells change size. Near the far end of their level's range vertices move to where cells twice as large,
// each in the place of 2³ of theirs, would have them (Levels::morph): by the time the octree takes those, nothing is left
// to change. Parents' corners are every other one of the tile's, so that their patches follow from values which mostly are
// there already. All vertices in one parent move alike and stay inside it: polygons between them collapse, those round the
// parents' edges become the parents' own. What parents do not see, rims of thin sheets and small drops, draws back to what
// they see; where there is nothing near, it shrinks to a point.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

/// Where the tile begins in that of its parents, in their cells.
uint32_t offset(const Tile& tile, uint32_t axis) { return uint32_t(tile.coord[axis] & 1) * (tile_cells / 2); }

uint32_t parent_cell(const Tile& tile, uint32_t cell) {
    const uint32_t x = cell % 8 / 2 + offset(tile, 0), y = cell / 8 % 8 / 2 + offset(tile, 1);
    return x + 8 * (y + 8 * (cell / 64 / 2 + offset(tile, 2)));
}

bool has_surface(const Tile& tile, uint32_t cell) { return tile.surface[cell / 8] >> cell % 8 & 1; }

/// Marks the parents of surface cells; false: none of them is on the move.
bool mark_parents(const Levels& levels, const Tile& tile, ParentCells& parents) {
    Tile& to = parents.tile;
    bool any = false;
    for (uint32_t row = 0; row < rows_per_tile; ++row) {
        for_bits(tile.surface[row], [&](uint32_t x) {
            const uint32_t parent = parent_cell(tile, x + 8 * row), at[3] = {parent % 8, parent / 8 % 8, parent / 64};
            if (has_surface(to, parent)) return;
            to.surface[parent / 8] |= uint8_t(1 << at[0]);
            float middle[3];
            for (uint32_t a = 0; a < 3; ++a) middle[a] = corner_at(to, a, at[a]) + 0.5f * to.cell;
            parents.morph[parent] = levels.morph(tile.level, middle);
            any = any || parents.morph[parent] > 0;
        });
    }
    return any;
}

void give_corner(Tile& tile, uint32_t x, uint32_t row, float value) {
    tile.value[x + 9 * row] = value;
    tile.inside[row] |= uint16_t(uint32_t(value < 0) << x);
}

/// Takes over what the tile knows of the corners of the marked cells, and evaluates the rest.
void find_corners(const Mesher& m, MesherScratch& s, const Tile& tile) {
    Tile& to = s.parents.tile;
    uint16_t need[81] = {};
    for (uint32_t row = 0; row < rows_per_tile; ++row) {
        const uint16_t corners = uint16_t(to.surface[row] | to.surface[row] << 1);
        for (const uint32_t step : {0, 1, 9, 10}) need[row % 8 + 9 * (row / 8) + step] |= corners;
    }
    uint32_t n = 0;
    for (uint32_t row = 0; row < 81; ++row)
        for_bits(need[row], [&](uint32_t x) {
            const uint32_t y = row % 9, z = row / 9, from = 2 * (y - offset(tile, 1)) + 18 * (z - offset(tile, 2));
            const uint32_t from_x = 2 * (x - offset(tile, 0));
            if (tile.known[from] >> from_x & 1) {
                give_corner(to, x, row, tile.value[from_x + 9 * from]);
            } else {
                s.x[n] = corner_at(to, 0, x), s.y[n] = corner_at(to, 1, y), s.z[n] = corner_at(to, 2, z);
                s.slot[n++] = uint16_t(x | row << 4);
            }
        });
    with_candidates(m, s, n, [&](const uint32_t* candidates, uint32_t count, uint32_t first, uint32_t batch) {
        m.access.evaluate(*m.input.field, candidates, count, s.x + first, s.y + first, s.z + first, batch, s.value + first);
    });
    for (uint32_t i = 0; i < n; ++i)
        give_corner(to, s.slot[i] & 15, s.slot[i] >> 4, std::abs(s.value[i]) < surface::unsupported ? s.value[i] : to.cell);
    s.corners_evaluated += n;
}

/// Whether the surface passes from a parent to the next along an axis.
bool joined(const Tile& tile, uint32_t parent, uint32_t axis) {
    uint32_t first[3] = {parent % 8, parent / 8 % 8, parent / 64}, last[3];
    for (uint32_t a = 0; a < 3; ++a) first[a] = 2 * (first[a] - offset(tile, a)), last[a] = first[a] + 2;
    first[axis] = last[axis];
    const uint32_t face = (2u << last[0]) - (1u << first[0]);
    uint32_t liquid = 0, air = 0;
    for (uint32_t z = first[2]; z <= last[2]; ++z)
        for (uint32_t y = first[1]; y <= last[1]; ++y) {
            const uint32_t known = tile.known[y + 9 * z] & face, inside = tile.inside[y + 9 * z];
            liquid |= known & inside, air |= known & ~inside;
        }
    return liquid && air;
}

float square(float x) { return x * x; }

float agreement(const Vertex& a, const Vertex& b) {
    return a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1] + a.normal[2] * b.normal[2];
}

/// Of the vertices of one parent the nearest; those that face otherwise, as on the other side of a sheet, are farther.
const Vertex& match(const Vertex* parents, uint32_t count, const Vertex& v) {
    const Vertex* best = parents;
    float least = surface::unsupported;
    for (const Vertex* p = parents; p < parents + count && count > 1; ++p) {
        float d2 = 0;
        for (int a = 0; a < 3; ++a) d2 += square(p->position[a] - v.position[a]);
        if (!(agreement(*p, v) > 0)) d2 *= 100;
        if (d2 < least) least = d2, best = p;
    }
    return *best;
}

}  // namespace

bool find_parents(const Mesher& m, MesherScratch& s, const Tile& tile) noexcept {
    const Levels& levels = m.input.levels;
    if (!levels.eye_count) return false;
    Tile& to = s.parents.tile;
    std::memset(static_cast<void*>(&to), 0, offsetof(Tile, value));
    to.level = tile.level + 1, to.cell = levels.cell(to.level);
    parent_of(tile.coord, to.coord);
    if (!mark_parents(levels, tile, s.parents)) return false;
    find_corners(m, s, tile);
    return true;
}

void adopt_orphans(MesherScratch& s, const Tile& tile) noexcept {
    Tile& to = s.parents.tile;
    constexpr uint16_t orphan = cells_per_tile;  // steps to a parent with patches of its own; of those without any: the first
    uint16_t steps[cells_per_tile];
    bool any = false;
    for (uint32_t p = 0; p < cells_per_tile; ++p) {
        if (!has_surface(to, p)) continue;
        const bool seen = patches_of(to.placed.pattern[p]).count > 0;
        steps[p] = seen ? 0 : uint16_t(orphan + p), any = any || !seen;
    }
    const auto follow = [&](uint32_t p, uint32_t other) {
        const uint16_t so = steps[other] < orphan ? uint16_t(steps[other] + 1) : steps[other];
        if (so >= steps[p]) return false;
        steps[p] = so, to.placed.vertex[p] = to.placed.vertex[other], to.placed.pattern[p] = to.placed.pattern[other];
        return true;
    };
    for (bool more = any; more;) {
        more = false;
        for (uint32_t p = 0; p < cells_per_tile; ++p)
            for (uint32_t axis = 0; axis < 3; ++axis) {
                const uint32_t next = p + (1u << 3 * axis);
                if ((p >> 3 * axis & 7) == 7 || !has_surface(to, p) || !has_surface(to, next)) continue;
                if (steps[p] != steps[next] && joined(tile, p, axis)) more = follow(p, next) || follow(next, p) || more;
            }
    }
}

void move_to_parent(const MesherScratch& s, const Tile& tile, uint32_t cell, Vertex& v) noexcept {
    const Tile& parents = s.parents.tile;
    const uint32_t parent = parent_cell(tile, cell);
    const uint32_t count = patches_of(parents.placed.pattern[parent]).count;
    const Vertex& to = match(s.parents.vertex + parents.placed.vertex[parent], count, v);
    const float share = s.parents.morph[parent];
    const float turning = agreement(to, v) > 0 ? share : 0;  // the other side of a sheet that shrinks stays the other side
    float normal[3], length2 = 0;
    for (int a = 0; a < 3; ++a) {
        v.position[a] = (1 - share) * v.position[a] + share * to.position[a];
        v.velocity[a] = (1 - share) * v.velocity[a] + share * to.velocity[a];
        normal[a] = (1 - turning) * v.normal[a] + turning * to.normal[a], length2 += square(normal[a]);
    }
    if (length2 > 1e-6f)
        for (int a = 0; a < 3; ++a) v.normal[a] = normal[a] / std::sqrt(length2);
}

}  // namespace rill
