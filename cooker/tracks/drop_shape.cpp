// SPDX-License-Identifier: MIT
#include "tracks/drop_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "surface/field_to_mesh.h"

namespace rill::cooker {
namespace {

constexpr float apart = 0.8f;  // edges, from other liquid

}  // namespace

DropShape DropShape::spindle(const glm::vec3& centre, const glm::vec3& axis, float along, float across) {
    const TangentFrame tangent = tangent_frame(axis);
    return {centre, glm::mat3(axis, tangent.t1, tangent.t2), {along, across, across}};
}

float DropShape::value(const glm::vec3& x) const {
    const glm::vec3 r = (x - centre) * axes / half;
    return (glm::length(r) - 1) * std::min({half.x, half.y, half.z});
}

DropShape DropShape::drawn(float cell, float thinner) const {
    const float scale = 1 + most_growth_of_drops * cell / std::cbrt(half.x * half.y * half.z);
    return {centre, axes, scale * half - thinner};
}

Drop DropShape::drop(bool is_liquid) const {
    const float sign = is_liquid ? 1.f : -1.f;
    glm::mat3 m(0);
    for (int a = 0; a < 3; ++a) m += sign * half[a] * glm::outerProduct(axes[a], axes[a]);
    Drop drop;
    drop.centre = centre;
    drop.shape = {m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]};
    drop.volume = sign * 4 * std::numbers::pi_v<float> / 3 * half.x * half.y * half.z;
    return drop;
}

bool is_alone(const DropShape& shape, uint32_t piece, const SurfaceFrame& frame, const std::vector<uint32_t>& label) {
    std::vector<VertexTree::Found> found;
    frame.tree.within(shape.centre, std::max({shape.half.x, shape.half.y, shape.half.z}) + apart * frame.edge, found);
    return std::all_of(found.begin(), found.end(), [&](const auto& f) {
        return label[f.vertex] == piece || shape.value(frame.mesh.positions[f.vertex]) > apart * frame.edge;
    });
}

void set_velocity(const SurfaceFrame& frame, Drop& drop) {
    if (frame.mesh.velocities.empty()) return;
    std::vector<VertexTree::Found> found;
    frame.tree.nearest(drop.centre, 1, found);
    drop.velocity = frame.mesh.velocities[found[0].vertex];
}

}  // namespace rill::cooker
