// SPDX-License-Identifier: MIT
// One source frame, prepared for sampling, tracking and fitting.
#pragma once
#include <memory>
#include <vector>

#include "common/mesh.h"
#include "measure/surface_distance.h"

namespace rill::cooker {

/// A point of a surface: where, which way out, and how the fluid moves there (m/s).
struct SurfacePoint {
    glm::vec3 position{}, normal{}, velocity{};
};

/// Two unit vectors across a unit normal.
struct TangentFrame {
    glm::vec3 t1, t2;
};
inline TangentFrame tangent_frame(const glm::vec3& n) {
    const glm::vec3 t1 = glm::normalize(glm::cross(n, std::fabs(n.z) < 0.9f ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0)));
    return {t1, glm::cross(n, t1)};
}

/// Nearest-vertex queries over one mesh; immutable, thread safe.
class VertexTree {
public:
    explicit VertexTree(const std::vector<glm::vec3>& points);  ///< keeps a reference
    ~VertexTree();
    struct Found {
        uint32_t vertex;
        float distance2;
    };
    /// Up to `count` nearest, ascending by distance (ties by index).
    void nearest(const glm::vec3& x, size_t count, std::vector<Found>& out) const;
    /// All within `radius`, in the tree's order: the same of the same points.
    void within(const glm::vec3& x, float radius, std::vector<Found>& out) const;
private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// A small closed piece of liquid, or of air in it, as the ellipsoid {centre + S u : |u| = 1}.
struct Drop {
    glm::vec3 centre{}, velocity{};
    std::array<float, 6> shape{};   ///< S: xx yy zz xy xz yz, metres; negative definite: air
    float volume = 0;               ///< m³; negative: air
};

/// Places beside the surface whose side is known: where the decoded surface must not be.
struct Probe {
    glm::vec3 position;
    uint32_t vertex;   ///< whose normal it stands on
    bool outside;
};

/// Vertices in spatially coherent groups, for batched field evaluation.
struct VertexGroup {
    uint32_t first, count;  ///< into SurfaceFrame::order
    glm::vec3 lower, upper;
};

struct SurfaceFrame {
    explicit SurfaceFrame(Mesh mesh, float edge, std::vector<Drop> drops = {});
    Mesh mesh;                      ///< normals filled in; without the drops
    std::vector<Drop> drops;
    std::vector<float> area;        ///< per vertex, m²
    std::vector<uint32_t> order;    ///< vertices, grouped
    std::vector<VertexGroup> groups;
    std::vector<Probe> probes;      ///< in the order of `groups`
    std::vector<uint32_t> first_probe;  ///< per group, and the end
    VertexTree tree;
    SurfaceIndex index;
    float edge;                     ///< median edge of the sequence, metres
};

/// Local least-squares quadratic of the source around x: the surface without its grid-scale noise.
/// Only vertices within `radius` that face like `normal` count. Moves x along the normal onto the fitted
/// patch and turns the normal. False where fewer than 4 vertices carry it (nothing there).
bool settle(const SurfaceFrame& frame, float radius, SurfacePoint& point);

/// How deep x lies in the source's liquid, metres; negative: in the air. 0 farther than `most` from its surface.
float depth_at(const SurfaceFrame& frame, const glm::vec3& x, float most, SurfaceIndex::Near* near = nullptr);

}  // namespace rill::cooker
