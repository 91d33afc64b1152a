// SPDX-License-Identifier: MIT
// Residency: who may have memory, who must go, and which reads are asked for. All of it serial, in
// begin_frame() (or while end_frame() waits for data), and a pure function of wants and residents.
#include <algorithm>

#include "pipeline.h"

namespace rill {
namespace {

constexpr uint32_t unwanted = UINT32_MAX;
constexpr uint8_t most_failures_waiting = 8;  ///< then a frame that waits for data gives the chunk up

/// Before every piece of the heap. Sizes include the tag.
struct Tag {
    uint64_t bytes, bytes_before;  ///< own; of the piece below, 0: none
    bool taken;
};
constexpr uint64_t tag_bytes = block_alignment;
static_assert(sizeof(Tag) <= tag_bytes);

Tag* first_tag(const Heap& heap) { return reinterpret_cast<Tag*>(heap.base); }
Tag* next_tag(const Heap& heap, Tag* tag) {
    uint8_t* at = reinterpret_cast<uint8_t*>(tag) + tag->bytes;
    return at < heap.base + heap.bytes ? reinterpret_cast<Tag*>(at) : nullptr;
}
Tag* tag_of(void* block) { return reinterpret_cast<Tag*>(static_cast<uint8_t*>(block) - tag_bytes); }

void join_with_next(Heap& heap, Tag* tag) {
    Tag* next = next_tag(heap, tag);
    if (!next || next->taken) return;
    tag->bytes += next->bytes;
    if (Tag* after = next_tag(heap, tag)) after->bytes_before = tag->bytes;
}

/// Shortens a piece to `bytes`; the rest becomes a free piece of its own, if a tag fits.
void split(Heap& heap, Tag* tag, uint64_t bytes) {
    if (tag->bytes - bytes < 2 * tag_bytes) return;
    auto* rest = reinterpret_cast<Tag*>(reinterpret_cast<uint8_t*>(tag) + bytes);
    *rest = {tag->bytes - bytes, bytes, false};
    tag->bytes = bytes;
    if (Tag* after = next_tag(heap, rest)) after->bytes_before = rest->bytes;
    join_with_next(heap, rest);
}

bool may_go(const ChunkSlot& slot) {
    return slot.state == ChunkState::resident || slot.state == ChunkState::arrived;
}

/// What is least missed of all that ranks below `rank`: the unwanted by time until needed, then wants
/// from the end. A total order, so that the order of `held` does not matter.
uint32_t find_victim(const Residency& r, const Directory& directory, const Plan& plan, uint32_t rank) {
    uint32_t victim = unwanted;
    float victim_seconds = 0;
    for (uint32_t i = 0; i < r.held_count; ++i) {
        const uint32_t chunk = r.held[i];
        const ChunkSlot& slot = r.chunks[chunk];
        if (!may_go(slot) || slot.rank <= rank) continue;
        const float seconds = seconds_until(directory, plan, slot.window);
        if (victim != unwanted) {
            const ChunkSlot& best = r.chunks[victim];
            if (slot.rank < best.rank) continue;
            if (slot.rank == best.rank &&
                (seconds < victim_seconds || (seconds == victim_seconds && chunk < victim)))
                continue;
        }
        victim = chunk;
        victim_seconds = seconds;
    }
    return victim;
}

void* make_room(Residency& r, const Directory& directory, const Plan& plan, uint32_t rank, uint64_t bytes) {
    for (;;) {
        if (void* block = heap_take(r.heap, bytes)) return block;
        const uint32_t victim = find_victim(r, directory, plan, rank);
        if (victim == unwanted) return nullptr;
        release_chunk(r, victim);
    }
}

uint32_t free_slot(const Residency& r) {
    uint32_t i = 0;
    while (r.slots[i].state() != ReadSlot::free) ++i;  // the caller knows that there is one
    return i;
}

/// False: the IO is busy.
bool ask(Residency& r, const format::ChunkRecord& record, uint32_t chunk, float seconds, void* block) {
    const uint32_t index = free_slot(r);
    ReadSlot& read = r.slots[index];
    ChunkSlot& slot = r.chunks[chunk];
    const uint64_t serial = r.asset->next_serial.fetch_add(1, std::memory_order_relaxed);
    const uint64_t ticket = make_ticket(serial, r.player_index, index);
    slot.block = static_cast<format::TrackBlock*>(block);
    read.chunk = chunk;
    read.forgotten = false;
    read.set(ReadSlot::out, ticket);
    void* destination = static_cast<uint8_t*>(block) + decoded_bytes(record);
    const Io& io = r.asset->io;
    if (!io.begin(io.user, Read{r.asset, ticket, record.offset, destination, record.bytes, seconds})) {
        read.set(ReadSlot::free, 0);
        heap_give(r.heap, block);
        slot.block = nullptr;
        ++r.reads_refused;
        r.busy = true;
        return false;
    }
    slot.state = ChunkState::reading;
    slot.read_slot = index;
    slot.held = r.held_count;
    r.held[r.held_count++] = chunk;
    ++r.slots_out;
    r.bytes_asked += record.bytes;
    r.frame_bytes_asked += record.bytes;
    return true;
}

bool may_retry(const Residency& r, const ChunkSlot& slot) {
    return r.waiting ? slot.failures < most_failures_waiting : slot.retry_at <= r.frame_number;
}

}  // namespace

void clear_heap(Heap& heap, void* memory, uint64_t bytes) noexcept {
    heap = {static_cast<uint8_t*>(memory), bytes / block_alignment * block_alignment, 0};
    if (heap.bytes < 2 * tag_bytes) heap.bytes = 0;
    if (heap.bytes) *first_tag(heap) = {heap.bytes, 0, false};
}

void* heap_take(Heap& heap, uint64_t bytes) noexcept {
    if (bytes > heap.bytes) return nullptr;
    const uint64_t need = align_up(bytes) + tag_bytes;
    for (Tag* tag = heap.bytes ? first_tag(heap) : nullptr; tag; tag = next_tag(heap, tag)) {
        if (tag->taken || tag->bytes < need) continue;
        split(heap, tag, need);
        tag->taken = true;
        heap.used += tag->bytes;
        return reinterpret_cast<uint8_t*>(tag) + tag_bytes;
    }
    return nullptr;
}

void heap_trim(Heap& heap, void* block, uint64_t bytes) noexcept {
    Tag* tag = tag_of(block);
    heap.used -= tag->bytes;
    split(heap, tag, align_up(bytes) + tag_bytes);
    heap.used += tag->bytes;
}

void heap_give(Heap& heap, void* block) noexcept {
    Tag* tag = tag_of(block);
    tag->taken = false;
    heap.used -= tag->bytes;
    join_with_next(heap, tag);
    if (!tag->bytes_before) return;
    auto* before = reinterpret_cast<Tag*>(reinterpret_cast<uint8_t*>(tag) - tag->bytes_before);
    if (!before->taken) join_with_next(heap, before);
}

void release_chunk(Residency& r, uint32_t chunk) noexcept {
    ChunkSlot& slot = r.chunks[chunk];
    if (slot.state == ChunkState::resident) --r.resident_in_window[slot.window];
    heap_give(r.heap, slot.block);
    slot.block = nullptr;
    slot.state = ChunkState::absent;
    const uint32_t last = r.held[--r.held_count];
    r.held[slot.held] = last;
    r.chunks[last].held = slot.held;
}

void drop_ranks(Residency& r, const Plan& plan) noexcept {
    for (uint32_t i = 0; i < plan.want_count; ++i) r.chunks[plan.wants[i].chunk].rank = unwanted;
}

void rank_wants(Residency& r, const Plan& plan) noexcept {
    for (uint32_t i = 0; i < plan.want_count; ++i) r.chunks[plan.wants[i].chunk].rank = i;
    for (uint32_t i = 0; i < plan.now_count && r.waiting; ++i) r.chunks[plan.wants[i].chunk].failures = 0;
    const Io& io = r.asset->io;
    for (uint32_t i = 0; i < r.slot_count; ++i) {
        ReadSlot& read = r.slots[i];
        if (read.state() != ReadSlot::out || read.forgotten || r.chunks[read.chunk].rank != unwanted) continue;
        read.forgotten = true;
        if (io.forget) io.forget(io.user, read.ticket());
    }
}

void forget_reads(Residency& r) noexcept {
    const Io& io = r.asset->io;
    for (uint32_t i = 0; i < r.slot_count; ++i) {
        ReadSlot& read = r.slots[i];
        if (read.state() != ReadSlot::out || read.forgotten) continue;
        read.forgotten = true;
        if (io.forget) io.forget(io.user, read.ticket());
    }
}

bool issue_reads(Residency& r, const Directory& directory, const Plan& plan, uint64_t read_bytes) noexcept {
    bool any = false;
    r.no_room = r.busy = false;
    for (uint32_t i = 0; i < plan.want_count; ++i) {
        const uint32_t chunk = plan.wants[i].chunk;
        const ChunkSlot& slot = r.chunks[chunk];
        const format::ChunkRecord& record = directory.tables.chunks[chunk];
        if (slot.state != ChunkState::absent || !may_retry(r, slot)) continue;
        if (r.slots_out == r.slot_count) break;
        // The first read of a frame may exceed the budget: else a large chunk would never come.
        if (read_bytes && r.frame_bytes_asked && r.frame_bytes_asked + record.bytes > read_bytes) break;
        const uint64_t bytes = reading_bytes(record);
        const bool never = bytes + tag_bytes > r.heap.bytes;
        void* block = never ? nullptr : make_room(r, directory, plan, i, bytes);
        if (!block && i < plan.now_count) r.no_room = true;
        if (never) continue;
        if (!block) break;
        if (!ask(r, record, chunk, plan.wants[i].seconds_until_needed, block)) break;
        any = true;
    }
    return any;
}

bool is_settled(const Residency& r, const Plan& plan) noexcept {
    for (uint32_t i = 0; i < plan.now_count; ++i) {
        const ChunkSlot& slot = r.chunks[plan.wants[i].chunk];
        if (slot.state == ChunkState::reading) return false;
        const bool hopeless = slot.failures >= most_failures_waiting || (r.no_room && r.slots_out == 0);
        if (slot.state == ChunkState::absent && !hopeless) return false;
    }
    return true;
}

}  // namespace rill
