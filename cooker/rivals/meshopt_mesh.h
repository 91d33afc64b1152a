// SPDX-License-Identifier: MIT
// meshoptimizer's codec as it is used for streaming: quantised positions, indices in strip order, zstd over both.
#pragma once
#include <string>

#include "common/mesh.h"

namespace rill::cooker {

/// Positions in `bits` bits of the longest side of the bounds; velocities, when the mesh has them, in
/// `velocity_bits` of their largest component. An empty mesh gives no bytes.
std::string meshopt_encode(const Mesh& mesh, int bits, int velocity_bits);
/// Only of what meshopt_encode() made: a measure, not a reader of files. Throws InputError when it is not.
Mesh meshopt_decode(const std::string& bytes);

}  // namespace rill::cooker
