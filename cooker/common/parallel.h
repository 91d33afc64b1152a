// SPDX-License-Identifier: MIT
// All cores for independent work. Results go to slots by index, so order never depends on timing.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/interrupt.h"

namespace rill::cooker {

/// Threads that `jobs` means: 0 is all cores.
inline size_t threads_of(int jobs) { return jobs > 0 ? size_t(jobs) : std::max(1u, std::thread::hardware_concurrency()); }

/// Neighbours that one task should take, of `count`: some, for they share work, but no core goes without.
inline size_t run_length(size_t count, int jobs) { return std::clamp<size_t>(count / threads_of(jobs), 1, 8); }

/// Calls work(index) for every index < count on up to `jobs` threads (0: all cores). The first exception is
/// rethrown here after all threads have ended. Throws Interrupted when the user asked to stop.
template <class Work>
void parallel_for(size_t count, int jobs, const Work& work) {
    const size_t threads = std::min(threads_of(jobs), count);
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

/// Hands results on in the order of their indices, each as soon as all before it are there: sums come out the same
/// however the work was shared, and little is held back. Not locked: one thread at a time.
template <class Result>
class InOrder {
public:
    explicit InOrder(std::function<void(Result&&)> take) : take_(std::move(take)) {}
    void put(size_t index, Result&& result) {
        waiting_.emplace(index, std::move(result));
        for (; !waiting_.empty() && waiting_.begin()->first == next_; ++next_) {
            take_(std::move(waiting_.begin()->second));
            waiting_.erase(waiting_.begin());
        }
    }

private:
    std::function<void(Result&&)> take_;
    std::map<size_t, Result> waiting_;
    size_t next_ = 0;
};

}  // namespace rill::cooker
