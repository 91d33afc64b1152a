// SPDX-License-Identifier: MIT
// What the runtime's tests stand on: a guarded, counting, fail-the-nth allocator; an IO that does as it is
// told; jobs in a bad order; and a small clip, a ball of points that sways, whose every moment is known.
#pragma once
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "asset/chunks_to_asset.h"
#include "asset/layers_to_chunks.h"
#include "format/crc32.h"
#include "rill/host.h"
#include "rill/rill.h"

namespace harness {

using Bytes = std::vector<uint8_t>;

// ---- memory -----------------------------------------------------------------------------------------

/// Every block lies between guards, is given back with its own size, and is counted.
struct GuardedMemory {
    static constexpr size_t guard = 64;
    static constexpr uint8_t mark = 0xA5;
    std::map<void*, size_t> blocks;
    uint64_t calls = 0, largest = 0, last = 0;
    uint64_t fail_at = 0;  ///< the how many-th allocation fails; 0: none

    ~GuardedMemory() { CHECK(blocks.empty()); }

    rill::Memory callbacks() {
        return {this,
                [](void* user, size_t bytes, size_t alignment) { return static_cast<GuardedMemory*>(user)->take(bytes, alignment); },
                [](void* user, void* block, size_t bytes) { static_cast<GuardedMemory*>(user)->give(block, bytes); }};
    }

private:
    void* take(size_t bytes, size_t alignment) {
        CHECK(alignment <= guard);
        ++calls;
        if (calls == fail_at) return nullptr;
        largest = std::max<uint64_t>(largest, bytes);
        last = bytes;
        const size_t whole = (bytes + 2 * guard + guard - 1) / guard * guard;
        auto* base = static_cast<uint8_t*>(std::aligned_alloc(guard, whole));
        REQUIRE(base);
        std::memset(base, mark, whole);
        std::memset(base + guard, 0xCD, bytes);  // nobody may count on zeros
        blocks[base + guard] = bytes;
        return base + guard;
    }
    void give(void* block, size_t bytes) {
        REQUIRE(blocks.count(block) == 1);
        CHECK(blocks[block] == bytes);
        auto* base = static_cast<uint8_t*>(block) - guard;
        const auto whole = [](const uint8_t* from, size_t size) {
            return std::all_of(from, from + size, [](uint8_t b) { return b == mark; });
        };
        CHECK(whole(base, guard));
        CHECK(whole(base + guard + bytes, guard));
        blocks.erase(block);
        std::free(base);
    }
};

// ---- IO -----------------------------------------------------------------------------------------------

/// Reads out of `file`, when and how the script says.
struct ScriptedIo {
    enum Action { now, later, refuse, fail };
    Bytes file;
    std::function<Action(const rill::Read&)> script = [](const rill::Read&) { return now; };
    std::vector<rill::Read> asked, pending;
    std::vector<uint64_t> forgotten;

    rill::Io callbacks() {
        return {this, [](void* user, const rill::Read& read) { return static_cast<ScriptedIo*>(user)->begin(read); },
                [](void* user, uint64_t ticket) { static_cast<ScriptedIo*>(user)->forgotten.push_back(ticket); }};
    }
    /// Completes the pending read at `index`.
    void deliver(size_t index, bool arrives = true) {
        const rill::Read read = pending.at(index);
        pending.erase(pending.begin() + long(index));
        complete(read, arrives);
    }
    void deliver_all(bool arrives = true) {
        while (!pending.empty()) deliver(0, arrives);
    }

private:
    bool begin(const rill::Read& read) {
        const Action action = script(read);
        if (action == refuse) return false;
        asked.push_back(read);
        if (action == later) pending.push_back(read);
        else complete(read, action == now);
        return true;
    }
    void complete(const rill::Read& read, bool arrives) {
        const bool inside = read.file_offset <= file.size() && read.bytes <= file.size() - read.file_offset;
        if (arrives && inside) std::memcpy(read.destination, file.data() + read.file_offset, read.bytes);
        rill::complete_read(read.asset, read.ticket, arrives && inside);
    }
};

// ---- jobs ---------------------------------------------------------------------------------------------

/// One thread that runs the tasks of all batches in an order nobody expects, each on another worker.
struct ShuffledJobs {
    struct Job {
        rill::Task task;
        void* context;
        uint32_t index;
    };
    std::vector<Job> queue;
    uint32_t workers = 3, turn = 0, seed = 1;

