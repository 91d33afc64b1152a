// SPDX-License-Identifier: MIT
// Points carried through time by the motion of the frames (surface_motion.h) and held to the surface; where the surface leaves
// them, they slide: first along their own tangent motion, at last staying where they are.
//
// What was tried instead: README.md, "How points are carried". Points also pushed apart along the surface, .15 or .4 of the
// overlap a frame: a quarter of the deaths by crowding, +5 and +12 % of bytes, for the pushes themselves must be coded.
#include <algorithm>
#include <cmath>

#include "tracks/pipeline.h"

namespace rill::cooker {
namespace {

constexpr float most_off = 0.5f;         // mean edges of the mesh there that a held point may be off it; at 1.2 twice as
                                        // many stray pieces
constexpr float least_agreement = 0.2f;  // n·n of a vertex that may hold the point

/// Nearest vertex that faces like `normal`; ~0u if none among the nearest.
uint32_t nearest_facing(const SurfaceFrame& frame, const glm::vec3& x, const glm::vec3& normal, size_t among) {
    thread_local std::vector<VertexTree::Found> found;
    frame.tree.nearest(x, among, found);
    for (const auto& f : found)
        if (glm::dot(frame.mesh.normals[f.vertex], normal) > least_agreement) return f.vertex;
    return ~0u;
}

/// Where the motion of the frame takes x.
glm::vec3 moved(const SurfaceFrame& frame, const std::vector<glm::vec3>& motion, const glm::vec3& x, const glm::vec3& normal) {
    const SurfaceIndex::Hit hit = frame.index.closest(x, 2 * frame.edge);
    if (hit.distance < 2 * frame.edge) {
        const Triangle& t = frame.mesh.triangles[hit.triangle];
        if (glm::dot(frame.mesh.normals[t[0]], normal) > least_agreement)
            return x + hit.barycentric.x * motion[t[0]] + hit.barycentric.y * motion[t[1]] + hit.barycentric.z * motion[t[2]];
    }
    const uint32_t v = nearest_facing(frame, x, normal, 4);
    return v == ~0u ? x : x + motion[v];
}

/// The point of the smoothed surface near x, if the surface comes within `reach`.
std::optional<SurfacePoint> hold(const SurfaceFrame& frame, const glm::vec3& x, const glm::vec3& normal, float radius,
                                 float reach) {
    const uint32_t v = nearest_facing(frame, x, normal, 12);
    if (v == ~0u) return {};
    // Drop onto the tangent plane at the vertex, so that the point keeps its place along the surface.
    const glm::vec3 n = frame.mesh.normals[v], p = frame.mesh.positions[v];
    if (glm::length(x - p) > reach) return {};
    glm::vec3 on = x - n * glm::dot(x - p, n);
    if (glm::length(on - p) > 2 * frame.edge) on = p;
    SurfacePoint held{on, n, {}};
    if (!settle(frame, radius, held) || glm::length(held.position - x) > reach) return {};
    // A fit may reach beyond what carries it: there must be surface where the point now stands.
    const SurfaceIndex::Hit under = frame.index.closest(held.position, 2 * frame.edge);
    if (!(under.distance < 2 * frame.edge)) return {};
    const Triangle& t = frame.mesh.triangles[under.triangle];
    float size = 0;  // coarse facets stand off the smooth surface that they mean
    for (int k = 0; k < 3; ++k) size += glm::distance(frame.mesh.positions[t[k]], frame.mesh.positions[t[(k + 1) % 3]]) / 3;
    if (under.distance > most_off * std::max(size, frame.edge)) return {};
    for (uint32_t corner : t)
        if (glm::dot(frame.mesh.normals[corner], held.normal) > least_agreement) return held;
    return {};
}

}  // namespace

std::optional<SurfacePoint> carry_point(const SurfaceFrame& from, const std::vector<glm::vec3>& motion, const SurfaceFrame& to,
                                        const SurfacePoint& point, float radius) {
    if (from.mesh.positions.empty() || to.mesh.positions.empty()) return {};
    const glm::vec3 x = moved(from, motion, point.position, point.normal);
    const float way = glm::length(x - point.position);
    const float reach = 2 * to.edge + 0.4f * std::min(way, 4 * radius);
    if (auto held = hold(to, x, point.normal, radius, reach)) return held;
    // The surface is gone from there (merges): the tangential half of the motion, then none.
    const glm::vec3 slide = x - point.normal * glm::dot(x - point.position, point.normal);
    if (auto held = hold(to, glm::mix(point.position, slide, 0.5f), point.normal, radius, 2 * to.edge)) return held;
    return hold(to, point.position, point.normal, radius, 2 * to.edge);
}

}  // namespace rill::cooker
