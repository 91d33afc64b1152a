// SPDX-License-Identifier: MIT
// Draco, as an input format and as what Rill is compared with.
#pragma once
#include <string>

#include "common/mesh.h"

namespace rill::cooker {

/// Edgebreaker at speed 0 (smallest), positions in `bits` bits of the longest side of the bounds; velocity,
/// when the mesh has it, as a generic attribute in `velocity_bits`. An empty mesh gives no bytes.
std::string draco_encode(const Mesh& mesh, int bits, int velocity_bits);
/// Unique ids of attributes as a glTF file states them; -1: find them by kind.
struct DracoIds {
    int position = -1, velocity = -1;
};
/// Throws InputError naming `name`. Velocity: a generic attribute of three floats, if any (with a position's
/// id: only the one whose id is given).
Mesh draco_decode(const std::string& bytes, const std::string& name, const DracoIds& ids = {});

}  // namespace rill::cooker
