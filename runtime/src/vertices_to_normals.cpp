// SPDX-License-Identifier: MIT
// Vertices → normals. The gradients of the field, at a vertex and round it, tell how the liquid bends over some edges of the
// source; triangles tell what is cut off at crests and rims, and sources of the same cells cut that off alike. Both together are
// nearer to the source's normals than either. Mean angles in degrees, four to eight frames each of a tank and a pour cooked to 0.25e, and
// of both at 0.12e:
//   the gradient alone                                          3.41  4.19  2.34  2.78
//   half of it, half the triangles'                             3.32  3.98  2.32  2.62
//   and the gradients of the vertices round it, too             3.27  3.92  2.28  2.57
//   the same, but vertices on walls and bevels keep theirs      3.23  3.90  2.24  2.56   (kept, with .4: 3.21 3.90 2.22 2.55)
//   the triangles' alone                                        3.47  4.06  2.51  2.77
//   half by differences of opposite neighbours, not triangles   3.34  4.09  2.30  2.68
// Not only cells of the source's size would gain, but larger ones must turn into each other without a jump, and the gradient
// does not depend on where cells lie: so only the smallest cells do this, and ever less where they turn into larger ones.
#include <array>
#include <cmath>

#include "mesher.h"
#include "vector.h"

namespace rill {
namespace {

constexpr float triangles_share = 0.4f;

/// What stands round the vertex of a patch: a vertex beyond each face that the patch crosses, and for each edge that it crosses a
/// triangle, of the vertex and of those beyond the edge's two faces.
struct Ring {
    uint8_t faces = 0;                   ///< bits
    uint8_t triangles = 0;
    uint8_t edge[6] = {};                ///< by face: an edge of the cell beyond it that the patch crosses
    uint8_t first[12] = {}, second[12] = {};  ///< faces of a triangle, counter-clockwise seen from the air
};
constexpr Ring ring_of(uint32_t signs, const CellPatches& patches, uint32_t patch) {
    Ring ring;
    for (uint32_t e = 0; e < 12; ++e) {
        if (!(patches.crossed >> e & 1) || patches.patch[e] != patch) continue;
        const uint32_t axis = e / 4, u = 2 * ((axis + 1) % 3) + (e & 1), v = 2 * ((axis + 2) % 3) + (e >> 1 & 1);
        ring.faces = uint8_t(ring.faces | 1u << u | 1u << v);
        ring.edge[u] = uint8_t(e ^ 1), ring.edge[v] = uint8_t(e ^ 2);
        const bool liquid_below = signs >> patches_detail::edge_corner(e) & 1, same_side = (e & 1) == (e >> 1 & 1);
        ring.first[ring.triangles] = uint8_t(same_side == liquid_below ? u : v);
        ring.second[ring.triangles++] = uint8_t(same_side == liquid_below ? v : u);
    }
    return ring;
}
/// By corner signs: of the first patch, mostly the only one.
constexpr std::array<Ring, 256> first_rings() {
    std::array<Ring, 256> rings{};
    for (uint32_t signs = 0; signs < 256; ++signs) rings[signs] = ring_of(signs, cell_patches[signs], 0);
    return rings;
}
constexpr std::array<Ring, 256> rings = first_rings();

struct TileNormals {
    const Mesher& m;
    const Tile& tile;
    const Tile* beyond[6];  ///< its faces; null: nothing of that size

    TileNormals(const Mesher& mesher, const Tile& of) : m(mesher), tile(of) {
        for (uint32_t face = 0; face < 6; ++face) {
            const uint32_t index = find_beyond(m, tile, face);
            beyond[face] = index != no_tile && m.tiles[index].rank < m.kept ? &m.tiles[index] : nullptr;
        }
    }

    /// The vertex beyond a face of a cell, on the patch of an edge of the cell there; `self` where there is none.
    uint32_t vertex_beyond(uint32_t cell, uint32_t face, uint32_t edge, uint32_t self) const {
        const uint32_t shift = 3 * (face / 2), step = 1u << shift;
        const Tile* there = &tile;
        uint32_t other = face & 1 ? cell + step : cell - step;
        if ((cell >> shift & 7) == (face & 1 ? 7u : 0u)) {
            there = beyond[face];
            other = face & 1 ? cell - 7 * step : cell + 7 * step;
            if (!there || !(there->surface[other / 8] >> other % 8 & 1)) return self;
        }
        return there->first_vertex + there->placed.vertex[other] + patch_of(there->placed.pattern[other], edge);
    }

    /// The normal of a vertex, `own` by the field, leant towards that of what stands round it.
    Vector lean(const Vector& own, const Ring& ring, uint32_t cell, uint32_t self) const {
        constexpr float part[7] = {0, 1, 1 / 2.f, 1 / 3.f, 1 / 4.f, 1 / 5.f, 1 / 6.f};
        const Vector here = load(m.position + 3 * size_t(self));
        Vector to[6], around{};
        uint32_t count = 0;
        for_bits(ring.faces, [&](uint32_t face) {
            const size_t other = 3 * size_t(vertex_beyond(cell, face, ring.edge[face], self));
            to[face] = load(m.position + other) - here, around = around + load(m.normal + other), ++count;
        });
        Vector area{};
        for (uint32_t k = 0; k < ring.triangles; ++k) area = area + cross(to[ring.first[k]], to[ring.second[k]]);
        const float area2 = dot(area, area), leant = still_here(here), share = triangles_share * leant;
        if (!(area2 > 0)) return own;
        const Vector gradient = (1 - 0.5f * leant) * own + 0.5f * leant * part[count] * around;
        const Vector sum = (1 - share) * gradient + share / std::sqrt(area2) * area;
        const float length2 = dot(sum, sum);
        return length2 > 1e-4f ? 1 / std::sqrt(length2) * sum : own;
    }

    /// How much of what is drawn at a place is not that of larger cells.
    float still_here(const Vector& place) const {
        const float at[3] = {place.x, place.y, place.z};
        return m.input.levels.eye_count ? 1 - m.input.levels.morph(tile.level, at) : 1;
    }

    void write(const Ring& ring, uint32_t cell, uint32_t self) const {
        Vector normal = load(m.normal + 3 * size_t(self));
        if (tile.level == 0 && m.of_field[self]) normal = lean(normal, ring, cell, self);
        write3(m.input.target->normal, self, {normal.x, normal.y, normal.z});
    }

    void write_cell(uint32_t cell) const {
        const uint32_t first = tile.first_vertex + tile.placed.vertex[cell];
        const CellPattern pattern = tile.placed.pattern[cell];
        if (!pattern.turned() && cell_patches[pattern.signs()].count == 1) {
            write(rings[pattern.signs()], cell, first);
            return;
        }
        const CellPatches patches = patches_of(pattern);
        for (uint32_t p = 0; p < patches.count; ++p) write(ring_of(pattern.signs(), patches, p), cell, first + p);
    }
};

}  // namespace

uint32_t prepare_normals(void* mesher) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    return m.input.target && m.input.target->normal.data ? tasks_of(m.kept, tiles_per_quick_task) : 0;
}

void run_normals(void* mesher, uint32_t task, uint32_t) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, tiles_per_quick_task, m.kept, [&](uint32_t i) {
        const Tile& tile = m.tiles[m.order[i].tile];
        const TileNormals normals(m, tile);
        for (uint32_t row = 0; row < rows_per_tile; ++row)
            for_bits(tile.surface[row], [&](uint32_t x) { normals.write_cell(x + 8 * row); });
    });
}

}  // namespace rill
