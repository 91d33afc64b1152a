// SPDX-License-Identifier: MIT
// Playing from simulated disks and networks, in simulated time: latency, bandwidth, failures; loops and seeks; files
// far larger than memory; many players of one file.
#include "harness.h"

#include <random>

using namespace harness;
using rill::Status;
using Action = ScriptedIo::Action;

namespace {

constexpr double frame_time = 1 / 60.0;

/// One request after the other through a line of so many bytes a second; each then takes `latency` to arrive.
struct Line {
    double latency, bytes_per_second, failures;
    double now = 0, free_at = 0;
    std::map<uint64_t, double> due;
    std::mt19937 random{1};

    Line(double seconds, double rate, double failing = 0) : latency(seconds), bytes_per_second(rate), failures(failing) {}
    void connect(ScriptedIo& io) {
        io.script = [this](const rill::Read& read) {
            free_at = std::max(free_at, now) + read.bytes / bytes_per_second;
            due[read.ticket] = free_at + latency;
            return Action::later;
        };
    }
    void advance(ScriptedIo& io, double seconds) {
        now += seconds;
        for (size_t i = 0; i < io.pending.size();) {
            if (due[io.pending[i].ticket] > now) ++i;
            else io.deliver(i, std::uniform_real_distribution<>(0, 1)(random) >= failures);
        }
    }
};

const Bytes& ball() {
    static const Bytes bytes = make_ball();
    return bytes;
}

/// What a second of playing back takes.
double bytes_per_clip_second(const Opened& opened) { return double(opened.io.file.size()) / opened.info.seconds; }

struct Outcome {
    int late = 0, last_late = -1, empty = 0;
    uint32_t failed = 0;
};
/// Plays `frames` frames, round and round.
Outcome play(Opened& opened, Line& line, int frames, float rate, double from = 0) {
    Playing playing(opened);
    playing.frame.rate = rate;
    playing.frame.loops = true;
    playing.frame.budget.cell_size = 0.3f;
    Outcome outcome;
    for (int i = 0; i < frames; ++i) {
        const double clip = opened.info.seconds, at = from + i * frame_time * rate;
        const double seconds = at - clip * std::floor(at / clip);
        const bool drawn = i % 12 == 0;
        const Status status = drawn ? playing.draw(seconds) : playing.stream(seconds);
        CHECK(status >= Status::ok);
        CHECK((status == Status::clipped) == (playing.stats.cut != 0));
        CHECK((playing.stats.chunks_late > 0) == ((playing.stats.cut & rill::cut_late) != 0));
        if (playing.stats.chunks_late) ++outcome.late, outcome.last_late = i;
        outcome.empty += drawn && playing.target.indices_used == 0;
        line.advance(opened.io, frame_time);
    }
    outcome.failed = playing.stats.reads_failed;
    return outcome;
}

}  // namespace

TEST_CASE("any line that carries the clip plays it without a gap, after the start") {
    for (const double latency : {1e-4, 5e-3, 0.05, 0.2})
        for (const double bandwidth : {0.3e6, 5e6, 100e6})
            for (const float rate : {1.0f, -1.0f, 0.1f}) {
                CAPTURE(latency);
                CAPTURE(bandwidth);
                CAPTURE(rate);
                Opened opened(ball());
                REQUIRE(opened.open() == Status::ok);
                REQUIRE(bandwidth > 2 * bytes_per_clip_second(opened));
                Line line{latency, bandwidth};
                line.connect(opened.io);
                const Outcome outcome = play(opened, line, 240, rate);
                const double start = latency + double(opened.io.file.size()) / bandwidth;
                CHECK(outcome.last_late <= int(start / frame_time) + 1);
                CHECK(outcome.failed == 0);
                opened.io.deliver_all();
            }
}

