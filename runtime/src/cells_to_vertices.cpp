// SPDX-License-Identifier: MIT
// Surface cells → vertices: one per patch, started at the mean of its edge crossings and moved onto the
// field by a Newton step inside its own cell. (A QEF of Hermite data would also find sharp edges; liquid
// has few, and the blended field rounds them off anyway.) All vertices of a tile step at once, in loops without a branch; those
// that walls come near to are placed again one by one, in vertices_at_walls.cpp.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"
#include "surface/field_kernels_lanes.h"
#include "vertex_step.h"

namespace rill {
namespace {

constexpr float trusted_cells = 0.25f;    // patches and their crossings: farther apart, the patches may be wrong

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

/// Work(cell), block by block of 4³: vertices next to each other share what they are evaluated from.
template <typename Work>
void for_surface_cells(const Tile& tile, Work work) {
    for (uint32_t half = 0; half < 16; ++half) {  // of a block
        const uint32_t block = half / 2, x = block * 4 & 4, y = block * 2 & 4, z = (block & 4) + (half & 1) * 2, row = y + 8 * z;
        uint32_t bits = 0;
        for (uint32_t k = 0; k < 8; ++k) bits |= uint32_t(tile.surface[row + k % 4 + k / 4 * 8] >> x & 15) << 4 * k;
        for_bits(bits, [&](uint32_t k) { work(x + k % 4 + 8 * (row + k / 4 % 4 + k / 16 * 8)); });
    }
}

/// Corner values of a cell of a tile, from that of its lowest corner.
constexpr uint32_t corner_offset[8] = {0, 1, 9, 10, 81, 82, 90, 91};
struct EdgeEnds {
    uint32_t low[12], high[12];  ///< offsets
};
constexpr EdgeEnds all_edge_ends() {
    EdgeEnds ends{};
    for (uint32_t e = 0; e < 12; ++e) {
        const uint32_t low = patches_detail::edge_corner(e);
        ends.low[e] = corner_offset[low], ends.high[e] = corner_offset[low | 1u << e / 4];
    }
    return ends;
}
constexpr EdgeEnds edge_ends = all_edge_ends();

const float* corner_values(const Tile& tile, uint32_t cell) {
    return tile.value + cell % 8 + 9 * (cell / 8 % 8 + 9 * (cell / 64));
}

/// All twelve edges at once: an edge without a crossing costs less than the branch.
CellCrossings crossings_of(const float* value) {
    using surface::inner::bits_of, surface::inner::float_of;
    CellCrossings crossings;
    float low[12], high[12];
    for (uint32_t e = 0; e < 12; ++e) low[e] = value[edge_ends.low[e]], high[e] = value[edge_ends.high[e]];
    for (uint32_t e = 0; e < 12; ++e) {
        // By bits, for of a condition on conditions GCC makes branches.
        const int32_t crossed = (low[e] < 0 ? -1 : 0) ^ (high[e] < 0 ? -1 : 0);
        const float fall = float_of((int32_t(bits_of(low[e] - high[e])) & crossed) | (int32_t(bits_of(1)) & ~crossed));
        crossings.share[e] = float_of(int32_t(bits_of(low[e] / fall)) & crossed);
    }
    return crossings;
}

/// Of the crossings of a patch: the sum of the lower ends of their edges, in cells, and their number.
struct EdgeSums {
    float lower[3], count;
};
constexpr EdgeSums edge_sums(const CellPatches& patches, uint32_t patch) {
    EdgeSums sums{};
    for (uint32_t e = 0; e < 12; ++e) {
        if (!(patches.crossed >> e & 1) || patches.patch[e] != patch) continue;
        const uint32_t corner = patches_detail::edge_corner(e);
        for (uint32_t a = 0; a < 3; ++a) sums.lower[a] += float(corner >> a & 1);
        sums.count += 1;
    }
    return sums;
}
/// By corner signs: of the first patch, mostly the only one.
constexpr std::array<EdgeSums, 256> first_edge_sums() {
    std::array<EdgeSums, 256> sums{};
    for (uint32_t signs = 0; signs < 256; ++signs) sums[signs] = edge_sums(cell_patches[signs], 0);
    return sums;
}
constexpr std::array<EdgeSums, 256> sums_of_first = first_edge_sums();

/// Appends patches of cells to the batch.
struct Placing {
    const Mesher& m;
    MesherScratch& s;
    const Tile& tile;
    const NearWalls walls = walls_near(m, tile);
    uint32_t n = 0;  ///< in the batch

