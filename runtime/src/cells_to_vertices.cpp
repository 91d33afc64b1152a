// SPDX-License-Identifier: MIT
// Surface cells → vertices: one per patch, started at the mean of its edge crossings and moved onto the
// field by Newton steps inside its own cell. (A QEF of Hermite data would also find sharp edges; liquid
// has few, and the blended field rounds them off anyway.) The exception are walls: a vertex whose crossings lie in walls
// and elsewhere goes towards where they meet, by `rim_share` of the way from the mean of its crossings,
// or all of it where rims are sharp. Where the source cuts edges between walls off, vertices do (surface/container.h).
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

constexpr float trusted_cells = 0.25f;    // patches and their crossings: farther apart, the patches may be wrong
constexpr float cell_margin = 1 / 128.f;  // vertices keep off their cell's faces: no two coincide
// A step takes the field to be at least so steep. Whole steps (0) go too far at rims, where the slope dwindles towards
// the middle of the sheet, and the field itself, which goes through the source's vertices, is a little outside its
// triangles. Bytes at equal p99, five clips of three scenes: 0 +3.6 %, 1 +2 %, 1.5 +.3 %; .7 of every step +1.8 %; the
// cooker aiming at the middle of the triangles instead, with 1, two clips: +.8 %. Later, with edges and volume as they are now, 1 to 1.25 are
// the same to half a percent, but liquid of a single frame misses its target with 1.12. Larger cells with whole steps, or 1.6 of them, with which
// balls keep their volume: as far off the full surface as with these. (All of this with cells that have nothing to do with the source's. On its
// very lattice vertices face the middles of its triangles: normals 4 to 9 % nearer, but at 0.12e p99 away from walls .160 edges, not .140.)
constexpr float least_slope = 1.25f;
// Meshers that march cubes cut rims off, by less than a cell; so do these vertices, then by as much on average. p99 and mean error of two
// splashes at 0.12e and 0.25e with 0 to .7 of the way: the same to a hundredth; edges between walls that are no bevels are better off
// with some of it (volume of a tank -.7 % with 0). Where a source's surface was cut through (cooker/cut_to_closed.h) its rims are
// sharp: a part of a splash .36 edges with .3, .29 with 1.
constexpr float rim_share = 0.3f;
// Where liquid ends before a bevel, by less than this, in cells, it goes on to it. p99 of a tank and of a pour
// cooked to 0.12e, in edges, with 0, .15 and .5: .113, .108, - and .125, .124, .128; without bevels .132 and .134. With no vertices
// put on the lines where bevels end: p99 the same, mean error +6 %; with the bevel's normal alone on these lines 2.20 degrees, not 1.85.
constexpr float nearly = 0.15f;
// Liquid that ends no farther before a wall, in cells, and with a normal whose share along the wall's is as large, ends at it: a degree
// that a wall's normals are off bends all that is seen through it. Mean error of four splashes with .02 to .05: the same, with .1 +1 to +5 %.
constexpr float before_wall = 0.03f, along_wall = 0.99f;

uint32_t corner_signs(const Tile& tile, uint32_t cell) {
    const uint32_t x = cell % 8, row = cell / 8 % 8 + 9 * (cell / 64);
    const auto pair = [&](uint32_t r) { return uint32_t(tile.inside[r]) >> x & 3; };
    return pair(row) | pair(row + 1) << 2 | pair(row + 9) << 4 | pair(row + 10) << 6;
}

/// Faces of a cell that its smaller neighbours have turned.
uint32_t turned_faces(const Tile& tile, uint32_t cell) {
    if (!(tile.beside & every_finer)) return 0;
    const uint32_t at[3] = {cell % 8, cell / 8 % 8, cell / 64};
    uint32_t turned = 0;
    for (uint32_t face = 0; face < 6; ++face) {
        const uint32_t axis = face / 2, i = at[axis == 0 ? 1 : 0], j = at[axis == 2 ? 1 : 2];
        if (at[axis] == (face & 1 ? 7u : 0u)) turned |= uint32_t(tile.turned[face] >> (i + 8 * j) & 1) << face;
    }
    return turned;
}

