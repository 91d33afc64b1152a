// SPDX-License-Identifier: MIT
// Surface cells without specks: one corner, or two side by side, of a sign that none of their neighbours share. Such
// a speck is smaller than the mesh resolves; most come from where patches of sharp rims end (a violent splash had 15
// of 12 triangles each in a frame). The march has visited all cells round a speck, so that its neighbours are
// known, and every tile that shares one of its corners comes to the same answer. Corners that tiles of different size
// share stay as they are: those see other neighbours.
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

enum class Sign { unknown, outside, inside };

/// One of the tiles that hold the corner has cells of another size.
bool on_mixed_border(const Tile& tile, const int place[3]) {
    if (!tile.beside) return false;
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) from[a] = place[a] == 0 ? -1 : 0, to[a] = place[a] == tile_cells ? 1 : 0;
    for (int z = from[2]; z <= to[2]; ++z)
        for (int y = from[1]; y <= to[1]; ++y)
            for (int x = from[0]; x <= to[0]; ++x)
                if (tile.at_place(place_of(x, y, z)) != beside_same) return true;
    return false;
}

/// Sign of a corner by its place from the tile's first one; places may lie beyond its faces.
Sign sign_at(const Mesher& m, const Tile& tile, const int at[3]) {
    int32_t coord[3];
    int place[3];
    bool beyond = false;
    for (int a = 0; a < 3; ++a) {
        const int away = at[a] < 0 ? -1 : at[a] > tile_cells ? 1 : 0;
        coord[a] = tile.coord[a] + away, place[a] = at[a] - away * tile_cells;
        beyond = beyond || away;
    }
    const uint32_t index = beyond ? find_tile(m, tile.level, coord) : no_tile;
    if (beyond && index == no_tile) return Sign::unknown;
    const Tile& holder = beyond ? m.tiles[index] : tile;
    const uint32_t row = uint32_t(place[1] + 9 * place[2]);
    if (!(holder.known[row] >> place[0] & 1) || on_mixed_border(holder, place)) return Sign::unknown;
    return holder.inside[row] >> place[0] & 1 ? Sign::inside : Sign::outside;
}

/// How many of the six neighbours share the sign; `twin` is one of them. More than one when some are unknown.
int count_alike(const Mesher& m, const Tile& tile, const int at[3], Sign sign, int twin[3]) {
    int alike = 0;
    for (int side = 0; side < 6 && alike < 2; ++side) {
        int beside[3] = {at[0], at[1], at[2]};
        beside[side / 2] += side & 1 ? 1 : -1;
        const Sign other = sign_at(m, tile, beside);
        if (other == Sign::unknown) return 2;
        if (other == sign) ++alike, std::memcpy(twin, beside, sizeof(beside));
    }
    return alike;
}

bool is_speck(const Mesher& m, const Tile& tile, const int at[3]) {
    const Sign sign = sign_at(m, tile, at);
    if (sign == Sign::unknown) return false;
    int twin[3] = {}, back[3] = {};
    const int alike = count_alike(m, tile, at, sign, twin);
    return alike == 0 || (alike == 1 && count_alike(m, tile, twin, sign, back) == 1);
}

/// Known corners of a row of which at most one neighbour within the tile is alike: the rest cannot be specks.
uint32_t suspects(const Tile& tile, uint32_t y, uint32_t z) {
    const uint32_t row = y + 9 * z, own = tile.inside[row];
    uint32_t once = 0, twice = 0;
    const auto count = [&](uint32_t alike) { twice |= once & alike, once |= alike; };
    count(~(own ^ own << 1) & 0x1fe), count(~(own ^ own >> 1) & 0x0ff);
    if (y > 0) count(~(own ^ tile.inside[row - 1]));
    if (y < 8) count(~(own ^ tile.inside[row + 1]));
    if (z > 0) count(~(own ^ tile.inside[row - 9]));
    if (z < 8) count(~(own ^ tile.inside[row + 9]));
    return tile.known[row] & ~twice & 0x1ff;
}

void find_specks(const Mesher& m, Tile& tile) {
    for (uint32_t row = 0; row < 81; ++row) {
        tile.speck[row] = 0;
        uint32_t bits = suspects(tile, row % 9, row / 9);
        for (int x = 0; bits; ++x, bits >>= 1) {
            const int at[3] = {x, int(row % 9), int(row / 9)};
            if (bits & 1 && is_speck(m, tile, at)) tile.speck[row] |= uint16_t(1 << x);
        }
    }
}

void turn_specks(Tile& tile) {
    bool any = false;
    for (uint32_t row = 0; row < 81; ++row) {
        tile.inside[row] ^= tile.speck[row];
        any = any || tile.speck[row];
        for (uint32_t x = 0, bits = tile.speck[row]; bits; ++x, bits >>= 1)
            if (bits & 1) tile.value[x + 9 * row] *= -1;
    }
    for (uint32_t row = 0; any && row < rows_per_tile; ++row) tile.surface[row] &= surface_cells(tile, row);
}

}  // namespace

uint32_t prepare_specks(void* mesher) {
    return tasks_of(static_cast<Mesher*>(mesher)->tile_count, tiles_per_quick_task);
}
void run_find_specks(void* mesher, uint32_t task, uint32_t) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, tiles_per_quick_task, m.tile_count, [&](uint32_t i) { find_specks(m, m.tiles[i]); });
}
void run_turn_specks(void* mesher, uint32_t task, uint32_t) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, tiles_per_quick_task, m.tile_count, [&](uint32_t i) { turn_specks(m.tiles[i]); });
}

}  // namespace rill
