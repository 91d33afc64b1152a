// SPDX-License-Identifier: MIT
// Velocity for sequences that come without: the motion of the surface (surface_motion.h).
#pragma once
#include "readers/reader.h"

namespace rill::cooker {

/// `source` with velocities of this making, forward; those of the last frame look back. Reading a frame reads
/// its neighbour too.
std::unique_ptr<SequenceReader> estimate_velocity(std::unique_ptr<SequenceReader> source);

}  // namespace rill::cooker
