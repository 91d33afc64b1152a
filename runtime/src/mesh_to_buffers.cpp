// SPDX-License-Identifier: MIT
// Mesh → the caller's buffers: one quad around every sign-changing lattice edge, cut at whole tiles where
// capacity ends. An edge belongs to the tile of its lower corner; the other cells around it then lie in
// tiles earlier in the order, so dropping tiles from its end never leaves a triangle without its vertices. After all tiles
// come the drops that have meshes of their own.
//
// Quads are split where the surface bends less, as its normals tell: an edge across a rim cuts it off. p99 of the same files −.3 and −.4 %, at
// 0.12e −1.5 %, normals −.01°, for 1 % of a frame's instructions (whole scenes of a tank and a pour); the shorter diagonal before.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"
#include "vector.h"

namespace rill {
namespace {

/// A tile and its lower neighbours: bit a of the index set = one tile down along axis a.
struct Neighbourhood {
    const Tile* tile[8];
};
Neighbourhood neighbourhood(const Mesher& m, const Tile& tile) {
    Neighbourhood n;
    n.tile[0] = &tile;
    for (int32_t k = 1; k < 8; ++k) {
        const int32_t coord[3] = {tile.coord[0] - (k & 1), tile.coord[1] - (k >> 1 & 1),
                                  tile.coord[2] - (k >> 2)};
        const uint32_t index = find_tile(m, tile.level, coord);
        n.tile[k] = index == no_tile ? nullptr : &m.tiles[index];
    }
    return n;
}

/// Surface cells of the tile and of those next to its lower faces: bit x + 1 of row y + 1 + 9 (z + 1), from −1 on.
struct PaddedCells {
    uint16_t row[81];
};
PaddedCells padded_cells(const Neighbourhood& n) {
    static constexpr uint8_t none[rows_per_tile] = {};
    const uint8_t* from[8];
    for (uint32_t k = 0; k < 8; ++k) from[k] = n.tile[k] ? n.tile[k]->surface : none;
    PaddedCells cells;
    for (uint32_t z = 0; z < 9; ++z) {
        const uint32_t k = z ? 0 : 4, layer = z ? 8 * (z - 1) : 56;
        uint16_t* row = cells.row + 9 * z;
        const uint8_t *here = from[k] + layer, *beyond = from[k | 1] + layer;
        row[0] = uint16_t(from[k | 2][layer + 7] << 1 | from[k | 3][layer + 7] >> 7);
        for (uint32_t y = 0; y < 8; ++y) row[y + 1] = uint16_t(here[y] << 1 | beyond[y] >> 7);
    }
    return cells;
}

/// Per axis: which lattice edges from the lower corners of the cells carry a quad, i.e. change sign and have all four
/// cells; by row. All rows at once, without a branch: eight of them are one vector.
struct QuadMasks {
    uint16_t axis[3][rows_per_tile];
};
QuadMasks quads_of(const Neighbourhood& n) {
    const PaddedCells cells = padded_cells(n);
    QuadMasks quads;
    for (int z = 0; z < tile_cells; ++z) {
        const uint16_t *own = cells.row + 9 * z + 10, *lower = own - 9, *corner = n.tile[0]->inside + 9 * z;
        for (int y = 0; y < tile_cells; ++y) {
            const uint32_t here = own[y] >> 1, back = own[y], left = own[y - 1], down = lower[y], sign = corner[y];
            const uint32_t beside = here & left >> 1, below = here & back & down;  // cells x − 1 are one bit further up
            quads.axis[0][y + 8 * z] = uint16_t((sign ^ sign >> 1) & beside & (down & lower[y - 1]) >> 1);
            quads.axis[1][y + 8 * z] = uint16_t((sign ^ corner[y + 1]) & below & down >> 1);
            quads.axis[2][y + 8 * z] = uint16_t((sign ^ corner[y + 9]) & beside & back & left);
        }
    }
    return quads;
}
uint32_t count_of(const QuadMasks& quads) {
    uint32_t count = 0;
    for (const auto& rows : quads.axis)
        for (uint32_t bits : rows) {
            bits -= bits >> 1 & 0x55, bits = (bits & 0x33) + (bits >> 2 & 0x33);
            count += (bits + (bits >> 4)) & 15;
        }
    return count;
}

/// The vertex of a cell on the patch that `edge` belongs to.
uint32_t vertex_of(const Tile& tile, uint32_t cell, uint32_t edge) {
    return tile.first_vertex + tile.placed.vertex[cell] + patch_of(tile.placed.pattern[cell], edge);
}

struct TileWriter {
    const Mesher& m;
    Tile& tile;
    Neighbourhood near;
    uint32_t* out;  ///< null: not wanted

