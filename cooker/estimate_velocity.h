// SPDX-License-Identifier: MIT
// Velocity for sequences that come without: the smoothest motion that lays each surface onto the next.
#pragma once
#include "readers/reader.h"

namespace rill::cooker {

/// Motion of every vertex of `from`, metres, onto the surface of `to`: closest points that face alike, asked for
/// from both sides, under a smoothness that loosens step by step. Zero where there is nothing to go to.
std::vector<glm::vec3> estimate_motion(const Mesh& from, const Mesh& to);

/// `source` with velocities of this making, forward; those of the last frame look back. Reading a frame reads
/// its neighbour too.
std::unique_ptr<SequenceReader> estimate_velocity(std::unique_ptr<SequenceReader> source);

}  // namespace rill::cooker
