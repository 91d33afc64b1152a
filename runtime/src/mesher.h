// SPDX-License-Identifier: MIT
// Inside of the mesher: what its stages share. Tiles of 8³ cells stand in a sparse hash; a tile's task
// writes to its own tile only, and reads of other tiles only what an earlier stage has finished.
#pragma once
#include <cstddef>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "cell_patches.h"
#include "format/bits.h"
#include "surface/field_to_mesh.h"

namespace rill {

inline constexpr int tile_corners = tile_cells + 1;
inline constexpr uint32_t cells_per_tile = 512, corners_per_tile = 729, rows_per_tile = 64;
inline constexpr uint32_t no_tile = ~0u;
inline constexpr int farthest_tile = 1 << 20;  ///< coordinates beyond are not meshed (float runs out there)

/// What lies at one of the 27 places in and round a tile; a tile's neighbours differ by one level at most.
enum Beside : uint32_t { beside_same = 0, beside_coarser = 1, beside_finer = 2 };
inline constexpr uint64_t every_coarser = 0x15555555555555, every_finer = 2 * every_coarser;  ///< of 27 places
constexpr uint32_t place_of(int x, int y, int z) { return uint32_t(x + 1 + 3 * (y + 1) + 9 * (z + 1)); }

/// What is left of a tile's surface cells when its vertices are placed.
struct PlacedCells {
    uint16_t vertex[cells_per_tile];  ///< the first of each, from the tile's first
    CellPattern pattern[cells_per_tile];
};

/// Cells are addressed by row = y + 8 z and bit x, corners by row = y + 9 z and bit x. Corners on a shared
/// face stand in both tiles, with the same bits whoever evaluates them: the field is a pure function of x.
struct Tile {
    static constexpr uint32_t kept_candidates = 96;
    int32_t level, coord[3];
    float cell;                      ///< size of its cells
    uint64_t beside;                 ///< two bits per place
    uint32_t rank;                   ///< its place in the drawing order
    uint32_t vertex_count, index_count;
    uint32_t first_vertex, first_index;
    bool queued;                     ///< in the list of the coming round
    bool seeded;                     ///< discs of the points are drawn into it already
    uint8_t pending[rows_per_tile];  ///< cells to visit
    uint8_t visited[rows_per_tile];
    uint8_t surface[rows_per_tile];  ///< visited, with corners of both signs
    uint64_t cross[6];               ///< cells wanted of the neighbour beyond each face, this round
    uint16_t known[81], inside[81];  ///< corners evaluated; those of negative value
    uint64_t turned[6];              ///< faces on borders with finer tiles, as `cross`: see turn_border_faces()
    uint8_t speck[rows_per_tile];    ///< corners that begin a piece which is noise; the tile's own, as cells
    bool has_specks;
    float lower[3], upper[3];        ///< of its vertices, and of all that its triangles use
    bool keeps_candidates() const { return candidate_count <= kept_candidates; }
    Beside at_place(uint32_t place) const { return Beside(beside >> (2 * place) & 3); }
    union {
        float value[corners_per_tile];  ///< until the vertices are placed
        PlacedCells placed;
    };
    uint32_t candidate_count;
    uint16_t candidates[kept_candidates];  ///< unless there are more, or larger numbers among them: keeps_candidates()
};

/// Faces spanned by corners x and x + 1 of the rows: both signs present.
constexpr uint32_t mixed(uint32_t any, uint32_t all) { return (any | any >> 1) & ~(all & all >> 1) & 0xff; }
/// Cells of a row with corners of both signs.
inline uint8_t surface_cells(const Tile& tile, uint32_t row) {
    const uint16_t* c = tile.inside + row % 8 + 9 * (row / 8);
    return uint8_t(mixed(c[0] | c[1] | c[9] | c[10], c[0] & c[1] & c[9] & c[10]));
}
/// Of a cell, numbered x + 8 (y + 8 z): which of its corners, x + 2 y + 4 z, are inside.
inline uint32_t corner_signs(const Tile& tile, uint32_t cell) {
    const uint32_t x = cell % 8, row = cell / 8 % 8 + 9 * (cell / 64);
    const auto pair = [&](uint32_t r) { return uint32_t(tile.inside[r]) >> x & 3; };
    return pair(row) | pair(row + 1) << 2 | pair(row + 9) << 4 | pair(row + 10) << 6;
}

/// A vertex on its way to the target.
struct Vertex {
    float position[3], normal[3], velocity[3];
    bool of_field;               ///< the normal
};

/// One that has been placed, for its neighbours to look at.
struct PlacedVertex {
    float position[4];           ///< as written to the target
    float normal[4];             ///< of what it lies on; [3]: 1 if that is the field, 0 if it is walls
    bool of_field() const { return normal[3] != 0; }
};

/// Where the target wants it; nowhere if it does not.
inline void write3(const Stream& stream, uint32_t index, const float (&v)[3]) {
    if (stream.data) std::memcpy(static_cast<uint8_t*>(stream.data) + size_t(index) * stream.stride, v, sizeof(v));
}

/// Cells twice as large in the place of a tile's own, towards which its vertices move: see cells_to_parents.cpp.
struct ParentCells {
    static constexpr uint32_t corners = 125, cells = 64;
    Tile tile;                       ///< of these cells; an eighth of it is filled in, where our tile lies in it
    float morph[cells_per_tile];     ///< by its cells: how far what lies in them has moved
    Vertex vertex[4 * cells];        ///< as tile.placed counts them
};

/// Batches of positions on their way through the field; one per worker. Evaluation may reorder a batch, so
/// `slot` travels with each position.
struct MesherScratch {
    static constexpr uint32_t capacity = corners_per_tile, most_candidates = 1024;
    uint32_t candidates[most_candidates], candidate_count;  ///< of the tile; a count beyond most_candidates: no list
    float x[capacity], y[capacity], z[capacity];
    uint16_t slot[capacity];
    float value[capacity], gx[capacity], gy[capacity], gz[capacity], velocity[3 * capacity];
    // Of a vertex: how far it goes against its gradient, over that; 1 / |gradient|; where it ends, and the normal there.
    float step[capacity], scale[capacity], to[3][capacity], normal[3][capacity];
    uint16_t at[capacity];       ///< its cell
    uint8_t of_field[capacity];  ///< as Vertex::of_field
    // By slot, never reordered: the cell of a vertex, and which of its patches.
    uint16_t cell[capacity];
    uint8_t patch[capacity];
    uint16_t meets[capacity];  ///< bits of the walls that its crossings lie in, as format::Header::walls, meets_free, nears_wall, nears_edge
    surface::Field field;      ///< the input's, with the walls alone that the tile is near to
    PlacedCells placed;        ///< of a tile whose corner values are not used up yet
    ParentCells parents;
    uint64_t corners_evaluated;
};

/// The field as the mesher sees it; tests put noise here.
struct FieldAccess {
    uint32_t (*gather)(const surface::Field&, const surface::Box&, uint32_t*, uint32_t) noexcept;
    void (*evaluate)(const surface::Field&, const uint32_t*, uint32_t, const float*, const float*,
                     const float*, uint32_t, float*) noexcept;
    void (*evaluate_at_surface)(const surface::Field&, const uint32_t*, uint32_t, const float*, const float*,
                              const float*, uint32_t, float*, float*, float*, float*, float*, float) noexcept;
};

/// A place in the drawing order: coarse tiles before fine ones, of each level groups of 4³ tiles one after the
/// other, in each its tiles, z y x.
struct OrderedTile {
    uint64_t key;
    uint32_t tile;
    int32_t level;
    static constexpr uint32_t group_shift = 6;  ///< key >> group_shift names the group
};

/// One of the field's drops and bubbles, as it was there before it was changed for this attempt. See small_drops.cpp.
struct SmallDrop {
    uint32_t mesh;           ///< number of the mesh of its own; 0: none
    bool in_cells;           ///< cells draw it
    float cell, growth;      ///< the size of those, metres; by how much it is enlarged for them
    uint32_t first_vertex, first_index;
    float centre[3], inverse[6], radius, reach;
};

/// A leaf that a point's disc may cross.
struct SeedTile {
    int32_t level, coord[3];
};
/// What a task found: so many, of its points before `next_point`; for those from there on there was no room.
struct SeedList {
    uint32_t count, next_point;
};
inline constexpr uint32_t most_seed_tasks = 64;
/// Of all tasks together; neighbours among them find the same tiles.
inline uint32_t most_seeds(const MeshLimits& limits) { return 2 * limits.tiles; }

struct Mesher {
    MeshLimits limits;
    MeshInput input;
    surface::Field uncut;      ///< the input's, without its container
    FieldAccess access;
    void (*draw)(const float centre[3], const float normal[3], float radius, uint8_t rows[rows_per_tile]);  ///< surface::Kernels'
    uint32_t cut;
    uint32_t vertices_wanted, indices_wanted, ranges_wanted;  ///< the most of all attempts
    uint32_t vertices_found;   ///< by this attempt
    float octaves, too_large;  ///< given up; how many too few those were, found by lay_out()
    uint32_t phase;            ///< the next, of those in field_to_mesh.cpp
    void (*run)(void* mesher, uint32_t task, uint32_t worker);  ///< of the tasks that are out

