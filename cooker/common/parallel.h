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

namespace rill::cooker {

/// Threads that `jobs` means: 0 is all cores.
inline size_t threads_of(int jobs) { return jobs > 0 ? size_t(jobs) : std::max(1u, std::thread::hardware_concurrency()); }

/// Neighbours that one task should take, of `count`: some, for they share work, but no core goes without.
inline size_t run_length(size_t count, int jobs) { return std::clamp<size_t>(count / threads_of(jobs), 1, 8); }

/// Indices below `count`, each to be worked at once by whoever is free.
class Batch {
public:
    Batch(size_t count, void (*work)(const void*, size_t), const void* context) : count_(count), work_(work), context_(context) {}
    /// On up to `threads` threads, this one included; returns when all is done. Rethrows the first exception.
    void run(size_t threads);

private:
    friend class Crew;
    void work_off() noexcept;
    const size_t count_;
    void (*const work_)(const void*, size_t);
    const void* const context_;
    std::atomic<size_t> next_{0};
    std::mutex failing_;
    std::exception_ptr failure_;
    size_t places_ = 0, helpers_ = 0;  ///< for threads that may still come; those that are at it. Under the crew's lock
};

/// Calls work(index) for every index < count on up to `jobs` threads (0: all cores); within work, too. The first exception is
/// rethrown here after all threads have ended. Throws Interrupted when the user asked to stop.
template <class Work>
void parallel_for(size_t count, int jobs, const Work& work) {
    Batch(count, [](const void* context, size_t i) { (*static_cast<const Work*>(context))(i); }, &work).run(std::min(threads_of(jobs), count));
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