CellPattern plain_pattern(const Tile& tile, uint32_t cell) {
    return pattern_of(corner_signs(tile, cell), turned_faces(tile, cell));
}

/// Whether the cell beyond a face is of the same size and has that face doubled, too.
bool doubled_beyond(const Mesher& m, const Tile& tile, uint32_t cell, uint32_t face) {
    int32_t at[3] = {int32_t(cell % 8), int32_t(cell / 8 % 8), int32_t(cell / 64)};
    at[face / 2] += face & 1 ? 1 : -1;
    const Tile* beyond = &tile;
    if (at[face / 2] < 0 || at[face / 2] >= tile_cells) {
        at[face / 2] &= tile_cells - 1;
        const uint32_t index = find_beyond(m, tile, face);
        if (index == no_tile) return false;
        beyond = &m.tiles[index];
    }
    if (!(beyond->surface[at[1] + 8 * at[2]] >> at[0] & 1)) return false;
    const CellPattern other = plain_pattern(*beyond, uint32_t(at[0] + 8 * (at[1] + 8 * at[2])));
    return patches_of(other).doubled >> (face ^ 1u) & 1;
}

/// Of a cell with turned or doubled faces: a face between cells of one size is turned when it is doubled from both sides.
CellPattern turned_pattern(const Mesher& m, const Tile& tile, uint32_t cell) {
    const CellPattern plain = plain_pattern(tile, cell);
    const uint32_t doubled = plain.turned() ? patches_of(plain).doubled : cell_patches[plain.signs()].doubled;
    uint32_t turned = plain.turned();
    for (uint32_t face = 0; doubled >> face; ++face)
        if (doubled >> face & 1 && doubled_beyond(m, tile, cell, face)) turned |= 1u << face;
    return pattern_of(plain.signs(), turned);
}

/// The pattern of a surface cell.
CellPattern pattern_at(const Mesher& m, const Tile& tile, uint32_t cell) {
    const uint32_t signs = corner_signs(tile, cell);
    const bool plain = !cell_patches[signs].doubled && !(tile.beside & every_finer);
    return plain ? pattern_of(signs, 0) : turned_pattern(m, tile, cell);
}

/// Block by block of 4³: vertices next to each other share what they are evaluated from.
template <typename Work>
void for_surface_cells(const Tile& tile, Work work) {
    for (uint32_t block = 0; block < 8; ++block)
        for (uint32_t z = block & 4, rows = 0; rows < 16; ++rows) {
            const uint32_t row = (z + rows / 4) * 8 + (block * 2 & 4) + rows % 4, first = block * 4 & 4;
            for_bits(tile.surface[row] >> first & 15, [&](uint32_t x) { work(first + x + 8 * row); });
        }
}

/// Corner values of a cell of a tile, from that of its lowest corner.
constexpr uint32_t corner_offset[8] = {0, 1, 9, 10, 81, 82, 90, 91};
struct EdgePlace {
    uint32_t low, high;  ///< offsets of its ends
    float corner[4];     ///< its lower end; and one, for counting
    float along[4];
};
constexpr std::array<EdgePlace, 12> place_edges() {
    std::array<EdgePlace, 12> edges{};
    for (uint32_t e = 0; e < 12; ++e) {
        const uint32_t low = patches_detail::edge_corner(e);
        edges[e] = {corner_offset[low], corner_offset[low | 1u << e / 4],
                    {float(low & 1), float(low >> 1 & 1), float(low >> 2), 1},
                    {float(e / 4 == 0), float(e / 4 == 1), float(e / 4 == 2), 0}};
    }
    return edges;
}
constexpr std::array<EdgePlace, 12> edge_places = place_edges();

const float* corner_values(const Tile& tile, uint32_t cell) {
    return tile.value + cell % 8 + 9 * (cell / 8 % 8 + 9 * (cell / 64));
}

