// SPDX-License-Identifier: MIT
// Which cells the surface crosses: marched from the points (Keeler & Bridson, section 1). Cells crossed by
// the points' own discs are visited first (points_to_tiles.cpp); every face with corners of both signs then leads to the
// cell beyond it, until no such face is left. So the surface is closed wherever room and views let it be.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

/// The walls that come near to the tile. (Farther than two cells no wall is nearer to a corner than what crosses its edges.)
surface::Container walls_beside(surface::Container container, const Tile& tile) {
    const float reach = std::max(surface::bevel_reach(container), 2 * tile.cell);
    for (uint32_t a = 0; a < 3; ++a) {
        if (corner_at(tile, a, 0) > container.lower[a] + reach) container.lower[a] = surface::everywhere.lower[a];
        if (corner_at(tile, a, tile_cells) < container.upper[a] - reach) container.upper[a] = surface::everywhere.upper[a];
    }
    return container;
}

/// Corners of the pending cells, by row. Rows are spread over y and then over z, eight at a time.
void corners_of_pending(const Tile& tile, uint16_t (&need)[81]) {
    uint16_t spread[8][10] = {};  // y from −1 on
    for (uint32_t z = 0; z < 8; ++z)
        for (uint32_t y = 0; y < 8; ++y) spread[z][y + 1] = uint16_t(tile.pending[y + 8 * z] | tile.pending[y + 8 * z] << 1);
    uint16_t layer[10][9] = {};  // z from −1 on
    for (uint32_t z = 0; z < 8; ++z)
        for (uint32_t y = 0; y < 9; ++y) layer[z + 1][y] = spread[z][y] | spread[z][y + 1];
    for (uint32_t z = 0; z < 9; ++z)
        for (uint32_t y = 0; y < 9; ++y) need[y + 9 * z] = layer[z][y] | layer[z + 1][y];
}

/// Makes a batch of corners, octant by octant, so that sixteen in a row lie close together. Returns how many.
uint32_t list_corners(MesherScratch& s, const Tile& tile, const uint16_t (&rows)[81]) {
    float place[3][tile_corners];
    for (uint32_t a = 0; a < 3; ++a)
        for (int k = 0; k < tile_corners; ++k) place[a][k] = corner_at(tile, a, k);
    uint32_t n = 0;
    for (const uint32_t octant : {0u, 1u, 3u, 2u, 6u, 7u, 5u, 4u}) {  // each beside the one before
        const uint32_t first_x = octant & 1 ? 5 : 0, first_y = octant & 2 ? 5 : 0, first_z = octant & 4 ? 5 : 0;
        const uint32_t last_y = first_y ? 9 : 5, last_z = first_z ? 9 : 5;
        for (uint32_t z = first_z; z < last_z; ++z) {
            uint32_t bits = 0;  // five by five at most
            for (uint32_t y = first_y; y < last_y; ++y) bits |= (rows[y + 9 * z] >> first_x & 31u) << 5 * (y - first_y);
            for_bits(bits, [&](uint32_t k) {
                const uint32_t x = first_x + k % 5, y = first_y + k / 5;
                s.x[n] = place[0][x], s.y[n] = place[1][y], s.z[n] = place[2][z], s.slot[n++] = uint16_t(x | (y + 9 * z) << 4);
            });
        }
    }
    return n;
}

/// Evaluates the corners of the pending cells that are not known yet.
void evaluate_corners(const Mesher& m, MesherScratch& s, Tile& tile) {
    uint16_t need[81], hanging[81] = {}, missing[81];
    corners_of_pending(tile, need);
    const bool mixed = (tile.beside & every_coarser) != 0;
    if (mixed) find_hanging(tile, hanging), need_parents(hanging, need);
    for (uint32_t row = 0; row < 81; ++row) missing[row] = uint16_t(need[row] & ~(tile.known[row] | hanging[row]));
    const uint32_t n = list_corners(s, tile, missing);
    for (uint32_t row = 0; row < 81; ++row) tile.known[row] |= missing[row];
    s.corners_evaluated += n;
    s.field.container = walls_beside(m.input.field->container, tile);
    with_candidates(m, s, n, [&](const uint32_t* candidates, uint32_t count, uint32_t first, uint32_t batch) {
        m.access.evaluate(s.field, candidates, count, s.x + first, s.y + first, s.z + first, batch,
                          s.value + first);
    });
    for (uint32_t i = 0; i < n; ++i) {
        // Where nothing is known there is air; this also catches what is not a number.
        const float value = std::abs(s.value[i]) < surface::unsupported ? s.value[i] : tile.cell;
        const uint32_t row = s.slot[i] >> 4, x = s.slot[i] & 15;
        tile.value[x + 9 * row] = value;
        tile.inside[row] |= uint16_t(uint32_t(value < 0) << x);
    }
    if (mixed) settle_hanging(tile, hanging, need);
}

