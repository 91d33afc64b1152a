// SPDX-License-Identifier: MIT
#include "commands/bench_beside.h"

#include <algorithm>
#include <chrono>
#include <future>

#include "readers/draco_mesh.h"

namespace rill::cooker {
namespace {

template <class Work>
double microseconds_of(const Work& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

/// Three rounds through the clip. `one` and `other`: place in the clip → microseconds.
template <class One, class Other>
SideBySide side_by_side(size_t frames, const One& one, const Other& other) {
    constexpr int rounds = 3;
    std::vector<SideBySide> best(frames, {1e30, 1e30});
    for (int round = 0; round < rounds; ++round)
        for (size_t i = 0; i < frames; ++i) best[i] = {std::min(best[i].one, one(i)), std::min(best[i].other, other(i))};
    SideBySide mean;
    for (const SideBySide& frame : best) mean.one += frame.one / double(frames), mean.other += frame.other / double(frames);
    return mean;
}

BenchFrame show(BenchPlayer& player, uint32_t frame) { return player.play(player.seconds_of(frame), 1); }

}  // namespace

BesideDraco beside_draco(BenchPlayer& single, const std::vector<uint32_t>& frames) {
    BesideDraco draco;
    std::vector<std::string> coded;
    for (uint32_t frame : frames) {
        Mesh mesh;
        single.play(single.seconds_of(frame), 1, &mesh);
        coded.push_back(draco_encode(mesh, 10, 10));
        draco.triangles += double(mesh.triangles.size()) / double(frames.size()), draco.bytes += double(coded.back().size()) / double(frames.size());
    }
    draco.times = side_by_side(
        frames.size(), [&](size_t i) { return double(show(single, frames[i]).microseconds[stage_processor]); },
        [&](size_t i) {
            const uint64_t start = processor_microseconds();
            if (!coded[i].empty()) draco_decode(coded[i], "Draco");
            return double(processor_microseconds() - start);
        });
    return draco;
}

SideBySide beside_one_worker(BenchPlayer& single, BenchPlayer& player, const std::vector<uint32_t>& frames) {
    const auto clock = [&](BenchPlayer& p) { return [&](size_t i) { return double(show(p, frames[i]).microseconds[stage_total]); }; };
    return side_by_side(frames.size(), clock(single), clock(player));
}

double two_at_once(BenchPlayer& single, const std::string& asset, const std::vector<uint32_t>& frames) {
    BenchPlayer second(asset, 1);
    const auto one = [&](size_t i) { return microseconds_of([&] { show(single, frames[i]); }); };
    const auto both = [&](size_t i) {
        return microseconds_of([&] {
            auto other = std::async(std::launch::async, [&] { show(second, frames[i]); });
            show(single, frames[i]);
            other.get();
        });
    };
    return 2 * side_by_side(frames.size(), one, both).ratio();
}

}  // namespace rill::cooker
