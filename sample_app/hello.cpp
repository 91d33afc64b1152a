// SPDX-License-Identifier: MIT
// rill-hello ASSET: the shortest way to embed the runtime, to be copied and changed. It plays an asset
// once at sixty frames a second, as a game would, and prints what came out of some of the frames.
//
// It uses the ready-made host (rill/host.h). An engine brings its own memory, threads and files instead:
// the structs Memory, Jobs and Io of rill/rill.h are all it takes, and engine.cpp beside this file shows one.
#include <chrono>
#include <cstdio>
#include <thread>
#include <vector>

#include "rill/host.h"

static int fail(const char* path, const char* cause) {
    std::fprintf(stderr, "rill-hello: %s: %s\n", path, cause);
    return 2;
}

/// Some calls answer `pending` while reads are on their way. A game does other things meanwhile.
template <class Call>
static rill::Status wait_for(Call call) {
    rill::Status status;
    while ((status = call()) == rill::Status::pending) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return status;
}

/// Buffers as a game would map them from the GPU; here they are vectors.
struct Buffers {
    std::vector<float> vertices;  // position, normal, velocity: nine floats each
    std::vector<uint32_t> indices;
    std::vector<rill::Range> ranges;
    rill::Target target{};

    void resize(uint32_t vertex_count, uint32_t index_count, uint32_t range_count) {
        vertices.resize(9 * size_t(vertex_count));
        indices.resize(index_count);
        ranges.resize(range_count);
        const uint32_t stride = 9 * sizeof(float);
        target = {};
        target.position = {vertices.data(), stride};
        target.normal = {vertices.data() + 3, stride};
        target.velocity = {vertices.data() + 6, stride};
        target.indices = indices.data();
        target.ranges = ranges.data();
        target.vertex_capacity = vertex_count;
        target.index_capacity = index_count;
        target.range_capacity = range_count;
    }
};

/// One frame of the game.
static rill::Status frame_of_game(rill::Player* player, double seconds, Buffers& buffers, rill::Stats* stats) {
    rill::Frame frame{};
    frame.seconds = seconds;      // any moment, also between the source's frames
    frame.rate = 1.0f;            // how time moves: tells what to read next; negative plays backwards
    for (int i = 0; i < 3; ++i) frame.asset_to_world[5 * i] = 1.0f;  // stands at the world's origin
    frame.target = &buffers.target;
    // With a View (frustum planes, eye, pixels per radian) and budget.pixel_error the runtime decodes what
    // the camera sees, as finely as it can see it. Without one: everything, at the source's resolution.
    const rill::Status begun = rill::begin_frame(player, frame);
    if (begun < rill::Status::ok) return begun;
    // ... the game's own work goes here, while the runtime's jobs run ...
    return rill::end_frame(player, stats);  // the only wait; then draw target.indices_used indices
}

static rill::Status play(rill::Player* player, double length) {
    Buffers buffers;
    buffers.resize(1 << 16, 1 << 18, 1 << 10);
    const auto begun = std::chrono::steady_clock::now();
    for (int count = 0;; ++count) {
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
        if (seconds > length) return rill::Status::ok;
        rill::Stats stats{};
        const rill::Status status = frame_of_game(player, seconds, buffers, &stats);
        if (status < rill::Status::ok) return status;
        const rill::Target& target = buffers.target;
        if (count % 15 == 0)
            std::printf("%6.3f s  %7u vertices  %7u triangles  %5u points  %2u reads in flight  %s\n", seconds,
                        target.vertices_used, target.indices_used / 3, stats.points_used, stats.reads_in_flight,
                        rill::text(status));
        // `clipped` is whole and drawable, but something was left out: cut names it, *_wanted says how much is needed.
        if (stats.cut & (rill::cut_vertices | rill::cut_indices | rill::cut_ranges))
            buffers.resize(stats.vertices_wanted + stats.vertices_wanted / 4, stats.indices_wanted + stats.indices_wanted / 4,
                           stats.ranges_wanted + stats.ranges_wanted / 4);
        std::this_thread::sleep_for(std::chrono::milliseconds(16));
    }
}

int main(int count, char** values) {
    if (count != 2) {
        std::fprintf(stderr, "usage: rill-hello ASSET\n");
        return 1;
    }
    const char* path = values[1];

    // 1. The host: where memory comes from, who runs jobs, who is told of trouble.
    rill::ThreadPool* pool = rill::start_threads(2);
    rill::Host host;
    host.memory = rill::heap_memory();
    if (pool) host.jobs = rill::thread_jobs(pool);  // without jobs everything runs inside end_frame()
    host.log = [](void*, rill::Status status, const char* message) {
        std::fprintf(stderr, "rill-hello: %s: %s\n", rill::text(status), message);
    };

    // 2. The file: reads are asked for by ticket and never waited for.
    uint64_t bytes = 0;
    rill::FileReader* file = rill::open_file(path, &bytes);
    if (!file) return fail(path, "cannot be opened");

    // 3. The asset: its directory is read and checked. Damage ends here, with a status that says what is wrong.
    rill::Asset* asset = nullptr;
    rill::Player* player = nullptr;
    rill::AssetInfo info{};
    rill::Status status = rill::open(host, rill::file_io(file), bytes, &asset);
    if (status == rill::Status::ok) status = wait_for([&] { return rill::poll(asset, &info); });

    // 4. The player: the last allocation. Smaller limits are legal and mean coarser water.
    if (status == rill::Status::ok) {
        const rill::Limits limits = rill::suggest_limits(asset);
        std::printf("%u frames, %.2f s, %u windows, %u layers; takes %.1f MB\n", info.frames, info.seconds, info.windows,
                    info.layers, rill::footprint(asset, limits) / 1e6);
        status = rill::create(asset, limits, &player);
    }

    // 5. The game, and then everything back in reverse order.
    if (status == rill::Status::ok) status = play(player, info.seconds);
    if (player) wait_for([&] { return rill::destroy(player); });
    if (asset) wait_for([&] { return rill::close(asset); });
    rill::close_file(file);
    if (pool) rill::stop_threads(pool);
    return status == rill::Status::ok ? 0 : fail(path, rill::text(status));
}
