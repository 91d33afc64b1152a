// SPDX-License-Identifier: MIT
// Where small cells meet larger ones, both must see the same signs, or the surface tears. The large ones rule: a
// corner that they do not have takes the mean of the corners of theirs that it lies between. So a border edge
// of a large cell changes sign in exactly one of its halves or not at all, its face shows the small cells the
// pattern that it shows the large one, and every cell keeps its plain pattern of eight signs (cell_patches.h).
//
// Two diagonal corners of a large face in the liquid may be joined across its middle or not. It is chosen so that none
// of the four small faces is ambiguous itself: else both cells might have both its segments on one patch, and the
// edge between their vertices would be used four times.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "mesher.h"

namespace rill {
namespace {

struct Corner {
    int at[3];
    uint32_t row() const { return uint32_t(at[1] + 9 * at[2]); }
    bool in(const uint16_t mask[81]) const { return mask[row()] >> at[0] & 1; }
    void put(uint16_t mask[81]) const { mask[row()] |= uint16_t(1 << at[0]); }
};

/// Visits the corners set in both masks.
template <typename Work>
void for_corners(const uint16_t a[81], const uint16_t b[81], Work work) {
    for (int row = 0; row < 81; ++row)
        for (int x = 0, bits = a[row] & b[row]; bits; ++x, bits >>= 1)
            if (bits & 1) work(Corner{{x, row % 9, row / 9}});
}

/// The 2 or 4 corners that a hanging one lies between, in turn round the face.
int parents_of(const Corner& c, Corner parents[4]) {
    int odd_axes[3], axes = 0;
    for (int a = 0; a < 3; ++a)
        if (c.at[a] & 1) odd_axes[axes++] = a;
    constexpr int u[4] = {-1, 1, 1, -1}, v[4] = {-1, -1, 1, 1};
    const int count = axes == 2 ? 4 : 2;
    for (int k = 0; k < count; ++k) {
        parents[k] = c;
        parents[k].at[odd_axes[0]] += u[k];
        if (axes == 2) parents[k].at[odd_axes[1]] += v[k];
    }
    return count;
}

bool is_ambiguous(const float v[4]) {
    return (v[0] < 0) == (v[2] < 0) && (v[1] < 0) == (v[3] < 0) && (v[0] < 0) != (v[1] < 0);
}
/// Of an ambiguous face, corners in turn: liquid in the middle, if an air corner has liquid at both edges' middles.
/// (Then no liquid corner has air at both: the two edges meet every liquid corner.)
bool is_joined(const float v[4]) {
    for (int k = 0; k < 4; ++k)
        if (!(v[k] < 0) && v[k] + v[(k + 1) & 3] < 0 && v[k] + v[(k + 3) & 3] < 0) return true;
    return false;
}

void mark_edge(int axis, int side_u, int side_v, uint16_t hanging[81]) {
    for (int along = 1; along < tile_corners; along += 2) {
        Corner c;
        c.at[axis] = along;
        c.at[(axis + 1) % 3] = side_u > 0 ? tile_cells : 0;
        c.at[(axis + 2) % 3] = side_v > 0 ? tile_cells : 0;
        c.put(hanging);
    }
}

}  // namespace

void find_hanging(const Tile& tile, uint16_t hanging[81]) noexcept {
    std::memset(hanging, 0, 81 * sizeof(uint16_t));
    const auto coarser = [&](int a, int da, int b, int db) {
        int d[3] = {};
        d[a] = da;
        if (db) d[b] = db;
        return tile.at_place(place_of(d[0], d[1], d[2])) == beside_coarser;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (int side = -1; side <= 1; side += 2) {
            if (coarser(axis, side, 0, 0))
                for (int i = 0; i < tile_corners; ++i)
                    for (int j = 0; j < tile_corners; ++j) {
                        Corner c;
                        c.at[axis] = side > 0 ? tile_cells : 0, c.at[u] = i, c.at[v] = j;
                        if ((i | j) & 1) c.put(hanging);
                    }
            for (int other = -1; other <= 1; other += 2)
                if (coarser(u, side, v, other)) mark_edge(axis, side, other, hanging);
        }
    }
}

void need_parents(const uint16_t hanging[81], uint16_t need[81]) noexcept {
    uint16_t more[81] = {};
    for_corners(hanging, need, [&](const Corner& c) {
        Corner parents[4];
        for (int k = parents_of(c, parents); k-- > 0;) parents[k].put(more);
    });
    for (int row = 0; row < 81; ++row) need[row] |= more[row];
}

void settle_hanging(Tile& tile, const uint16_t hanging[81], const uint16_t need[81]) noexcept {
    for_corners(hanging, need, [&](const Corner& c) {
        Corner parents[4];
        const int count = parents_of(c, parents);
        float v[4], sum = 0;
        for (int k = 0; k < count; ++k) {
            v[k] = tile.value[size_t(parents[k].at[0]) + 9 * parents[k].row()];
            sum += v[k];
        }
        if (count == 4 && is_ambiguous(v)) {
            float size = 0;
            for (const float x : v) size += std::abs(x);
            sum = is_joined(v) ? -std::max(std::abs(sum), 1e-6f * size) : std::abs(sum);
        }
        const float mean = sum / float(count);
        const bool inside = sum < 0;
        tile.value[size_t(c.at[0]) + 9 * c.row()] = (mean < 0) == inside ? mean : sum;
        const uint16_t bit = uint16_t(1 << c.at[0]);
        tile.known[c.row()] |= bit;
        tile.inside[c.row()] = uint16_t((tile.inside[c.row()] & ~bit) | (inside ? bit : 0));
    });
}

void turn_border_faces(Tile& tile) noexcept {
    std::memset(tile.turned, 0, sizeof(tile.turned));
    for (uint32_t face = 0; face < 6; ++face) {
        const uint32_t axis = face / 2, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
        int side[3] = {};
        side[axis] = face & 1 ? 1 : -1;
        if (tile.at_place(place_of(side[0], side[1], side[2])) != beside_finer) continue;
        const patches_detail::Face corners = patches_detail::face_of(face);
        for (uint32_t k = 0; k < 64; ++k) {
            uint32_t at[3];
            at[axis] = face & 1 ? tile_cells - 1 : 0, at[u] = k % 8, at[v] = k / 8;
            if (!(tile.surface[at[1] + 8 * at[2]] >> at[0] & 1)) continue;
            float value[4];
            for (int c = 0; c < 4; ++c) {
                const uint32_t corner = corners.corner[c];
                value[c] = tile.value[at[0] + (corner & 1) + 9 * (at[1] + (corner >> 1 & 1) + 9 * (at[2] + (corner >> 2)))];
            }
            if (is_ambiguous(value) && is_joined(value)) tile.turned[face] |= uint64_t(1) << k;
        }
    }
}

}  // namespace rill
