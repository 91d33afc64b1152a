// SPDX-License-Identifier: MIT
// Which size cells have where. Tiles are the leaves of an octree whose boxes are `tile_cells` cells wide:
// a tile of level l has cells of cell_size · 2^l. Whether a box is divided follows from its place alone, so
// nobody stores the tree, and every task finds the same one.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace rill {

inline constexpr uint32_t most_views = 16;
inline constexpr int32_t most_levels = 16;
inline constexpr int tile_cells = 8;
/// A box of level l is divided when some point of it is nearer to an eye than reach · its cells. One that is not,
/// and a divided one of level l − 1 at its side (√3 tiles of that level across), can only exist together while
/// reach / 2 < √3 · tile_cells / 2: from here on tiles that touch differ by one level at most.
inline constexpr float least_reach = 16;

inline float distance_to_box(const float x[3], const float lower[3], const float upper[3]) {
    float squared = 0;
    for (int a = 0; a < 3; ++a) {
        const float d = std::max({lower[a] - x[a], x[a] - upper[a], 0.f});
        squared += d * d;
    }
    return std::sqrt(squared);
}

struct Levels {
    float cell_size;              ///< of level 0, asset space
    uint32_t eye_count;           ///< 0: level 0 everywhere
    float eyes[most_views][3];
    float reach[most_views];      ///< a cell may measure 1 / reach of its distance; least_reach at least

    float cell(int32_t level) const { return cell_size * float(1u << uint32_t(level)); }
    /// What cells may measure in the nearest part of a box, never smaller than those of level 0: drawn are the largest of a
    /// level that fit.
    float cell_at(const float lower[3], const float upper[3]) const {
        float most = eye_count ? 1e15f : cell_size;
        for (uint32_t e = 0; e < eye_count; ++e) most = std::min(most, distance_to_box(eyes[e], lower, upper) / reach[e]);
        return std::max(cell_size, most);
    }
    /// Only for boxes whose parents are divided, or where that is asked first.
    bool divided(int32_t level, const int32_t tile[3]) const {
        if (level == 0) return false;
        const float size = float(tile_cells) * cell(level);
        for (uint32_t e = 0; e < eye_count; ++e) {
            float squared = 0;
            for (int a = 0; a < 3; ++a) {
                const float lower = float(tile[a]) * size, x = eyes[e][a];
                const float d = std::max({lower - x, x - (lower + size), 0.f});
                squared += d * d;
            }
            const float limit = reach[e] * cell(level);
            if (squared < limit * limit) return true;
        }
        return false;
    }
    /// How far what is drawn at a place with cells of this level has turned into what cells twice as large would draw there,
    /// 0 … 1. A box is undivided once its nearest point is reach · its cells away: all in it is 1 by then, and 0
    /// again as part of the larger box, whose farthest point is a diagonal on.
    float morph(int32_t level, const float place[3]) const {
        constexpr float diagonal = 14, begin = 1.7f, end = 2;  // √3 · tile_cells and a bit, in cells; shares of the reach
        static_assert(least_reach + diagonal < end * least_reach);
        float least = level < coarsest() ? 1.f : 0.f;
        for (uint32_t e = 0; e < eye_count && least > 0; ++e) {
            float squared = 0;
            for (int a = 0; a < 3; ++a) squared += (place[a] - eyes[e][a]) * (place[a] - eyes[e][a]);
            const float from = std::max(begin * reach[e], reach[e] + diagonal), to = end * reach[e];
            least = std::min(least, (std::sqrt(squared) / cell(level) - from) / (to - from));
        }
        return std::max(least, 0.f);
    }
    /// Cells 2^octaves times as large, wherever the eyes allow no more by distance: the smallest, too.
    void coarsen(float octaves) {
        float left = octaves;
        for (uint32_t e = 0; e < eye_count; ++e) {
            const float room = std::log2(reach[e] / least_reach), used = std::min(octaves, room);
            reach[e] = std::max(reach[e] * std::exp2(-used), least_reach);
            left = std::min(left, octaves - used);
        }
        cell_size *= std::exp2(std::ceil(left - 0.01f));
    }
    /// The coarsest level there is: the whole world in one tile is of no use.
    int32_t coarsest() const { return eye_count ? most_levels : 0; }
};

/// Tile coordinates one level up; floors, also below zero.
inline void parent_of(const int32_t tile[3], int32_t parent[3]) {
    for (int a = 0; a < 3; ++a) parent[a] = tile[a] >> 1;
}

}  // namespace rill
