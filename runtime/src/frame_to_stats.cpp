// SPDX-License-Identifier: MIT
// What a frame did → Stats: what was there, what was held back and why, and how long it took.
#include <algorithm>

#include "pipeline.h"

namespace rill {
namespace {

/// What of this moment is there, by block and by layer.
void count_drawn(const Player& player, Stats& stats) {
    uint64_t drawn[format::max_blocks / 64] = {};
    uint32_t missing_layer = player.plan.detail.layers;
    for (uint32_t i = 0; i < player.plan.now_count; ++i) {
        const uint32_t chunk = player.plan.wants[i].chunk;
        const ChunkState state = player.residency.chunks[chunk].state;
        const format::ChunkRecord& record = player.directory->tables.chunks[chunk];
        if (state == ChunkState::resident) {
            uint64_t& word = drawn[record.block / 64];
            const uint64_t bit = uint64_t(1) << (record.block % 64);
            stats.blocks_drawn += (word & bit) == 0;
            word |= bit;
            continue;
        }
        missing_layer = std::min<uint32_t>(missing_layer, record.layer);
        if (state != ChunkState::rejected) ++stats.chunks_late;
        else stats.cut |= cut_damaged;
    }
    stats.layers_drawn = missing_layer;
    if (stats.chunks_late) stats.cut |= player.residency.no_room ? cut_residency : cut_late;
    if (!player.frame.target) stats.blocks_drawn = stats.layers_drawn = 0;
}

void count_residency(const Player& player, Stats& stats) {
    const Residency& r = player.residency;
    for (uint32_t i = 0; i < r.held_count; ++i)
        stats.chunks_resident += r.chunks[r.held[i]].state == ChunkState::resident;
    stats.chunks_rejected = r.chunks_rejected;
    stats.reads_in_flight = r.slots_out;
    stats.reads_refused = r.reads_refused;
    stats.reads_failed = r.reads_failed;
    stats.bytes_resident = r.heap.used;
    stats.bytes_asked = r.bytes_asked;
    stats.bytes_arrived = r.bytes_arrived;
    stats.windows_decoded = r.windows_decoded;
}

void count_output(Player& player, Stats& stats) {
    Target* target = player.frame.target;
    if (!target) return;
    const Evaluation& e = player.evaluation;
    const MeshCounts mesh = mesh_counts(player.mesher);
    stats.points_wanted = e.points_wanted;
    stats.points_used = player.field.point_count + player.field.drop_count;
    stats.vertices_wanted = mesh.vertices_wanted;
    stats.indices_wanted = mesh.indices_wanted;
    stats.ranges_wanted = mesh.ranges_wanted;
    stats.cut |= mesh.cut | (e.cut ? uint32_t(cut_points) : 0u);
    const bool points = target->point_position.data || target->point_normal.data;
    target->points_used = points ? std::min(e.points.count, target->point_capacity) : 0;
    if (points && target->points_used < e.points.count) stats.cut |= cut_points;
}

void count_time(Player& player, Stats& stats) {
    if (!player.frame.budget.microseconds) return;
    stats.plan_us = player.plan_us;
    stats.wait_us = player.wait_us;
    stats.decode_us = uint32_t(player.decode_done.us - player.decode_begun.us);
    if (player.frame.target) {
        stats.field_us = uint32_t(player.mesh_begun.us - player.decode_done.us);
        stats.mesh_us = uint32_t(player.mesh_done.us - player.mesh_begun.us);
    }
    if (player.pace.octaves > 0) stats.cut |= cut_time;
}

/// Of what is drawn, with all that was given up.
void count_detail(const Player& player, Stats& stats) {
    Levels levels = player.plan.levels_drawn;
    if (player.frame.target) levels.coarsen(mesh_counts(player.mesher).octaves);
    stats.cell_size = smallest_cell(*player.directory, player.plan, levels);
    stats.pixel_error = stats.cell_size * player.plan.detail.pixels_per_metre;
}

}  // namespace

Stats count_all(Player& player) noexcept {
    Stats stats{};
    stats.blocks_in_view = player.plan.blocks_in_view;
    stats.layers_wanted = player.plan.detail.layers;
    count_detail(player, stats);
    count_drawn(player, stats);
    count_residency(player, stats);
    count_output(player, stats);
    count_time(player, stats);
    learn_pace(player, mesh_counts(player.mesher), player.residency.decode_bytes);
    return stats;
}

}  // namespace rill
