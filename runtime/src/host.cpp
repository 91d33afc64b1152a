// SPDX-License-Identifier: MIT
// host.h: heap, threads and IO for those without an engine. Unlike the runtime this may allocate and lock.
#include "rill/host.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace rill {
namespace {

void* allocate_heap(void*, size_t bytes, size_t alignment) {
    // aligned_alloc wants a multiple of the alignment, and something to give.
    const size_t rounded = (std::max<size_t>(bytes, 1) + alignment - 1) / alignment * alignment;
    return rounded < bytes ? nullptr : std::aligned_alloc(alignment, rounded);
}
void release_heap(void*, void* block, size_t) { std::free(block); }

}  // namespace

Memory heap_memory() noexcept { return {nullptr, allocate_heap, release_heap}; }

// ---- threads ----------------------------------------------------------------------------------------

struct ThreadPool {
    struct Batch {
        Task task;
        void* context;
        uint32_t next, count;
    };
    std::mutex mutex;
    std::condition_variable wake;
    std::deque<Batch> needed, prefetch;  ///< what the frame waits for goes first
    std::atomic<uint64_t> submitted{0};  ///< batches so far
    std::vector<std::thread> threads;
    bool stopping = false, helped = false;  ///< helped: there is a worker 0 just now

    /// Takes one task out under the lock and runs it outside. False: there is none.
    bool run_one(std::unique_lock<std::mutex>& lock, uint32_t worker, bool also_prefetch) {
        std::deque<Batch>& queue = needed.empty() && also_prefetch ? prefetch : needed;
        if (queue.empty()) return false;
        Batch& batch = queue.front();
        const Batch mine = batch;
        if (++batch.next == batch.count) queue.pop_front();
        lock.unlock();
        mine.task(mine.context, mine.next, worker);
        lock.lock();
        return true;
    }

    void work(uint32_t worker) {
        std::unique_lock<std::mutex> lock(mutex);
        for (;;) {
            if (run_one(lock, worker, true)) continue;
            if (stopping) return;
            lock.unlock();
            look_out();
            lock.lock();
            if (needed.empty() && prefetch.empty() && !stopping) wake.wait(lock);
        }
    }

    /// Out of work, within a frame more comes at once: to sleep and be woken takes longer than a stage's last task. (Two workers,
    /// `dam_break`, a dozen stages a frame: 1.52 times as fast as one if threads sleep at once, 1.56 after 50 µs, 1.7 after 100 and 300.)
    void look_out() const {
        constexpr std::chrono::microseconds patience(100);
        const uint64_t seen = submitted.load(std::memory_order_relaxed);
        for (const auto start = std::chrono::steady_clock::now();
             submitted.load(std::memory_order_relaxed) == seen && std::chrono::steady_clock::now() - start < patience;)
            std::this_thread::yield();
    }

    void stop() {
        {
            const std::lock_guard<std::mutex> lock(mutex);
            stopping = true;
        }
        wake.notify_all();
        for (std::thread& thread : threads) thread.join();
    }
};

ThreadPool* start_threads(uint32_t workers) noexcept try {
    auto pool = std::make_unique<ThreadPool>();
    try {
        for (uint32_t i = 0; i < workers; ++i)
            pool->threads.emplace_back([p = pool.get(), i] { p->work(i + 1); });
    } catch (...) {
        pool->stop();
        return nullptr;
    }
    return pool.release();
} catch (const std::exception&) {
    return nullptr;
}

Jobs thread_jobs(ThreadPool* pool) noexcept {
    if (!pool || pool->threads.empty()) return {};
    Jobs jobs{};
    jobs.user = pool;
    jobs.workers = uint32_t(pool->threads.size()) + 1;
    jobs.submit = [](void* user, Task task, void* context, uint32_t count, bool needed_this_frame) {
        if (!count) return;
        auto& pool = *static_cast<ThreadPool*>(user);
        {
            const std::lock_guard<std::mutex> lock(pool.mutex);
            (needed_this_frame ? pool.needed : pool.prefetch).push_back({task, context, 0, count});
            pool.submitted.fetch_add(1, std::memory_order_relaxed);
        }
        count == 1 ? pool.wake.notify_one() : pool.wake.notify_all();
    };
    jobs.help = [](void* user) {
        auto& pool = *static_cast<ThreadPool*>(user);
        std::unique_lock<std::mutex> lock(pool.mutex);
        // Threads that drive different players may wait at the same time, and there is one worker 0.
        bool helped = false;
        if (!pool.helped) pool.helped = true, helped = pool.run_one(lock, 0, false), pool.helped = false;
        lock.unlock();
        if (!helped) std::this_thread::yield();
    };
    return jobs;
}

