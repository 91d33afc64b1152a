// SPDX-License-Identifier: MIT
// The sparse store of tiles: open addressing over tile coordinates, in the caller's memory. Tiles are only
// created while one thread runs, so their numbers never depend on scheduling.
#include <algorithm>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

constexpr uint32_t coord_bits = 21;

uint64_t pack(uint64_t x, uint64_t y, uint64_t z) { return (z << (2 * coord_bits)) | (y << coord_bits) | x; }

uint32_t slot_of(const Mesher& m, const int32_t coord[3]) {
    uint64_t h = pack(uint32_t(coord[0] + farthest_tile), uint32_t(coord[1] + farthest_tile),
                      uint32_t(coord[2] + farthest_tile));
    h ^= h >> 31, h *= 0x9e3779b97f4a7c15u, h ^= h >> 29;  // Fibonacci hashing, folded
    uint32_t slot = uint32_t(h) & m.hash_mask;
    while (m.hash[slot] && std::memcmp(m.tiles[m.hash[slot] - 1].coord, coord, sizeof(Tile::coord)) != 0)
        slot = (slot + 1) & m.hash_mask;
    return slot;
}

/// False when the tile, widened by a cell, lies outside one plane of every view.
bool in_sight(const Mesher& m, const int32_t coord[3]) {
    const float size = tile_cells * m.input.cell_size, half = 0.5f * size + m.input.cell_size;
    const float centre[3] = {(float(coord[0]) + 0.5f) * size, (float(coord[1]) + 0.5f) * size,
                             (float(coord[2]) + 0.5f) * size};
    for (uint32_t v = 0; v < m.input.view_count; ++v) {
        bool outside = false;
        for (const float(&p)[4] : m.input.views[v].planes) {
            const float distance = p[0] * centre[0] + p[1] * centre[1] + p[2] * centre[2] + p[3];
            const float reach = half * (std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]));
            outside = outside || distance < -reach;
        }
        if (!outside) return true;
    }
    return m.input.view_count == 0;
}

}  // namespace

uint32_t find_tile(const Mesher& m, const int32_t coord[3]) noexcept {
    return m.hash[slot_of(m, coord)] - 1;  // 0 − 1 = no_tile
}

uint32_t find_or_create_tile(Mesher& m, const int32_t coord[3]) noexcept {
    const uint32_t slot = slot_of(m, coord);
    if (m.hash[slot]) return m.hash[slot] - 1;
    for (int a = 0; a < 3; ++a)
        if (coord[a] < -farthest_tile || coord[a] >= farthest_tile) return no_tile;
    if (!in_sight(m, coord)) return no_tile;
    if (m.tile_count == m.limits.tiles) {
        m.tiles_ran_out = true;
        return no_tile;
    }
    Tile& tile = m.tiles[m.tile_count];
    std::memset(static_cast<void*>(&tile), 0, offsetof(Tile, value));
    std::memcpy(tile.coord, coord, sizeof(tile.coord));
    m.hash[slot] = ++m.tile_count;
    return m.tile_count - 1;
}

float corner_at(const Mesher& m, const Tile& tile, uint32_t axis, uint32_t corner) noexcept {
    return float(tile_cells * tile.coord[axis] + int32_t(corner)) * m.input.cell_size;
}

void list_candidates(const Mesher& m, MesherScratch& s, const Tile& tile) noexcept {
    surface::Box box;
    for (uint32_t a = 0; a < 3; ++a)
        box.lower[a] = corner_at(m, tile, a, 0), box.upper[a] = corner_at(m, tile, a, tile_cells);
    s.candidate_count = m.access.gather(*m.input.field, box, s.candidates, s.most_candidates);
}

void queue_tile(Mesher& m, uint32_t index) noexcept {
    Tile& tile = m.tiles[index];
    if (tile.queued) return;
    tile.queued = true;
    m.next_active[m.next_active_count++] = index;
}

void sort_tiles(Mesher& m) noexcept {
    m.order_count = 0;
    for (uint32_t i = 0; i < m.tile_count; ++i) {
        const Tile& tile = m.tiles[i];
        const bool any =
            std::any_of(tile.surface, tile.surface + rows_per_tile, [](uint8_t r) { return r != 0; });
        if (!any) continue;
        uint64_t group[3], local[3];
        for (int a = 0; a < 3; ++a) {
            const uint32_t biased = uint32_t(tile.coord[a] + farthest_tile);
            group[a] = biased >> 2, local[a] = biased & 3;
        }
        const uint64_t groups = (group[2] << 38) | (group[1] << 19) | group[0];
        m.order[m.order_count++] = {
            groups << OrderedTile::group_shift | local[2] << 4 | local[1] << 2 | local[0], i};
    }
    std::sort(m.order, m.order + m.order_count,
              [](const OrderedTile& a, const OrderedTile& b) { return a.key < b.key; });
}

}  // namespace rill
