// SPDX-License-Identifier: MIT
// Any reader → frames the cooker can trust: the frames asked for, evenly stepped, each of them checked and
// wound outward. Every sequence passes through here; readers themselves only decode.
#pragma once
#include "readers/reader.h"

namespace rill::cooker {

/// Frames options.first … options.last by options.step (step 0: all; step 1 with a range: the source's own
/// step). Throws InputError naming the missing number where the numbers do not step evenly.
std::unique_ptr<SequenceReader> sequence_to_frames(std::unique_ptr<SequenceReader> source,
                                                   const ReadOptions& options);

/// Throws InputError for non-finite positions or velocities, attributes of another length than the
/// positions, and indices out of range. Drops triangles that name a vertex twice (not slivers: dropping
/// those would open the surface) and turns an inside-out mesh, telling `warn`.
void check_frame(Mesh& mesh, const std::string& name, const std::function<void(const std::string&)>& warn);

}  // namespace rill::cooker