TEST_CASE("five reads in a hundred fail: nothing stops, prefetch hides most of it") {
    Clip clip;
    clip.frames = 97;
    Opened opened(make_ball(clip));
    REQUIRE(opened.open() == Status::ok);
    Line line{0.02, 1e6, 0.05};
    line.connect(opened.io);
    int late = 0;
    uint32_t failed = 0;
    for (int player = 0; player < 8; ++player) {
        const Outcome outcome = play(opened, line, 240, 1, 0.1 * player);
        late += outcome.late, failed += outcome.failed;
        CHECK(outcome.empty <= 1);
        opened.io.deliver_all();
    }
    CHECK(failed > 3);
    CHECK(late < 8 * 240 / 20);
}

TEST_CASE("a line too slow for the clip: coarse first, detail later, and all of it in the end") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Line line{0.05, bytes_per_clip_second(opened) / 5};
    line.connect(opened.io);
    Playing playing(opened);
    uint32_t layers = 0, points = 0, steps = 0;
    for (int i = 0; i < 600; ++i) {
        CHECK(playing.draw(0.4) >= Status::ok);
        CHECK(playing.stats.layers_drawn >= layers);
        CHECK(playing.stats.points_used >= points);
        steps += playing.stats.points_used > points;
        layers = playing.stats.layers_drawn, points = playing.stats.points_used;
        line.advance(opened.io, frame_time);
    }
    CHECK(layers == 3);
    CHECK(steps >= 4);
    CHECK(playing.draw(0.4) == Status::ok);
    opened.io.deliver_all();
}

TEST_CASE("seek: the picture comes after one way there and back, and one window is decoded") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    for (const double latency : {0.001, 0.05, 0.2}) {
        Line line{latency, 100e6};
        line.connect(opened.io);
        Playing playing(opened);
        playing.frame.rate = 0.001f;
        playing.frame.budget.cell_size = 0.3f;
        int frames = 0;
        do {
            playing.draw(0.9);
            line.advance(opened.io, frame_time);
            ++frames;
        } while (playing.target.indices_used == 0 && frames < 100);
        CHECK(frames <= 2 + int(latency / frame_time) + 1);
        CHECK(playing.stats.windows_decoded == 1);
        CHECK(playing.stats.chunks_late == 0);
        opened.io.deliver_all();
    }
}

TEST_CASE("looping: beyond the end the beginning is there already, either way") {
    Clip clip;
    clip.frames = 97;  // twelve windows, of which four or five are held
    Opened opened(make_ball(clip));
    REQUIRE(opened.open() == Status::ok);
    for (const float rate : {1.0f, -1.0f}) {
        const auto late_at_the_seam = [&](bool loops) {
            Line line{0.1, 5e6};
            line.connect(opened.io);
            Playing playing(opened);
            playing.frame.rate = rate;
            playing.frame.loops = loops;
            const double end = opened.info.seconds;
            const auto show = [&](double t) {
                playing.stream(t);
                line.advance(opened.io, frame_time);
                return playing.stats.chunks_late;
            };
            for (int i = 120; i >= 0; --i) show(rate > 0 ? end - i * frame_time : i * frame_time);
            uint32_t late = 0;
            for (int i = 0; i < 30; ++i) late += show(rate > 0 ? i * frame_time : end - i * frame_time);
            opened.io.deliver_all();
            return late;
        };
        CHECK(late_at_the_seam(true) == 0);
        CHECK(late_at_the_seam(false) > 0);  // what the flag is for
    }
}

