// SPDX-License-Identifier: MIT
// Surface cells without specks: pieces of a few corners that no drop holds, and that are of one corner or two or have
// fewer than three points by them. They are what the field means where patches of sharp rims end, not liquid: a violent splash
// had 15 in a frame, of 12 to 50 triangles. (Drops are what liquid as small as two corners is cooked to. Pieces that their
// source does not have, and source pieces lost, 51 frames of pour_sphere: 39 and 3 with points enough for small ones, too, 4 and 3 so;
// four times as large cells: 667 and 41, 203 and 61; two times: 77 and 17, 38 and 17. Ten points for small ones: 301 and 54 in the largest.)
// The march has visited all cells round a piece, so that its neighbours are known. Corners that tiles of different size share
// stay as they are: those see other neighbours.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

constexpr uint32_t most_corners = 24, least_corners = 3, enough_points = 3;
constexpr int widest = 7;  // steps from the first corner: a piece lies in its tile and those beside

enum class Sign { unknown, outside, inside };
struct Place {
    int x, y, z;  ///< of a corner, from the tile's first one; may lie beyond its faces
    bool operator==(const Place& o) const { return x == o.x && y == o.y && z == o.z; }
    bool before(const Place& o) const { return z != o.z ? z < o.z : y != o.y ? y < o.y : x < o.x; }
};

/// One of the tiles that hold the corner has cells of another size.
bool on_mixed_border(const Tile& tile, int x, int y, int z) {
    if (!tile.beside) return false;
    const auto first = [](int at) { return at == 0 ? -1 : 0; };
    const auto last = [](int at) { return at == tile_cells ? 1 : 0; };
    for (int k = first(z); k <= last(z); ++k)
        for (int j = first(y); j <= last(y); ++j)
            for (int i = first(x); i <= last(x); ++i)
                if (tile.at_place(place_of(i, j, k)) != beside_same) return true;
    return false;
}

Sign sign_of(const Tile& tile, int x, int y, int z) {
    const uint32_t row = uint32_t(y + 9 * z);
    if (!(tile.known[row] >> x & 1) || on_mixed_border(tile, x, y, z)) return Sign::unknown;
    return tile.inside[row] >> x & 1 ? Sign::inside : Sign::outside;
}
Sign sign_at(const Mesher& m, const Tile& tile, const Place& at) {
    const int p[3] = {at.x, at.y, at.z};
    int32_t coord[3];
    int place[3];
    bool beyond = false;
    for (int a = 0; a < 3; ++a) {
        const int away = p[a] < 0 ? -1 : p[a] > tile_cells ? 1 : 0;
        coord[a] = tile.coord[a] + away, place[a] = p[a] - away * tile_cells;
        beyond = beyond || away;
    }
    if (!beyond) return sign_of(tile, at.x, at.y, at.z);
    const uint32_t index = find_tile(m, tile.level, coord);
    return index == no_tile ? Sign::unknown : sign_of(m.tiles[index], place[0], place[1], place[2]);
}

/// Corners of one sign, joined along edges.
struct Piece {
    Place corner[most_corners];
    uint32_t count = 0;
    bool holds(const Place& p) const { return std::find(corner, corner + count, p) != corner + count; }
};

/// The piece whose first corner is `first`; false when that is not its first, when it is large, or not all known.
bool collect(const Mesher& m, const Tile& tile, const Place& first, Piece& piece) {
    const Sign sign = sign_at(m, tile, first);
    if (sign == Sign::unknown) return false;
    piece.corner[0] = first, piece.count = 1;
    for (uint32_t k = 0; k < piece.count; ++k)
        for (int side = 0; side < 6; ++side) {
            Place p = piece.corner[k];
            (side / 2 == 0 ? p.x : side / 2 == 1 ? p.y : p.z) += side & 1 ? 1 : -1;
            const Sign other = sign_at(m, tile, p);
            if (other == Sign::unknown) return false;
            if (other != sign || piece.holds(p)) continue;
            if (p.before(first) || piece.count == most_corners || std::abs(p.x - first.x) > widest ||
                std::abs(p.y - first.y) > widest || p.z - first.z > widest) return false;
            piece.corner[piece.count++] = p;
        }
    return true;
}

/// Whether drop d holds a corner of the piece.
bool holds_corner(const surface::Field& f, uint32_t d, const Tile& tile, const Piece& piece) {
    float inverse[6];
    for (int k = 0; k < 6; ++k) inverse[k] = f.inverse[k][d];
    return std::any_of(piece.corner, piece.corner + piece.count, [&](const Place& p) {
        const float r[3] = {corner_at(tile, 0, p.x) - f.dx[d], corner_at(tile, 1, p.y) - f.dy[d], corner_at(tile, 2, p.z) - f.dz[d]};
        return length_of(inverse, r) < 1;
    });
}

