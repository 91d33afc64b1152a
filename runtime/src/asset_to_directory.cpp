// SPDX-License-Identifier: MIT
// First reads → checked, immutable directory. Two reads: the header, which says how much there is, and
// the directory. All allocation happens here, on the thread that polls.
#include <algorithm>
#include <cstring>

#include "pipeline.h"

namespace rill {
namespace {

constexpr float farthest = 1e15f;

using Phase = Asset::Phase;

Status fail(Asset& asset, Status status, const char* reason) {
    asset.phase = Phase::failed;
    asset.failure = status;
    log(asset, status, reason);
    release_tables(asset);
    return status;
}

/// False: the IO is busy; asked again by the next poll().
bool begin_read(Asset& asset, uint64_t offset, void* destination, uint32_t bytes) {
    const uint64_t ticket = make_ticket(asset.next_serial.fetch_add(1, std::memory_order_relaxed), 0, 0);
    asset.slot.set(ReadSlot::out, ticket);
    if (asset.io.begin(asset.io.user, Read{&asset, ticket, offset, destination, bytes, 0})) return true;
    asset.slot.set(ReadSlot::free, 0);
    return false;
}

/// pending until the bytes are there.
Status read_whole(Asset& asset, uint64_t offset, void* destination, uint32_t bytes) {
    if (asset.slot.state() == ReadSlot::free && !begin_read(asset, offset, destination, bytes))
        return Status::pending;
    switch (asset.slot.state()) {
        case ReadSlot::arrived: asset.slot.set(ReadSlot::free, 0); return Status::ok;
        case ReadSlot::failed: asset.slot.set(ReadSlot::free, 0); return Status::read_failed;
        default: return Status::pending;
    }
}

/// Measures or places all tables of the directory.
void lay_out(Arena& arena, const format::Header& h, format::DirectoryTables& tables, uint8_t*& model,
             char*& settings) {
    tables.frame_times = arena.take_array<double>(h.frame_time_count);
    tables.windows = arena.take_array<format::WindowRecord>(h.window_count);
    tables.chunks = arena.take_array<format::ChunkRecord>(h.chunk_count);
    model = arena.take_array<uint8_t>(h.model_bytes);
    settings = arena.take_array<char>(uint64_t(h.settings_bytes) + 1);
}

/// Sums of one window that sizes and suggestions come from.
struct WindowNeed {
    uint64_t points = 0, drops = 0, bytes = 0;
    uint32_t finest = 0;  ///< layer that has points
    float spacing = 0;    ///< of points down to there
};
WindowNeed need_of(const format::DirectoryTables& tables, const format::WindowRecord& w) {
    WindowNeed need;
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& c = tables.chunks[w.first_chunk + k];
        need.points += c.point_count;
        need.drops += c.drop_count;
        need.bytes += reading_bytes(c) + block_alignment;
        if (c.point_count && c.layer >= need.finest) need.finest = c.layer, need.spacing = c.spacing;
    }
    return need;
}

/// Of a mesh in cells of the source's size. A point stands for a square of its spacing, and a surface crosses 1.5 cells for each
/// face of a cell that it is as large as, averaged over its directions. Where tracks are short that counts many that are not alive at
/// once: 40 a point are ample then. Few points with much surface are calm liquid, no larger than a few times the box it fills.
uint64_t vertices_for(const WindowNeed& need, const format::Header& h) {
    constexpr double cells_per_face = 1.5, ample = 40, folded = 2, per_drop = 60, least = 200000, most = 1 << 24;
    double box = 0;  // its surface, in faces of a cell
    for (int a = 0; a < 3; ++a)
        box += 2 * double(h.upper[a] - h.lower[a]) * double(h.upper[(a + 1) % 3] - h.lower[(a + 1) % 3]) / (double(h.cell_size) * h.cell_size);
    const double across = double(need.spacing) / h.cell_size, points = double(need.points);
    const double calm = cells_per_face * std::min(points * across * across, folded * box);
    return uint64_t(std::clamp(std::max(ample * points, calm) + per_drop * double(need.drops), least, most));
}
uint32_t saturate(uint64_t x) { return uint32_t(std::min<uint64_t>(x, UINT32_MAX)); }

void sum_up_windows(Directory& d) {
    uint64_t most_three = 0, last = 0, last_but_one = 0;
    // Twice round the end: clips that loop hold the last windows beside the first.
    for (uint32_t i = 0; i < d.header.window_count + 2; ++i) {
        const format::WindowRecord& w = d.tables.windows[i % d.header.window_count];
        const WindowNeed need = need_of(d.tables, w);
        d.info.most_points = std::max(d.info.most_points, saturate(need.points + need.drops));
        d.info.largest_window_bytes = std::max(d.info.largest_window_bytes, need.bytes);
        d.info.blocks = std::max(d.info.blocks, uint32_t(w.block_count));
        d.most_point_tracks = std::max(d.most_point_tracks, saturate(need.points));
        d.most_drop_tracks = std::max(d.most_drop_tracks, saturate(need.drops));
        d.most_chunks = std::max(d.most_chunks, w.chunk_count);
        d.suggested_vertices = std::max(d.suggested_vertices, vertices_for(need, d.header));
        most_three = std::max(most_three, last_but_one + last + need.bytes);
        last_but_one = last;
        last = need.bytes;
    }
    // An eighth more: pieces of unequal size never fill a heap to the brim.
    d.suggested_resident_bytes = align_up(most_three + most_three / 8 + 4096);
}

/// The mean over the clip weighted by points, so that the choice of layers does not jump from window to window. What
/// a layer leaves wrong is its p99 error or, where none was measured, what its spacing hides.
void average_errors(Directory& d) {
    constexpr float hidden = 1 / 3.f;  // of the spacing
    double sum[format::max_layers] = {}, weight[format::max_layers] = {};
    for (uint32_t i = 0; i < d.header.chunk_count; ++i) {
        const format::ChunkRecord& c = d.tables.chunks[i];
        sum[c.layer] += double(c.error_p99 > 0 ? c.error_p99 : hidden * c.spacing) * c.point_count;
        weight[c.layer] += c.point_count;
    }
    for (uint32_t l = 0; l < d.header.layer_count; ++l) {
        const float before = l ? d.layer_error[l - 1] : farthest;  // a layer without points mends nothing
        d.layer_error[l] = weight[l] > 0 ? std::min(float(sum[l] / weight[l]), before) : before;
    }
}

void describe(Directory& d) {
    const format::Header& h = d.header;
    d.container = surface::container_of(h.lower, h.upper, h.walls, h.cell_size);
    AssetInfo& info = d.info;
    info.seconds = frame_time(d, h.frame_count - 1);
    info.first_seconds = h.first_seconds;
    info.frames_per_second = h.frames_per_second;
    std::memcpy(info.lower, h.lower, sizeof info.lower);
    std::memcpy(info.upper, h.upper, sizeof info.upper);
    info.cell_size = h.cell_size;
    info.format = h.version;
    info.frames = h.frame_count;
    info.windows = h.window_count;
    info.layers = h.layer_count;
    info.first_frame = h.first_frame;
    info.frame_step = h.frame_step;
    info.content_hash = h.content_hash;
    info.settings_json = reinterpret_cast<const char*>(d.tables.settings);
    sum_up_windows(d);
    average_errors(d);
}

/// The tables first, the basis after: its size depends on the longest window.
Status parse_directory(Asset& asset) {
    Directory& d = asset.directory;
    const Memory& memory = asset.host.memory;
    uint8_t* model;
    char* settings;
    // The longest window is known only after parsing; the clip bounds it just as well.
    const uint32_t longest = std::min(d.header.frame_count, format::max_window_samples);
    Arena measure;
    lay_out(measure, d.header, d.tables, model, settings);
    measure.take(format::basis_tables_bytes(longest));

    asset.tables = memory.allocate(memory.user, measure.used, block_alignment);
    if (!asset.tables) return fail(asset, Status::out_of_memory, "no memory for the directory");
    asset.tables_bytes = measure.used;
    Arena place{static_cast<uint8_t*>(asset.tables)};
    lay_out(place, d.header, d.tables, model, settings);

    const char* reason = "";
    const Status status = format::check_directory(d.header, asset.directory_bytes, d.tables, &reason);
    if (status != Status::ok) return fail(asset, status, reason);
    if (d.header.model_bytes) std::memcpy(model, d.tables.model, d.header.model_bytes);
    if (d.header.settings_bytes) std::memcpy(settings, d.tables.settings, d.header.settings_bytes);
    settings[d.header.settings_bytes] = 0;
    d.tables.model = model;
    d.tables.settings = reinterpret_cast<const uint8_t*>(settings);
    format::build_basis_tables(d.basis, place.take(format::basis_tables_bytes(longest)), longest);
    memory.release(memory.user, asset.directory_bytes, d.header.directory_bytes);
    asset.directory_bytes = nullptr;
    describe(d);
    asset.phase = Phase::ready;
    return Status::ok;
}

uint32_t header_bytes_present(const Asset& asset) {
    return uint32_t(std::min<uint64_t>(asset.file_bytes, format::header_bytes));
}

Status advance_header(Asset& asset) {
    const uint32_t bytes = header_bytes_present(asset);
    // A file with nothing in it needs no read to be refused.
    const Status read = bytes ? read_whole(asset, 0, asset.header_bytes, bytes) : Status::ok;
    if (read == Status::read_failed) return fail(asset, read, "the header could not be read");
    if (read != Status::ok) return read;
    const char* reason = "";
    const Status status =
        format::check_header(asset.header_bytes, bytes, asset.file_bytes, asset.directory.header, &reason);
    if (status != Status::ok) return fail(asset, status, reason);
    asset.phase = Phase::directory;
    return Status::ok;
}

Status advance_directory(Asset& asset) {
    const uint32_t bytes = asset.directory.header.directory_bytes;
    const Memory& memory = asset.host.memory;
    if (!asset.directory_bytes) {
        asset.directory_bytes = static_cast<uint8_t*>(memory.allocate(memory.user, bytes, block_alignment));
        if (!asset.directory_bytes) return fail(asset, Status::out_of_memory, "no memory for the directory");
    }
    const Status read = read_whole(asset, format::header_bytes, asset.directory_bytes, bytes);
    if (read == Status::read_failed) return fail(asset, read, "the directory could not be read");
    return read == Status::ok ? parse_directory(asset) : read;
}

}  // namespace

