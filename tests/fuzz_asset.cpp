// SPDX-License-Identifier: MIT
// Any bytes as an asset: opened, played at several moments, closed. Each input is tried as it is and once more with
// its checksums put right, or nothing behind them would ever be reached.
#define DOCTEST_CONFIG_DISABLE
#include <cstdlib>

#include "fuzz_harness.h"
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"  // in what is only checked
#pragma GCC diagnostic ignored "-Wunused-variable"
#include "harness.h"
#pragma GCC diagnostic pop

using harness::Bytes;
namespace format = rill::format;

namespace {

constexpr uint32_t most_vertices = 3000, most_indices = 18000;

/// The heap, up to a size that no seed comes near.
struct LimitedMemory {
    static constexpr size_t most = size_t(256) << 20;
    size_t used = 0;
    rill::Memory callbacks() {
        return {this,
                [](void* user, size_t bytes, size_t alignment) -> void* {
                    LimitedMemory& self = *static_cast<LimitedMemory*>(user);
                    if (bytes > most - self.used) return nullptr;
                    self.used += bytes;
                    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
                },
                [](void* user, void* block, size_t bytes) {
                    static_cast<LimitedMemory*>(user)->used -= bytes;
                    std::free(block);
                }};
    }
};

void play(const Bytes& bytes) {
    LimitedMemory memory;
    rill::Host host;
    host.memory = memory.callbacks();
    rill::MemoryReader reader{bytes.data(), bytes.size()};
    rill::Asset* asset = nullptr;
    if (rill::open(host, rill::memory_io(&reader), bytes.size(), &asset) != rill::Status::ok) return;
    rill::AssetInfo info{};
    rill::Status status;
    while ((status = rill::poll(asset, &info)) == rill::Status::pending) {}
    rill::Player* player = nullptr;
    rill::Limits limits;
    if (status == rill::Status::ok) {
        limits = rill::suggest_limits(asset);
        limits.vertices = std::min(limits.vertices, most_vertices), limits.indices = std::min(limits.indices, most_indices);
        status = rill::create(asset, limits, &player);
    }
    if (status == rill::Status::ok) {
        std::vector<float> position(3 * most_vertices), normal(position.size()), velocity(position.size());
        std::vector<uint32_t> indices(most_indices);
        std::vector<rill::Range> ranges(512);
        rill::Target target{};
        target.position = {position.data(), 12}, target.normal = {normal.data(), 12}, target.velocity = {velocity.data(), 12};
        target.indices = indices.data(), target.ranges = ranges.data();
        target.vertex_capacity = most_vertices, target.index_capacity = most_indices, target.range_capacity = 512;
        for (double share : {0.0, 0.4, 1.0}) {
            rill::Frame frame{};
            frame.seconds = share * info.seconds, frame.rate = 1, frame.target = &target;
            frame.budget.cell_size = 2 * info.cell_size;
            if (rill::begin_frame(player, frame) != rill::Status::ok) break;
            rill::end_frame(player, nullptr);
            for (uint32_t i = 0; i < target.indices_used; ++i)
                if (indices[i] >= target.vertices_used) std::abort();
            for (uint32_t i = 0; i < 3 * target.vertices_used; ++i)
                if (!std::isfinite(position[i]) || !std::isfinite(normal[i])) std::abort();
        }
        while (rill::destroy(player) == rill::Status::pending) {}
    }
    while (rill::close(asset) == rill::Status::pending) {}
    if (memory.used != 0) std::abort();
}

/// Every size and checksum as the rest says it should be.
void put_right(Bytes& bytes) {
    using namespace harness;
    if (bytes.size() < format::header_bytes) return;
    put(bytes, offsetof(format::Header, file_bytes), uint64_t(bytes.size()));
    const format::Header header = header_of(bytes);
    const uint64_t windows = format::header_bytes + uint64_t(header.frame_time_count) * sizeof(double);
    uint64_t content = format::fnv1a_start, at = windows + uint64_t(header.window_count) * format::window_record_bytes;
    for (uint32_t w = 0; w < header.window_count; ++w) {
        const uint64_t place = windows + uint64_t(w) * format::window_record_bytes;
        if (place + format::window_record_bytes > bytes.size()) break;
        const auto window = get<format::WindowRecord>(bytes, place);
        uint64_t offset = window.offset;
        for (uint32_t i = 0; i < window.chunk_count && at + format::chunk_record_bytes <= bytes.size(); ++i, at += format::chunk_record_bytes) {
            const auto size = get<uint32_t>(bytes, at + field_bytes);
            uint32_t crc = get<uint32_t>(bytes, at + field_crc);
            if (offset <= bytes.size() && size <= bytes.size() - offset)
                put(bytes, at + field_crc, crc = format::crc32(bytes.data() + offset, size));
            content = format::fnv1a(content, crc), offset += size;
        }
    }
    put(bytes, offsetof(format::Header, content_hash), content);
    seal(bytes);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    std::vector<std::string> seeds;
    for (const bool more : {false, true}) {
        harness::Clip clip;
        clip.frames = more ? 6 : 1, clip.window = 2, clip.points = 40, clip.layers = more ? 2 : 1, clip.drop = more, clip.uneven = more;
        const Bytes bytes = harness::make_ball(clip);
        seeds.emplace_back(bytes.begin(), bytes.end());
    }
    fuzz::write_seeds(*argc, *argv, seeds);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    Bytes bytes(data, data + size);
    play(bytes);
    put_right(bytes);
    play(bytes);
    return 0;
}
