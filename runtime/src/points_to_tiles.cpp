// SPDX-License-Identifier: MIT
// Which tiles the march begins in: those that the points' own discs cross, and of drops a few. Tasks look at the points; the tiles are
// made by one thread, in the order of the points, so that their numbers never depend on scheduling. (All of it by one thread took
// 2 % of a frame, as much as all else that does.)
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

constexpr float disc_share = 0.3f;  // of a patch's support: discs of neighbours nearly touch; the march fills in
constexpr int most_seed_tiles = 4;  // either way from a point; the march does the rest

/// Points at a wall may stand a little beyond it: the surface is this side, a quarter of a cell and more.
float in_container(const surface::Field& f, int axis, float place, float cell) {
    const float lower = f.container.lower[axis] + 0.25f * cell, upper = f.container.upper[axis] - 0.25f * cell;
    return std::max(lower, std::min(place, upper));
}

/// The disc of a point, and the leaf that the point is in.
struct SeedDisc {
    const float *p, *n;
    int32_t level, home[3];
};
/// Found(level, coord) for the leaves in and round a box that the disc may cross.
template <typename Found>
void seed_box(const Mesher& m, const SeedDisc& disc, int32_t level, const int32_t c[3], Found&& found) {
    const Levels& levels = m.input.levels;
    const float size = tile_cells * levels.cell(level);
    float height = 0, reach = 0;
    for (int a = 0; a < 3; ++a) {
        height += disc.n[a] * ((float(c[a]) + 0.5f) * size - disc.p[a]);
        reach += 0.5f * size * std::abs(disc.n[a]);
    }
    const bool is_home = level == disc.level && std::equal(c, c + 3, disc.home);
    if (std::abs(height) > reach && !is_home) return;
    if (levels.divided(level, c)) {
        for (int k = 0; k < 8; ++k) {
            const int32_t child[3] = {2 * c[0] + (k & 1), 2 * c[1] + (k >> 1 & 1), 2 * c[2] + (k >> 2)};
            seed_box(m, disc, level - 1, child, found);
        }
        return;
    }
    int32_t box[3] = {c[0], c[1], c[2]}, above[3];
    for (; level < levels.coarsest(); ++level) {
        parent_of(box, above);
        if (levels.divided(level + 1, above)) break;
        std::copy(above, above + 3, box);
    }
    found(level, box);
}
template <typename Found>
void seed_point(const Mesher& m, uint32_t i, Found&& found) {
    const surface::Field& f = *m.input.field;
    const float n[3] = {f.nx[i], f.ny[i], f.nz[i]};
    float p[3] = {f.x[i], f.y[i], f.z[i]};
    for (int a = 0; a < 3; ++a) p[a] = in_container(f, a, p[a], m.input.levels.cell_size);
    SeedDisc disc{p, n, 0, {}};
    if (!leaf_at(m, p, disc.level, disc.home)) return;
    const float radius = disc_share * f.support[i], inverse = 1 / (tile_cells * m.input.levels.cell(disc.level));
    int32_t from[3], to[3];
    for (int a = 0; a < 3; ++a) {
        const float extent = radius * std::sqrt(std::max(0.f, 1 - n[a] * n[a])) * inverse, at = p[a] * inverse;
        from[a] = disc.home[a] + int32_t(std::max(std::floor(at - extent) - std::floor(at), -float(most_seed_tiles)));
        to[a] = disc.home[a] + int32_t(std::min(std::floor(at + extent) - std::floor(at), float(most_seed_tiles)));
    }
    int32_t c[3];
    for (c[2] = from[2]; c[2] <= to[2]; ++c[2])
        for (c[1] = from[1]; c[1] <= to[1]; ++c[1])
            for (c[0] = from[0]; c[0] <= to[0]; ++c[0]) seed_box(m, disc, disc.level, c, found);
}

uint32_t last_point(const Mesher& m, uint32_t task) { return std::min((task + 1) * m.seed_points, m.input.field->point_count); }
SeedTile* seeds_of(const Mesher& m, uint32_t task) { return m.seeds + size_t(task) * m.seed_room; }

/// Makes the tiles that a task found, in the order in which it would have come to them.
void make_seed_tiles(Mesher& m, uint32_t task) {
    const auto make = [&](int32_t level, const int32_t coord[3]) {
        const uint32_t tile = find_or_create_tile(m, level, coord);
        if (tile != no_tile) queue_tile(m, tile);
    };
    const SeedList& list = m.seed_lists[task];
    const SeedTile* found = seeds_of(m, task);
    for (uint32_t k = 0; k < list.count; ++k) make(found[k].level, found[k].coord);
    for (uint32_t i = list.next_point; i < last_point(m, task); ++i) seed_point(m, i, make);  // those that it had no room for
}

