// SPDX-License-Identifier: MIT
#include "engine.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <new>

#include <nlohmann/json.hpp>

namespace player {

double now_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// ---- memory

rill::Memory CountingHeap::memory() { return {this, allocate, release}; }

void* CountingHeap::allocate(void* user, size_t bytes, size_t alignment) {
    auto& heap = *static_cast<CountingHeap*>(user);
    alignment = std::max(alignment, sizeof(void*));
    // aligned_alloc wants whole multiples of the alignment.
    void* block = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    if (!block) return nullptr;
    ++heap.allocations_;
    heap.bytes_now_ += bytes;
    heap.bytes_peak_ = std::max(heap.bytes_peak_, heap.bytes_now_);
    return block;
}

void CountingHeap::release(void* user, void* block, size_t bytes) {
    if (!block) return;
    static_cast<CountingHeap*>(user)->bytes_now_ -= bytes;
    std::free(block);
}

// ---- jobs

JobPool::JobPool(unsigned workers) {
    for (uint32_t worker = 1; worker < workers; ++worker) threads_.emplace_back([this, worker] { work(worker); });
}

JobPool::~JobPool() {
    {
        std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

rill::Jobs JobPool::jobs() {
    if (threads_.empty()) return {};
    return {this, static_cast<uint32_t>(threads_.size() + 1), submit, help};
}

void JobPool::submit(void* user, rill::Task task, void* context, uint32_t count, bool needed_this_frame) {
    if (count == 0) return;
    auto& pool = *static_cast<JobPool*>(user);
    {
        std::lock_guard lock(pool.mutex_);
        (needed_this_frame ? pool.now_ : pool.later_).push_back({task, context, count, 0});
    }
    count == 1 ? pool.wake_.notify_one() : pool.wake_.notify_all();
}

void JobPool::help(void* user) {
    auto& pool = *static_cast<JobPool*>(user);
    std::unique_lock lock(pool.mutex_);
    // Threads that drive different players may wait at the same time, and there is one worker 0.
    if (!pool.helped_) {
        pool.helped_ = true;
        const bool ran = pool.run_one(lock, 0, false);  // never a job that may wait: the frame would wait for it
        pool.helped_ = false;
        if (ran) return;
    }
    lock.unlock();
    std::this_thread::yield();
}

bool JobPool::run_one(std::unique_lock<std::mutex>& lock, uint32_t worker, bool also_later) {
    std::deque<Batch>& queue = now_.empty() && also_later ? later_ : now_;
    if (queue.empty()) return false;
    const Batch batch = queue.front();
    if (++queue.front().next == batch.count) queue.pop_front();
    lock.unlock();
    batch.task(batch.context, batch.next, worker);
    lock.lock();
    return true;
}

void JobPool::work(uint32_t worker) {
    std::unique_lock lock(mutex_);
    while (true) {
        wake_.wait(lock, [this] { return stopping_ || !now_.empty() || !later_.empty(); });
        if (!run_one(lock, worker, true) && stopping_) return;
    }
}

// ---- files

AsyncReader::~AsyncReader() {
    {
        std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_all();
    if (thread_.joinable()) thread_.join();
    if (file_ >= 0) ::close(file_);
}

bool AsyncReader::open(const std::string& path, std::string& cause) {
    file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat facts {};
    if (file_ < 0 || fstat(file_, &facts) != 0) {
        cause = std::strerror(errno);
        return false;
    }
    if (!S_ISREG(facts.st_mode)) {
        cause = "not a regular file";
        return false;
    }
    bytes_ = static_cast<uint64_t>(facts.st_size);
    thread_ = std::thread([this] { work(); });
    return true;
}

rill::Io AsyncReader::io() { return {this, begin, forget}; }

bool AsyncReader::begin(void* user, const rill::Read& read) {
    auto& reader = *static_cast<AsyncReader*>(user);
    {
        std::lock_guard lock(reader.mutex_);
        // A short queue keeps the order of need fresh: what does not fit is asked for again.
        if (reader.wishes_.size() >= 64) return false;
        reader.wishes_.push_back({read, now_seconds() + read.seconds_until_needed, false});
    }
    reader.wake_.notify_one();
    return true;
}

void AsyncReader::forget(void* user, uint64_t ticket) {
    auto& reader = *static_cast<AsyncReader*>(user);
    std::lock_guard lock(reader.mutex_);
    for (Wish& wish : reader.wishes_)
        if (wish.read.ticket == ticket) wish.forgotten = true;
}

/// The whole range or nothing.
static bool read_fully(int file, const rill::Read& read) {
    auto* to = static_cast<char*>(read.destination);
    for (uint32_t done = 0; done < read.bytes;) {
        const ssize_t got = pread(file, to + done, read.bytes - done, static_cast<off_t>(read.file_offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        done += static_cast<uint32_t>(got);
    }
    return true;
}

void AsyncReader::work() {
    std::unique_lock lock(mutex_);
    while (true) {
        wake_.wait(lock, [this] { return stopping_ || !wishes_.empty(); });
        if (wishes_.empty()) return;
        const auto first = std::min_element(wishes_.begin(), wishes_.end(), [](const Wish& a, const Wish& b) {
            return a.deadline < b.deadline;
        });
        const Wish wish = *first;
        wishes_.erase(first);
        lock.unlock();
        const bool arrived = !wish.forgotten && read_fully(file_, wish.read);
        rill::complete_read(wish.read.asset, wish.read.ticket, arrived);
        lock.lock();
    }
}

// ---- clip

/// While the asset opens, the message becomes the cause of the one failure; later each is told at once.
void Clip::log(void* user, rill::Status status, const char* message) {
    auto& clip = *static_cast<Clip*>(user);
    if (clip.player_) std::fprintf(stderr, "rill-player: %s: %s\n", rill::text(status), message);
    else if (clip.first_trouble_.empty()) clip.first_trouble_ = message;
}

/// Calls `step` until it no longer answers pending; the reader's thread does the work meanwhile.
template <class Step>
static rill::Status wait_while_pending(Step step) {
    rill::Status status;
    while ((status = step()) == rill::Status::pending) std::this_thread::sleep_for(std::chrono::microseconds(200));
    return status;
}

/// Even steps, as the header tells, unless the settings list the numbers.
static std::vector<int> numbers_of(const rill::AssetInfo& info) {
    std::vector<int> numbers(info.frames);
    for (uint32_t i = 0; i < info.frames; ++i) numbers[i] = info.first_frame + static_cast<int>(i) * info.frame_step;
    const nlohmann::json settings = nlohmann::json::parse(info.settings_json, nullptr, false);
    const auto listed = settings.is_object() ? settings.find("frame_numbers") : settings.end();
    if (listed == settings.end() || !listed->is_array() || listed->size() != numbers.size()) return numbers;
    if (!std::all_of(listed->begin(), listed->end(), [](const nlohmann::json& n) { return n.is_number_integer(); })) return numbers;
    const auto stated = listed->get<std::vector<int>>();
    return std::is_sorted(stated.begin(), stated.end()) ? stated : numbers;
}

uint32_t Clip::nearest_frame(double seconds) const {
    uint32_t low = 0, high = info_.frames - 1;  // the last frame not after `seconds`
    while (low < high) {
        const uint32_t middle = (low + high + 1) / 2;
        if (frame_seconds(middle) <= seconds) low = middle;
        else high = middle - 1;
    }
    return low + 1 < info_.frames && frame_seconds(low + 1) - seconds < seconds - frame_seconds(low) ? low + 1 : low;
}

bool Clip::open(const std::string& path, std::string& cause) {
    if (!reader_.open(path, cause)) return false;
    rill::Host host;
    host.memory = heap_.memory();
    host.jobs = pool_.jobs();
    host.log = log;
    host.log_user = this;
    rill::Status status = rill::open(host, reader_.io(), reader_.bytes(), &asset_);
    if (status == rill::Status::ok) status = wait_while_pending([&] { return rill::poll(asset_, &info_); });
    if (status == rill::Status::ok) {
        numbers_ = numbers_of(info_);
        limits_ = rill::suggest_limits(asset_);
        status = rill::create(asset_, limits_, &player_);
    }
    if (status != rill::Status::ok)
        cause = rill::text(status) + (first_trouble_.empty() ? "" : ": " + first_trouble_);
    return status == rill::Status::ok;
}

Clip::~Clip() {
    if (player_) wait_while_pending([&] { return rill::destroy(player_); });
    if (asset_) wait_while_pending([&] { return rill::close(asset_); });
}

}  // namespace player
