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
// Tried for speed: the vertices in and round a tile written down by place first, for these and the quads, in one stage (a quarter less for
// the normals, all of it lost to writing; what waits is the first look at a neighbour's vertices, whoever it is that looks); first who stands
// round each of a batch, then all of them without a branch (±0 and 3 % of a frame more).
//
// Not only cells of the source's size would gain, but larger ones must turn into each other without a jump, and the gradient
// does not depend on where cells lie: so only the smallest cells do this, and ever less where they turn into larger ones.
#include <array>
#include <cmath>

#include "mesher.h"
#include "vector.h"

namespace rill {
namespace {

constexpr float triangles_share = 0.4f;

/// By corner signs: of the first patch, mostly the only one.
constexpr std::array<Ring, 256> first_rings() {
    std::array<Ring, 256> rings{};
    for (uint32_t signs = 0; signs < 256; ++signs) rings[signs] = ring_of(pattern_of(signs, 0), cell_patches[signs], 0);
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
        Vector at[Ring::most + 1], around{};
        for (uint32_t k = 0; k < ring.count; ++k) {
            const PlacedVertex& other = m.vertices[vertex_beyond(cell, ring.face[k], ring.edge[k], self)];
            at[k] = load(other.position), around = around + load(other.normal);
        }
        at[ring.count] = at[0];
        // The triangles to the vertex add up to any others between those round it: two of them are the product of diagonals.
        Vector area{};
        for (uint32_t k = 1; k + 1 < ring.count; k += 2) area = area + cross(at[k + 1] - at[0], at[k + 2] - at[k]);
        const float area2 = dot(area, area), leant = still_here(self), share = triangles_share * leant;
        if (!(area2 > 0)) return own;
        const Vector gradient = (1 - 0.5f * leant) * own + 0.5f * leant / float(ring.count) * around;
        const Vector sum = (1 - share) * gradient + share / std::sqrt(area2) * area;
        const float length2 = dot(sum, sum);
        return length2 > 1e-4f ? 1 / std::sqrt(length2) * sum : own;
    }

    /// How much of what is drawn at a vertex is not that of larger cells.
    float still_here(uint32_t vertex) const {
        if (!m.input.levels.eye_count) return 1;
        return 1 - m.input.levels.morph(tile.level, m.vertices[vertex].position);
    }

    void write(const Ring& ring, uint32_t cell, uint32_t self) const {
        const PlacedVertex& vertex = m.vertices[self];
        Vector normal = load(vertex.normal);
        if (tile.level == 0 && vertex.of_field()) normal = lean(normal, ring, cell, self);
        write3(m.input.target->normal, self, {normal.at[0], normal.at[1], normal.at[2]});
    }

    void write_cell(uint32_t cell) const {
        const uint32_t first = tile.first_vertex + tile.placed.vertex[cell];
        const CellPattern pattern = tile.placed.pattern[cell];
        if (!pattern.turned() && cell_patches[pattern.signs()].count == 1) {
            write(rings[pattern.signs()], cell, first);
            return;
        }
        const CellPatches patches = patches_of(pattern);
        for (uint32_t p = 0; p < patches.count; ++p) write(ring_of(pattern, patches, p), cell, first + p);
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