/// The cells where the six half axes leave the ellipsoid; it is convex, so the march finds the rest.
void seed_drop(Mesher& m, uint32_t i) {
    const surface::Field& f = *m.input.field;
    constexpr int row[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    for (int a = 0; a < 6; ++a) {
        float p[3] = {f.dx[i], f.dy[i], f.dz[i]}, length2 = 0;
        for (int k : row[a / 2]) length2 += f.inverse[k][i] * f.inverse[k][i];
        if (!(length2 > 0)) continue;
        p[a / 2] += (a & 1 ? 1.f : -1.f) / std::sqrt(length2);
        int32_t level, tile_coord[3];
        if (!leaf_at(m, p, level, tile_coord)) continue;
        int cell[3];
        for (int b = 0; b < 3; ++b) {
            cell[b] = int32_t(std::floor(p[b] / m.input.levels.cell(level))) - tile_cells * tile_coord[b];
            cell[b] = std::clamp(cell[b], 0, tile_cells - 1);
        }
        const uint32_t index = find_or_create_tile(m, level, tile_coord);
        if (index == no_tile) continue;
        Tile& tile = m.tiles[index];
        const int row = cell[1] + 8 * cell[2];
        tile.pending[row] |= uint8_t(1 << cell[0] & ~tile.visited[row]);
        queue_tile(m, index);
    }
}

}  // namespace

uint32_t prepare_seeds(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    const uint32_t points = usable(m.input) ? m.input.field->point_count : 0;
    m.seed_points = std::max(256u, tasks_of(points, most_seed_tasks));
    m.seed_tasks = tasks_of(points, m.seed_points);
    m.seed_room = m.seed_tasks ? most_seeds(m.limits) / m.seed_tasks : 0;
    return m.seed_tasks;
}

void run_seeds(void* mesher, uint32_t task, uint32_t) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    SeedTile* const list = seeds_of(m, task);
    uint32_t count = 0, point = task * m.seed_points, before = 0;
    bool full = false;
    // Points next to each other touch the same tiles.
    constexpr uint32_t remembered = 8;
    const auto add = [&](int32_t level, const int32_t coord[3]) {
        const SeedTile tile{level, {coord[0], coord[1], coord[2]}};
        for (uint32_t k = count > remembered ? count - remembered : 0; k < count; ++k)
            if (std::memcmp(&list[k], &tile, sizeof(tile)) == 0) return;
        full = full || count == m.seed_room;
        if (!full) list[count++] = tile;
    };
    for (; point < last_point(m, task) && !full; point += !full) {
        before = count;
        seed_point(m, point, add);
    }
    m.seed_lists[task] = {full ? before : count, point};
}

void plant_seeds(Mesher& m) noexcept {
    for (uint32_t task = 0; task < m.seed_tasks; ++task) make_seed_tiles(m, task);
    for (uint32_t i = 0; i < m.input.field->drop_count; ++i)
        if (i >= m.drop_count || m.drops[i].in_cells) seed_drop(m, i);
}

void draw_discs(const Mesher& m, MesherScratch& s, Tile& tile) noexcept {
    const surface::Field& f = *m.input.field;
    const float cells = 1 / tile.cell;
    uint8_t rows[rows_per_tile] = {};
    for (uint32_t c = 0; c < std::min(s.candidate_count, s.most_candidates); ++c) {
        const uint32_t i = s.candidates[c];
        if (i >= f.point_count) break;  // drops come last
        const float place[3] = {in_container(f, 0, f.x[i], tile.cell), in_container(f, 1, f.y[i], tile.cell), in_container(f, 2, f.z[i], tile.cell)};
        const float normal[3] = {f.nx[i], f.ny[i], f.nz[i]};
        const float radius = disc_share * f.support[i] * cells;
        float at[3];  // in cells of this tile
        bool touches = true, is_home = true;
        for (int a = 0; a < 3; ++a) {
            at[a] = place[a] * cells - float(tile_cells * tile.coord[a]);
            touches = touches && at[a] > -radius && at[a] < tile_cells + radius;
            is_home = is_home && at[a] >= 0 && at[a] < tile_cells;
        }
        if (!touches) continue;
        m.draw(at, normal, radius, rows);
        if (is_home) rows[int(at[1]) + 8 * int(at[2])] |= uint8_t(1 << int(at[0]));
    }
    for (uint32_t row = 0; row < rows_per_tile; ++row) tile.pending[row] |= uint8_t(rows[row] & ~tile.visited[row]);
}

}  // namespace rill