    /// The four cells round the edge along `axis` from the lower corner of cell `home`, at `at`.
    template <uint32_t axis>
    void quad(const int (&at)[3], bool liquid_below) {
        constexpr uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3, step_u = 1u << 3 * u, step_v = 1u << 3 * v;
        const uint32_t home = uint32_t(at[0] + 8 * at[1] + 64 * at[2]);
        uint32_t round[4];
        if ((at[u] > 0) & (at[v] > 0)) {
            round[0] = vertex_of(tile, home - step_u - step_v, 4 * axis + 3);
            round[1] = vertex_of(tile, home - step_v, 4 * axis + 2);
            round[2] = vertex_of(tile, home, 4 * axis);
            round[3] = vertex_of(tile, home - step_u, 4 * axis + 1);
        } else {
            find_beyond<axis>(at, home, round);
        }
        if (!out) return;
        // Counter-clockwise seen from the far end of the edge, where the air is when the liquid is below.
        const uint32_t turn = liquid_below ? 0 : 3;
        const uint32_t index[4] = {round[turn], round[1 ^ turn], round[2 ^ turn], round[3 ^ turn]};
        const uint32_t s = splits_first(m, tile.cell, index) ? 0 : 1;
        const uint32_t six[6] = {index[s], index[s + 1], index[s + 2],
                                 index[s], index[s + 2], index[(s + 3) & 3]};
        std::memcpy(out, six, sizeof(six));
        out += 6;
    }

private:
    /// Some of the four lie in other tiles.
    template <uint32_t axis>
    void find_beyond(const int (&at)[3], uint32_t home, uint32_t (&round)[4]) {
        constexpr uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
        constexpr uint32_t down[4] = {3, 2, 0, 1};  // one down along u (1) and v (2)?
        const uint32_t inner = (at[u] > 0 ? 1u : 0u) | (at[v] > 0 ? 2u : 0u);
        for (uint32_t k = 0; k < 4; ++k) {
            const uint32_t step = down[k], beyond = step & ~inner, edge = 4 * axis + step;
            // A step out of the tile comes in on the far side of the one beyond.
            const uint32_t cell = home - ((step & 1) << 3 * u) - (step >> 1 << 3 * v) + ((beyond & 1) << (3 * u + 3)) +
                                  (beyond >> 1 << (3 * v + 3));
            round[k] = vertex_of(*near.tile[(beyond & 1) << u | beyond >> 1 << v], cell, edge);
            if (beyond) cover(tile, m.vertices[round[k]].position);
        }
    }
};

void write_tile(const Mesher& m, Tile& tile) {
    const Target* target = m.input.target;
    uint32_t* out = target && target->indices ? target->indices + tile.first_index : nullptr;
    if (tile.beside) {
        join_mixed(m, tile, out, true);
        return;
    }
    TileWriter writer{m, tile, neighbourhood(m, tile), out};
    const QuadMasks quads = quads_of(writer.near);
    for (int row = 0; row < int(rows_per_tile); ++row) {
        const uint32_t along[3] = {quads.axis[0][row], quads.axis[1][row], quads.axis[2][row]};
        if (!(along[0] | along[1] | along[2])) continue;
        const int y = row % 8, z = row / 8;
        const uint32_t liquid = tile.inside[y + 9 * z];
        for_bits(along[0], [&](uint32_t x) { writer.quad<0>({int(x), y, z}, liquid >> x & 1); });
        for_bits(along[1], [&](uint32_t x) { writer.quad<1>({int(x), y, z}, liquid >> x & 1); });
        for_bits(along[2], [&](uint32_t x) { writer.quad<2>({int(x), y, z}, liquid >> x & 1); });
    }
}

bool same_group(const Mesher& m, uint32_t a, uint32_t b) {
    return m.order[a].level == m.order[b].level &&
           m.order[a].key >> OrderedTile::group_shift == m.order[b].key >> OrderedTile::group_shift;
}

/// All drops that have meshes of their own and are drawn are one piece.
Range range_of_drops(const Mesher& m, uint32_t number, uint32_t first_index) {
    Range range{number, first_index, 0, {HUGE_VALF, HUGE_VALF, HUGE_VALF}, {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF}};
    for (uint32_t i = 0; i < m.drops_kept; ++i) range.index_count += indices_of(m.drops[i]), cover(m.drops[i], range);
    return range;
}

}  // namespace

bool splits_first(const Mesher& m, float cell, const uint32_t index[4]) noexcept {
    constexpr float share_of_length = 0.1f;  // where nothing bends, the shorter
    Vector p[4], n[4];
    for (uint32_t k = 0; k < 4; ++k) p[k] = load(m.vertices[index[k]].position), n[k] = load(m.vertices[index[k]].normal);
    const auto facing = [&](uint32_t from) {  // one way, when split there
        const Vector &q = p[from], across = p[from + 2] - q;
        return dot(cross(p[from + 1] - q, across), cross(across, p[(from + 3) & 3] - q)) > 0;
    };
    const Vector a = p[2] - p[0], b = p[3] - p[1];
    const float share = share_of_length / cell;
    const float bend_a = std::abs(dot(n[2] - n[0], a)) + share * dot(a, a), bend_b = std::abs(dot(n[3] - n[1], b)) + share * dot(b, b);
    const bool first = bend_a <= bend_b;
    return facing(first ? 0 : 1) || !facing(first ? 1 : 0) ? first : !first;
}

void cover(Tile& tile, const float position[3]) noexcept {
    for (int a = 0; a < 3; ++a) {
        tile.lower[a] = std::min(tile.lower[a], position[a]);
        tile.upper[a] = std::max(tile.upper[a], position[a]);
    }
}

uint32_t count_indices(const Mesher& m, Tile& tile) noexcept {
    if (tile.beside) return join_mixed(m, tile, nullptr, false);
    return 6 * count_of(quads_of(neighbourhood(m, tile)));
}

void lay_out(Mesher& m) noexcept {
    const Target* target = m.input.target;
    const uint64_t most_vertices = std::min(m.limits.vertices, target ? target->vertex_capacity : ~0u);
    const uint64_t most_indices = target && target->indices ? target->index_capacity : ~0u;
    const uint64_t most_ranges = target && target->ranges ? target->range_capacity : ~0u;
    uint64_t vertices = 0, indices = 0, ranges = 0;
    bool open_range = false, room = true;  // open_range: this group has triangles already
    m.kept = 0;
    for (uint32_t i = 0; i < m.order_count; ++i) {
        Tile& tile = m.tiles[m.order[i].tile];
        if (i == 0 || !same_group(m, i - 1, i)) open_range = false;
        if (tile.index_count && !open_range) ++ranges, open_range = true;
        tile.first_vertex = uint32_t(vertices), tile.first_index = uint32_t(indices);
        vertices += tile.vertex_count, indices += tile.index_count;
        room = room && vertices <= most_vertices && indices <= most_indices && ranges <= most_ranges;
        m.kept += room;
    }
    bool any_drop = false;
    for (uint32_t i = 0; i < m.drop_count; ++i) {
        SmallDrop& drop = m.drops[i];
        if (drop.mesh && !any_drop) ++ranges, any_drop = true;
        drop.first_vertex = uint32_t(vertices), drop.first_index = uint32_t(indices);
        vertices += vertices_of(drop), indices += indices_of(drop);
        room = room && vertices <= most_vertices && indices <= most_indices && ranges <= most_ranges;
        m.drops_kept += room;
    }
    if (vertices > most_vertices) m.cut |= cut_vertices;
    if (indices > most_indices) m.cut |= cut_indices;
    if (ranges > most_ranges) m.cut |= cut_ranges;
    if (m.tiles_ran_out) {
        m.cut |= cut_vertices;
        vertices =
            std::max<uint64_t>(vertices, 2 * uint64_t(m.limits.vertices));  // unknown: ask for twice the room
    }
    const auto counted = [](uint64_t n) { return uint32_t(std::min<uint64_t>(n, ~0u)); };
    m.vertices_found = counted(vertices);
    m.vertices_wanted = std::max(m.vertices_wanted, counted(vertices));
    m.indices_wanted = std::max(m.indices_wanted, counted(indices));
    m.ranges_wanted = std::max(m.ranges_wanted, counted(ranges));
    // An octave quarters all of them, more or less.
    const auto excess = [](uint64_t wanted, uint64_t most) {
        return wanted > most && most ? 0.5f * std::log2(float(wanted) / float(most)) + 0.05f : 0.f;
    };
    m.too_large = std::max({excess(vertices, most_vertices), excess(indices, most_indices), excess(ranges, most_ranges)});
}

uint32_t prepare_quads(void* mesher) {
    return tasks_of(static_cast<Mesher*>(mesher)->kept, tiles_per_quick_task);
}

void run_quads(void* mesher, uint32_t task, uint32_t) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, tiles_per_quick_task, m.kept,
              [&](uint32_t i) { write_tile(m, m.tiles[m.order[i].tile]); });
}