/// Takes over the corners that neighbours have evaluated already. Rounds alternate between the two colours
/// of a chequerboard, so none of these neighbours is running.
void borrow_corners(const Mesher& m, Tile& tile) {
    for (uint32_t face = 0; face < 6; ++face) {
        int32_t coord[3] = {tile.coord[0], tile.coord[1], tile.coord[2]};
        coord[face / 2] += face & 1 ? 1 : -1;
        const uint32_t index = find_tile(m, tile.level, coord);
        if (index == no_tile) continue;
        const Tile& from = m.tiles[index];
        const uint32_t axis = face / 2, far = face & 1 ? 8 : 0, near = 8 - far;
        for (uint32_t k = 0; k < (axis == 0 ? 81u : 9u); ++k) {
            const uint32_t step = axis == 0 ? 0 : axis == 1 ? 1 : 9, base = axis == 1 ? 9 * k : k;
            const uint32_t to = base + far * step, source = base + near * step;
            const auto ours = [&](uint32_t row) { return axis == 0 ? (row >> near & 1) << far : row; };
            const uint32_t bits = ours(from.known[source]);
            if (!bits) continue;
            tile.known[to] |= uint16_t(bits);
            tile.inside[to] = uint16_t((tile.inside[to] & ~bits) | (ours(from.inside[source]) & bits));
            const float* value = from.value + 9 * source + (axis == 0 ? int32_t(near) - int32_t(far) : 0);
            for_bits(bits, [&](uint32_t x) { tile.value[9 * to + x] = value[x]; });  // sign and value stay one
        }
    }
}

/// Visits the pending cells, and makes pending what lies beyond their sign-changing faces.
void visit(Tile& tile) {
    uint8_t next[rows_per_tile] = {};
    for (uint32_t row = 0; row < rows_per_tile; ++row) {
        const uint32_t pending = tile.pending[row];
        if (!pending) continue;
        const uint32_t y = row % 8, z = row / 8;
        const uint16_t* corner = tile.inside + y + 9 * z;
        const uint32_t a = corner[0], b = corner[1], c = corner[9], d = corner[10];
        const uint32_t any = a | b | c | d, all = a & b & c & d;
        const uint32_t active = pending & surface_cells(tile, row), x_faces = any & ~all;
        tile.visited[row] |= uint8_t(pending), tile.surface[row] |= uint8_t(active);
        const uint32_t left = active & x_faces, right = active & (x_faces >> 1);
        next[row] |= uint8_t(left >> 1 | right << 1);
        tile.cross[0] |= uint64_t(left & 1) << row, tile.cross[1] |= uint64_t(right >> 7) << row;
        const auto push = [&](uint32_t bits, bool at_border, uint32_t neighbour, uint32_t face,
                              uint32_t byte) {
            if (at_border)
                tile.cross[face] |= uint64_t(bits) << (8 * byte);
            else
                next[neighbour] |= uint8_t(bits);
        };
        push(active & mixed(a | c, a & c), y == 0, row - 1, 2, z);
        push(active & mixed(b | d, b & d), y == 7, row + 1, 3, z);
        push(active & mixed(a | b, a & b), z == 0, row - 8, 4, y);
        push(active & mixed(c | d, c & d), z == 7, row + 8, 5, y);
    }
    for (uint32_t row = 0; row < rows_per_tile; ++row)
        tile.pending[row] = next[row] & uint8_t(~tile.visited[row]);
}

bool has_pending(const Tile& tile) {
    return std::any_of(tile.pending, tile.pending + rows_per_tile, [](uint8_t r) { return r != 0; });
}

/// Where cells beyond a face are asked for: `axis` points out of it, `up` or down.
struct Crossing {
    uint32_t axis, u, v;  ///< u < v: along the face; bit i + 8 j of the wanted is cell (i, j) there
    bool up;
};

template <typename Work>
void for_wanted(uint64_t wanted, Work work) {
    for (const uint32_t half : {0u, 4u}) for_bits(uint32_t(wanted >> 8 * half), [&](uint32_t k) { work(k % 8, k / 8 + half); });
}

/// True when one of the cells was not visited yet.
bool ask_cells(Tile& tile, const Crossing& c, uint64_t wanted) {
    const uint32_t layer = c.up ? 0 : tile_cells - 1;  // the neighbour's next to us
    uint32_t more = 0;
    const auto ask = [&](uint32_t row, uint32_t bits) {
        const uint32_t fresh = bits & ~uint32_t(tile.visited[row]);
        tile.pending[row] |= uint8_t(fresh), more |= fresh;
    };
    if (c.axis == 0)
        for_wanted(wanted, [&](uint32_t i, uint32_t j) { ask(i + 8 * j, 1u << layer); });
    else
        for (uint32_t j = 0; j < 8; ++j) ask(c.axis == 1 ? layer + 8 * j : j + 8 * layer, uint32_t(wanted >> 8 * j) & 255);
    return more != 0;
}

