// SPDX-License-Identifier: MIT
#include "asset/asset_player.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

#include "rill/host.h"

namespace rill::cooker {
namespace {

using Vectors = std::vector<glm::vec3>;
static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "written by the runtime as three floats");

Stream stream_of(Vectors& vectors) { return {vectors.data(), uint32_t(sizeof(glm::vec3))}; }

}  // namespace

struct AssetPlayer::Impl {
    std::string path;
    std::string reason;  ///< the last thing the runtime logged
    ThreadPool* pool = nullptr;
    FileReader* file = nullptr;
    Asset* asset = nullptr;
    Player* player = nullptr;
    AssetInfo info{};
    Limits limits{};
    Vectors positions, normals, velocities;
    std::vector<uint32_t> indices;
    std::vector<Range> ranges;

    ~Impl() {
        while (player && destroy(player) == Status::pending) std::this_thread::yield();
        while (asset && close(asset) == Status::pending) std::this_thread::yield();
        close_file(file);
        stop_threads(pool);
    }

    [[noreturn]] void fail(Status status) const {
        throw InputError(path + ": " + text(status) + (reason.empty() ? "" : " (" + reason + ")"));
    }
    void need(Status status) const {
        if (status < Status::ok) fail(status);
    }

    void start(int jobs) {
        uint64_t bytes = 0;
        file = open_file(path.c_str(), &bytes);
        if (!file) throw InputError(path + ": cannot be opened: " + std::strerror(errno));
        Host host;
        host.memory = heap_memory();
        if (jobs > 1) {
            pool = start_threads(uint32_t(jobs - 1));
            if (!pool) throw InputError(path + ": cannot start " + std::to_string(jobs) + " threads");
            host.jobs = thread_jobs(pool);
        }
        host.log_user = this;
        host.log = [](void* user, Status, const char* message) { static_cast<Impl*>(user)->reason = message; };
        need(rill::open(host, file_io(file), bytes, &asset));
        Status status;
        while ((status = poll(asset, &info)) == Status::pending) std::this_thread::yield();
        need(status);
        limits = suggest_limits(asset);
    }

    void restart() {
        while (player && destroy(player) == Status::pending) std::this_thread::yield();
        player = nullptr;
        need(create(asset, limits, &player));
    }

    void size_buffers(size_t vertex_count, size_t index_count, size_t range_count) {
        for (Vectors* vectors : {&positions, &normals, &velocities})
            if (vectors->size() < vertex_count) vectors->resize(vertex_count);
        if (indices.size() < index_count) indices.resize(index_count);
        if (ranges.size() < range_count) ranges.resize(range_count);
    }

    Target target() {
        Target target{};
        target.position = stream_of(positions);
        target.normal = stream_of(normals);
        target.velocity = stream_of(velocities);
        target.indices = indices.data();
        target.ranges = ranges.data();
        target.vertex_capacity = uint32_t(positions.size());
        target.index_capacity = uint32_t(indices.size());
        target.range_capacity = uint32_t(ranges.size());
        return target;
    }

    Status draw(Frame& frame, Target& into, Stats& stats) {
        into = target();
        frame.target = &into;
        need(begin_frame(player, frame));
        const Status status = end_frame(player, &stats);
        need(status);
        if (stats.chunks_rejected) fail(Status::corrupt);
        if (stats.reads_failed && stats.chunks_late) fail(Status::read_failed);
        return status;
    }

    /// Larger buffers, and a larger player where its own scratch is the narrow place.
    void make_larger(const Stats& stats) {
        const auto grown = [](uint64_t now, uint64_t wanted) {
            return uint32_t(std::min<uint64_t>(std::max(now * 2, wanted + wanted / 8), UINT32_MAX / 8));
        };
        if (stats.cut & (cut_vertices | cut_indices)) {
            size_buffers(grown(positions.size(), stats.vertices_wanted), grown(indices.size(), stats.indices_wanted),
                         ranges.size());
            limits.vertices = grown(limits.vertices, stats.vertices_wanted);
            limits.indices = grown(limits.indices, stats.indices_wanted);
        }
        if (stats.cut & cut_ranges) size_buffers(0, 0, grown(ranges.size(), stats.ranges_wanted));
        if (stats.cut & cut_points) limits.points = grown(limits.points, stats.points_wanted);
        if (stats.cut & cut_residency) limits.resident_bytes *= 2;
        restart();
    }
};

AssetPlayer::AssetPlayer(const std::string& path, int jobs) : impl_(std::make_unique<Impl>()) {
    impl_->path = path;
    impl_->start(jobs);
    impl_->restart();
    impl_->size_buffers(impl_->limits.vertices, impl_->limits.indices, 1024);
}

AssetPlayer::~AssetPlayer() = default;
const AssetInfo& AssetPlayer::info() const { return impl_->info; }
double AssetPlayer::frame_seconds(uint32_t index) const { return rill::frame_seconds(impl_->asset, index); }
Asset* AssetPlayer::asset() const { return impl_->asset; }

Mesh AssetPlayer::mesh(double seconds, float cell, uint32_t layers, Stats* out) {
    Impl& impl = *impl_;
    Frame frame{};
    frame.seconds = seconds;
    frame.rate = 1;
    frame.budget.cell_size = cell;
    frame.budget.layers = layers;
    frame.wait_for_data = true;
    Target target{};
    Stats stats{};
    // Doubling reaches any size that fits in memory; a demand that never settles is a fault of the runtime.
    for (int attempt = 0; impl.draw(frame, target, stats) == Status::clipped; ++attempt) {
        if (attempt == 16) throw InputError(impl.path + ": a frame does not fit in any memory");
        impl.make_larger(stats);
    }
    Mesh mesh;
    mesh.positions.assign(impl.positions.begin(), impl.positions.begin() + target.vertices_used);
    mesh.normals.assign(impl.normals.begin(), impl.normals.begin() + target.vertices_used);
    mesh.velocities.assign(impl.velocities.begin(), impl.velocities.begin() + target.vertices_used);
    for (uint32_t i = 0; i + 2 < target.indices_used; i += 3)
        mesh.triangles.push_back({impl.indices[i], impl.indices[i + 1], impl.indices[i + 2]});
    if (out) *out = stats;
    return mesh;
}

}  // namespace rill::cooker