/// Of what a patch meets: a surface that is no wall.
constexpr uint32_t meets_free = 1u << 6;
/// Or that is near to walls; to two of them.
constexpr uint32_t nears_wall = 1u << 7, nears_edge = 1u << 8;
/// As far as that, in cells.
float near_walls(const Mesher& m, const Tile& tile) { return std::max(m.input.field->container.bevel / tile.cell, before_wall); }

/// Of the walls, those that run through a box of so many cells, from there on in cells of the tile.
uint32_t walls_in(const Mesher& m, const Tile& tile, uint32_t walls, const float (&first)[3], float cells) {
    uint32_t found = 0;
    for_bits(walls, [&](uint32_t side) {
        const float at = m.input.field->container.place(int(side)) / tile.cell - first[side / 2];
        found |= uint32_t(at >= 0 && at <= cells) << side;
    });
    return found;
}
uint32_t walls_in(const Mesher& m, const Tile& tile) {
    const float reach = near_walls(m, tile);
    float first[3];
    for (uint32_t a = 0; a < 3; ++a) first[a] = float(tile_cells * tile.coord[a]) - reach;
    return walls_in(m, tile, meets_free - 1, first, tile_cells + 2 * reach);
}

/// What a cell is near to. `corner`: its own, in cells.
uint32_t nears(const Mesher& m, const Tile& tile, uint32_t tile_walls, const float (&corner)[3]) {
    if (!tile_walls) return 0;
    const float reach = near_walls(m, tile), first[3] = {corner[0] - reach, corner[1] - reach, corner[2] - reach};
    const uint32_t walls = walls_in(m, tile, tile_walls, first, 1 + 2 * reach);
    return !walls ? 0 : walls & (walls - 1) ? nears_wall | nears_edge : nears_wall;
}

/// What the crossings of a patch lie in.
uint32_t meets(const Mesher& m, const Tile& tile, uint32_t tile_walls, const CellPatches& patches, uint32_t patch, const float* value, const float (&corner)[3]) {
    constexpr float same = 1e-3f;  // cells
    const uint32_t walls = walls_in(m, tile, tile_walls, corner, 1);
    if (!walls) return meets_free;
    uint32_t met = 0;
    for_bits(patches.crossed, [&](uint32_t e) {
        if (patches.patch[e] != patch) return;
        const EdgePlace& edge = edge_places[e];
        const uint32_t axis = e / 4;
        const float low = value[edge.low], at = corner[axis] + low / (low - value[edge.high]);
        uint32_t wall = 0;
        for (uint32_t side = 2 * axis; side < 2 * axis + 2; ++side)
            if (walls >> side & 1 && std::abs(at - m.input.field->container.place(int(side)) / tile.cell) < same) wall |= 1u << side;
        met |= wall ? wall : meets_free;
    });
    return met ? met : meets_free;  // a patch without crossings
}

/// Adds a crossing to the sum of its patch, and one to its number.
void add_crossing(const EdgePlace& edge, const float* value, float (&total)[4]) {
    const float low = value[edge.low], crossing = low / (low - value[edge.high]);
    for (uint32_t a = 0; a < 4; ++a) total[a] += edge.corner[a] + crossing * edge.along[a];
}

