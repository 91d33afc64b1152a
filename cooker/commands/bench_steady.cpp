// SPDX-License-Identifier: MIT
#include "commands/bench_steady.h"

#include <algorithm>

#include "commands/bench_player.h"

namespace rill::cooker {

SteadyPlay steady_play(const std::string& asset, int jobs, const std::vector<uint32_t>& frames) {
    BenchPlayer player(asset, jobs);
    const double first = player.seconds_of(frames.front()), last = player.seconds_of(frames.back());
    player.play(first, 1);
    SteadyPlay steady;
    std::vector<uint32_t> times;
    for (int i = 1; first + i / 60.0 <= last; ++i) {
        const BenchFrame frame = player.play(first + i / 60.0, 1);
        const uint32_t all = frame.microseconds[stage_total], decode = frame.microseconds[stage_decode];
        times.push_back(all);
        steady.worst_decode_us = std::max(steady.worst_decode_us, decode);
        steady.worst_share = std::max(steady.worst_share, double(decode) / std::max(1u, all));
    }
    steady.pictures = uint32_t(times.size());
    if (times.empty()) return steady;
    std::sort(times.begin(), times.end());
    steady.median_us = times[times.size() / 2], steady.worst_us = times.back();
    return steady;
}

}  // namespace rill::cooker
