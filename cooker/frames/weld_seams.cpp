// SPDX-License-Identifier: MIT
#include "frames/weld_seams.h"

#include <meshoptimizer.h>

#include "measure/surface_distance.h"

namespace rill::cooker {

size_t weld_seams(Mesh& mesh) {
    const size_t count = mesh.positions.size();
    if (count == 0) return 0;
    std::vector<glm::vec3> places = mesh.positions;
    for (glm::vec3& x : places) x += 0.f;  // −0 is 0
    std::vector<unsigned> place_of(count);
    const size_t distinct = meshopt_generateVertexRemap(place_of.data(), nullptr, count, places.data(), count, sizeof places[0]);
    if (distinct == count) return 0;
    const Topology before = topology(mesh);
    if (before.open_edges == 0) return 0;
    Mesh welded;
    welded.positions.resize(distinct), welded.triangles = mesh.triangles;
    for (size_t v = 0; v < count; ++v) welded.positions[place_of[v]] = places[v];
    for (Triangle& t : welded.triangles)
        for (uint32_t& v : t) v = place_of[v];
    drop_degenerate(welded);
    const Topology after = topology(welded);
    if (after.open_edges >= before.open_edges || after.non_manifold_edges > before.non_manifold_edges) return 0;
    if (!mesh.velocities.empty()) {
        std::vector<uint32_t> at(distinct, 0);
        welded.velocities.assign(distinct, glm::vec3(0));
        for (size_t v = 0; v < count; ++v) welded.velocities[place_of[v]] += mesh.velocities[v], ++at[place_of[v]];
        for (size_t v = 0; v < distinct; ++v) welded.velocities[v] /= float(at[v]);
    }
    mesh = std::move(welded);
    return before.open_edges - after.open_edges;
}

}  // namespace rill::cooker
