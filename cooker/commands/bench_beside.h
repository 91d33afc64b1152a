// SPDX-License-Identifier: MIT
// The runtime beside others, frame by frame: what is a ratio is measured in turns, so that both meet the machine in the same mood.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "commands/bench_player.h"

namespace rill::cooker {

/// Microseconds a frame: of every frame, each has the best of its three times.
struct SideBySide {
    double one = 0, other = 0;
    double ratio() const { return other > 0 ? one / other : 0; }
};

/// One worker going forward, and Draco's decoder on what it shows (10 bits, speed 0), both in processor time.
struct BesideDraco {
    SideBySide times;
    double triangles = 0, bytes = 0;  ///< a frame
    double triangles_per_second() const { return times.other > 0 ? 1e6 * triangles / times.other : 0; }
    double rill_over_draco() const { return times.one > 0 ? times.other / times.one : 0; }
};
BesideDraco beside_draco(BenchPlayer& single, const std::vector<uint32_t>& frames);

/// One worker going forward with cells of the source's size, twice, four and eight times as large: processor time of each.
struct BesideCells {
    static constexpr size_t sizes = 4;
    std::array<double, sizes> times{};
    double share(size_t size) const { return times[0] > 0 ? times[size] / times[0] : 0; }
};
BesideCells beside_larger_cells(BenchPlayer& single, const std::vector<uint32_t>& frames);

/// One worker, and as many as `player` has, going forward, by the clock.
SideBySide beside_one_worker(BenchPlayer& single, BenchPlayer& player, const std::vector<uint32_t>& frames);

/// What two workers can reach at best here: how many times the frames of one player of one worker two of them show at once. Cores that
/// share memory, or are shared with others, are not twice as fast as one.
double two_at_once(BenchPlayer& single, const std::string& asset, const std::vector<uint32_t>& frames);

}  // namespace rill::cooker
