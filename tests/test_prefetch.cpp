// SPDX-License-Identifier: MIT
// Prefetch decoded between frames: by jobs that run at once, late, beside a frame that wants the same, or never.
#include "harness.h"

#include <cmath>
#include <deque>
#include <thread>

using namespace harness;
using rill::Status;

namespace {

const Bytes& ball() {
    static const Bytes bytes = make_ball();
    return bytes;
}

constexpr double window_seconds = 8 / Clip::fps;  // three windows of six chunks each

/// An engine of two workers that keeps prefetch for when it is told.
struct HoldingJobs {
    struct Job {
        rill::Task task;
        void* context;
        uint32_t index;
    };
    std::deque<Job> needed, prefetch;
    uint32_t prefetched = 0;  ///< jobs so far

    rill::Jobs callbacks() {
        return {this, 2,
                [](void* user, rill::Task task, void* context, uint32_t count, bool needed_this_frame) {
                    auto& jobs = *static_cast<HoldingJobs*>(user);
                    jobs.prefetched += needed_this_frame ? 0 : count;
                    for (uint32_t i = 0; i < count; ++i)
                        (needed_this_frame ? jobs.needed : jobs.prefetch).push_back({task, context, i});
                },
                [](void* user) { run(static_cast<HoldingJobs*>(user)->needed); }};
    }
    static void run(std::deque<Job>& queue) {
        if (queue.empty()) return;
        const Job job = queue.front();
        queue.pop_front();
        job.task(job.context, job.index, 1);
    }
    void run_prefetch() {
        while (!prefetch.empty()) run(prefetch);
    }
};

/// Hash and decoded windows of every frame at 60 a second, with `between` after each.
struct Played {
    std::vector<uint64_t> hashes;
    std::vector<uint32_t> windows;
    bool operator==(const Played& other) const { return hashes == other.hashes; }
};
template <typename Between>
Played play_through(Playing& playing, Between between) {
    Played played;
    for (int i = 0; i < 60; ++i) {
        CHECK(playing.draw(i / 60.0) == Status::ok);
        played.hashes.push_back(playing.hash());
        played.windows.push_back(playing.stats.windows_decoded);
        between(i);
    }
    return played;
}

}  // namespace

TEST_CASE("workers to spare decode prefetch between frames, a little at a time" * doctest::test_suite("threads")) {
    Played expected;
    {
        Opened opened(ball());
        REQUIRE(opened.open() == Status::ok);
        Playing playing(opened);
        expected = play_through(playing, [](int) {});
    }
    HoldingJobs jobs;
    Opened opened(ball());
    opened.host.jobs = jobs.callbacks();
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    SUBCASE("by the engine, at once") {
        size_t most = 0;
        const Played played = play_through(playing, [&](int) {
            most = std::max(most, jobs.prefetch.size());
            jobs.run_prefetch();
        });
        CHECK(played == expected);
        CHECK(most <= 2);
        CHECK(jobs.prefetched == 12);  // all but the six of the first window
        const int border = int(std::ceil(60 * window_seconds));
        CHECK(played.windows[size_t(border) - 1] >= 2);  // before it is needed
        CHECK(played.windows.back() == 3);
    }
    SUBCASE("some frames later, so that frames take over what they need") {
        CHECK(play_through(playing, [&](int i) { if (i % 25 == 24) jobs.run_prefetch(); }) == expected);
        CHECK(jobs.prefetched > 0);
    }
    SUBCASE("never: it does nothing any more, and destroying waits for that") {
        CHECK(play_through(playing, [](int) {}) == expected);
        REQUIRE(!jobs.prefetch.empty());
        CHECK(rill::destroy(playing.player) == Status::pending);
        CHECK(play_through(playing, [](int) {}) == expected);  // one who thinks better of it
        CHECK(rill::destroy(playing.player) == Status::pending);
        jobs.run_prefetch();
        CHECK(rill::destroy(playing.player) == Status::ok);
        playing.player = nullptr;
    }
    SUBCASE("on a thread of its own, while frames want the same") {
        for (int round = 0; round < 4; ++round) {
            std::vector<std::thread> threads;
            const Played played = play_through(playing, [&](int i) {
                if (i % 19 != 18) return;  // held until the border is near
                for (const HoldingJobs::Job& job : jobs.prefetch)
                    threads.emplace_back([job] { job.task(job.context, job.index, 0); });
                jobs.prefetch.clear();
            });
            CHECK(played == expected);
            for (std::thread& thread : threads) thread.join();
        }
    }
    jobs.run_prefetch();
}

TEST_CASE("prefetch that does not decode is rejected once, wherever that was tried" * doctest::test_suite("threads")) {
    for (const bool spare : {false, true}) {
        HoldingJobs jobs;
        Opened opened(ball());
        const rill::format::ChunkRecord chunk = chunk_of(opened.io.file, 8);
        opened.io.file[chunk.offset + chunk.bytes / 2] ^= 0x10;
        if (spare) opened.host.jobs = jobs.callbacks();
        REQUIRE(opened.open() == Status::ok);
        Playing playing(opened);
        for (int i = 0; i < 20; ++i) {  // up to the border
            CHECK(playing.draw(i / 60.0) == Status::ok);
            jobs.run_prefetch();
        }
        CHECK(playing.stats.chunks_rejected == 1);
        CHECK(opened.log.size() == 1);
        CHECK(playing.draw(window_seconds) == Status::clipped);
        CHECK(playing.stats.cut == rill::cut_damaged);
    }
}
