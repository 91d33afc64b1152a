// SPDX-License-Identifier: MIT
// Threads that stay: a cook calls parallel_for so often, for so little, that to start them each time takes as long as the work.
#include "common/parallel.h"

#include <chrono>
#include <condition_variable>

#include "common/interrupt.h"

namespace rill::cooker {

/// The program's threads, as many as any batch has asked for so far. Who brings a batch works at it, too, so that it ends
/// even if all others are busy: batches within batches cannot wait for each other.
class Crew {
public:
    ~Crew();
    void help(Batch& batch, size_t threads);
    void leave(Batch& batch);

private:
    void serve();
    void look_out() const;
    std::mutex mutex_;
    std::condition_variable wake_, done_;
    std::vector<Batch*> open_;  ///< with places left; the innermost last
    std::vector<std::thread> threads_;
    std::atomic<uint64_t> brought_{0};  ///< batches so far
    bool ends_ = false;
};

namespace {
Crew& crew() {
    static Crew only;
    return only;
}
}  // namespace

Crew::~Crew() {
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void Crew::help(Batch& batch, size_t threads) {
    {
        const std::lock_guard lock(mutex_);
        while (threads_.size() < threads) threads_.emplace_back([this] { serve(); });
        batch.places_ = threads;
        open_.push_back(&batch);
        brought_.fetch_add(1, std::memory_order_relaxed);
    }
    threads == 1 ? wake_.notify_one() : wake_.notify_all();
}

void Crew::leave(Batch& batch) {
    std::unique_lock lock(mutex_);
    std::erase(open_, &batch);
    done_.wait(lock, [&] { return batch.helpers_ == 0; });
}

void Crew::serve() {
    std::unique_lock lock(mutex_);
    while (!ends_) {
        if (open_.empty()) {
            lock.unlock();
            look_out();
            lock.lock();
            if (open_.empty() && !ends_) wake_.wait(lock);
            continue;
        }
        Batch& batch = *open_.back();
        if (--batch.places_ == 0) open_.pop_back();
        ++batch.helpers_;
        lock.unlock();
        batch.work_off();
        lock.lock();
        if (--batch.helpers_ == 0) done_.notify_all();
    }
}

/// One batch follows another: to sleep and be woken takes longer than many of them.
void Crew::look_out() const {
    constexpr std::chrono::microseconds patience(50);
    const uint64_t seen = brought_.load(std::memory_order_relaxed);
    for (const auto start = std::chrono::steady_clock::now();
         brought_.load(std::memory_order_relaxed) == seen && std::chrono::steady_clock::now() - start < patience;)
        std::this_thread::yield();
}

void Batch::work_off() noexcept {
    for (size_t i; (i = next_.fetch_add(1)) < count_;) {
        try {
            stop_if_interrupted();
            work_(context_, i);
        } catch (...) {
            const std::lock_guard lock(failing_);
            if (!failure_) failure_ = std::current_exception();
            next_ = count_;
        }
    }
}

void Batch::run(size_t threads) {
    const bool shared = threads > 1;
    if (shared) crew().help(*this, threads - 1);
    work_off();
    if (shared) crew().leave(*this);
    if (failure_) std::rethrow_exception(failure_);
}

}  // namespace rill::cooker