    Tile* tiles;
    uint32_t tile_count;
    bool tiles_ran_out;
    uint32_t* hash;  ///< tile + 1, 0 = empty
    uint32_t hash_mask;
    uint32_t *active, *next_active;  ///< tiles of this round, of the coming one
    uint32_t active_count, next_active_count;
    bool seeding;
    SeedTile* seeds;      ///< `seed_room` per task
    SeedList seed_lists[most_seed_tasks];
    uint32_t seed_tasks, seed_points, seed_room;  ///< points and room: of each task
    uint32_t colour;  ///< of the chequerboard, whose tiles run this round
    OrderedTile* order;
    uint32_t order_count, kept;  ///< tiles with surface; how many of them are drawn
    SmallDrop* drops;            ///< by their number in the field
    uint32_t drop_count, drops_kept;  ///< drops; how many of them are drawn if they have a mesh, after all tiles
    PlacedVertex* vertices;      ///< those of the target
    MesherScratch* scratch;      ///< one per worker
};

/// Tiles a task takes: a tile alone is too little work for an engine's job.
inline constexpr uint32_t tiles_per_march_task = 2, tiles_per_quick_task = 16, drops_per_task = 64;
constexpr uint32_t tasks_of(uint32_t tiles, uint32_t per_task) { return (tiles + per_task - 1) / per_task; }
/// Runs work(tile index in the list) for the tiles of one task.
template <typename Work>
void for_tiles(uint32_t task, uint32_t per_task, uint32_t count, Work work) {
    const uint32_t last = count - task * per_task < per_task ? count : (task + 1) * per_task;
    for (uint32_t i = task * per_task; i < last; ++i) work(i);
}

// tiles.cpp
uint32_t find_tile(const Mesher& m, int32_t level, const int32_t coord[3]) noexcept;
/// The tile beyond a face; no_tile where there is none of the same size.
uint32_t find_beyond(const Mesher& m, const Tile& tile, uint32_t face) noexcept;
/// no_tile when it is out of sight, out of reach, or no room is left. The octree must have a leaf there.
uint32_t find_or_create_tile(Mesher& m, int32_t level, const int32_t coord[3]) noexcept;
/// The leaf that holds a position; false when that is out of reach.
bool leaf_at(const Mesher& m, const float position[3], int32_t& level, int32_t coord[3]) noexcept;
/// Its place along an axis, metres.
inline float corner_at(const Tile& tile, uint32_t axis, int32_t corner) { return float(tile_cells * tile.coord[axis] + corner) * tile.cell; }
/// Of a cube: at least in part.
bool in_sight(const Mesher& m, const float centre[3], float half) noexcept;
/// Puts it into the list of the coming round.
void queue_tile(Mesher& m, uint32_t tile) noexcept;
/// Fills m.order with the tiles that have surface.
void sort_tiles(Mesher& m) noexcept;

// hanging_corners.cpp: what cells of different size agree on
/// Corners on borders with coarser tiles that the coarser do not have, per row as Tile::known.
void find_hanging(const Tile& tile, uint16_t hanging[81]) noexcept;
/// Adds what hanging corners among `need` follow from.
void need_parents(const uint16_t hanging[81], uint16_t need[81]) noexcept;
/// Gives them their values, from their parents'.
void settle_hanging(Tile& tile, const uint16_t hanging[81], const uint16_t need[81]) noexcept;
/// Fills Tile::turned: where the smaller cells join the liquid across an ambiguous face of a larger one.
void turn_border_faces(Tile& tile) noexcept;

// points_to_tiles.cpp: where the march begins
inline bool usable(const MeshInput& input) { return input.field && input.levels.cell_size > 0 && input.levels.cell_size < 1e12f; }
uint32_t prepare_seeds(void* mesher);
void run_seeds(void* mesher, uint32_t task, uint32_t worker);
/// One thread, once those are found: makes the tiles and queues them.
void plant_seeds(Mesher& m) noexcept;
/// Marks the cells of a tile that the discs of its points, the worker's candidates, cross. A guess is enough: the march finds what is
/// missed.
void draw_discs(const Mesher& m, MesherScratch& s, Tile& tile) noexcept;

// march.cpp: field → surface cells
uint32_t prepare_march(void* mesher);
void run_march(void* mesher, uint32_t task, uint32_t worker);

// small_drops.cpp: drops that cells are too coarse for
/// |S⁻¹ r|: below 1 in the drop. `inverse`: S⁻¹ as xx yy zz xy xz yz.
inline float length_of(const float (&inverse)[6], const float (&r)[3]) {
    const float x = inverse[0] * r[0] + inverse[3] * r[1] + inverse[4] * r[2], y = inverse[3] * r[0] + inverse[1] * r[1] + inverse[5] * r[2],
                z = inverse[4] * r[0] + inverse[5] * r[1] + inverse[2] * r[2];
    return std::sqrt(x * x + y * y + z * z);
}
uint32_t prepare_judge_drops(void* mesher);
void run_judge_drops(void* mesher, uint32_t task, uint32_t worker);
/// What was judged comes true in the field: cells see none that have meshes of their own, and show all others.
void change_drops(Mesher& m) noexcept;
/// The field has them again as it had them.
void give_back_drops(Mesher& m) noexcept;
uint32_t vertices_of(const SmallDrop& drop) noexcept;
uint32_t indices_of(const SmallDrop& drop) noexcept;
/// Widens the range's bounds by it.
void cover(const SmallDrop& drop, Range& range) noexcept;
uint32_t prepare_small_drops(void* mesher);
void run_small_drops(void* mesher, uint32_t task, uint32_t worker);

// drop_specks.cpp
uint32_t prepare_find_specks(void* mesher);
void run_find_specks(void* mesher, uint32_t task, uint32_t worker);
uint32_t prepare_turn_specks(void* mesher);

// cells_to_parents.cpp: vertices on their way to where larger cells would have them
/// Fills s.parents.tile with what lies there by the corners it shares with the tile; false: nothing of it moves yet.
bool find_parents(const Mesher& m, MesherScratch& s, const Tile& tile) noexcept;
/// s.parents is placed: parents that no corner of theirs tells of the surface take the vertices of others in the tile.
void adopt_orphans(MesherScratch& s, const Tile& tile) noexcept;
/// Moves a vertex of a cell of the tile towards that of its parent.
void move_to_parent(const MesherScratch& s, const Tile& tile, uint32_t cell, Vertex& vertex) noexcept;

// cells_to_vertices.cpp
uint32_t prepare_counts(void* mesher);
void run_counts(void* mesher, uint32_t task, uint32_t worker);
uint32_t prepare_vertices(void* mesher);
void run_vertices(void* mesher, uint32_t task, uint32_t worker);

// vertices_at_walls.cpp: vertices whose cells walls come near to
/// Where a cell's edges are crossed, as a share of each from its lower end; 0 for edges that are not.
struct CellCrossings {
    float share[12];
};
/// Of what the crossings of a patch lie in: a surface that is no wall. Of what its cell is near to: a wall; two of them.
inline constexpr uint32_t meets_free = 1u << 6, nears_wall = 1u << 7, nears_edge = 1u << 8;
/// The walls that come near to a tile.
struct NearWalls {
    uint32_t sides, sharp;     ///< bits; of those, the sharp ones
    float reach, place[6];     ///< as near as that; where they are. In cells
};
NearWalls walls_near(const Mesher& m, const Tile& tile) noexcept;
/// Where the vertex of a patch begins that a sharp wall cuts: the mean of its crossings that lie in no wall, in cells from the lower corner.
/// That of all lies inside the liquid, where the field has no slope to tell the rim from. False where there are none.
bool start_at_sharp_rim(const NearWalls& walls, const CellPatches& patches, uint32_t patch, const CellCrossings& crossings, const float (&corner)[3],
                        float (&start)[3]) noexcept;
/// What a patch of a cell meets and is near to, of those. `corner`: of the cell, in cells.
uint32_t walls_met(const NearWalls& walls, const CellPatches& patches, uint32_t patch, const CellCrossings& crossings,
                   const float (&corner)[3]) noexcept;
/// Places a vertex of a batch, evaluated and with its step not taken, on the field and the walls that it meets: s.to, s.normal and
/// s.of_field. False if it has no normal.
bool step_at_walls(const Mesher& m, MesherScratch& s, const Tile& tile, uint32_t i) noexcept;

// vertices_to_normals.cpp
uint32_t prepare_normals(void* mesher);
void run_normals(void* mesher, uint32_t task, uint32_t worker);

// mixed_edges.cpp
/// A tile with neighbours of another size: counts the indices of its polygons, or writes them (null: only covers).
uint32_t join_mixed(const Mesher& m, Tile& tile, uint32_t* out, bool write) noexcept;

// mesh_to_buffers.cpp
/// How many indices the tile's quads take.
uint32_t count_indices(const Mesher& m, Tile& tile) noexcept;
/// Widens the tile's bounds by a position.
void cover(Tile& tile, const float position[3]) noexcept;
/// Split a quad along 0–2 (else 1–3): along which the surface bends less, for it lies nearer to that, unless only the other keeps both
/// triangles facing one way. `cell`: about how large the quad is.
bool splits_first(const Mesher& m, float cell, const uint32_t index[4]) noexcept;
/// Prefix sums over the order, cut at the capacities. Sets too_large.
void lay_out(Mesher& m) noexcept;
uint32_t prepare_quads(void* mesher);
void run_quads(void* mesher, uint32_t task, uint32_t worker);
uint32_t prepare_ranges(void* mesher);

/// Lists what may matter to any position of the tile, for it and for the worker.
void list_candidates(const Mesher& m, MesherScratch& s, Tile& tile) noexcept;
/// The same for the worker once it has been done for the tile.
void take_candidates(const Mesher& m, MesherScratch& s, const Tile& tile) noexcept;

/// Work(candidates, count, first, n) for positions [first, first + n) of the scratch, whose box is halved until its
/// candidates fit; those of a single position are then cut: still a pure function of it.
template <typename Work>
void halve_until_listed(const Mesher& m, MesherScratch& s, uint32_t first, uint32_t n, Work&& work) {
    if (n == 0) return;
    surface::Box box;
    const float* p[3] = {s.x + first, s.y + first, s.z + first};
    uint32_t widest = 0;
    for (uint32_t a = 0; a < 3; ++a) {
        float lower = p[a][0], upper = p[a][0];
        for (uint32_t i = 1; i < n; ++i) {
            lower = p[a][i] < lower ? p[a][i] : lower;
            upper = p[a][i] > upper ? p[a][i] : upper;
        }
        box.lower[a] = lower, box.upper[a] = upper;
        if (upper - lower > box.upper[widest] - box.lower[widest]) widest = a;
    }
    const uint32_t count = m.access.gather(*m.input.field, box, s.candidates, s.most_candidates);
    const bool fits = count <= s.most_candidates;
    if (fits || n == 1 || !(box.upper[widest] > box.lower[widest])) {
        work(s.candidates, fits ? count : s.most_candidates, first, n);
        return;
    }
    const float middle = 0.5f * (box.lower[widest] + box.upper[widest]);
    uint32_t split = first;
    const auto swap = [](auto& a, auto& b) {
        const auto t = a;
        a = b, b = t;
    };
    for (uint32_t i = first; i < first + n; ++i) {
        if (!(p[widest][i - first] < middle)) continue;
        swap(s.x[i], s.x[split]), swap(s.y[i], s.y[split]), swap(s.z[i], s.z[split]);
        swap(s.slot[i], s.slot[split]), ++split;
    }
    if (split == first || split == first + n) split = first + n / 2;  // rounding left one side empty
    halve_until_listed(m, s, first, split - first, work);
    halve_until_listed(m, s, split, first + n - split, work);
}

/// The same for the first n positions of the scratch, all in the tile that was listed last. Where that list is long, as it is
/// with coarse cells, runs of positions, which lie together, have lists of their own. (96 and 48: cells twice and four times as
/// large take 3 to 10 % less than with one list; 64 and 64 the same, 128 and 64 2 % more.)
template <typename Work>
void with_candidates(const Mesher& m, MesherScratch& s, uint32_t n, Work&& work) {
    constexpr uint32_t long_list = 96, run = 48;
    if (s.candidate_count <= long_list) {
        if (n) work(s.candidates, s.candidate_count, 0, n);
        return;
    }
    for (uint32_t first = 0; first < n; first += run) halve_until_listed(m, s, first, n - first < run ? n - first : run, work);
}

}  // namespace rill