    /// At the mean of its crossings, whose shares are `share`; without any, in the middle. `corner`: the cell's, in cells; `all`: its crossings.
    void append_patch(uint32_t cell, const CellPatches& patches, uint32_t patch, const EdgeSums& sums, const float* share, const float (&corner)[3], const CellCrossings& all) {
        float* out[3] = {s.x + n, s.y + n, s.z + n};
        float start[3];
        const bool is_cut = walls.sharp && start_at_sharp_rim(walls, patches, patch, all, corner, start);
        for (uint32_t a = 0; a < 3; ++a) {
            const float along = share[4 * a] + share[4 * a + 1] + share[4 * a + 2] + share[4 * a + 3];
            const float mean = sums.count > 0 ? (along + sums.lower[a]) / sums.count : 0.5f, place = is_cut ? start[a] : mean;
            // (std::clamp becomes branches.)
            const float above = place > cell_margin ? place : cell_margin, within = above < 1 - cell_margin ? above : 1 - cell_margin;
            *out[a] = (corner[a] + within) * tile.cell;
        }
        s.slot[n] = uint16_t(n), s.cell[n] = uint16_t(cell), s.patch[n] = uint8_t(patch);
        s.meets[n] = uint16_t(walls.sides ? walls_met(walls, patches, patch, all, corner) : meets_free), ++n;
    }

    void append_cell(uint32_t cell, CellPattern pattern) {
        const CellCrossings crossings = crossings_of(corner_values(tile, cell));
        float corner[3];
        for (uint32_t a = 0; a < 3; ++a) corner[a] = float(tile_cells * tile.coord[a] + int32_t(cell >> 3 * a & 7));
        if (!pattern.turned() && cell_patches[pattern.signs()].count == 1) {
            append_patch(cell, cell_patches[pattern.signs()], 0, sums_of_first[pattern.signs()], crossings.share, corner, crossings);
            return;
        }
        const CellPatches patches = patches_of(pattern);
        for (uint32_t p = 0; p < std::max<uint32_t>(patches.count, 1); ++p) {
            float share[12];
            for (uint32_t e = 0; e < 12; ++e) share[e] = patches.patch[e] == p ? crossings.share[e] : 0.f;
            append_patch(cell, patches, p, edge_sums(patches, p), share, corner, crossings);
        }
    }
};

/// A normal from the corners' signs, for where the field has none.
void guess_normal(const Mesher& m, const Tile& tile, uint32_t cell, uint32_t patch, float (&normal)[3]) {
    const CellPatches patches = patches_of(pattern_at(m, tile, cell));
    const float* value = corner_values(tile, cell);
    for (int a = 0; a < 3; ++a) normal[a] = 0;
    for_bits(patches.crossed, [&](uint32_t e) {
        if (patches.patch[e] == patch) normal[e / 4] += value[edge_ends.low[e]] < 0 ? 1.f : -1.f;
    });
    if (!normalise(normal)) normal[0] = normal[1] = 0, normal[2] = 1;
}

bool has_normal(float length2, float value) { return is_direction(length2) && std::abs(value) < surface::unsupported; }

/// Takes positions [first, last) of a batch one step onto the field, each inside its cell: s.to, and s.normal. False where a
/// normal is missing. All as if there were no walls.
bool step_all(MesherScratch& s, const Tile& tile, uint32_t first, uint32_t last) {
    const float size = tile.cell, most2 = size * size, least2 = least_slope * least_slope;
    const float* from[3] = {s.x, s.y, s.z};
    const float* gradient[3] = {s.gx, s.gy, s.gz};
    for (uint32_t i = first; i < last; ++i) s.at[i] = s.cell[s.slot[i]], s.of_field[i] = true;
    int32_t missing = 0;
    for (uint32_t i = first; i < last; ++i) {
        const float g2 = s.gx[i] * s.gx[i] + s.gy[i] * s.gy[i] + s.gz[i] * s.gz[i];
        const float k = s.value[i] / (g2 > least2 ? g2 : least2);
        s.step[i] = k * k * g2 < most2 ? k : 0.f;  // farther than a cell, or no field: stay
        s.scale[i] = 1 / std::sqrt(g2);
        missing |= has_normal(g2, s.value[i]) ? 0 : 1;
    }
    for (uint32_t a = 0; a < 3; ++a) {
        const int32_t lowest = tile_cells * tile.coord[a];
        for (uint32_t i = first; i < last; ++i) {
            const float corner = float(lowest + int32_t(s.at[i] >> 3 * a & 7));
            const float to = from[a][i] - s.step[i] * gradient[a][i], low = (corner + cell_margin) * size, high = (corner + 1 - cell_margin) * size;
            const float above = to > low ? to : low;
            s.to[a][i] = above < high ? above : high, s.normal[a][i] = s.scale[i] * gradient[a][i];
        }
    }
    return !missing;
}

/// Those again that are not as step_all() takes them to be.
void step_others(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t first, uint32_t last) {
    for (uint32_t i = first; i < last; ++i) {
        const uint32_t slot = s.slot[i];
        const bool found = s.meets[slot] == meets_free ? has_normal(s.gx[i] * s.gx[i] + s.gy[i] * s.gy[i] + s.gz[i] * s.gz[i], s.value[i])
                                                       : step_at_walls(m, s, tile, i);
        if (found) continue;
        float normal[3];
        guess_normal(m, tile, s.cell[slot], s.patch[slot], normal);
        for (uint32_t a = 0; a < 3; ++a) s.normal[a][i] = normal[a];
    }
}

bool is_moving(const Mesher& m) { return m.input.velocity && m.input.target && m.input.target->velocity.data; }

/// Where vertices go: to the target, moved to their parents' if they morph; or they are those parents'.
struct Output {
    const Mesher& m;
    Tile* drawn;  ///< null: vertices of parents
    bool morphs;

