// SPDX-License-Identifier: MIT
// The sparse store of tiles: open addressing over tile coordinates, in the caller's memory. Tiles are only
// created while one thread runs, so their numbers never depend on scheduling.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

constexpr uint32_t coord_bits = 21;

uint64_t pack(uint64_t x, uint64_t y, uint64_t z) { return (z << (2 * coord_bits)) | (y << coord_bits) | x; }

uint32_t slot_of(const Mesher& m, int32_t level, const int32_t coord[3]) {
    uint64_t h = pack(uint32_t(coord[0] + farthest_tile), uint32_t(coord[1] + farthest_tile),
                      uint32_t(coord[2] + farthest_tile));
    h ^= uint64_t(level) * 0xd1342543de82ef95u;
    h ^= h >> 31, h *= 0x9e3779b97f4a7c15u, h ^= h >> 29;  // Fibonacci hashing, folded
    uint32_t slot = uint32_t(h) & m.hash_mask;
    const auto other = [&](const Tile& t) {
        return t.level != level || std::memcmp(t.coord, coord, sizeof(Tile::coord)) != 0;
    };
    while (m.hash[slot] && other(m.tiles[m.hash[slot] - 1])) slot = (slot + 1) & m.hash_mask;
    return slot;
}

/// How far polygons in sight reach beyond the cell that they cross the border of sight in, in cells.
float sight_margin(const Mesher& m) { return m.input.levels.eye_count ? 2.f : 1.f; }

/// Of a cube: in a view at least in part, all in one view, or out of all.
enum class Sight { none, part, whole };
Sight sight_of(const Mesher& m, const float centre[3], float half) {
    Sight best = m.input.view_count ? Sight::none : Sight::whole;
    for (uint32_t v = 0; v < m.input.view_count && best != Sight::whole; ++v) {
        bool outside = false, inside = true;
        for (const float(&p)[4] : m.input.views[v].planes) {
            const float distance = p[0] * centre[0] + p[1] * centre[1] + p[2] * centre[2] + p[3];
            const float reach = half * (std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]));
            outside = outside || distance < -reach;
            inside = inside && distance >= reach;
        }
        if (!outside) best = inside ? Sight::whole : Sight::part;
    }
    return best;
}
Sight sight_of_tile(const Mesher& m, int32_t level, const int32_t coord[3]) {
    const float cell = m.input.levels.cell(level), size = tile_cells * cell;
    const float centre[3] = {(float(coord[0]) + 0.5f) * size, (float(coord[1]) + 0.5f) * size,
                             (float(coord[2]) + 0.5f) * size};
    return sight_of(m, centre, 0.5f * size + sight_margin(m) * cell);
}

/// Cells out of sight count as visited: nobody goes there.
void skip_unseen(const Mesher& m, Tile& tile) {
    const float half = (0.5f + sight_margin(m)) * tile.cell;
    for (int32_t row = 0; row < int32_t(rows_per_tile); ++row)
        for (int32_t x = 0; x < tile_cells; ++x) {
            const int32_t at[3] = {x, row % 8, row / 8};
            float centre[3];
            for (int a = 0; a < 3; ++a) centre[a] = (float(tile_cells * tile.coord[a] + at[a]) + 0.5f) * tile.cell;
            if (sight_of(m, centre, half) == Sight::none) tile.visited[row] |= uint8_t(1 << x);
        }
}

/// A tile is a leaf: boxes of its level beside it are divided, or part of a coarser leaf, or leaves like it.
uint64_t look_round(const Levels& levels, int32_t level, const int32_t coord[3]) {
    uint64_t found = 0;
    for (int z = -1; z <= 1 && levels.eye_count; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x) {
                const int32_t there[3] = {coord[0] + x, coord[1] + y, coord[2] + z};
                int32_t parent[3];
                parent_of(there, parent);
                const bool coarser = level < levels.coarsest() && !levels.divided(level + 1, parent);
                const Beside kind = coarser                         ? beside_coarser
                                    : levels.divided(level, there) ? beside_finer
                                                                    : beside_same;
                found |= uint64_t(kind) << (2 * place_of(x, y, z));
            }
    return found;
}

}  // namespace

uint32_t find_tile(const Mesher& m, int32_t level, const int32_t coord[3]) noexcept {
    return m.hash[slot_of(m, level, coord)] - 1;  // 0 − 1 = no_tile
}