uint32_t prepare_ranges(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    Target* target = m.input.target;
    if (!target) return give_back_drops(m), 0;
    uint32_t vertices = 0, indices = 0, ranges = 0;
    Range range{};
    for (uint32_t i = 0; i < m.kept; ++i) {
        const Tile& tile = m.tiles[m.order[i].tile];
        vertices += tile.vertex_count, indices += tile.index_count;
        if (tile.index_count) {
            if (range.index_count == 0) {
                range = {ranges, tile.first_index, 0, {}, {}};
                for (int a = 0; a < 3; ++a) range.lower[a] = tile.lower[a], range.upper[a] = tile.upper[a];
            }
            range.index_count += tile.index_count;
            for (int a = 0; a < 3; ++a) {
                range.lower[a] = std::min(range.lower[a], tile.lower[a]);
                range.upper[a] = std::max(range.upper[a], tile.upper[a]);
            }
        }
        const bool last = i + 1 == m.kept || !same_group(m, i, i + 1);
        if (!last || range.index_count == 0) continue;
        if (target->ranges) std::memcpy(target->ranges + ranges, &range, sizeof(range));
        ++ranges, range.index_count = 0;
    }
    range = range_of_drops(m, ranges, indices);
    if (range.index_count) {
        for (uint32_t i = 0; i < m.drops_kept; ++i) vertices += vertices_of(m.drops[i]);
        indices += range.index_count;
        if (target->ranges) std::memcpy(target->ranges + ranges, &range, sizeof(range));
        ++ranges;
    }
    target->vertices_used = vertices;
    target->indices_used = target->indices ? indices : 0;
    target->ranges_used = target->ranges ? ranges : 0;
    give_back_drops(m);
    return 0;
}

}  // namespace rill
