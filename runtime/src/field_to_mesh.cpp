// SPDX-License-Identifier: MIT
// The mesher's memory and its table of stages. points_to_tiles.cpp and march.cpp find the surface cells, drop_specks.cpp
// clears noise from them, cells_to_vertices.cpp places their vertices, vertices_to_normals.cpp gives these their
// normals, mesh_to_buffers.cpp joins them to triangles in the caller's buffers. small_drops.cpp draws what
// cells are too coarse for.
#include "surface/field_to_mesh.h"

#include <algorithm>
#include <cstring>
#include <new>

#include "mesher.h"
#include "surface/field_kernels.h"

namespace rill {
namespace {

MeshLimits completed(MeshLimits limits) {
    limits.workers = std::max(limits.workers, 1u);
    // Smooth or violent, a surface has about 60 cells in each tile it crosses (measured); droplets fewer.
    if (limits.tiles == 0) limits.tiles = limits.vertices / 32 + 64;
    return limits;
}

uint32_t hash_slots(uint32_t tiles) {
    uint32_t slots = 64;
    while (slots < tiles * uint64_t(2) && slots < 1u << 31) slots *= 2;
    return slots;
}

/// Hands out pieces of one block, 64-byte aligned each; with a null base it only measures.
struct Carver {
    uint8_t* base;
    size_t used = 0;
    template <typename T>
    T* take(size_t count) {
        T* piece = base ? reinterpret_cast<T*>(base + used) : nullptr;
        used += (count * sizeof(T) + 63) & ~size_t(63);
        return piece;
    }
};

size_t carve(void* memory, const MeshLimits& limits, Mesher& m) {
    Carver carver{static_cast<uint8_t*>(memory)};
    carver.take<Mesher>(1);
    m.tiles = carver.take<Tile>(limits.tiles);
    m.hash = carver.take<uint32_t>(hash_slots(limits.tiles));
    m.active = carver.take<uint32_t>(limits.tiles);
    m.next_active = carver.take<uint32_t>(limits.tiles);
    m.seeds = carver.take<SeedTile>(most_seeds(limits));
    m.order = carver.take<OrderedTile>(limits.tiles);
    m.drops = carver.take<SmallDrop>(limits.drops);
    m.vertices = carver.take<PlacedVertex>(limits.vertices);
    m.scratch = carver.take<MesherScratch>(limits.workers);
    return carver.used;
}

}  // namespace

size_t mesher_bytes(const MeshLimits& limits) noexcept {
    Mesher unused;
    return carve(nullptr, completed(limits), unused);
}

Mesher* place_mesher(void* memory, const MeshLimits& limits) noexcept {
    Mesher* m = new (memory) Mesher{};
    m->limits = completed(limits);
    carve(memory, m->limits, *m);
    m->hash_mask = hash_slots(m->limits.tiles) - 1;
    m->access = {surface::gather, surface::evaluate, surface::evaluate_at_surface};
    m->draw = surface::best_kernels().draw;
    return m;
}

namespace {

void start_attempt(Mesher& m) {
    give_back_drops(m);
    m.tile_count = m.order_count = m.kept = m.drops_kept = 0;
    m.active_count = m.next_active_count = m.colour = 0;
    m.tiles_ran_out = false, m.seeding = true;
    m.phase = 0;
    std::memset(m.hash, 0, (size_t(m.hash_mask) + 1) * sizeof(uint32_t));
}

/// False: no more detail may be given up.
bool start_coarser(Mesher& m, float octaves) {
    const float more = std::min(octaves, m.input.most_octaves - m.octaves);
    if (!(more > 0)) return false;
    m.octaves += more;
    m.input.levels.coarsen(more);
    start_attempt(m);
    return true;
}

uint32_t prepare_round(void* mesher) {
    constexpr float octaves_when_late = 1;
    Mesher& m = *static_cast<Mesher*>(mesher);
    if (m.input.late && m.input.late(m.input.user) && start_coarser(m, octaves_when_late)) {
        m.cut |= cut_time;
        return 0;
    }
    return prepare_march(mesher);
}

uint32_t prepare_layout(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    lay_out(m);
    if (m.too_large > 0) start_coarser(m, m.too_large);
    return 0;
}

constexpr Stage phases[] = {
    {prepare_judge_drops, run_judge_drops, false},
    {prepare_seeds, run_seeds, false},
    {prepare_round, run_march, true},
    {prepare_find_specks, run_find_specks, false},
    {prepare_turn_specks, nullptr, false},
    {prepare_counts, run_counts, false},
    {prepare_layout, nullptr, false},
    {prepare_vertices, run_vertices, false},
    {prepare_normals, run_normals, false},
    {prepare_quads, run_quads, false},
    {prepare_small_drops, run_small_drops, false},
    {prepare_ranges, nullptr, false},
};
constexpr uint32_t phase_count = sizeof(phases) / sizeof(phases[0]);

/// Runs what is serial until there are tasks, or all is done. A phase may start the whole anew, with larger cells.
uint32_t prepare_mesh(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    while (m.phase < phase_count) {
        const uint32_t index = m.phase++;
        const uint32_t tasks = phases[index].prepare(mesher);
        if (!tasks || !phases[index].run) continue;
        if (phases[index].repeats) m.phase = index;
        m.run = phases[index].run;
        return tasks;
    }
    return 0;
}

void run_mesh(void* mesher, uint32_t task, uint32_t worker) { static_cast<Mesher*>(mesher)->run(mesher, task, worker); }

}  // namespace

void begin_mesh(Mesher* m, const MeshInput& input) noexcept {
    m->input = input;
    m->drop_count = 0;
    m->cut = m->vertices_wanted = m->indices_wanted = m->ranges_wanted = 0;
    m->octaves = 0;
    for (uint32_t w = 0; w < m->limits.workers; ++w) m->scratch[w].corners_evaluated = 0;
    start_attempt(*m);
}

const Stage* mesh_stages(uint32_t* count) noexcept {
    static constexpr Stage stages[] = {{prepare_mesh, run_mesh, true}};
    *count = 1;
    return stages;
}

MeshCounts mesh_counts(const Mesher* m) noexcept {
    uint64_t corners = 0;
    for (uint32_t w = 0; w < m->limits.workers; ++w) corners += m->scratch[w].corners_evaluated;
    return {m->cut, m->vertices_wanted, m->indices_wanted, m->ranges_wanted,
            uint32_t(std::min<uint64_t>(corners, ~0u)), m->vertices_found, m->octaves};
}

}  // namespace rill