    rill::Jobs callbacks() {
        return {this, workers,
                [](void* user, rill::Task task, void* context, uint32_t count, bool) {
                    for (uint32_t i = 0; i < count; ++i)
                        static_cast<ShuffledJobs*>(user)->queue.push_back({task, context, i});
                },
                [](void* user) { static_cast<ShuffledJobs*>(user)->run_one(); }};
    }
    void run_one() {
        if (queue.empty()) return;
        seed = seed * 1664525u + 1013904223u;
        const size_t pick = (seed >> 8) % queue.size();
        const Job job = queue[pick];
        queue.erase(queue.begin() + long(pick));
        job.task(job.context, job.index, turn++ % workers);
    }
};

// ---- a clip -------------------------------------------------------------------------------------------

struct Clip {
    uint32_t frames = 25, window = 8;  ///< window: frames it spans; it touches one more
    uint32_t points = 600, layers = 3;
    bool uneven = false;               ///< frame times, steps of 0.9 … 1.1 of even
    bool drop = false;                 ///< one drop beside the ball
    uint32_t across = 0;               ///< blocks are so many cubed boxes of the ball; 0: two halves, wide bounds
    float cell = 0.08f;                ///< the source's
    std::string settings = "{\"made\":\"by the tests\"}";

    static constexpr double fps = 24;
    static constexpr float radius = 1;
    double seconds(uint32_t frame) const {
        return (frame + (uneven ? 0.25 * std::sin(0.4 * frame) : 0.0)) / fps;
    }
    /// The ball's middle sways along x.
    static glm::vec3 centre(double seconds) { return {float(0.4 * std::sin(3 * seconds)), 0, 0}; }
    static glm::vec3 velocity(double seconds) { return {float(1.2 * std::cos(3 * seconds)), 0, 0}; }
};

inline glm::vec3 on_sphere(uint32_t i, uint32_t count) {
    const double z = 1 - (2 * i + 1) / double(count), round = i * 2.39996322972865332;
    const double r = std::sqrt(1 - z * z);
    return {float(r * std::cos(round)), float(r * std::sin(round)), float(z)};
}

inline rill::cooker::TrackSamples ball_track(const Clip& clip, glm::vec3 direction, uint32_t first, uint32_t samples) {
    rill::cooker::TrackSamples track;
    track.death = uint8_t(samples - 1);
    for (uint32_t s = 0; s < samples; ++s) {
        track.position.push_back(Clip::centre(clip.seconds(first + s)) + direction * Clip::radius);
        track.normal.push_back(direction);
    }
    return track;
}

inline rill::cooker::TrackSamples drop_track(uint32_t samples) {
    rill::cooker::TrackSamples track;
    track.death = uint8_t(samples - 1);
    track.drop = true;
    track.position.assign(samples, {0, 3, 0});
    track.shape.assign(samples, {0.2f, 0.2f, 0.2f, 0, 0, 0});
    return track;
}

/// Block of a direction, and the box of its part of the ball.
inline uint32_t block_of(const Clip& clip, glm::vec3 direction) {
    if (!clip.across) return direction.x < 0 ? 0 : 1;
    uint32_t block = 0;
    for (int a = 2; a >= 0; --a)
        block = block * clip.across + std::min(uint32_t((direction[a] + 1) / 2 * float(clip.across)), clip.across - 1);
    return block;
}
inline void bound_chunk(const Clip& clip, uint32_t block, uint32_t first, uint32_t samples,
                        rill::cooker::ChunkToWrite& chunk) {
    if (!clip.across) {
        chunk.lower = {block ? -0.5f : -1.5f, -1.01f, -1.01f};
        chunk.upper = {block ? 1.5f : 0.5f, clip.drop && block ? 3.3f : 1.01f, 1.01f};
        return;
    }
    const float size = 2 / float(clip.across);
    glm::vec3 low(1e9f), high(-1e9f);
    for (uint32_t s = 0; s < samples; ++s)
        low = glm::min(low, Clip::centre(clip.seconds(first + s))), high = glm::max(high, Clip::centre(clip.seconds(first + s)));
    const glm::vec3 corner = size * glm::vec3(block % clip.across, block / clip.across % clip.across, block / clip.across / clip.across);
    chunk.lower = low + corner - 1.01f;
    chunk.upper = high + corner + size - 0.99f;
}

inline constexpr glm::vec3 ball_lower = {-1.5f, -1.1f, -1.1f};

/// Blocks as Clip says, `layers` layers of which each doubles the points.
inline std::vector<rill::cooker::ChunkToWrite> ball_chunks(const Clip& clip, uint32_t first, uint32_t samples) {
    using namespace rill;
    const cooker::Quantiser quantiser{1e-4f, 2, 1e-3f, 2e-4f, 2e-3f};
    const glm::vec3 origin = ball_lower;
    std::vector<double> memory(format::basis_tables_bytes(samples) / sizeof(double) + 2);
    format::BasisTables tables{};
    format::build_basis_tables(tables, memory.data(), samples);

    const uint32_t blocks = clip.across ? clip.across * clip.across * clip.across : 2;
    std::vector<std::vector<cooker::QuantisedTrack>> sets(clip.layers * blocks);
    for (uint32_t i = 0; i < clip.points; ++i) {
        // i in bit-reversed halves: every prefix is even.
        uint32_t layer = clip.layers - 1, stride = i;
        while (layer > 0 && stride % 2 == 0) stride /= 2, --layer;
        const glm::vec3 direction = on_sphere(i, clip.points);
        const cooker::TrackSamples track = ball_track(clip, direction, first, samples);
        sets[layer * blocks + block_of(clip, direction)].push_back(quantise_track(track, quantiser, origin, tables));
    }
    if (clip.drop) sets[1].push_back(quantise_track(drop_track(samples), quantiser, origin, tables));

    std::vector<cooker::ChunkToWrite> chunks;
    uint32_t points = 0;
    for (uint32_t layer = 0; layer < clip.layers; ++layer) {
        for (uint32_t block = 0; block < blocks; ++block) points += uint32_t(sets[layer * blocks + block].size());
        for (uint32_t block = 0; block < blocks; ++block) {
            const auto& set = sets[layer * blocks + block];
            if (set.empty()) continue;
            cooker::ChunkToWrite chunk;
            chunk.encoded = encode_chunk(set, quantiser, origin, samples, {});
            chunk.layer = layer;
            chunk.block = block;
            bound_chunk(clip, block, first, samples, chunk);
            chunk.spacing = std::sqrt(12.6f / float(std::max(points, 1u)));
            chunks.push_back(std::move(chunk));
        }
    }
    return chunks;
}

inline std::string scratch_path(const std::string& name) {
    static uint32_t serial = 0;
    return (std::filesystem::temp_directory_path() /
            ("rill_" + std::to_string(::getpid()) + "_" + std::to_string(serial++) + "_" + name)).string();
}

inline Bytes read_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return Bytes(std::istreambuf_iterator<char>(file), {});
}

