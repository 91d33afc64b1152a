// SPDX-License-Identifier: MIT
// How thick the liquid is, and how well it is met where it is thin.
#pragma once
#include <array>

#include "measure/surface_distance.h"

namespace rill::cooker {

/// Per vertex the diameter of the largest ball inside the liquid that touches the surface there, metres; `most` where it
/// touches nothing that faces the vertex within that.
std::vector<float> thickness(const Mesh& mesh, const SurfaceIndex& index, float most);

/// Distances from the source's vertices to the decoded surface, where the liquid is thinner than 1, 2, 3 times the spacing
/// of the decoded points.
struct ThinError {
    static constexpr size_t classes = 3;
    std::array<Spread, classes> below;
    double area = 0;  ///< of the source
    void add(const ThinError& other);
    double area_share(size_t i) const { return area > 0 ? below[i].weight / area : 0; }
};
/// `distances`: per vertex.
ThinError thin_error(const Mesh& source, const SurfaceIndex& index, const std::vector<float>& distances, float spacing);

}  // namespace rill::cooker
