// SPDX-License-Identifier: MIT
// The public API: a table of contents. Arguments are checked here, work is done elsewhere.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <new>
#include <thread>

#include "pipeline.h"

namespace rill {
namespace {

// ---- arguments ------------------------------------------------------------------------------------

bool all_finite(const float* values, size_t count) {
    for (size_t i = 0; i < count; ++i)
        if (!std::isfinite(values[i])) return false;
    return true;
}

/// Rotation (or mirror) times one positive scale: what plane and distance tests rely on.
bool is_similarity(const float* m) {
    float length[3];
    for (int a = 0; a < 3; ++a) {
        length[a] = std::sqrt(m[a] * m[a] + m[4 + a] * m[4 + a] + m[8 + a] * m[8 + a]);
        if (!(length[a] > 1e-12f && length[a] < 1e12f)) return false;
    }
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3;
        const float dot = m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b];
        if (std::abs(dot) > 1e-3f * length[a] * length[b]) return false;
        if (std::abs(length[a] - length[b]) > 1e-3f * length[a]) return false;
    }
    return true;
}

bool are_views(const Frame& frame) {
    if (frame.view_count > most_views || (frame.view_count && !frame.views)) return false;
    if (frame.view_count && !is_similarity(frame.asset_to_world)) return false;
    for (uint32_t v = 0; v < frame.view_count; ++v) {
        const View& view = frame.views[v];
        if (!all_finite(view.planes[0], 24) || !all_finite(view.eye, 3)) return false;
        if (!(view.pixels_per_radian > 0) || !std::isfinite(view.pixels_per_radian)) return false;
    }
    return true;
}

bool is_stream(const Stream& stream) { return !stream.data || stream.stride >= 3 * sizeof(float); }

bool is_target(const Target& target) {
    return is_stream(target.position) && is_stream(target.normal) && is_stream(target.velocity) &&
           is_stream(target.point_position) && is_stream(target.point_normal) &&
           (target.indices || !target.index_capacity) && (target.ranges || !target.range_capacity);
}

bool is_amount(float x) { return x >= 0 && std::isfinite(x); }

bool is_frame(const Frame& frame) {
    return std::isfinite(frame.seconds) && std::isfinite(frame.rate) && all_finite(frame.asset_to_world, 12) &&
           are_views(frame) && is_amount(frame.budget.pixel_error) && is_amount(frame.budget.cell_size) &&
           (!frame.target || is_target(*frame.target));
}

bool is_host(const Host& host) {
    const bool jobs = !host.jobs.submit || (host.jobs.help && host.jobs.workers > 0);
    return host.memory.allocate && host.memory.release && jobs;
}

// ---- a player's one block of memory -----------------------------------------------------------------

uint32_t worker_count(const Asset& asset) { return asset.host.jobs.submit ? asset.host.jobs.workers : 1; }

Limits settle_limits(const Asset& asset, const Limits& asked) {
    const Limits own = suggest_limits(&asset);
    Limits limits = asked;
    if (!limits.resident_bytes) limits.resident_bytes = own.resident_bytes;
    if (!limits.points) limits.points = own.points;
    if (!limits.vertices) limits.vertices = own.vertices;
    if (!limits.indices) limits.indices = own.indices;
    if (!limits.reads_in_flight) limits.reads_in_flight = own.reads_in_flight;
    limits.reads_in_flight = std::min(limits.reads_in_flight, most_slots);
    return limits;
}

struct Layout {
    Player* player;
    Want* wants;
    ChunkSlot* chunks;
    uint32_t *held, *to_decode;
    uint16_t* resident_in_window;
    ReadSlot* slots;
    Piece* pieces;
    void *heap, *rows, *field, *mesher;
    format::PointSet points;
    format::DropSet drops;
    uint32_t point_capacity, drop_capacity;
};

void lay_out_sets(Arena& arena, Layout& out) {
    format::PointSet& p = out.points;
    for (float** row : {&p.x, &p.y, &p.z, &p.nx, &p.ny, &p.nz, &p.vx, &p.vy, &p.vz, &p.activity})
        *row = arena.take_array<float>(out.point_capacity);
    format::DropSet& d = out.drops;
    for (float** row : {&d.x, &d.y, &d.z, &d.vx, &d.vy, &d.vz, &d.activity})
        *row = arena.take_array<float>(out.drop_capacity);
    for (float*& row : d.shape) row = arena.take_array<float>(out.drop_capacity);
}

MeshLimits mesh_limits(const Asset& asset, const Limits& limits, const Layout& layout) { return {limits.vertices, layout.drop_capacity, 0, worker_count(asset)}; }

