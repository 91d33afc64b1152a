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

/// Three rounds through the clip. `measure`: which of them, place in the clip → microseconds.
template <size_t count, class Measure>
std::array<double, count> in_turns(size_t frames, const Measure& measure) {
    constexpr int rounds = 3;
    std::array<double, count> none, mean{};
    none.fill(1e30);
    std::vector<std::array<double, count>> best(frames, none);
    for (int round = 0; round < rounds; ++round)
        for (size_t i = 0; i < frames; ++i)
            for (size_t k = 0; k < count; ++k) best[i][k] = std::min(best[i][k], measure(k, i));
    for (const auto& frame : best)
        for (size_t k = 0; k < count; ++k) mean[k] += frame[k] / double(frames);
    return mean;
}
template <class One, class Other>
SideBySide side_by_side(size_t frames, const One& one, const Other& other) {
    const auto [first, second] = in_turns<2>(frames, [&](size_t k, size_t i) { return k ? other(i) : one(i); });
    return {first, second};
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

BesideCells beside_larger_cells(BenchPlayer& single, const std::vector<uint32_t>& frames) {
    const BesideCells cells{in_turns<BesideCells::sizes>(frames.size(), [&](size_t k, size_t i) {
        single.look(single.info().cell_size * float(1 << k), false);
        return double(show(single, frames[i]).microseconds[stage_processor]);
    })};
    single.look(0, false);
    return cells;
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