    /// Positions [first, last) of a batch; those of the whole batch are vertices `begin` and on of the tile. `velocity`: of these
    /// positions, by axis; null: none.
    void write(MesherScratch& s, uint32_t begin, uint32_t first, uint32_t last, const float* velocity) const {
        if (!drawn || morphs)
            write_with_parents(s, begin, first, last, velocity);
        else
            write_drawn(s, begin, first, last, velocity);
    }

private:
    void write_with_parents(MesherScratch& s, uint32_t begin, uint32_t first, uint32_t last, const float* velocity) const {
        for (uint32_t i = first; i < last; ++i) {
            Vertex v{};
            for (uint32_t a = 0; a < 3; ++a) v.position[a] = s.to[a][i], v.normal[a] = s.normal[a][i];
            for (uint32_t a = 0; a < 3 && velocity; ++a) v.velocity[a] = velocity[i - first + a * (last - first)];
            v.of_field = s.of_field[i];
            if (!drawn) {
                s.parents.vertex[begin + s.slot[i]] = v;
                continue;
            }
            move_to_parent(s, *drawn, s.at[i], v);
            const uint32_t vertex = drawn->first_vertex + begin + s.slot[i];
            m.vertices[vertex] = {{v.position[0], v.position[1], v.position[2], 0}, {v.normal[0], v.normal[1], v.normal[2], v.of_field ? 1.f : 0.f}};
            cover(*drawn, v.position);
            if (!m.input.target) continue;
            write3(m.input.target->position, vertex, v.position);
            if (velocity) write3(m.input.target->velocity, vertex, v.velocity);
        }
    }
    /// The same for nearly all there are, with nothing read twice.
    void write_drawn(const MesherScratch& s, uint32_t begin, uint32_t first, uint32_t last, const float* velocity) const {
        const Stream to = m.input.target ? m.input.target->position : Stream{}, moving = velocity ? m.input.target->velocity : Stream{};
        PlacedVertex* const vertices = m.vertices;
        float lower[3], upper[3];
        for (uint32_t a = 0; a < 3; ++a) lower[a] = drawn->lower[a], upper[a] = drawn->upper[a];
        for (uint32_t i = first; i < last; ++i) {
            const uint32_t vertex = drawn->first_vertex + begin + s.slot[i];
            const float p[3] = {s.to[0][i], s.to[1][i], s.to[2][i]}, n[3] = {s.normal[0][i], s.normal[1][i], s.normal[2][i]};
            for (uint32_t a = 0; a < 3; ++a) lower[a] = std::min(lower[a], p[a]), upper[a] = std::max(upper[a], p[a]);
            vertices[vertex] = {{p[0], p[1], p[2], 0}, {n[0], n[1], n[2], s.of_field[i] ? 1.f : 0.f}};
            write3(to, vertex, p);
            if (!moving.data) continue;
            const float* v = velocity + i - first;
            write3(moving, vertex, {v[0], v[last - first], v[2 * size_t(last - first)]});
        }
        for (uint32_t a = 0; a < 3; ++a) drawn->lower[a] = lower[a], drawn->upper[a] = upper[a];
    }
};

/// Moves a batch of n vertices onto the field and writes them, as vertices `begin` and on of the tile.
void finish_batch(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t n, bool has_walls, uint32_t begin, const Output& output) {
    float* velocity = is_moving(m) ? s.velocity : nullptr;
    with_candidates(m, s, n, [&](const uint32_t* candidates, uint32_t count, uint32_t first, uint32_t batch) {
        m.access.evaluate_at_surface(m.uncut, candidates, count, s.x + first, s.y + first, s.z + first,
                                   batch, s.value + first, s.gx + first, s.gy + first, s.gz + first,
                                   velocity, trusted_cells * tile.cell);
        if (!step_all(s, tile, first, first + batch) || has_walls) step_others(m, s, tile, first, first + batch);
        output.write(s, begin, first, first + batch, velocity);
    });
}

/// The vertices of all surface cells of a tile. The corner values are used up then; what the quads need takes their place.
void place_cells(const Mesher& m, MesherScratch& s, Tile& tile, const Output& output) {
    Placing batch{m, s, tile};
    uint32_t done = 0;
    const auto finish = [&] { finish_batch(m, s, tile, batch.n, batch.walls.sides != 0, done, output), done += batch.n, batch.n = 0; };
    for_surface_cells(tile, [&](uint32_t cell) {
        const CellPattern pattern = pattern_at(m, tile, cell);
        s.placed.pattern[cell] = pattern, s.placed.vertex[cell] = uint16_t(done + batch.n);
        if (batch.n + 4 > MesherScratch::capacity) finish();
        batch.append_cell(cell, pattern);
    });
    finish();
    tile.placed = s.placed;
}

void place_tile(const Mesher& m, MesherScratch& s, Tile& tile) {
    for (int a = 0; a < 3; ++a) tile.lower[a] = surface::unsupported, tile.upper[a] = -surface::unsupported;
    take_candidates(m, s, tile);
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
