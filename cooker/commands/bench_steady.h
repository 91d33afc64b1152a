// SPDX-License-Identifier: MIT
// Steadiness: the clip as a game plays it, at 60 pictures a second, window after window decoded on the way.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace rill::cooker {

struct SteadyPlay {
    uint32_t pictures = 0;                   ///< all but the first, which has to wait for its window
    uint32_t median_us = 0, worst_us = 0;    ///< of a picture, from begin_frame() to the return of end_frame()
    uint32_t worst_decode_us = 0;            ///< of that, at most, until all chunks were decoded
    double worst_share = 0;                  ///< decoding, of the picture it is the largest part of
};
/// From the first to the last of `frames`, by a fresh player with so many workers.
SteadyPlay steady_play(const std::string& asset, int jobs, const std::vector<uint32_t>& frames);

}  // namespace rill::cooker
