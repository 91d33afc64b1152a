// SPDX-License-Identifier: MIT
// Surface cells → vertices: one per patch, started at the mean of its edge crossings and moved onto the
// field by Newton steps inside its own cell. (A QEF of Hermite data would also find sharp edges; liquid
// has few, and the blended field rounds them off anyway.)
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
// cooker aiming at the middle of the triangles instead, with 1, two clips: +.8 %.
constexpr float least_slope = 1.25f;

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
    int32_t at[3] = {int32_t(cell % 8), int32_t(cell / 8 % 8), int32_t(cell / 64)}, side[3] = {};
    side[face / 2] = face & 1 ? 1 : -1;
    at[face / 2] += side[face / 2];
    const Tile* beyond = &tile;
    if (at[face / 2] < 0 || at[face / 2] >= tile_cells) {
        if (tile.at_place(place_of(side[0], side[1], side[2])) != beside_same) return false;
        const int32_t coord[3] = {tile.coord[0] + side[0], tile.coord[1] + side[1], tile.coord[2] + side[2]};
        at[face / 2] &= tile_cells - 1;
        const uint32_t index = find_tile(m, tile.level, coord);
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

/// Adds a crossing to the sum of its patch, and one to its number.
void add_crossing(const EdgePlace& edge, const float* value, float (&total)[4]) {
    const float low = value[edge.low], crossing = low / (low - value[edge.high]);
    for (uint32_t a = 0; a < 4; ++a) total[a] += edge.corner[a] + crossing * edge.along[a];
}

/// Appends the patches of a cell to the batch: mean of their crossings. Without any: its middle.
void place_patches(MesherScratch& s, const Tile& tile, uint32_t cell, const CellPatches& patches, uint32_t& n) {
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
    for (uint32_t p = 0; p < std::max<uint32_t>(patches.count, 1); ++p, ++n) {
        float* out[3] = {s.x + n, s.y + n, s.z + n};
        const float share = 1 / sum[p][3];
        for (uint32_t a = 0; a < 3; ++a) {
            const float inside = std::clamp(sum[p][a] * share, cell_margin, 1 - cell_margin);
            *out[a] = (float(tile_cells * tile.coord[a] + int32_t(at[a])) + inside) * tile.cell;
        }
        s.slot[n] = uint16_t(n), s.cell[n] = uint16_t(cell), s.patch[n] = uint8_t(p);
    }
}

/// A normal from the corners' signs, for where the field has none.
void guess_normal(const Mesher& m, const Tile& tile, uint32_t cell, uint32_t patch, float normal[3]) {
    const CellPatches patches = patches_of(pattern_at(m, tile, cell));
    const float* value = corner_values(tile, cell);
    for (int a = 0; a < 3; ++a) normal[a] = 0;
    for_bits(patches.crossed, [&](uint32_t e) {
        if (patches.patch[e] == patch) normal[e / 4] += value[edge_places[e].low] < 0 ? 1.f : -1.f;
    });
    if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0) normal[2] = 1;
}

/// One step onto the field, inside the cell. `i`: place in the batch.
void step(MesherScratch& s, const Tile& tile, uint32_t i) {
    const float g2 = s.gx[i] * s.gx[i] + s.gy[i] * s.gy[i] + s.gz[i] * s.gz[i], size = tile.cell;
    const float k = s.value[i] / std::max(g2, least_slope * least_slope);
    if (!(k * k * g2 < size * size)) return;  // farther than a cell, or no field: stay
    const uint32_t cell = s.cell[s.slot[i]], at[3] = {cell % 8, cell / 8 % 8, cell / 64};
    const float g[3] = {s.gx[i], s.gy[i], s.gz[i]};
    float* p[3] = {s.x + i, s.y + i, s.z + i};
    for (uint32_t a = 0; a < 3; ++a) {
        const float corner = float(tile_cells * tile.coord[a] + int32_t(at[a]));
        *p[a] =
            std::clamp(*p[a] - k * g[a], (corner + cell_margin) * size, (corner + 1 - cell_margin) * size);
    }
}

bool is_moving(const Mesher& m) { return m.input.velocity && m.input.target && m.input.target->velocity.data; }

void write3(const Stream& stream, uint32_t index, const float v[3]) {
    if (stream.data)
        std::memcpy(static_cast<uint8_t*>(stream.data) + size_t(index) * stream.stride, v, 3 * sizeof(float));
}

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
        cover(*drawn, v.position);
        if (!m.input.target) return;
        write3(m.input.target->position, vertex, v.position);
        write3(m.input.target->normal, vertex, v.normal);
        if (is_moving(m)) write3(m.input.target->velocity, vertex, v.velocity);
    }
};

/// Moves a batch of n vertices onto the field and writes them, as vertices `begin` and on of the tile.
void finish_batch(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t n, uint32_t begin, const Output& output) {
    float* velocity = is_moving(m) ? s.velocity : nullptr;
    with_candidates(m, s, n, [&](const uint32_t* candidates, uint32_t count, uint32_t first, uint32_t batch) {
        m.access.evaluate_at_surface(*m.input.field, candidates, count, s.x + first, s.y + first, s.z + first,
                                   batch, s.value + first, s.gx + first, s.gy + first, s.gz + first,
                                   velocity, trusted_cells * tile.cell);
        for (uint32_t i = first; i < first + batch; ++i) {
            step(s, tile, i);
            const uint32_t slot = s.slot[i];
            Vertex vertex{{s.x[i], s.y[i], s.z[i]}, {s.gx[i], s.gy[i], s.gz[i]}, {}};
            float(&normal)[3] = vertex.normal;
            float length2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
            if (!(length2 > 1e-12f && length2 < 1e12f) || !(std::abs(s.value[i]) < surface::unsupported)) {
                guess_normal(m, tile, s.cell[slot], s.patch[slot], normal);
                length2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
            }
            const float scale = 1 / std::sqrt(length2);
            for (float& c : normal) c *= scale;
            for (uint32_t a = 0; a < 3 && velocity; ++a) vertex.velocity[a] = velocity[i - first + a * batch];
            output.write(s, begin + slot, s.cell[slot], vertex);
        }
    });
}

/// The vertices of all surface cells of a tile. The corner values are used up then; what the quads need takes their place.
void place_cells(const Mesher& m, MesherScratch& s, Tile& tile, const Output& output) {
    uint32_t n = 0, done = 0;
    for_surface_cells(tile, [&](uint32_t cell) {
        const CellPattern pattern = pattern_at(m, tile, cell);
        s.pattern[cell] = pattern, s.vertex[cell] = uint16_t(done + n);
        if (n + 4 > MesherScratch::capacity) {
            finish_batch(m, s, tile, n, done, output);
            done += n, n = 0;
        }
        place_patches(s, tile, cell, patches_of(pattern), n);
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