TEST_CASE("a file of a gigabyte: only its directory is read, and what it takes is told exactly") {
    Bytes bytes = ball();
    const rill::format::Header h = header_of(bytes);
    constexpr uint64_t file_bytes = 1 << 30;
    std::map<uint64_t, uint64_t> original;  // offset in the large file → in the small one
    std::vector<std::pair<size_t, uint64_t>> moved;
    for (uint32_t i = 0; i < h.window_count; ++i) {
        const rill::format::WindowRecord window = window_of(bytes, i);
        const rill::format::ChunkRecord last = chunk_of(bytes, window.first_chunk + window.chunk_count - 1);
        const uint64_t far = file_bytes / h.window_count * (i + 1) - (last.offset + last.bytes - window.offset);
        for (uint32_t k = 0; k < window.chunk_count; ++k) {
            const uint64_t near = chunk_of(bytes, window.first_chunk + k).offset;
            original[far + near - window.offset] = near;
        }
        moved.emplace_back(windows_at(bytes) + i * rill::format::window_record_bytes, far);
    }
    for (const auto& [at, far] : moved) put(bytes, at, far);
    put(bytes, offsetof(rill::format::Header, file_bytes), file_bytes);
    seal(bytes);
    struct Sparse {
        const Bytes* small;
        const std::map<uint64_t, uint64_t>* original;
        uint64_t bytes_read = 0, reads = 0;
    } sparse{&bytes, &original};
    const rill::Io io{&sparse,
                      [](void* user, const rill::Read& read) {
                          auto& s = *static_cast<Sparse*>(user);
                          const auto chunk = s.original->find(read.file_offset);
                          const uint64_t from = chunk == s.original->end() ? read.file_offset : chunk->second;
                          std::memcpy(read.destination, s.small->data() + from, read.bytes);
                          s.bytes_read += read.bytes, ++s.reads;
                          rill::complete_read(read.asset, read.ticket, true);
                          return true;
                      },
                      nullptr};
    GuardedMemory memory;
    rill::Host host;
    host.memory = memory.callbacks();
    rill::Asset* asset = nullptr;
    REQUIRE(rill::open(host, io, file_bytes, &asset) == Status::ok);
    rill::AssetInfo info{};
    while (rill::poll(asset, &info) == Status::pending) {}
    CHECK(info.frames == 25);
    CHECK(sparse.reads == 2);
    CHECK(sparse.bytes_read == rill::format::header_bytes + h.directory_bytes);
    uint64_t held = 0;
    for (const auto& [block, size] : memory.blocks) held += size;
    CHECK(held < 200000);
    rill::Player* player = nullptr;
    const uint64_t told = rill::footprint(asset, {});
    REQUIRE(rill::create(asset, {}, &player) == Status::ok);
    CHECK(memory.last == told);
    rill::Frame frame{};
    frame.seconds = 0.9;
    rill::Stats stats{};
    CHECK(rill::begin_frame(player, frame) == Status::ok);
    CHECK(rill::end_frame(player, &stats) == Status::ok);
    CHECK(stats.chunks_late == 0);
    CHECK(sparse.bytes_read == rill::format::header_bytes + h.directory_bytes + stats.bytes_arrived);
    CHECK(rill::destroy(player) == Status::ok);
    CHECK(rill::close(asset) == Status::ok);
}

TEST_CASE("a hundred players share one asset: one directory, one block each, one surface") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    const uint64_t calls = opened.memory.calls;
    const size_t reads = opened.io.asked.size();
    rill::Limits limits{};
    limits.vertices = 2000;
    const uint64_t told = rill::footprint(opened.asset, limits);
    uint64_t largest_asset = 0;
    for (const auto& [block, size] : opened.memory.blocks) largest_asset = std::max<uint64_t>(largest_asset, size);
    CHECK(reads == 2);
    std::vector<std::unique_ptr<Playing>> players;
    for (int i = 0; i < 100; ++i) {
        players.push_back(std::make_unique<Playing>(opened, limits));
        players.back()->resize(2000, 12000, 64);
        players.back()->frame.budget.cell_size = 0.3f;
        CHECK(opened.memory.last == told);
    }
    CHECK(opened.memory.calls == calls + 100);
    uint64_t expected = 0;
    for (int i = 0; i < 100; ++i) {
        CHECK(players[size_t(i)]->draw(0.01 * i) == Status::ok);
        CHECK(players[size_t(i)]->draw(0.5) == Status::ok);
        if (i == 0) expected = players[0]->hash();
        CHECK(players[size_t(i)]->hash() == expected);
    }
    CHECK(opened.memory.calls == calls + 100);
}