void stop_threads(ThreadPool* pool) noexcept {
    if (!pool) return;
    pool->stop();
    delete pool;
}

// ---- files ------------------------------------------------------------------------------------------

struct FileReader {
    struct Wish {
        Read read;
        bool forgotten;
    };
    static constexpr size_t most_wishes = 256;  ///< beyond: busy

    int file = -1;
    std::mutex mutex;
    std::condition_variable wake;
    std::vector<Wish> wishes;  ///< reserved once: begin() runs inside frames
    bool stopping = false;
    std::thread thread;

    ~FileReader() {
        if (file >= 0) ::close(file);
    }

    bool read_fully(const Read& read) const {
        auto* to = static_cast<char*>(read.destination);
        uint64_t at = read.file_offset;
        for (size_t left = read.bytes; left;) {
            const ssize_t got = ::pread(file, to, left, off_t(at));
            if (got < 0 && errno == EINTR) continue;
            if (got <= 0) return false;  // an error, or the file has shrunk
            to += got;
            at += uint64_t(got);
            left -= size_t(got);
        }
        return true;
    }

    void work() {
        std::unique_lock<std::mutex> lock(mutex);
        for (;;) {
            wake.wait(lock, [&] { return stopping || !wishes.empty(); });
            if (wishes.empty()) return;
            // Forgotten ones go at once, then the most urgent, then the oldest.
            auto chosen = std::min_element(wishes.begin(), wishes.end(), [](const Wish& a, const Wish& b) {
                if (a.forgotten != b.forgotten) return a.forgotten;
                return a.read.seconds_until_needed < b.read.seconds_until_needed;
            });
            const Wish wish = *chosen;
            wishes.erase(chosen);
            lock.unlock();
            const bool arrived = !wish.forgotten && read_fully(wish.read);
            complete_read(wish.read.asset, wish.read.ticket, arrived);
            lock.lock();
        }
    }
};

FileReader* open_file(const char* path, uint64_t* bytes) noexcept try {
    if (!path || !bytes) {
        errno = EINVAL;
        return nullptr;
    }
    auto reader = std::make_unique<FileReader>();
    reader->file = ::open(path, O_RDONLY | O_CLOEXEC);
    struct stat facts{};
    if (reader->file < 0 || ::fstat(reader->file, &facts) != 0) return nullptr;
    if (!S_ISREG(facts.st_mode)) {
        errno = S_ISDIR(facts.st_mode) ? EISDIR : EINVAL;
        return nullptr;
    }
    *bytes = uint64_t(facts.st_size);
    reader->wishes.reserve(FileReader::most_wishes);
    reader->thread = std::thread([r = reader.get()] { r->work(); });
    return reader.release();
} catch (const std::exception&) {
    errno = EAGAIN;
    return nullptr;
}

Io file_io(FileReader* reader) noexcept {
    Io io{};
    io.user = reader;
    io.begin = [](void* user, const Read& read) {
        auto& reader = *static_cast<FileReader*>(user);
        {
            const std::lock_guard<std::mutex> lock(reader.mutex);
            if (reader.wishes.size() == FileReader::most_wishes) return false;
            reader.wishes.push_back({read, false});
        }
        reader.wake.notify_one();
        return true;
    };
    io.forget = [](void* user, uint64_t ticket) {
        auto& reader = *static_cast<FileReader*>(user);
        const std::lock_guard<std::mutex> lock(reader.mutex);
        for (FileReader::Wish& wish : reader.wishes) wish.forgotten = wish.forgotten || wish.read.ticket == ticket;
    };
    return io;
}

void close_file(FileReader* reader) noexcept {
    if (!reader) return;
    {
        const std::lock_guard<std::mutex> lock(reader->mutex);
        reader->stopping = true;
    }
    reader->wake.notify_one();
    if (reader->thread.joinable()) reader->thread.join();
    delete reader;
}

// ---- memory -----------------------------------------------------------------------------------------

Io memory_io(MemoryReader* reader) noexcept {
    Io io{};
    io.user = reader;
    io.begin = [](void* user, const Read& read) {
        const auto& memory = *static_cast<MemoryReader*>(user);
        const bool inside = read.file_offset <= memory.bytes && read.bytes <= memory.bytes - read.file_offset;
        if (inside)
            std::memcpy(read.destination, static_cast<const char*>(memory.data) + read.file_offset, read.bytes);
        complete_read(read.asset, read.ticket, inside);
        return true;
    };
    return io;
}

}  // namespace rill
