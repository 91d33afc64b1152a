// SPDX-License-Identifier: MIT
// Polygons between cells of different size: one round every smallest lattice edge that changes sign, through the
// vertices of the cells round it (Ju, Losasso, Schaefer & Warren 2002). Where two of the four places belong to
// one large cell the quad is a triangle. A polygon belongs to the tile that is drawn last of those round its
// edge; large cells are drawn before small ones, so that is one with the smallest cells.
#include <algorithm>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

/// The tiles in and round one, and how its cells are called there.
struct Surroundings {
    const Mesher& m;
    const Tile& home;
    const Tile* tile[27];

    Surroundings(const Mesher& mesher, const Tile& of) : m(mesher), home(of) {
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y)
                for (int x = -1; x <= 1; ++x) {
                    const uint32_t place = place_of(x, y, z);
                    const int32_t there[3] = {of.coord[0] + x, of.coord[1] + y, of.coord[2] + z};
                    const Beside kind = of.at_place(place);
                    int32_t parent[3];
                    parent_of(there, parent);
                    const uint32_t index = kind == beside_same      ? find_tile(m, of.level, there)
                                           : kind == beside_coarser ? find_tile(m, of.level + 1, parent)
                                                                    : no_tile;
                    tile[place] = index == no_tile ? nullptr : &m.tiles[index];
                }
    }
};

/// One of the four places round an edge.
struct Quarter {
    const Tile* tile;
    uint32_t cell;         ///< of that tile
    uint32_t edge;         ///< of that cell: crossed where the polygon passes
    int32_t face = -1;     ///< the edge lies inside this face of a large cell; `edge` then ends it
    bool large;
};

/// A smallest edge of the home tile: along `axis` from corner `at` (0 … 8 across).
struct Edge {
    uint32_t axis;
    int at[3];
};

/// Fills in the part of a large cell that the edge touches. `cell`: in small cells, relative to the home tile.
void find_in_large(const Tile& home, const Edge& edge, const int cell[3], Quarter& q) {
    const uint32_t axis = edge.axis, u = (axis + 1) % 3, v = (axis + 2) % 3;
    int large[3], offset[3];  // offset: of the edge's lower end in the large cell, in halves of it
    for (int a = 0; a < 3; ++a) {
        const int base = tile_cells * home.coord[a];
        const int whole = (base + cell[a]) >> 1;
        large[a] = whole & (tile_cells - 1);
        offset[a] = base + edge.at[a] - 2 * whole;
    }
    q.cell = uint32_t(large[0] + 8 * large[1] + 64 * large[2]);
    const auto name = [](uint32_t along, uint32_t first, uint32_t second) { return 4 * along + first + 2 * second; };
    const uint32_t side_u = uint32_t(offset[u]) / 2, side_v = uint32_t(offset[v]) / 2;
    const uint32_t end = uint32_t(offset[axis]);  // which end of the face's middle line this half reaches
    if (offset[u] == 1) q.edge = name(u, side_v, end), q.face = int32_t(2 * v + side_v);
    else if (offset[v] == 1) q.edge = name(v, end, side_u), q.face = int32_t(2 * u + side_u);
    else q.edge = name(axis, side_u, side_v);
}

/// False: there is no polygon, or it is another tile's.
bool find_quarters(const Surroundings& near, const Edge& edge, Quarter quarters[4]) {
    constexpr int step_u[4] = {-1, 0, 0, -1}, step_v[4] = {-1, -1, 0, 0};
    const uint32_t u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
    for (uint32_t k = 0; k < 4; ++k) {
        int cell[3] = {edge.at[0], edge.at[1], edge.at[2]}, side[3];
        cell[u] += step_u[k], cell[v] += step_v[k];
        for (int a = 0; a < 3; ++a) side[a] = cell[a] < 0 ? -1 : cell[a] >= tile_cells ? 1 : 0;
        const uint32_t place = place_of(side[0], side[1], side[2]);
        Quarter& q = quarters[k] = {};
        q.tile = near.tile[place];
        if (!q.tile) return false;  // also where a finer tile lies, whose edge it is then
        q.large = near.home.at_place(place) == beside_coarser;
        if (q.large) {
            find_in_large(near.home, edge, cell, q);
        } else {
            q.cell = uint32_t((cell[0] & 7) + 8 * (cell[1] & 7) + 64 * (cell[2] & 7));
            q.edge = 4 * edge.axis + (step_u[k] ? 1 : 0) + (step_v[k] ? 2 : 0);
        }
        if (!(q.tile->surface[q.cell / 8] >> q.cell % 8 & 1)) return false;
        if (q.tile->rank > near.home.rank) return false;
    }
    return true;
}

