// SPDX-License-Identifier: MIT
// Files with a vertex per corner, or seams where normals or texture coordinates break, as many exporters write them.
#pragma once
#include <cstddef>

#include "common/mesh.h"

namespace rill::cooker {

/// Makes one vertex of all that stand at exactly the same place, with their mean velocity, where that closes open edges (and makes no
/// edge that more than two triangles share); returns how many it closed. A mesh without open edges stays as it is: where its sheets touch, they stay apart.
size_t weld_seams(Mesh& mesh);

}  // namespace rill::cooker
