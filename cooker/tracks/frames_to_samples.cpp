// SPDX-License-Identifier: MIT
// Adaptive scattering driven by the decoder: a point is born where the surface decoded so far misses the source.
// That puts points where curvature, thin liquid or new liquid asks for them, without a model of either.
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "tracks/pipeline.h"

namespace rill::cooker {
namespace {

constexpr float coarsest = 8;    // spacing of the first points on bare surface, in edges
// No two points closer, in edges; closer still below a tolerance of .18 edges. (2.2 for all: dam_break at 0.12e stops at a p99
// of .19 edges, whatever it may cost.)
constexpr float finest = 2.2f, least_finest = 1, usual_tolerance = 0.18f;
constexpr float same_side = 0.3f;

uint32_t scramble(uint32_t x) {
    x ^= x >> 16, x *= 0x7feb352du, x ^= x >> 15, x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

/// Poisson-disk test against points chosen in this call.
class Disks {
public:
    explicit Disks(float cell) : cell_(cell) {}
    bool free(const SurfacePoint& p, float radius) const {
        const int reach = int(std::ceil(radius / cell_));
        const glm::ivec3 c = cell_of(p.position);
        for (int z = -reach; z <= reach; ++z)
            for (int y = -reach; y <= reach; ++y)
                for (int x = -reach; x <= reach; ++x) {
                    const auto found = cells_.find(key(c + glm::ivec3(x, y, z)));
                    if (found == cells_.end()) continue;
                    for (const SurfacePoint& q : found->second)
                        if (glm::dot(p.normal, q.normal) > same_side && glm::distance(p.position, q.position) < radius)
                            return false;
                }
        return true;
    }
    void add(const SurfacePoint& p) { cells_[key(cell_of(p.position))].push_back(p); }

private:
    glm::ivec3 cell_of(const glm::vec3& p) const { return glm::ivec3(glm::floor(p / cell_)); }
    static uint64_t key(const glm::ivec3& c) {
        const auto part = [](int v) { return uint64_t(uint32_t(v + (1 << 20)) & 0x1fffffu); };
        return part(c.x) | part(c.y) << 21 | part(c.z) << 42;
    }
    float cell_;
    std::unordered_map<uint64_t, std::vector<SurfacePoint>> cells_;
};

/// Half the spacing of the points around, in [least, most] metres; 0 where one already stands close enough.
float room_for(const VertexTree& tree, const std::vector<SurfacePoint>& points, const SurfacePoint& p, float least, float most) {
    thread_local std::vector<VertexTree::Found> found;
    tree.nearest(p.position, 10, found);
    float nearest = 1e30f, third = 1e30f;
    int same = 0;
    for (const auto& f : found) {
        if (glm::dot(points[f.vertex].normal, p.normal) < same_side) continue;
        const float d = std::sqrt(f.distance2);
        if (same++ == 0) nearest = d;
        if (same == 3) {
            third = std::min(third, d);
            break;
        }
    }
    const float room = std::clamp(0.6f * third, least, most);
    return nearest < 0.75f * room ? 0.f : room;
}

}  // namespace

std::vector<SurfacePoint> choose_births(const SurfaceFrame& frame, const Residual& residual, const std::vector<SurfacePoint>& points,
                                        float threshold, float tolerance) {
    const auto badness = [&](uint32_t v) {
        return residual.wrong_side[v] || residual.spur[v] ? 4 * frame.edge : std::min(std::fabs(residual.distance[v]), 4 * frame.edge);
    };
    std::vector<uint32_t> bad;
    for (uint32_t v = 0; v < residual.distance.size(); ++v)
        if (badness(v) > threshold && frame.area[v] > 0) bad.push_back(v);
    std::sort(bad.begin(), bad.end(), [&](uint32_t a, uint32_t b) {
        const float x = badness(a), y = badness(b);
        return x != y ? x > y : scramble(a) < scramble(b);
    });
    std::vector<glm::vec3> positions;
    for (const SurfacePoint& p : points) positions.push_back(p.position);
    const VertexTree tree(positions);
    const float most = coarsest * frame.edge;
    const float least = std::clamp(finest * tolerance / usual_tolerance, least_finest * frame.edge, finest * frame.edge);
    Disks disks(3 * frame.edge);
    std::vector<SurfacePoint> born;
    for (uint32_t v : bad) {
        const glm::vec3 velocity = frame.mesh.velocities.empty() ? glm::vec3(0) : frame.mesh.velocities[v];
        const SurfacePoint p{frame.mesh.positions[v], frame.mesh.normals[v], velocity};
        const float room = room_for(tree, points, p, least, residual.spur[v] ? least : most);
        if (room <= 0 || !disks.free(p, room)) continue;
        disks.add(p);
        born.push_back(p);
    }
    return born;
}

}  // namespace rill::cooker