/// The box of the cells that have a corner of the piece.
surface::Box box_round(const Tile& tile, const Piece& piece) {
    constexpr float far = surface::unsupported;
    surface::Box box{{far, far, far}, {-far, -far, -far}};
    for (uint32_t k = 0; k < piece.count; ++k) {
        const int p[3] = {piece.corner[k].x, piece.corner[k].y, piece.corner[k].z};
        for (uint32_t a = 0; a < 3; ++a) {
            box.lower[a] = std::min(box.lower[a], corner_at(tile, a, p[a] - 1));
            box.upper[a] = std::max(box.upper[a], corner_at(tile, a, p[a] + 1));
        }
    }
    return box;
}

/// Whether point j is in a cell that has a corner of the piece.
bool is_beside(const surface::Field& f, uint32_t j, const Tile& tile, const Piece& piece) {
    const auto cell = [&](float at, int a) {
        const float c = std::floor(at / tile.cell) - float(tile_cells * tile.coord[a]);
        return int(std::clamp(c, -100.f, 100.f));
    };
    const int x = cell(f.x[j], 0), y = cell(f.y[j], 1), z = cell(f.z[j], 2);
    for (int k = 0; k < 8; ++k)
        if (piece.holds({x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)})) return true;
    return false;
}

/// Whether drops or points mean the piece.
bool is_meant(const Mesher& m, MesherScratch& s, const Tile& tile, const Piece& piece) {
    const surface::Field& f = *m.input.field;
    const uint32_t found = std::min(m.access.gather(f, box_round(tile, piece), s.candidates, s.most_candidates), s.most_candidates);
    uint32_t points = 0;
    for (uint32_t c = 0; c < found; ++c) {
        const uint32_t j = s.candidates[c];
        if (j >= f.point_count) {
            if (holds_corner(f, j - f.point_count, tile, piece)) return true;
        } else {
            points += piece.count >= least_corners && is_beside(f, j, tile, piece);
        }
    }
    return points >= enough_points;
}

/// Known corners of a row that may be the first of their piece: those before it along x, y, z are of the other sign.
uint32_t firsts(const Tile& tile, uint32_t y, uint32_t z) {
    const uint32_t row = y + 9 * z, own = tile.inside[row];
    uint32_t bits = tile.known[row] & 0xff & ((own ^ own << 1) | 1);
    if (y > 0) bits &= own ^ tile.inside[row - 1];
    if (z > 0) bits &= own ^ tile.inside[row - 9];
    return bits;
}

void find_specks(const Mesher& m, MesherScratch& s, Tile& tile) {
    tile.has_specks = false;
    Piece piece;
    for (uint32_t row = 0; row < rows_per_tile; ++row) {
        tile.speck[row] = 0;
        uint32_t bits = firsts(tile, row % 8, row / 8);
        for (int x = 0; bits; ++x, bits >>= 1) {
            if (!(bits & 1) || !collect(m, tile, {x, int(row % 8), int(row / 8)}, piece)) continue;
            if (is_meant(m, s, tile, piece)) continue;
            tile.speck[row] |= uint8_t(1 << x);
            tile.has_specks = true;
        }
    }
}

/// Gives a corner the other sign in every tile that has it.
void turn_corner(Mesher& m, const Tile& tile, const Place& at) {
    const int p[3] = {at.x, at.y, at.z};
    for (int k = 0; k < 8; ++k) {
        int32_t coord[3];
        int place[3];
        bool held = true;
        for (int a = 0; a < 3; ++a) {
            const int global = tile_cells * tile.coord[a] + p[a], down = k >> a & 1;
            coord[a] = (global >= 0 ? global : global - tile_cells + 1) / tile_cells - down;
            place[a] = global - tile_cells * coord[a];
            held = held && place[a] <= tile_cells;
        }
        const uint32_t index = held ? find_tile(m, tile.level, coord) : no_tile;
        if (index == no_tile) continue;
        Tile& holder = m.tiles[index];
        const int row = place[1] + 9 * place[2];
        holder.inside[row] ^= uint16_t(1 << place[0]);
        holder.value[place[0] + 9 * row] *= -1;
        for (uint32_t r = 0; r < rows_per_tile; ++r) holder.surface[r] &= surface_cells(holder, r);
    }
}

}  // namespace

uint32_t prepare_find_specks(void* mesher) {
    return tasks_of(static_cast<Mesher*>(mesher)->tile_count, tiles_per_quick_task);
}
void run_find_specks(void* mesher, uint32_t task, uint32_t worker) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, tiles_per_quick_task, m.tile_count,
              [&](uint32_t i) { find_specks(m, m.scratch[worker], m.tiles[i]); });
}

/// They are few, and their corners stand in several tiles: one thread turns them.
uint32_t prepare_turn_specks(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    Piece piece;
    for (uint32_t i = 0; i < m.tile_count; ++i) {
        const Tile& tile = m.tiles[i];
        if (!tile.has_specks) continue;
        for (uint32_t row = 0; row < rows_per_tile; ++row)
            for (int x = 0; x < tile_cells; ++x)
                if (tile.speck[row] >> x & 1 && collect(m, tile, {x, int(row % 8), int(row / 8)}, piece))
                    for (uint32_t k = 0; k < piece.count; ++k) turn_corner(m, tile, piece.corner[k]);
    }
    return 0;
}

}  // namespace rill
