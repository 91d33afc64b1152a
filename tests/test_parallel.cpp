// SPDX-License-Identifier: MIT
// The cooker's threads: every index once, work within work, and exceptions that end it.
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "common/interrupt.h"
#include "common/parallel.h"

using namespace rill::cooker;

TEST_CASE("every index is worked once, by any number of threads, within work, too" * doctest::test_suite("threads")) {
    for (const int jobs : {1, 2, 3, 8}) {
        for (const size_t count : {size_t(0), size_t(1), size_t(2), size_t(1000)}) {
            std::vector<std::atomic<int>> times(count);
            parallel_for(count, jobs, [&](size_t i) { ++times[i]; });
            for (const std::atomic<int>& t : times) REQUIRE(t == 1);
        }
        std::vector<std::vector<int>> times(20, std::vector<int>(30, 0));
        parallel_for(times.size(), jobs, [&](size_t i) { parallel_for(times[i].size(), jobs, [&](size_t k) { ++times[i][k]; }); });
        for (const std::vector<int>& row : times)
            for (int t : row) REQUIRE(t == 1);
    }
}

TEST_CASE("as many threads as were asked for work at once" * doctest::test_suite("threads")) {
    constexpr size_t threads = 4;
    std::atomic<size_t> present{0};
    const auto late = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    parallel_for(threads, int(threads), [&](size_t) {  // each waits for the others
        ++present;
        while (present < threads && std::chrono::steady_clock::now() < late) std::this_thread::yield();
    });
    CHECK(std::chrono::steady_clock::now() < late);
}

TEST_CASE("an exception ends the work, and comes out where it was called" * doctest::test_suite("threads")) {
    for (const int jobs : {1, 4}) {
        std::atomic<size_t> worked{0};
        const auto fail = [&] {
            parallel_for(100000, jobs, [&](size_t i) {
                if (i == 5) throw std::runtime_error("five");
                ++worked;
            });
        };
        CHECK_THROWS_WITH(fail(), "five");
        CHECK(worked < 100000 - 1);
        const auto fail_within = [&] { parallel_for(4, jobs, [&](size_t) { fail(); }); };
        CHECK_THROWS_WITH(fail_within(), "five");
        worked = 0;
        parallel_for(10, jobs, [&](size_t) { ++worked; });  // and the threads are there for the next
        CHECK(worked == 10);
    }
}

TEST_CASE("who was asked to stop takes no more work" * doctest::test_suite("threads")) {
    interrupting_signal = 2;
    std::atomic<size_t> worked{0};
    CHECK_THROWS_AS(parallel_for(100, 4, [&](size_t) { ++worked; }), Interrupted);
    interrupting_signal = 0;
    CHECK(worked == 0);
}
