// SPDX-License-Identifier: MIT
#include "frames/open_sequence.h"

#include <cmath>

#include "frames/estimate_velocity.h"
#include "frames/sequence_to_frames.h"

namespace rill::cooker {

std::unique_ptr<SequenceReader> open_sequence(const std::string& input, const ReadOptions& options) {
    if (options.frames_per_second < 0 || !std::isfinite(options.frames_per_second))
        throw UsageError("the frame rate must be positive");
    if (options.step < 0 || (options.step > 0 && options.last < options.first))
        throw UsageError("frames A:B:S need A <= B and S >= 1");
    const bool estimate = options.velocity_name == "estimate";
    ReadOptions source = options;
    if (estimate) source.velocity_name.clear(), source.velocity_per_frame = false;
    source.require_velocity = false;  // what is missing is estimated
    auto frames = sequence_to_frames(open_reader(input, source), source);
    const bool missing = frames->info().velocity == VelocityMeaning::none && options.require_velocity;
    if (missing && !estimate && options.warn)
        options.warn(frames->name(0) + ": no velocity; it is estimated from the surfaces (--velocity estimate; exported velocity is better)");
    return missing || estimate ? estimate_velocity(std::move(frames)) : std::move(frames);
}

}  // namespace rill::cooker