/// Measures or places; both go through here, which is why footprint() is exact.
Layout lay_out(Arena& arena, const Asset& asset, const Limits& limits) {
    const Directory& d = asset.directory;
    const uint64_t tracks = uint64_t(d.most_point_tracks) + d.most_drop_tracks;
    Layout out{};
    out.player = arena.take_array<Player>(1);
    out.wants = arena.take_array<Want>(d.header.chunk_count);
    out.chunks = arena.take_array<ChunkSlot>(d.header.chunk_count);
    out.held = arena.take_array<uint32_t>(d.header.chunk_count);
    out.to_decode = arena.take_array<uint32_t>(d.header.chunk_count);
    out.resident_in_window = arena.take_array<uint16_t>(d.header.window_count);
    out.slots = arena.take_array<ReadSlot>(limits.reads_in_flight);
    // Points and drops of a chunk each end in a piece of their own that may not be full.
    out.pieces = arena.take_array<Piece>(tracks / piece_tracks + 2 * uint64_t(d.most_chunks));
    out.point_capacity = std::min(limits.points, d.most_point_tracks);
    out.drop_capacity = std::min(limits.points, d.most_drop_tracks);
    lay_out_sets(arena, out);
    out.rows = arena.take(time_rows_bytes(d.basis.longest));
    out.field = arena.take(surface::field_bytes(out.point_capacity, out.drop_capacity));
    out.mesher = arena.take(mesher_bytes(mesh_limits(asset, limits, out)));
    out.heap = arena.take(limits.resident_bytes);
    return out;
}

void make_residency(Residency& r, Asset& asset, const Layout& layout, const Limits& limits) {
    const Directory& d = asset.directory;
    r.asset = &asset;
    clear_heap(r.heap, layout.heap, limits.resident_bytes);
    r.chunks = layout.chunks;
    r.held = layout.held;
    r.to_decode = layout.to_decode;
    r.resident_in_window = layout.resident_in_window;
    r.slots = layout.slots;
    r.slot_count = limits.reads_in_flight;
    for (uint32_t w = 0; w < d.header.window_count; ++w) {
        r.resident_in_window[w] = 0;
        const format::WindowRecord& window = d.tables.windows[w];
        for (uint32_t k = 0; k < window.chunk_count; ++k)
            r.chunks[window.first_chunk + k] = {ChunkState::absent, 0, UINT32_MAX, w, 0, 0, 0, nullptr, ""};
    }
    for (uint32_t i = 0; i < r.slot_count; ++i) new (&r.slots[i]) ReadSlot;
}

Player* make_player(Asset& asset, const Layout& layout, const Limits& limits, uint64_t bytes) {
    auto* player = new (layout.player) Player{};
    player->asset = &asset;
    player->directory = &asset.directory;
    player->limits = limits;
    player->memory_bytes = bytes;
    player->plan.wants = layout.wants;
    make_residency(player->residency, asset, layout, limits);
    Evaluation& e = player->evaluation;
    e.rows_memory = layout.rows;
    e.pieces = layout.pieces;
    e.points = layout.points;
    e.drops = layout.drops;
    e.point_capacity = layout.point_capacity;
    e.drop_capacity = layout.drop_capacity;
    player->field_memory = layout.field;
    player->mesher = place_mesher(layout.mesher, mesh_limits(asset, limits, layout));
    for (Player::Mark* mark :
         {&player->decode_begun, &player->decode_done, &player->mesh_begun, &player->mesh_done})
        mark->player = player;
    return player;
}

/// False when all tickets are taken: so many players of one asset there are not.
bool enlist(Asset& asset, Player* player) {
    for (uint32_t i = 0; i < most_players; ++i) {
        Player* nobody = nullptr;
        if (!asset.players[i].compare_exchange_strong(nobody, player)) continue;
        player->residency.player_index = i + 1;
        return true;
    }
    return false;
}

// ---- a frame ----------------------------------------------------------------------------------------

uint32_t prepare_mark(void* context) {
    auto& mark = *static_cast<Player::Mark*>(context);
    mark.us = microseconds_now(*mark.player);
    return 0;
}
const Stage mark_stage = {prepare_mark, nullptr, false};

/// Reads that complete inside begin() free their slots at once: go on while that brings something.
void pump_reads(Player& player) {
    const uint64_t read_bytes = player.residency.waiting ? 0 : player.frame.budget.read_bytes;
    collect_reads(player.residency, *player.directory);
    while (issue_reads(player.residency, *player.directory, player.plan, read_bytes) &&
           collect_reads(player.residency, *player.directory) && !player.residency.busy) {
    }
}

