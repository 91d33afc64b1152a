// SPDX-License-Identifier: MIT
// All cores for independent work. Results go to slots by index, so order never depends on timing.
#pragma once
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "interrupt.h"

namespace rill::cooker {

/// Calls work(index) for every index < count on up to `jobs` threads (0: all cores). The first exception is
/// rethrown here after all threads have ended. Throws Interrupted when the user asked to stop.
template <class Work>
void parallel_for(size_t count, int jobs, const Work& work) {
    size_t threads = jobs > 0 ? size_t(jobs) : std::max(1u, std::thread::hardware_concurrency());
    threads = std::min(threads, count);
    std::atomic<size_t> next{0};
    std::exception_ptr failure;
    std::mutex failure_mutex;
    const auto run = [&] {
        for (size_t i; (i = next.fetch_add(1)) < count;) {
            try {
                stop_if_interrupted();
                work(i);
            } catch (...) {
                const std::lock_guard lock(failure_mutex);
                if (!failure) failure = std::current_exception();
                next = count;
            }
        }
    };
    std::vector<std::thread> pool;
    for (size_t t = 1; t < threads; ++t) pool.emplace_back(run);
    run();
    for (std::thread& thread : pool) thread.join();
    if (failure) std::rethrow_exception(failure);
}

}  // namespace rill::cooker
