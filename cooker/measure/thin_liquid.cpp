// SPDX-License-Identifier: MIT
#include "measure/thin_liquid.h"

#include <algorithm>
#include <cmath>

namespace rill::cooker {
namespace {

constexpr double faces = -0.2;      // n·n of surface that bounds the liquid from the other side
constexpr double beside = 0.5;      // cosine, seen from the ball's centre: what else is nearer than that to the vertex is a bump of its own side
constexpr double touches = 1e-3;    // of the radius that a ball may reach beyond the surface

/// Ma, Bae & Choi 2012, "3D medial axis point approximation using nearest neighbors and the normal field": a ball that
/// touches at the vertex shrinks until nothing is left in it.
float thickness_at(const Mesh& mesh, const SurfaceIndex& index, const glm::dvec3& x, const glm::dvec3& n, float most) {
    double radius = 0.5 * most;
    bool thin = false;  // what bounds it faces the vertex
    for (int round = 0; round < 32; ++round) {
        const glm::dvec3 centre = x - radius * n;
        const SurfaceIndex::Hit hit = index.closest(glm::vec3(centre), float(radius));
        if (!(hit.distance < radius * (1 - touches))) break;
        const glm::dvec3 to = glm::dvec3(hit.point) - centre, across = x - glm::dvec3(hit.point);
        const Triangle& t = mesh.triangles[hit.triangle];
        const glm::dvec3 a = mesh.positions[t[0]];
        const glm::dvec3 facing = glm::cross(glm::dvec3(mesh.positions[t[1]]) - a, glm::dvec3(mesh.positions[t[2]]) - a);
        const bool opposite = glm::dot(facing, n) < faces * glm::length(facing);
        if (!opposite && glm::dot(to, n) > beside * glm::length(to)) break;
        const double smaller = glm::dot(across, across) / (2 * glm::dot(n, across));
        if (!(smaller < radius) || !(smaller > 0)) break;
        radius = smaller, thin |= opposite;
    }
    return thin ? float(2 * radius) : most;
}

}  // namespace

std::vector<float> thickness(const Mesh& mesh, const SurfaceIndex& index, float most) {
    const std::vector<glm::vec3> normals = mesh.normals.empty() ? vertex_normals(mesh) : mesh.normals;
    std::vector<float> result(mesh.positions.size(), most);
    for (size_t v = 0; v < result.size(); ++v)
        if (glm::dot(normals[v], normals[v]) > 0.5f) result[v] = thickness_at(mesh, index, mesh.positions[v], normals[v], most);
    return result;
}

void ThinError::add(const ThinError& other) {
    for (size_t i = 0; i < classes; ++i) below[i].add(other.below[i]);
    area += other.area;
}

ThinError thin_error(const Mesh& source, const SurfaceIndex& index, const std::vector<float>& distances, float spacing) {
    ThinError error;
    const std::vector<float> areas = vertex_areas(source), thick = thickness(source, index, ThinError::classes * spacing);
    for (size_t v = 0; v < areas.size(); ++v) {
        error.area += areas[v];
        for (size_t i = 0; i < ThinError::classes && areas[v] > 0; ++i)
            if (thick[v] < float(i + 1) * spacing) error.below[i].add(distances[v], areas[v]);
    }
    return error;
}

}  // namespace rill::cooker