float layer_limit(const Directory& directory, uint32_t layer) noexcept {
    if (layer == 0) return farthest;
    return std::max(directory.layer_error[layer - 1] / format::fine_enough, directory.header.cell_size / layer_fades);
}

double frame_time(const Directory& directory, uint32_t index) noexcept {
    return directory.header.frame_time_count ? directory.tables.frame_times[index]
                                             : index / directory.header.frames_per_second;
}

uint64_t decoded_bytes(const format::ChunkRecord& chunk) noexcept {
    const uint64_t tracks = uint64_t(chunk.point_count) + chunk.drop_count;
    return align_up(sizeof(format::TrackBlock)) + align_up(tracks * sizeof(format::Track)) +
           align_up(uint64_t(chunk.coefficient_count) * sizeof(float));
}

uint64_t reading_bytes(const format::ChunkRecord& chunk) noexcept {
    return decoded_bytes(chunk) + align_up(chunk.bytes);
}

void ReadSlot::complete(uint64_t ticket, bool did_arrive) noexcept {
    uint64_t expected = ticket << 2 | out;
    word.compare_exchange_strong(expected, ticket << 2 | (did_arrive ? arrived : failed),
                                 std::memory_order_release, std::memory_order_relaxed);
}

void log(const Asset& asset, Status status, const char* message) noexcept {
    if (asset.host.log) asset.host.log(asset.host.log_user, status, message);
}

void release_tables(Asset& asset) noexcept {
    const Memory& memory = asset.host.memory;
    if (asset.directory_bytes)
        memory.release(memory.user, asset.directory_bytes, asset.directory.header.directory_bytes);
    if (asset.tables) memory.release(memory.user, asset.tables, asset.tables_bytes);
    asset.directory_bytes = nullptr;
    asset.tables = nullptr;
}

void start_asset(Asset& asset) noexcept {
    if (const uint32_t bytes = header_bytes_present(asset)) begin_read(asset, 0, asset.header_bytes, bytes);
}

Status advance_asset(Asset& asset) noexcept {
    if (asset.phase == Phase::header) {
        const Status status = advance_header(asset);
        if (status != Status::ok) return status;
    }
    if (asset.phase == Phase::directory) return advance_directory(asset);
    return asset.phase == Phase::ready ? Status::ok : asset.failure;
}

}  // namespace rill
