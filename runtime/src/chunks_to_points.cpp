// SPDX-License-Identifier: MIT
// Resident chunks at a moment → points and drops. Who is alive is counted first, so that tasks may write to
// fixed places. The order of points is that of the pieces, whoever runs them.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "pipeline.h"

namespace rill {
namespace {

void add_pieces(Evaluation& e, uint32_t chunk, uint32_t first, uint32_t last) {
    for (; first < last; first += std::min(piece_tracks, last - first))
        e.pieces[e.piece_count++] = {chunk, first, first + std::min(piece_tracks, last - first), 0, 0};
}

const format::TrackBlock& block_of(const Player& player, const Piece& piece) {
    return *player.residency.chunks[piece.chunk].block;
}

void list_pieces(const Player& player, Evaluation& e) {
    e.piece_count = 0;
    for (uint32_t i = 0; i < player.plan.now_count; ++i) {
        const uint32_t chunk = player.plan.wants[i].chunk;
        if (player.residency.chunks[chunk].state != ChunkState::resident) continue;
        const format::TrackBlock& block = *player.residency.chunks[chunk].block;
        add_pieces(e, chunk, 0, block.point_count);
        add_pieces(e, chunk, block.point_count, block.point_count + block.drop_count);
    }
}

/// Coarse layers get their places first; what no longer fits is left out and reported.
void lay_out_pieces(const Player& player, Evaluation& e) {
    uint32_t left = player.limits.points;
    if (player.frame.budget.points) left = std::min(left, player.frame.budget.points);
    e.points.count = e.drops.count = e.points_wanted = 0;
    e.cut = false;
    for (uint32_t i = 0; i < e.piece_count; ++i) {
        Piece& piece = e.pieces[i];
        const format::TrackBlock& block = block_of(player, piece);
        const bool drops = piece.first >= block.point_count;
        uint32_t& count = drops ? e.drops.count : e.points.count;
        const uint32_t capacity = drops ? e.drop_capacity : e.point_capacity;
        const uint32_t active = count_active(e.rows, block, piece.first, piece.last);
        piece.offset = count;
        piece.room = std::min({active, left, capacity - count});
        e.cut = e.cut || piece.room < active;
        e.points_wanted += active;
        count += piece.room;
        left -= piece.room;
    }
}

uint32_t prepare_evaluate(void* context) {
    auto& player = *static_cast<Player*>(context);
    Evaluation& e = player.evaluation;
    const Moment& moment = player.plan.moment;
    const uint32_t samples = player.directory->tables.windows[moment.window].sample_count;
    e.rows = place_time_rows(e.rows_memory, player.directory->basis, samples, moment.sample, moment.steps, moment.samples_per_second);
    list_pieces(player, e);
    lay_out_pieces(player, e);
    return e.piece_count;
}

format::PointSet slice(const format::PointSet& all, uint32_t offset) {
    return {0,          all.x + offset,  all.y + offset,  all.z + offset,  all.nx + offset, all.ny + offset,
            all.nz + offset, all.vx + offset, all.vy + offset, all.vz + offset, all.activity + offset};
}

format::DropSet slice(const format::DropSet& all, uint32_t offset) {
    format::DropSet part{0, all.x + offset, all.y + offset, all.z + offset, {}, all.vx + offset,
                         all.vy + offset, all.vz + offset, all.activity + offset};
    for (int i = 0; i < 6; ++i) part.shape[i] = all.shape[i] + offset;
    return part;
}

void write_vector(const Stream& stream, uint32_t index, float x, float y, float z) {
    if (!stream.data) return;
    const float vector[3] = {x, y, z};
    std::memcpy(static_cast<uint8_t*>(stream.data) + uint64_t(index) * stream.stride, vector, sizeof vector);  // of any stride
}

/// The points themselves, for those who want to see them.
void hand_out_points(const format::PointSet& points, uint32_t first, uint32_t last, const Target& target) {
    last = std::min(last, target.point_capacity);
    for (uint32_t i = first; i < last; ++i) {
        write_vector(target.point_position, i, points.x[i], points.y[i], points.z[i]);
        write_vector(target.point_normal, i, points.nx[i], points.ny[i], points.nz[i]);
    }
}

/// Fits and fields cost by the point: those so far out of sight that they touch nothing in it are left out.
void cull_points(const Plan& plan, float margin, format::PointSet& points) {
    for (uint32_t i = 0; i < points.count; ++i) {
        const float p[3] = {points.x[i], points.y[i], points.z[i]};
        bool seen = plan.view_count == 0;
        for (uint32_t v = 0; v < plan.view_count && !seen; ++v) seen = touches(plan.views[v], p, p, margin);
        if (!seen) points.activity[i] = 0;
    }
}

float zigzag(float x) { return std::abs(2 * (x - std::floor(x)) - 1); }  // 0 … 1

/// When it is the turn of a place to lose a layer, 0 … 1: smooth, so that a point that moves or goes on in the next window keeps its turn,
/// and other a few points on, so that those whose turn it is have neighbours that are whole.
float turn_at(const float* place, float wave) {
    const float x = place[0] / wave, y = place[1] / wave, z = place[2] / wave;
    const float along = x + 0.75f * y - 0.57f * z, across = 0.57f * x - y + 0.75f * z, up = 0.75f * x + 0.57f * y + z;
    return zigzag(along + zigzag(across) + zigzag(up));
}

/// Before cells are so large that they show nothing of a layer, its points fade, each at its place and in its turn. The worst move of a
/// camera (`rill bench`) changed dam_break, drop_splash and pour_sphere by a p99 of .6, .3 and .5 pixels (files and `fine_enough`, .45, of
/// the time); by 1.4, .5, .9 without turns but in a narrow band; by 8, 8, 1.2 (.61) if all fade together, for half a point among such
/// neighbours is nothing; by 1.7, 1.1, 1.0 (.61) if blocks lose their layers at once.
void fade_layer(const Player& player, uint32_t layer, format::PointSet& points) {
    constexpr float waves_in_cells = 24, at_once = 0.4f;  // about five points; share of the fade that one point takes
    const float limit = layer_limit(*player.directory, layer), begin = layer_fades * limit;
    const float wave = waves_in_cells * player.directory->header.cell_size;
    const Levels& levels = player.plan.levels_drawn;
    for (uint32_t i = 0; i < points.count; ++i) {
        const float place[3] = {points.x[i], points.y[i], points.z[i]}, cell = levels.cell_at(place, place);
        if (cell <= begin) continue;
        const float left = (limit - cell) / (limit - begin);  // of the fade
        points.activity[i] *= std::clamp((left - turn_at(place, wave) * (1 - at_once)) / at_once, 0.f, 1.f);
    }
}

/// Places of tracks that turned out to be no points.
void leave_out(format::PointSet& points, uint32_t room) {
    for (uint32_t i = points.count; i < room; ++i)
        for (float* row : {points.x, points.y, points.z, points.nx, points.ny, points.nz, points.vx, points.vy, points.vz, points.activity}) row[i] = 0;
    points.count = room;
}

void run_evaluate(void* context, uint32_t index, uint32_t) {
    auto& player = *static_cast<Player*>(context);
    Evaluation& e = player.evaluation;
    const Piece& piece = e.pieces[index];
    if (!piece.room) return;
    const format::TrackBlock& block = block_of(player, piece);
    format::PointSet points{};
    format::DropSet drops{};
    if (piece.first >= block.point_count) {
        drops = slice(e.drops, piece.offset);
        evaluate_tracks(e.rows, block, piece.first, piece.last, 0, piece.room, points, drops);
        for (uint32_t i = drops.count; i < piece.room; ++i) drops.activity[i] = 0;
    } else {
        points = slice(e.points, piece.offset);
        evaluate_tracks(e.rows, block, piece.first, piece.last, piece.room, 0, points, drops);
        leave_out(points, piece.room);
        const format::ChunkRecord& record = player.directory->tables.chunks[piece.chunk];
        cull_points(player.plan, (reach_in_spacings + 1) * record.spacing, points);
        if (record.layer > 0) fade_layer(player, record.layer, points);
        hand_out_points(e.points, piece.offset, piece.offset + piece.room, *player.frame.target);
    }
}

}  // namespace

const Stage evaluate_stage = {prepare_evaluate, run_evaluate, false};

}  // namespace rill