/// Appends the patches of a cell to the batch: mean of their crossings. Without any: its middle.
void place_patches(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t walls, uint32_t cell, const CellPatches& patches, uint32_t& n) {
    const float* value = corner_values(tile, cell);
    float sum[4][4] = {};
    if (patches.count == 1) {  // nearly all: sums that stay in registers
        float total[4] = {};
        for_bits(patches.crossed, [&](uint32_t e) { add_crossing(edge_places[e], value, total); });
        std::copy(total, total + 4, sum[0]);
    } else if (patches.count) {
        for_bits(patches.crossed, [&](uint32_t e) { add_crossing(edge_places[e], value, sum[patches.patch[e]]); });
    } else {
        std::fill(sum[0], sum[0] + 3, 0.5f), sum[0][3] = 1;
    }
    const uint32_t at[3] = {cell % 8, cell / 8 % 8, cell / 64};
    float corner[3];
    for (uint32_t a = 0; a < 3; ++a) corner[a] = float(tile_cells * tile.coord[a] + int32_t(at[a]));
    const uint32_t near = nears(m, tile, walls, corner);
    for (uint32_t p = 0; p < std::max<uint32_t>(patches.count, 1); ++p, ++n) {
        float* out[3] = {s.x + n, s.y + n, s.z + n};
        const float share = 1 / sum[p][3];
        for (uint32_t a = 0; a < 3; ++a) {
            const float inside = std::clamp(sum[p][a] * share, cell_margin, 1 - cell_margin);
            *out[a] = (corner[a] + inside) * tile.cell;
        }
        s.slot[n] = uint16_t(n), s.cell[n] = uint16_t(cell), s.patch[n] = uint8_t(p);
        s.meets[n] = uint16_t(near ? meets(m, tile, walls, patches, p, value, corner) | near : meets_free);
    }
}

/// False where it is none.
bool normalise(float (&v)[3]) {
    const float length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], scale = 1 / std::sqrt(length2);
    for (float& c : v) c *= scale;
    return length2 > 1e-12f && length2 < 1e12f;
}