/// Then prefetch is decoded between frames, else by them.
bool has_workers_to_spare(const Player& player) {
    const Jobs& jobs = player.asset->host.jobs;
    return jobs.submit && jobs.workers > 1;
}

void chain_stages(Player& player) {
    Relay& relay = player.relay;
    const uint32_t prefetch = has_workers_to_spare(player) ? 0 : prefetch_due(player.residency, player.plan);
    choose_decodes(player.residency, *player.directory, player.plan, decode_bytes_affordable(player), prefetch);
    relay.clear(player.asset->host.jobs);
    relay.add(&mark_stage, 1, &player.decode_begun);
    relay.add(decode_stages, decode_stage_count, &player);
    relay.add(&mark_stage, 1, &player.decode_done);
    if (player.frame.target) {
        relay.add(&evaluate_stage, 1, &player);
        relay.add(field_stages, field_stage_count, &player);
        relay.add(&mark_stage, 1, &player.mesh_begun);
        uint32_t count;
        const Stage* stages = mesh_stages(&count);
        relay.add(stages, count, player.mesher);
    }
    relay.add(&mark_stage, 1, &player.mesh_done);
}

void start_stages(Player& player) {
    chain_stages(player);
    player.started = true;
    if (player.asset->host.jobs.submit) player.relay.start();
}

void wait_for_data(Player& player) {
    const Jobs& jobs = player.asset->host.jobs;
    for (;;) {
        pump_reads(player);
        if (is_settled(player.residency, player.plan)) return;
        if (jobs.help) jobs.help(jobs.user);
        else std::this_thread::yield();
    }
}

void finish_stages(Player& player) {
    const Jobs& jobs = player.asset->host.jobs;
    if (!jobs.submit) player.relay.run_all();
    while (!player.relay.done()) jobs.help(jobs.user);
}

}  // namespace

uint64_t read_clock(const Host& host) noexcept {
    if (host.clock) return host.clock(host.clock_user);
    using namespace std::chrono;
    return uint64_t(duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count());
}

const char* text(Status status) noexcept {
    switch (status) {
        case Status::ok: return "done";
        case Status::pending: return "waiting for reads";
        case Status::clipped: return "drawn, with something held back";
        case Status::bad_argument: return "an argument is not valid";
        case Status::api_mismatch: return "header and library are of different versions";
        case Status::not_an_asset: return "not a .rill file";
        case Status::unknown_format: return "a .rill file of a version this library does not read";
        case Status::corrupt: return "the file is damaged";
        case Status::read_failed: return "the file could not be read";
        case Status::out_of_memory: return "out of memory";
    }
    return "unknown status";
}

// ---- assets -----------------------------------------------------------------------------------------

Status open(const Host& host, const Io& io, uint64_t file_bytes, Asset** out) noexcept {
    if (host.api != api_version) return Status::api_mismatch;
    if (!out || !is_host(host) || !io.begin) return Status::bad_argument;
    *out = nullptr;
    void* block = host.memory.allocate(host.memory.user, sizeof(Asset), block_alignment);
    if (!block) return Status::out_of_memory;
    auto* asset = new (block) Asset;
    asset->host = host;
    asset->io = io;
    asset->file_bytes = file_bytes;
    *out = asset;
    start_asset(*asset);
    return Status::ok;
}

Status poll(Asset* asset, AssetInfo* out) noexcept {
    if (!asset) return Status::bad_argument;
    const Status status = advance_asset(*asset);
    if (status == Status::ok && out) *out = asset->directory.info;
    return status;
}

void complete_read(Asset* asset, uint64_t ticket, bool arrived) noexcept {
    if (!asset) return;
    const uint32_t index = ticket_player(ticket);
    if (!index) return asset->slot.complete(ticket, arrived);
    // The player lives: destroy() waits for its reads.
    Player* player = asset->players[index - 1].load(std::memory_order_acquire);
    if (!player || ticket_slot(ticket) >= player->residency.slot_count) return;
    player->residency.slots[ticket_slot(ticket)].complete(ticket, arrived);
}

Status close(Asset* asset) noexcept {
    if (!asset || asset->player_count.load() != 0) return Status::bad_argument;
    if (asset->slot.state() == ReadSlot::out) {
        if (!asset->slot.forgotten && asset->io.forget) asset->io.forget(asset->io.user, asset->slot.ticket());
        asset->slot.forgotten = true;
        if (asset->slot.state() == ReadSlot::out) return Status::pending;  // forget() may have completed it
    }
    release_tables(*asset);
    const Memory memory = asset->host.memory;
    asset->~Asset();
    memory.release(memory.user, asset, sizeof(Asset));
    return Status::ok;
}

