// SPDX-License-Identifier: MIT
#include "commands/bench_player.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <thread>

#include "readers/file_bytes.h"

namespace rill::cooker {
namespace {

void* counted_allocate(void* user, size_t bytes, size_t alignment) {
    CountedMemory& memory = *static_cast<CountedMemory*>(user);
    ++memory.allocations;
    memory.bytes += bytes;
    memory.peak_bytes = std::max(memory.peak_bytes, memory.bytes);
    return memory.heap.allocate(memory.heap.user, bytes, alignment);
}
void counted_release(void* user, void* block, size_t bytes) {
    CountedMemory& memory = *static_cast<CountedMemory*>(user);
    memory.bytes -= bytes;
    memory.heap.release(memory.heap.user, block, bytes);
}

uint64_t fnv(uint64_t hash, const void* data, size_t bytes) {
    for (const uint8_t* at = static_cast<const uint8_t*>(data); bytes-- > 0; ++at) hash = (hash ^ *at) * 1099511628211u;
    return hash;
}
uint32_t microseconds_since(std::chrono::steady_clock::time_point start) {
    return uint32_t(std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace

uint64_t processor_microseconds() { return uint64_t(double(std::clock()) * 1e6 / CLOCKS_PER_SEC); }

Memory CountedMemory::memory() {
    heap = heap_memory();
    return {this, counted_allocate, counted_release};
}

void BenchPlayer::fail(Status status) { throw InputError(path_ + ": " + text(status) + (reason_.empty() ? "" : " (" + reason_ + ")")); }

BenchPlayer::BenchPlayer(const std::string& path, int jobs) : path_(path), bytes_(read_file(path)) {
    reader_ = {bytes_.data(), bytes_.size()};
    Host host;
    host.memory = memory_.memory();
    if (jobs > 1) {
        pool_ = start_threads(uint32_t(jobs - 1));
        if (!pool_) throw InputError("cannot start " + std::to_string(jobs) + " threads");
        host.jobs = thread_jobs(pool_);
    }
    host.log_user = &reason_;
    host.log = [](void* user, Status, const char* message) { *static_cast<std::string*>(user) = message; };
    Status status = rill::open(host, memory_io(&reader_), bytes_.size(), &asset_);
    if (status == Status::ok)
        while ((status = poll(asset_, &info_)) == Status::pending) std::this_thread::yield();
    if (status < Status::ok) fail(status);
    const Limits limits = suggest_limits(asset_);
    if (status = create(asset_, limits, &player_); status < Status::ok) fail(status);
    positions_.resize(limits.vertices), normals_.resize(limits.vertices), velocities_.resize(limits.vertices);
    indices_.resize(limits.indices);
    ranges_.resize(65536);
    look(0, false);
}

BenchPlayer::~BenchPlayer() {
    while (player_ && destroy(player_) == Status::pending) std::this_thread::yield();
    while (asset_ && close(asset_) == Status::pending) std::this_thread::yield();
    if (pool_) stop_threads(pool_);
}

void BenchPlayer::look(float cell_size, bool eighth) {
    look_from({info_.upper[0], info_.upper[1], info_.upper[2]}, 1000, 0);
    from_view_ = eighth;
    budget_.cell_size = eighth ? std::max(cell_size, info_.cell_size) : cell_size;
    for (int a = 0; a < 3; ++a) view_.planes[a][a] = 1, view_.planes[a][3] = -(info_.lower[a] + info_.upper[a]) / 2;
}

void BenchPlayer::look_from(const glm::vec3& eye, float pixels_per_radian, float pixel_error) {
    from_view_ = true;
    budget_ = {};
    budget_.pixel_error = pixel_error;
    budget_.microseconds = UINT32_MAX;  // no limit, but the stages are timed
    view_ = {};
    view_.pixels_per_radian = pixels_per_radian;
    for (auto& plane : view_.planes) plane[3] = 1;
    for (int a = 0; a < 3; ++a) view_.eye[a] = eye[a];
}

BenchFrame BenchPlayer::play(double seconds, float rate, Mesh* mesh) {
    const uint32_t stride = sizeof(glm::vec3);
    Target target{};
    target.position = {positions_.data(), stride}, target.normal = {normals_.data(), stride}, target.velocity = {velocities_.data(), stride};
    target.indices = indices_.data(), target.ranges = ranges_.data();
    target.vertex_capacity = uint32_t(positions_.size()), target.index_capacity = uint32_t(indices_.size());
    target.range_capacity = uint32_t(ranges_.size());
    Frame frame{};
    frame.seconds = seconds, frame.rate = rate;
    frame.asset_to_world[0] = frame.asset_to_world[5] = frame.asset_to_world[10] = 1;
    frame.budget = budget_;
    if (from_view_) frame.views = &view_, frame.view_count = 1;
    frame.target = &target;
    frame.wait_for_data = true;
    Stats stats{};
    const auto start = std::chrono::steady_clock::now();
    const uint64_t computed = processor_microseconds();
    Status status = begin_frame(player_, frame);
    if (status >= Status::ok) status = end_frame(player_, &stats);
    BenchFrame result;
    result.microseconds = {stats.plan_us, stats.decode_us, stats.field_us, stats.mesh_us, stats.wait_us, microseconds_since(start),
                           uint32_t(processor_microseconds() - computed)};
    if (status < Status::ok) fail(status);
    if (stats.chunks_rejected) fail(Status::corrupt);
    result.triangles = target.indices_used / 3, result.points = stats.points_used, result.cut = stats.cut;
    bytes_read_ = stats.bytes_arrived;
    uint64_t hash = 14695981039346656037u;
    for (const auto* stream : {&positions_, &normals_, &velocities_}) hash = fnv(hash, stream->data(), size_t(target.vertices_used) * stride);
    hash = fnv(hash, indices_.data(), size_t(target.indices_used) * 4);
    result.hash = fnv(hash, ranges_.data(), size_t(target.ranges_used) * sizeof(Range));
    if (mesh) {
        mesh->positions.assign(positions_.begin(), positions_.begin() + target.vertices_used);
        mesh->triangles.clear();
        for (uint32_t i = 0; i + 2 < target.indices_used; i += 3) mesh->triangles.push_back({indices_[i], indices_[i + 1], indices_[i + 2]});
    }
    return result;
}

}  // namespace rill::cooker
