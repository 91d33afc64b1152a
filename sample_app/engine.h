// SPDX-License-Identifier: MIT
// The "engine" of the sample: memory, threads and file reading as a game would bring them, written
// against rill.h alone, and a Clip that plays one asset through them.
#pragma once
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "rill/rill.h"

namespace player {

/// Heap memory that counts: what the runtime holds now, held at most, and how often it asked.
class CountingHeap {
public:
    rill::Memory memory();
    uint64_t bytes_now() const { return bytes_now_; }
    uint64_t bytes_peak() const { return bytes_peak_; }
    uint64_t allocations() const { return allocations_; }

private:
    static void* allocate(void* user, size_t bytes, size_t alignment);
    static void release(void* user, void* block, size_t bytes);
    uint64_t bytes_now_ = 0, bytes_peak_ = 0, allocations_ = 0;  // driving thread only, as rill.h promises
};

/// `workers` in all: the thread that waits in end_frame() is worker 0, the others have threads.
class JobPool {
public:
    explicit JobPool(unsigned workers);
    ~JobPool();
    /// All null for one worker: the runtime then runs everything inline.
    rill::Jobs jobs();

private:
    struct Batch {
        rill::Task task;
        void* context;
        uint32_t count, next;
    };
    static void submit(void* user, rill::Task task, void* context, uint32_t count, bool needed_this_frame);
    static void help(void* user);
    bool run_one(std::unique_lock<std::mutex>& lock, uint32_t worker, bool also_later);
    void work(uint32_t worker);

    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<Batch> now_, later_;
    bool stopping_ = false, helped_ = false;  ///< helped_: there is a worker 0 just now
    std::vector<std::thread> threads_;
};

/// One file, one thread, most urgent read first.
class AsyncReader {
public:
    AsyncReader() = default;
    ~AsyncReader();
    /// False: `cause` says why in one line.
    bool open(const std::string& path, std::string& cause);
    uint64_t bytes() const { return bytes_; }
    rill::Io io();

private:
    struct Wish {
        rill::Read read;
        double deadline;
        bool forgotten;
    };
    static bool begin(void* user, const rill::Read& read);
    static void forget(void* user, uint64_t ticket);
    void work();

    int file_ = -1;
    uint64_t bytes_ = 0;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<Wish> wishes_;
    bool stopping_ = false;
    std::thread thread_;
};

/// Seconds on a clock that never goes back.
double now_seconds();

/// An open asset with one Player.
class Clip {
public:
    explicit Clip(unsigned jobs) : pool_(jobs) {}
    ~Clip();
    /// Reads and checks the directory, creates the player. False: `cause` says why in one line.
    bool open(const std::string& path, std::string& cause);

    const rill::AssetInfo& info() const { return info_; }
    const rill::Limits& limits() const { return limits_; }
    const CountingHeap& heap() const { return heap_; }
    double frame_seconds(uint32_t index) const { return rill::frame_seconds(asset_, index); }
    /// The source's numbers of all frames, ascending.
    const std::vector<int>& frame_numbers() const { return numbers_; }
    /// Index of the frame nearest in time.
    uint32_t nearest_frame(double seconds) const;
    rill::Status begin_frame(const rill::Frame& frame) { return rill::begin_frame(player_, frame); }
    rill::Status end_frame(rill::Stats* stats) { return rill::end_frame(player_, stats); }

private:
    CountingHeap heap_;
    JobPool pool_;
    AsyncReader reader_;
    rill::Asset* asset_ = nullptr;
    rill::Player* player_ = nullptr;
    rill::AssetInfo info_{};
    rill::Limits limits_{};
    std::vector<int> numbers_;
    std::string first_trouble_;  // of open(): logged before there is anybody to tell
    static void log(void* user, rill::Status status, const char* message);
};

}  // namespace player