double frame_seconds(const Asset* asset, uint32_t index) noexcept {
    if (!asset || asset->phase != Asset::Phase::ready) return 0;
    return frame_time(asset->directory, std::min(index, asset->directory.header.frame_count - 1));
}

// ---- players ----------------------------------------------------------------------------------------

/// A closed mesh has six indices a vertex.
Limits suggest_limits(const Asset* asset) noexcept {
    if (!asset || asset->phase != Asset::Phase::ready) return {};
    const Directory& d = asset->directory;
    Limits limits{};
    limits.resident_bytes = d.suggested_resident_bytes;
    limits.points = std::max(1u, d.info.most_points);
    limits.vertices = uint32_t(d.suggested_vertices);
    limits.indices = limits.vertices * 6;
    limits.reads_in_flight = 16;
    return limits;
}

uint64_t footprint(const Asset* asset, const Limits& limits) noexcept {
    if (!asset || asset->phase != Asset::Phase::ready) return 0;
    Arena measure;
    lay_out(measure, *asset, settle_limits(*asset, limits));
    return measure.used;
}

Status create(Asset* asset, const Limits& asked, Player** out) noexcept {
    if (!asset || !out || asset->phase != Asset::Phase::ready) return Status::bad_argument;
    *out = nullptr;
    const Limits limits = settle_limits(*asset, asked);
    const uint64_t bytes = footprint(asset, limits);
    const Memory& memory = asset->host.memory;
    if (bytes > SIZE_MAX / 2) return Status::out_of_memory;
    void* block = memory.allocate(memory.user, bytes, block_alignment);
    if (!block) return Status::out_of_memory;
    Arena place{static_cast<uint8_t*>(block)};
    Player* player = make_player(*asset, lay_out(place, *asset, limits), limits, bytes);
    if (!enlist(*asset, player)) {
        memory.release(memory.user, block, bytes);
        return Status::out_of_memory;
    }
    asset->player_count.fetch_add(1);
    *out = player;
    return Status::ok;
}

Status destroy(Player* player) noexcept {
    if (!player || player->frame_open) return Status::bad_argument;
    if (!stop_unpacking(player->residency)) {
        const Jobs& jobs = player->asset->host.jobs;
        jobs.help(jobs.user);
        return Status::pending;
    }
    collect_reads(player->residency, *player->directory);
    if (player->residency.slots_out) {
        forget_reads(player->residency);
        collect_reads(player->residency, *player->directory);  // forget() may have completed some
        if (player->residency.slots_out) return Status::pending;
    }
    Asset& asset = *player->asset;
    const Memory memory = asset.host.memory;
    const uint64_t bytes = player->memory_bytes;
    asset.players[player->residency.player_index - 1].store(nullptr, std::memory_order_release);
    player->~Player();
    memory.release(memory.user, player, bytes);
    asset.player_count.fetch_sub(1);
    return Status::ok;
}

// ---- frames -----------------------------------------------------------------------------------------

Status begin_frame(Player* player, const Frame& frame) noexcept {
    if (!player || player->frame_open || !is_frame(frame)) return Status::bad_argument;
    Player& p = *player;
    p.frame = frame;
    p.frame_open = true;
    p.started = false;
    if (Target* target = frame.target)
        target->vertices_used = target->indices_used = target->ranges_used = target->points_used = 0;
    const uint64_t begun = microseconds_now(p);

    Residency& r = p.residency;
    ++r.frame_number;
    r.frame_bytes_asked = 0;
    r.waiting = frame.wait_for_data;
    settle_decodes(r, *p.directory);
    drop_ranks(r, p.plan);
    plan_frame(*p.directory, frame, p.plan);
    give_up_detail(p);
    rank_wants(r, p.plan);
    pump_reads(p);
    p.plan_us = uint32_t(microseconds_now(p) - begun);
    if (!r.waiting) start_stages(p);
    return Status::ok;
}

Status end_frame(Player* player, Stats* out) noexcept {
    if (!player || !player->frame_open) return Status::bad_argument;
    Player& p = *player;
    const uint64_t begun = microseconds_now(p);
    if (!p.started) {
        wait_for_data(p);
        start_stages(p);
    }
    finish_stages(p);
    p.wait_us = uint32_t(microseconds_now(p) - begun);
    settle_decodes(p.residency, *p.directory);
    const Stats stats = count_all(p);
    if (has_workers_to_spare(p)) start_unpacking(p, prefetch_due(p.residency, p.plan));
    p.residency.last_seconds = p.plan.moment.seconds;
    p.frame_open = false;
    if (out) *out = stats;
    return stats.cut ? Status::clipped : Status::ok;
}

}  // namespace rill