inline rill::cooker::AssetFacts ball_facts(const Clip& clip) {
    rill::cooker::AssetFacts facts;
    facts.frame_count = clip.frames;
    facts.first_frame = 5;
    facts.layer_count = clip.layers;
    facts.frames_per_second = Clip::fps;
    for (uint32_t f = 0; clip.uneven && f < clip.frames; ++f) facts.frame_seconds.push_back(clip.seconds(f));
    facts.cell_size = clip.cell;
    facts.lower = ball_lower;
    facts.upper = {1.5f, clip.drop ? 3.3f : 1.1f, 1.1f};
    facts.settings_json = clip.settings;
    return facts;
}

inline void write_ball(const Clip& clip, const std::string& path) {
    rill::cooker::AssetWriter writer(path);
    for (uint32_t first = 0; first == 0 || first + 1 < clip.frames; first += clip.window) {
        const uint32_t samples = std::min(clip.window + 1, clip.frames - first);
        writer.add_window(first, samples, clip.across ? clip.across * clip.across * clip.across : 2,
                          ball_chunks(clip, first, samples));
    }
    writer.finish(ball_facts(clip));
}

inline Bytes make_ball(const Clip& clip = {}) {
    const std::string path = scratch_path("ball.rill");
    write_ball(clip, path);
    const Bytes bytes = read_file(path);
    std::filesystem::remove(path);
    return bytes;
}

