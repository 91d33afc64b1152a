// SPDX-License-Identifier: MIT
// Does the velocity carry the surface from frame to frame? Units, sign and direction are what exporters get
// wrong, so they are measured: vertices are advected against both neighbours in time by many factors.
#pragma once
#include <functional>
#include <string>

#include "readers/reader.h"

namespace rill::cooker {

struct VelocityFit {
    /// What fits: forward or backward; what the source says when the frames do not tell; none without velocity.
    VelocityMeaning meaning = VelocityMeaning::none;
    double factor = 1;       ///< velocity times this fits; 1 when what is stored fits, or nothing does
    double still = 0;        ///< mean distance to the next surface of vertices that moved, m
    double as_stored = 0;    ///< the same after one step by the velocity as it is
    double carried = 0;      ///< the same by the factor and meaning found
    bool conclusive = false; ///< enough moved, and the velocity explains it
};
/// Looks at up to four pairs of frames: neighbours, or up to 16 apart where less moves. Tells `warn` in one line what is
/// wrong and what would be right. Deterministic; holds eight frames at most. Throws what the reader throws.
VelocityFit check_velocity(const SequenceReader& reader, const std::function<void(const std::string&)>& warn);

/// The reader with its velocities times fit.factor and its meaning replaced.
std::unique_ptr<SequenceReader> apply_fit(std::unique_ptr<SequenceReader> reader, const VelocityFit& fit);

}  // namespace rill::cooker
