// SPDX-License-Identifier: MIT
// Completed reads → verified, decoded chunks. Collecting and settling are serial; decoding is a stage.
#include <algorithm>
#include <cstdio>

#include "format/chunk_decoder.h"
#include "format/crc32.h"
#include "pipeline.h"

namespace rill {
namespace {

/// So much prefetch a frame decodes at most: what arrives at once shall not all burden one frame.
constexpr uint32_t most_prefetch_decodes = 8;

void decode_chunk(Player& player, uint32_t index) {
    const uint32_t chunk = player.residency.to_decode[index];
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
    slot.state = status == Status::ok ? ChunkState::resident : ChunkState::undecodable;
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

uint32_t prepare_decode(void* context) { return static_cast<Player*>(context)->residency.decode_count; }
void run_decode(void* context, uint32_t index, uint32_t) { decode_chunk(*static_cast<Player*>(context), index); }

}  // namespace

const Stage decode_stage = {prepare_decode, run_decode, false};

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

void choose_decodes(Residency& r, const Directory& directory, const Plan& plan, uint64_t most_bytes) noexcept {
    r.decode_count = 0;
    r.decode_bytes = 0;
    uint32_t prefetch = 0;
    for (uint32_t i = 0; i < plan.want_count && prefetch < most_prefetch_decodes; ++i) {
        const uint32_t chunk = plan.wants[i].chunk, bytes = directory.tables.chunks[chunk].bytes;
        if (r.chunks[chunk].state != ChunkState::arrived) continue;
        if (r.decode_count && r.decode_bytes + bytes > most_bytes) break;
        r.to_decode[r.decode_count++] = chunk;
        r.decode_bytes += bytes;
        if (i >= plan.now_count) ++prefetch;
    }
}

void settle_decodes(Residency& r, const Directory& directory) noexcept {
    for (uint32_t i = 0; i < r.decode_count; ++i) {
        const uint32_t chunk = r.to_decode[i];
        ChunkSlot& slot = r.chunks[chunk];
        if (slot.state != ChunkState::resident) {
            reject(r, directory, chunk);
            continue;
        }
        heap_trim(r.heap, slot.block, decoded_bytes(directory.tables.chunks[chunk]));
        if (r.resident_in_window[slot.window]++ == 0) ++r.windows_decoded;
    }
    r.decode_count = 0;
}

}  // namespace rill