bool in_sight(const Mesher& m, const float centre[3], float half) noexcept { return sight_of(m, centre, half) != Sight::none; }

bool leaf_at(const Mesher& m, const float position[3], int32_t& level, int32_t coord[3]) noexcept {
    const Levels& levels = m.input.levels;
    const auto place = [&](int32_t at_level) {
        const float inverse = 1 / (tile_cells * levels.cell(at_level));
        bool near = true;
        for (int a = 0; a < 3; ++a) {
            const float t = std::floor(position[a] * inverse);
            near = near && t >= -float(farthest_tile) && t < float(farthest_tile);
            coord[a] = near ? int32_t(t) : 0;
        }
        return near;
    };
    // Boxes nest and the rule is monotone: up while the box above is whole.
    for (level = 0; level < levels.coarsest(); ++level)
        if (place(level + 1) && levels.divided(level + 1, coord)) break;
    return place(level);
}

uint32_t find_beyond(const Mesher& m, const Tile& tile, uint32_t face) noexcept {
    int32_t side[3] = {};
    side[face / 2] = face & 1 ? 1 : -1;
    if (tile.at_place(place_of(side[0], side[1], side[2])) != beside_same) return no_tile;
    const int32_t coord[3] = {tile.coord[0] + side[0], tile.coord[1] + side[1], tile.coord[2] + side[2]};
    return find_tile(m, tile.level, coord);
}

uint32_t find_or_create_tile(Mesher& m, int32_t level, const int32_t coord[3]) noexcept {
    const uint32_t slot = slot_of(m, level, coord);
    if (m.hash[slot]) return m.hash[slot] - 1;
    for (int a = 0; a < 3; ++a)
        if (coord[a] < -farthest_tile || coord[a] >= farthest_tile) return no_tile;
    const Sight sight = sight_of_tile(m, level, coord);
    if (sight == Sight::none) return no_tile;
    if (m.tile_count == m.limits.tiles) {
        m.tiles_ran_out = true;
        return no_tile;
    }
    Tile& tile = m.tiles[m.tile_count];
    std::memset(static_cast<void*>(&tile), 0, offsetof(Tile, value));
    std::memcpy(tile.coord, coord, sizeof(tile.coord));
    tile.level = level, tile.cell = m.input.levels.cell(level);
    tile.beside = look_round(m.input.levels, level, coord);
    if (sight == Sight::part) skip_unseen(m, tile);
    m.hash[slot] = ++m.tile_count;
    return m.tile_count - 1;
}

namespace {
void gather_candidates(const Mesher& m, MesherScratch& s, const Tile& tile) {
    surface::Box box;
    for (uint32_t a = 0; a < 3; ++a)
        box.lower[a] = corner_at(tile, a, 0), box.upper[a] = corner_at(tile, a, tile_cells);
    s.candidate_count = m.access.gather(*m.input.field, box, s.candidates, s.most_candidates);
}
}  // namespace

void list_candidates(const Mesher& m, MesherScratch& s, Tile& tile) noexcept {
    gather_candidates(m, s, tile);
    const uint32_t count = s.candidate_count;
    const bool fits = count == 0 || (count <= Tile::kept_candidates && s.candidates[count - 1] <= UINT16_MAX);  // they ascend
    tile.candidate_count = fits ? count : ~0u;
    if (tile.keeps_candidates()) std::copy(s.candidates, s.candidates + count, tile.candidates);
}

void take_candidates(const Mesher& m, MesherScratch& s, const Tile& tile) noexcept {
    if (!tile.keeps_candidates()) {
        gather_candidates(m, s, tile);
        return;
    }
    s.candidate_count = tile.candidate_count;
    std::copy(tile.candidates, tile.candidates + tile.candidate_count, s.candidates);
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
            groups << OrderedTile::group_shift | local[2] << 4 | local[1] << 2 | local[0], i, tile.level};
    }
    std::sort(m.order, m.order + m.order_count, [](const OrderedTile& a, const OrderedTile& b) {
        return a.level != b.level ? a.level > b.level : a.key < b.key;
    });
    for (uint32_t i = 0; i < m.order_count; ++i) m.tiles[m.order[i].tile].rank = i;
}

}  // namespace rill