bool same_cell(const Quarter& a, const Quarter& b) { return a.tile == b.tile && a.cell == b.cell; }

uint32_t vertex_of(const Quarter& q) {
    const CellPattern pattern = q.tile->placed.pattern[q.cell];
    const uint32_t signs = pattern.signs();
    uint32_t edge = q.edge;
    if (q.face >= 0 && !patches_detail::crossed(signs, edge)) {
        // All that crosses this face then belongs to one patch: with two, every edge of it is crossed.
        for (uint32_t other : patches_detail::face_of(uint32_t(q.face)).edge)
            if (patches_detail::crossed(signs, other)) edge = other;
    }
    return q.tile->first_vertex + q.tile->placed.vertex[q.cell] + patch_of(pattern, edge);
}

/// Two large cells across a corner meet at both halves of their edge: a diagonal between them would be drawn twice.
bool split_at_first(const Mesher& m, float cell, const Quarter quarters[4], const uint32_t index[4]) {
    if (quarters[0].large && quarters[2].large) return false;
    if (quarters[1].large && quarters[3].large) return true;
    return splits_first(m, cell, index);
}

uint32_t write_polygon(const Mesher& m, Tile& tile, const Quarter quarters[4], bool turned, uint32_t* out) {
    uint32_t index[4], ring[4], count = 0;
    for (uint32_t k = 0; k < 4; ++k) {
        index[k] = vertex_of(quarters[k]);
        cover(tile, m.vertices[index[k]].position);
        if (!same_cell(quarters[k], quarters[(k + 3) & 3])) ring[count++] = index[k];
    }
    if (!out) return count == 4 ? 6 : 3;
    if (turned) std::reverse(ring, ring + count);
    if (count < 4) {
        std::memcpy(out, ring, 3 * sizeof(uint32_t));
        return 3;
    }
    // Turned round, places 0 2 and 1 3 change roles.
    const uint32_t s = split_at_first(m, tile.cell, quarters, index) != turned ? 0 : 1;
    const uint32_t six[6] = {ring[s], ring[s + 1], ring[s + 2], ring[s], ring[s + 2], ring[(s + 3) & 3]};
    std::memcpy(out, six, sizeof(six));
    return 6;
}

uint32_t count_polygon(const Quarter quarters[4]) {
    uint32_t corners = 0;
    for (uint32_t k = 0; k < 4; ++k) corners += !same_cell(quarters[k], quarters[(k + 3) & 3]);
    return corners == 4 ? 6 : 3;
}

}  // namespace

uint32_t join_mixed(const Mesher& m, Tile& tile, uint32_t* out, bool write) noexcept {
    const Surroundings near(m, tile);
    uint32_t indices = 0;
    for (uint32_t axis = 0; axis < 3; ++axis)
        for (int z = 0; z < tile_corners; ++z)
            for (int y = 0; y < tile_corners; ++y) {
                const uint32_t row = uint32_t(y + 9 * z), known = tile.known[row], inside = tile.inside[row];
                const uint32_t step = axis == 1 ? 1 : 9;
                if (axis && (axis == 1 ? y : z) == tile_cells) continue;
                uint32_t crossed = axis ? (inside ^ tile.inside[row + step]) & known & tile.known[row + step]
                                        : (inside ^ inside >> 1) & known & known >> 1 & 0xff;
                for (int x = 0; crossed; ++x, crossed >>= 1) {
                    Quarter quarters[4];
                    if (!(crossed & 1) || !find_quarters(near, {axis, {x, y, z}}, quarters)) continue;
                    indices += write ? write_polygon(m, tile, quarters, !(inside >> x & 1), out ? out + indices : nullptr)
                                     : count_polygon(quarters);
                }
            }
    return indices;
}

}  // namespace rill