/// A normal from the corners' signs, for where the field has none.
void guess_normal(const Mesher& m, const Tile& tile, uint32_t cell, uint32_t patch, float (&normal)[3]) {
    const CellPatches patches = patches_of(pattern_at(m, tile, cell));
    const float* value = corner_values(tile, cell);
    for (int a = 0; a < 3; ++a) normal[a] = 0;
    for_bits(patches.crossed, [&](uint32_t e) {
        if (patches.patch[e] == patch) normal[e / 4] += value[edge_places[e].low] < 0 ? 1.f : -1.f;
    });
    if (!normalise(normal)) normal[0] = normal[1] = 0, normal[2] = 1;
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

/// One step onto the field and the walls that are met, inside the cell. `i`: place in the batch.
void step(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t i) {
    const uint32_t met = s.meets[s.slot[i]] & ~(nears_wall | nears_edge), walls = met & (meets_free - 1);
    const float g2 = s.gx[i] * s.gx[i] + s.gy[i] * s.gy[i] + s.gz[i] * s.gz[i], size = tile.cell;
    float k = s.value[i] / std::max(g2, least_slope * least_slope);
    if (!(met & meets_free) || !(k * k * g2 < size * size)) k = 0;  // farther than a cell, or no field: stay
    if (k == 0 && !walls) return;
    const CellBox box(tile, s.cell[s.slot[i]]);
    const float g[3] = {s.gx[i], s.gy[i], s.gz[i]};
    const bool is_cut_rim = walls && walls != met && !(walls & m.input.field->container.sharp);
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

bool is_moving(const Mesher& m) { return m.input.velocity && m.input.target && m.input.target->velocity.data; }

/// Where vertices go: to the target, moved to their parents' if they morph; or they are those parents'.
struct Output {
    const Mesher& m;
    Tile* drawn;  ///< null: vertices of parents
    bool morphs;

    void write(MesherScratch& s, uint32_t i, uint32_t cell, Vertex& v) const {
        if (!drawn) {
            s.parents.vertex[i] = v;
            return;
        }
        if (morphs) move_to_parent(s, *drawn, cell, v);
        const uint32_t vertex = drawn->first_vertex + i;
        std::memcpy(m.position + 3 * size_t(vertex), v.position, sizeof(v.position));
        std::memcpy(m.normal + 3 * size_t(vertex), v.normal, sizeof(v.normal));
        m.of_field[vertex] = v.of_field;
        cover(*drawn, v.position);
        if (!m.input.target) return;
        write3(m.input.target->position, vertex, v.position);
        if (is_moving(m)) write3(m.input.target->velocity, vertex, v.velocity);
    }
};

/// Moves a batch of n vertices onto the field and writes them, as vertices `begin` and on of the tile.
void finish_batch(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t n, uint32_t begin, const Output& output) {
    float* velocity = is_moving(m) ? s.velocity : nullptr;
    with_candidates(m, s, n, [&](const uint32_t* candidates, uint32_t count, uint32_t first, uint32_t batch) {
        m.access.evaluate_at_surface(m.uncut, candidates, count, s.x + first, s.y + first, s.z + first,
                                   batch, s.value + first, s.gx + first, s.gy + first, s.gz + first,
                                   velocity, trusted_cells * tile.cell);
        for (uint32_t i = first; i < first + batch; ++i) {
            const uint32_t slot = s.slot[i];
            Vertex vertex{};
            float(&normal)[3] = vertex.normal;
            const bool on_bevel = s.meets[slot] & nears_edge && step_to_bevel(m, s, tile, i, normal);
            if (!on_bevel) {
                step(m, s, tile, i);
                if ((s.meets[slot] & ~nears_edge) == (meets_free | nears_wall)) snap_to_wall(m, s, tile, i);
                if (!find_normal(s, i, normal)) guess_normal(m, tile, s.cell[slot], s.patch[slot], normal);
            }
            vertex.of_field = !on_bevel && s.meets[slot] & meets_free;
            vertex.position[0] = s.x[i], vertex.position[1] = s.y[i], vertex.position[2] = s.z[i];
            for (uint32_t a = 0; a < 3 && velocity; ++a) vertex.velocity[a] = velocity[i - first + a * batch];
            output.write(s, begin + slot, s.cell[slot], vertex);
        }
    });
}

/// The vertices of all surface cells of a tile. The corner values are used up then; what the quads need takes their place.
void place_cells(const Mesher& m, MesherScratch& s, Tile& tile, const Output& output) {
    const uint32_t walls = walls_in(m, tile);
    uint32_t n = 0, done = 0;
    for_surface_cells(tile, [&](uint32_t cell) {
        const CellPattern pattern = pattern_at(m, tile, cell);
        s.pattern[cell] = pattern, s.vertex[cell] = uint16_t(done + n);
        if (n + 4 > MesherScratch::capacity) {
            finish_batch(m, s, tile, n, done, output);
            done += n, n = 0;
        }
        place_patches(m, s, tile, walls, cell, patches_of(pattern), n);
    });
    finish_batch(m, s, tile, n, done, output);
    for_surface_cells(tile, [&](uint32_t cell) {
        tile.placed.vertex[cell] = s.vertex[cell], tile.placed.pattern[cell] = s.pattern[cell];
    });
}

void place_tile(const Mesher& m, MesherScratch& s, Tile& tile) {
    for (int a = 0; a < 3; ++a) tile.lower[a] = surface::unsupported, tile.upper[a] = -surface::unsupported;
    list_candidates(m, s, tile);
    const bool morphs = find_parents(m, s, tile);
    if (morphs) {
        place_cells(m, s, s.parents.tile, {m, nullptr, false});
        adopt_orphans(s, tile);
    }
    place_cells(m, s, tile, {m, &tile, morphs});
}

}  // namespace

uint32_t prepare_counts(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    sort_tiles(m);
    return tasks_of(m.order_count, tiles_per_quick_task);
}

void run_counts(void* mesher, uint32_t task, uint32_t) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, tiles_per_quick_task, m.order_count, [&](uint32_t i) {
        Tile& tile = m.tiles[m.order[i].tile];
        tile.vertex_count = 0;
        for_surface_cells(
            tile, [&](uint32_t cell) { tile.vertex_count += patches_of(pattern_at(m, tile, cell)).count; });
        tile.index_count = count_indices(m, tile);
    });
}

uint32_t prepare_vertices(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    return tasks_of(m.kept, tiles_per_march_task);
}

void run_vertices(void* mesher, uint32_t task, uint32_t worker) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, tiles_per_march_task, m.kept,
              [&](uint32_t i) { place_tile(m, m.scratch[worker], m.tiles[m.order[i].tile]); });
}

}  // namespace rill