// ---- the records of an asset in memory ------------------------------------------------------------------

template <class T>
T get(const Bytes& bytes, size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}
template <class T>
void put(Bytes& bytes, size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
}
inline rill::format::Header header_of(const Bytes& bytes) { return get<rill::format::Header>(bytes, 0); }
inline size_t windows_at(const Bytes& bytes) {
    return rill::format::header_bytes + header_of(bytes).frame_time_count * sizeof(double);
}
inline size_t chunks_at(const Bytes& bytes) {
    return windows_at(bytes) + header_of(bytes).window_count * rill::format::window_record_bytes;
}
inline size_t chunk_at(const Bytes& bytes, uint32_t index) { return chunks_at(bytes) + index * rill::format::chunk_record_bytes; }
inline rill::format::WindowRecord window_of(const Bytes& bytes, uint32_t index) {
    return get<rill::format::WindowRecord>(bytes, windows_at(bytes) + index * rill::format::window_record_bytes);
}
/// Offsets of fields in the record of a chunk, and that record without what no test asks for.
enum ChunkField : size_t { field_bytes = 0, field_crc = 4, field_layer = 8, field_block = 9, field_points = 10, field_drops = 13,
                           field_coefficients = 16, field_lower = 20, field_upper = 26, field_spacing = 32 };
inline rill::format::ChunkRecord chunk_of(const Bytes& bytes, uint32_t index) {
    const size_t at = chunk_at(bytes, index);
    rill::format::ChunkRecord chunk{};
    chunk.bytes = get<uint32_t>(bytes, at + field_bytes), chunk.crc = get<uint32_t>(bytes, at + field_crc);
    chunk.layer = bytes[at + field_layer], chunk.block = bytes[at + field_block];
    uint32_t window = 0;
    while (index >= window_of(bytes, window).first_chunk + window_of(bytes, window).chunk_count) ++window;
    chunk.offset = window_of(bytes, window).offset;
    for (uint32_t i = window_of(bytes, window).first_chunk; i < index; ++i) chunk.offset += get<uint32_t>(bytes, chunk_at(bytes, i) + field_bytes);
    return chunk;
}
/// Makes the checksums of header and directory right again after a change.
inline void seal(Bytes& bytes) {
    using namespace rill::format;
    const Header h = header_of(bytes);
    const uint64_t room = bytes.size() - header_bytes;
    put(bytes, offsetof(Header, directory_crc), crc32(bytes.data() + header_bytes, std::min<uint64_t>(h.directory_bytes, room)));
    put(bytes, offsetof(Header, header_crc), crc32(bytes.data(), header_bytes - 4));
}

// ---- playing --------------------------------------------------------------------------------------------

