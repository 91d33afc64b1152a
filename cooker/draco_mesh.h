// SPDX-License-Identifier: MIT
// Draco, as an input format and as what Rill is compared with.
#pragma once
#include <string>

#include "mesh.h"

namespace rill::cooker {

/// Edgebreaker at speed 0 (smallest), positions in `bits` bits of the longest side of the bounds; velocity,
/// when the mesh has it, as a generic attribute in as many bits. An empty mesh gives no bytes.
std::string draco_encode(const Mesh& mesh, int bits);
/// Throws InputError naming `name`. Velocity: a generic attribute of three floats, if any.
Mesh draco_decode(const std::string& bytes, const std::string& name);

}  // namespace rill::cooker