void ask_same(Mesher& m, int32_t level, const int32_t there[3], const Crossing& c, uint64_t wanted) {
    const uint32_t neighbour = find_or_create_tile(m, level, there);
    if (neighbour == no_tile) return;
    if (ask_cells(m.tiles[neighbour], c, wanted)) queue_tile(m, neighbour);
}

/// Four of our cells border on one of the larger.
void ask_coarser(Mesher& m, int32_t level, const int32_t there[3], const Crossing& c, uint64_t wanted) {
    int32_t parent[3];
    parent_of(there, parent);
    const uint32_t from_u = 4 * uint32_t(there[c.u] & 1), from_v = 4 * uint32_t(there[c.v] & 1);
    uint64_t larger = 0;
    for_wanted(wanted, [&](uint32_t i, uint32_t j) { larger |= uint64_t(1) << (from_u + i / 2 + 8 * (from_v + j / 2)); });
    ask_same(m, level + 1, parent, c, larger);
}

/// One of our cells borders on four of the smaller, and the face on four tiles of theirs.
void ask_finer(Mesher& m, int32_t level, const int32_t there[3], const Crossing& c, uint64_t wanted) {
    for (uint32_t k = 0; k < 4; ++k) {
        int32_t child[3] = {2 * there[0], 2 * there[1], 2 * there[2]};
        child[c.axis] += !c.up, child[c.u] += int32_t(k & 1), child[c.v] += int32_t(k >> 1);
        uint64_t smaller = 0;
        for_wanted(wanted, [&](uint32_t i, uint32_t j) {
            if (i / 4 == (k & 1) && j / 4 == k >> 1) smaller |= uint64_t(0x303) << (2 * (i % 4) + 16 * (j % 4));
        });
        if (smaller) ask_same(m, level - 1, child, c, smaller);
    }
}

/// Hands the cells wanted beyond each face to the neighbours; makes them where they are missing.
void exchange(Mesher& m, uint32_t index) {
    for (uint32_t face = 0; face < 6; ++face) {
        const uint64_t wanted = m.tiles[index].cross[face];
        if (!wanted) continue;
        const uint32_t axis = face / 2;
        const Crossing crossing{axis, axis == 0 ? 1u : 0u, axis == 2 ? 1u : 2u, bool(face & 1)};
        int32_t side[3] = {}, there[3];
        side[axis] = crossing.up ? 1 : -1;
        for (int a = 0; a < 3; ++a) there[a] = m.tiles[index].coord[a] + side[a];
        const Beside kind = m.tiles[index].at_place(place_of(side[0], side[1], side[2]));
        const auto ask = kind == beside_same ? ask_same : kind == beside_coarser ? ask_coarser : ask_finer;
        ask(m, m.tiles[index].level, there, crossing, wanted);
    }
}

/// The queued tiles of the next colour make up the coming round.
void take_colour(Mesher& m) {
    const uint32_t queued = m.next_active_count;
    m.colour ^= 1;
    m.active_count = m.next_active_count = 0;
    for (uint32_t i = 0; i < queued; ++i) {
        const uint32_t index = m.next_active[i];
        Tile& tile = m.tiles[index];
        if (uint32_t(tile.coord[0] ^ tile.coord[1] ^ tile.coord[2]) % 2 == m.colour) {
            m.active[m.active_count++] = index;
            tile.queued = false;
        } else {
            m.next_active[m.next_active_count++] = index;
        }
    }
}

}  // namespace

uint32_t prepare_march(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    if (!usable(m.input)) return 0;
    if (m.seeding) {
        m.seeding = false;
        m.uncut = *m.input.field, m.uncut.container = surface::everywhere;
        for (uint32_t w = 0; w < m.limits.workers; ++w) m.scratch[w].field = m.uncut;
        change_drops(m);
        plant_seeds(m);
    } else {
        for (uint32_t i = 0; i < m.active_count; ++i) exchange(m, m.active[i]);
    }
    take_colour(m);
    if (m.active_count == 0 && m.next_active_count) take_colour(m);
    return tasks_of(m.active_count, tiles_per_march_task);
}

void run_march(void* mesher, uint32_t task, uint32_t worker) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    MesherScratch& s = m.scratch[worker];
    for_tiles(task, tiles_per_march_task, m.active_count, [&](uint32_t i) {
        Tile& tile = m.tiles[m.active[i]];
        std::memset(tile.cross, 0, sizeof(tile.cross));
        list_candidates(m, s, tile);
        if (!tile.seeded) draw_discs(m, s, tile);
        tile.seeded = true;
        borrow_corners(m, tile);
        while (has_pending(tile)) {
            evaluate_corners(m, s, tile);
            visit(tile);
        }
        if (tile.beside & every_finer) turn_border_faces(tile);
    });
}

}  // namespace rill