/// An asset opened over a ScriptedIo; closes itself, however long that takes.
struct Opened {
    GuardedMemory memory;
    ScriptedIo io;
    std::vector<std::string> log;
    rill::Host host;
    rill::Asset* asset = nullptr;
    rill::AssetInfo info{};

    explicit Opened(Bytes bytes) {
        io.file = std::move(bytes);
        host.memory = memory.callbacks();
        host.log_user = this;
        host.log = [](void* user, rill::Status, const char* message) {
            static_cast<Opened*>(user)->log.push_back(message);
        };
    }
    ~Opened() {
        while (asset && rill::close(asset) == rill::Status::pending) io.deliver_all(false);
    }
    /// The last word of poll(); pending only if the IO keeps its reads.
    rill::Status open() {
        const rill::Status status = rill::open(host, io.callbacks(), io.file.size(), &asset);
        return status == rill::Status::ok ? poll() : status;
    }
    rill::Status poll() {
        rill::Status status = rill::Status::pending;
        for (int i = 0; i < 4 && status == rill::Status::pending; ++i) status = rill::poll(asset, &info);
        return status;
    }
};

/// A player with buffers that are as large as told, in blocks of exactly that size.
struct Playing {
    Opened& opened;
    rill::Player* player = nullptr;
    std::vector<glm::vec3> positions, normals, velocities;
    std::vector<uint32_t> indices;
    std::vector<rill::Range> ranges;
    std::unique_ptr<uint32_t[]> no_indices{new uint32_t[0]};
    std::unique_ptr<rill::Range[]> no_ranges{new rill::Range[0]};
    rill::Target target{};
    rill::Frame frame{};
    rill::Stats stats{};

    explicit Playing(Opened& over, rill::Limits limits = {}) : opened(over) {
        frame.rate = 1;
        resize(40000, 240000, 512);
        CHECK(rill::create(over.asset, limits, &player) == rill::Status::ok);
    }
    ~Playing() {
        while (player && rill::destroy(player) == rill::Status::pending) opened.io.deliver_all(false);
    }
    void resize(uint32_t vertex_count, uint32_t index_count, uint32_t range_count) {
        positions = std::vector<glm::vec3>(vertex_count);
        normals = positions;
        velocities = positions;
        indices = std::vector<uint32_t>(index_count);
        ranges = std::vector<rill::Range>(range_count);
        target = {};
        target.position = {positions.data(), sizeof(glm::vec3)};
        target.normal = {normals.data(), sizeof(glm::vec3)};
        target.velocity = {velocities.data(), sizeof(glm::vec3)};
        // Null would mean "not wanted": nothing at all is something else.
        target.indices = index_count ? indices.data() : no_indices.get();
        target.ranges = range_count ? ranges.data() : no_ranges.get();
        target.vertex_capacity = vertex_count;
        target.index_capacity = index_count;
        target.range_capacity = range_count;
    }
    rill::Status draw(double seconds) { return run(seconds, &target); }
    /// The same without a mesh.
    rill::Status stream(double seconds) { return run(seconds, nullptr); }
    rill::Status run(double seconds, rill::Target* into) {
        frame.seconds = seconds;
        frame.target = into;
        CHECK(rill::begin_frame(player, frame) == rill::Status::ok);
        return rill::end_frame(player, &stats);
    }
    /// Of everything a frame wrote.
    uint64_t hash() const {
        uint64_t h = rill::format::fnv1a_start;
        const auto add = [&](const void* data, size_t size) {
            h = rill::format::fnv1a(h, rill::format::crc32(data, size));
            h = rill::format::fnv1a(h, uint32_t(size));
        };
        add(positions.data(), target.vertices_used * sizeof(glm::vec3));
        add(normals.data(), target.vertices_used * sizeof(glm::vec3));
        add(velocities.data(), target.vertices_used * sizeof(glm::vec3));
        add(indices.data(), target.indices_used * sizeof(uint32_t));
        add(ranges.data(), target.ranges_used * sizeof(rill::Range));
        return h;
    }
};

}  // namespace harness
