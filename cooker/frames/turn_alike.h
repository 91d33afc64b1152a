// SPDX-License-Identifier: MIT
// Triangles that face otherwise than their neighbours, as broken exporters write them.
#pragma once
#include <cstddef>

#include "common/mesh.h"

namespace rill::cooker {

/// Turns triangles until neighbours, across edges that two triangles share, face the same way: of every connected part the lesser
/// area turns. Returns how many triangles it turned; a mesh that is alike stays as it is, and so does a part that no turning
/// makes alike (one-sided surfaces).
size_t turn_alike(Mesh& mesh);

}  // namespace rill::cooker
