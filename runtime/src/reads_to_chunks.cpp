// SPDX-License-Identifier: MIT
// Completed reads → verified, decoded chunks. Collecting and settling are serial; decoding is a stage, or, of prefetch and where
// there are workers to spare, jobs between frames. (Before, frames decoded up to eight prefetched chunks themselves, as they came:
// two frames in each window of `pour_sphere` took half as long again.)
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "format/chunk_decoder.h"
#include "format/crc32.h"
#include "pipeline.h"

namespace rill {
namespace {

constexpr double usual_frame = 1 / 60.0, shortest_frame = 1 / 240.0, longest_frame = 1 / 4.0;  ///< real seconds
constexpr float ready_before = 0.1f;  ///< prefetch is to be decoded so long before it is needed

/// What became of it; the rest of the slot only the frame's own thread writes.
ChunkState decode_chunk(Player& player, uint32_t chunk) {
    ChunkSlot& slot = player.residency.chunks[chunk];
    const Directory& directory = *player.directory;
    const format::ChunkRecord& record = directory.tables.chunks[chunk];
    const format::WindowRecord& window = directory.tables.windows[slot.window];

    auto* base = reinterpret_cast<uint8_t*>(slot.block);
    const uint64_t tracks = uint64_t(record.point_count) + record.drop_count;
    format::TrackBlock& block = *slot.block;
    block = {};
    block.point_count = record.point_count;
    block.drop_count = record.drop_count;
    block.coefficient_count = record.coefficient_count;
    block.tracks = reinterpret_cast<format::Track*>(base + align_up(sizeof(format::TrackBlock)));
    block.coefficients = reinterpret_cast<float*>(reinterpret_cast<uint8_t*>(block.tracks) +
                                                  align_up(tracks * sizeof(format::Track)));
    const uint8_t* bytes = base + decoded_bytes(record);

    slot.fault = "checksum is wrong";
    Status status = Status::corrupt;
    if (format::crc32(bytes, record.bytes) == record.crc) {
        slot.fault = "does not decode";
        const format::ChunkShape shape{window.sample_count, record.point_count, record.drop_count,
                                       record.coefficient_count, format::steps_of(directory.header, window)};
        status = format::decode_chunk(bytes, record.bytes, shape, directory.tables.model,
                                      directory.header.model_bytes, block, &slot.fault);
    }
    return status == Status::ok ? ChunkState::resident : ChunkState::undecodable;
}

void unpack(void* context, uint32_t, uint32_t worker) {
    auto& job = *static_cast<Unpacking*>(context);
    uint32_t phase = Unpacking::queued;
    if (!job.phase.compare_exchange_strong(phase, Unpacking::running, std::memory_order_acquire)) {
        job.phase.store(Unpacking::idle, std::memory_order_release);
        return;
    }
    Player& player = *job.player;
    job.result = decode_chunk(player, job.chunk);
    // If nobody waits, the player may be gone once this is said.
    if (job.phase.exchange(Unpacking::done, std::memory_order_acq_rel) == Unpacking::awaited) player.relay.finish_one(worker);
}

void reject(Residency& r, const Directory& directory, uint32_t chunk) {
    ChunkSlot& slot = r.chunks[chunk];
    const format::ChunkRecord& record = directory.tables.chunks[chunk];
    char message[192];
    std::snprintf(message, sizeof message, "chunk %u (window %u, layer %u, block %u) rejected: %s", chunk,
                  slot.window, record.layer, record.block, slot.fault);
    log(*r.asset, Status::corrupt, message);
    release_chunk(r, chunk);
    slot.state = ChunkState::rejected;
    ++r.chunks_rejected;
}

uint32_t prepare_decode(void* context) {
    auto& player = *static_cast<Player*>(context);
    Residency& r = player.residency;
    for (uint32_t i = 0; i < r.join_count; ++i) {
        Unpacking& job = r.unpacking[r.joins[i]];
        uint32_t phase = Unpacking::queued;
        if (job.phase.compare_exchange_strong(phase, Unpacking::taken, std::memory_order_acquire)) {
            r.to_decode[r.decode_count++] = job.chunk;
            continue;
        }
        player.relay.expect();  // before anybody can finish
        phase = Unpacking::running;
        if (!job.phase.compare_exchange_strong(phase, Unpacking::awaited, std::memory_order_acq_rel)) player.relay.expect_no_more();
    }
    return r.decode_count;
}
void run_decode(void* context, uint32_t index, uint32_t) {
    auto& player = *static_cast<Player*>(context);
    const uint32_t chunk = player.residency.to_decode[index];
    player.residency.chunks[chunk].state = decode_chunk(player, chunk);
}
/// What jobs have decoded of this moment is there for the stages to come.
uint32_t prepare_join(void* context) {
    Residency& r = static_cast<Player*>(context)->residency;
    for (uint32_t i = 0; i < r.join_count; ++i) {
        const Unpacking& job = r.unpacking[r.joins[i]];
        if (job.phase.load(std::memory_order_acquire) == Unpacking::done) r.chunks[job.chunk].state = job.result;
    }
    return 0;
}

/// Of the job that has the chunk now; one that a frame took it from does not count.
uint32_t job_of(const Residency& r, uint32_t chunk) {
    uint32_t i = 0;
    for (; i < most_unpacking; ++i) {
        const uint32_t phase = r.unpacking[i].phase.load(std::memory_order_acquire);
        if (r.unpacking[i].chunk == chunk && phase != Unpacking::idle && phase != Unpacking::taken) break;
    }
    return i;  // there is one, as long as the chunk's state says so
}

void settle(Residency& r, const Directory& directory, uint32_t chunk) {
    ChunkSlot& slot = r.chunks[chunk];
    if (slot.state != ChunkState::resident) return reject(r, directory, chunk);
    heap_trim(r.heap, slot.block, decoded_bytes(directory.tables.chunks[chunk]));
    if (r.resident_in_window[slot.window]++ == 0) ++r.windows_decoded;
}

}  // namespace

const Stage decode_stages[decode_stage_count] = {{prepare_decode, run_decode, false}, {prepare_join, nullptr, false}};

bool collect_reads(Residency& r, const Directory& directory) noexcept {
    bool any = false;
    for (uint32_t i = 0; i < r.slot_count && r.slots_out; ++i) {
        ReadSlot& read = r.slots[i];
        const ReadSlot::State state = read.state();
        if (state != ReadSlot::arrived && state != ReadSlot::failed) continue;
        ChunkSlot& slot = r.chunks[read.chunk];
        if (state == ReadSlot::arrived) {
            slot.state = ChunkState::arrived;
            slot.failures = 0;
            r.bytes_arrived += directory.tables.chunks[read.chunk].bytes;
            any = true;
        } else {
            release_chunk(r, read.chunk);
            if (!read.forgotten) {  // one that was forgotten may well come back empty
                ++r.reads_failed;
                slot.failures = uint8_t(std::min(slot.failures + 1, 255));
                slot.retry_at = r.frame_number + (uint64_t(1) << std::min<uint32_t>(slot.failures, 6));
            }
        }
        read.set(ReadSlot::free, 0);
        --r.slots_out;
    }
    return any;
}

uint32_t prefetch_due(const Residency& r, const Plan& plan) noexcept {
    uint32_t left = 0;
    float seconds = 0;
    for (uint32_t i = plan.now_count; i < plan.want_count; ++i) {
        if (r.chunks[plan.wants[i].chunk].state != ChunkState::arrived) continue;
        if (!left++) seconds = plan.wants[i].seconds_until_needed;
    }
    if (!left) return 0;
    const double moved = std::abs(plan.moment.seconds - r.last_seconds), rate = std::abs(plan.rate);
    const double frame = moved > 0 && rate > 0 ? std::clamp(moved / rate, shortest_frame, longest_frame) : usual_frame;
    const double frames = std::max(1.0, double(seconds - ready_before) / frame);
    return uint32_t(std::clamp(std::ceil(left / frames), 1.0, double(most_unpacking)));
}

void choose_decodes(Residency& r, const Directory& directory, const Plan& plan, uint64_t most_bytes, uint32_t prefetch) noexcept {
    r.decode_count = r.join_count = 0;
    r.decode_bytes = 0;
    for (uint32_t i = 0; i < plan.want_count; ++i) {
        if (i >= plan.now_count && prefetch == 0) break;
        const uint32_t chunk = plan.wants[i].chunk, bytes = directory.tables.chunks[chunk].bytes;
        const bool joins = r.chunks[chunk].state == ChunkState::unpacking && i < plan.now_count;
        if (r.chunks[chunk].state != ChunkState::arrived && !joins) continue;
        if (r.decode_bytes && r.decode_bytes + bytes > most_bytes) break;
        if (joins) r.joins[r.join_count++] = job_of(r, chunk);
        else r.to_decode[r.decode_count++] = chunk;
        r.decode_bytes += bytes;
        if (i >= plan.now_count) --prefetch;
    }
}

void settle_decodes(Residency& r, const Directory& directory) noexcept {
    for (uint32_t i = 0; i < r.decode_count; ++i) settle(r, directory, r.to_decode[i]);
    r.decode_count = r.join_count = 0;
    for (Unpacking& job : r.unpacking) {
        if (job.phase.load(std::memory_order_acquire) != Unpacking::done) continue;
        r.chunks[job.chunk].state = job.result;
        settle(r, directory, job.chunk);
        job.phase.store(Unpacking::idle, std::memory_order_relaxed);
    }
}

void start_unpacking(Player& player, uint32_t count) noexcept {
    Residency& r = player.residency;
    const Jobs& jobs = player.asset->host.jobs;
    uint32_t free = 0;
    for (uint32_t i = player.plan.now_count; i < player.plan.want_count && count; ++i) {
        const uint32_t chunk = player.plan.wants[i].chunk;
        if (r.chunks[chunk].state != ChunkState::arrived) continue;
        while (free < most_unpacking && r.unpacking[free].phase.load(std::memory_order_acquire) != Unpacking::idle) ++free;
        if (free == most_unpacking) return;  // the engine is busy: a frame will do it
        Unpacking& job = r.unpacking[free];
        job.player = &player;
        job.chunk = chunk;
        job.phase.store(Unpacking::queued, std::memory_order_release);
        r.chunks[chunk].state = ChunkState::unpacking;
        jobs.submit(jobs.user, unpack, &job, 1, false);
        --count;
    }
}

bool stop_unpacking(Residency& r) noexcept {
    bool stopped = true;
    for (Unpacking& job : r.unpacking) {
        uint32_t phase = Unpacking::queued;
        if (job.phase.compare_exchange_strong(phase, Unpacking::taken, std::memory_order_acq_rel))
            r.chunks[job.chunk].state = ChunkState::arrived;  // as before, should there be another frame
        phase = job.phase.load(std::memory_order_acquire);
        stopped = stopped && (phase == Unpacking::idle || phase == Unpacking::done);
    }
    return stopped;
}

}  // namespace rill
