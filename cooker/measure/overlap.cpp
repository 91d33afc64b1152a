// SPDX-License-Identifier: MIT
#include "measure/overlap.h"

#include <algorithm>
#include <cmath>

namespace rill::cooker {
namespace {

constexpr size_t least_samples = 32, most_samples = 256, most_angles = 8'000'000;  // of a large mesh fewer: half a second
constexpr float outside = 0.02f;  // edges: gaps between pieces that nearly touch are mostly wider

/// How often the surface winds round x.
double winding(const Mesh& mesh, const glm::dvec3& x) {
    double angle = 0;  // halves of solid angles: van Oosterom, Strackee 1983
    for (const Triangle& t : mesh.triangles) {
        const glm::dvec3 a = glm::dvec3(mesh.positions[t[0]]) - x, b = glm::dvec3(mesh.positions[t[1]]) - x, c = glm::dvec3(mesh.positions[t[2]]) - x;
        const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
        angle += std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
    }
    return angle / 6.28318530717958647692;
}

}  // namespace

double share_inside(const Mesh& mesh, float edge) {
    const std::vector<glm::vec3> normals = vertex_normals(mesh);
    const size_t samples = std::clamp(most_angles / std::max<size_t>(mesh.triangles.size(), 1), least_samples, most_samples);
    const size_t count = mesh.positions.size(), stride = std::max<size_t>((count + samples - 1) / samples, 1);
    size_t looked_at = 0, inside = 0;
    for (size_t v = 0; v < count; v += stride) {
        if (normals[v] == glm::vec3(0)) continue;
        ++looked_at, inside += winding(mesh, mesh.positions[v] + outside * edge * normals[v]) > 0.5;
    }
    return looked_at > 0 ? double(inside) / double(looked_at) : 0;
}

}  // namespace rill::cooker
