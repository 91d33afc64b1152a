// SPDX-License-Identifier: MIT
// The error metric: one definition for the closed loop of the cooker, `rill verify` and `rill compare`.
#pragma once
#include <cstdint>
#include <vector>

#include "mesh.h"

namespace rill::cooker {

/// Bounding volume hierarchy over the triangles of a mesh; read only after construction, thread safe.
class SurfaceIndex {
public:
    explicit SurfaceIndex(const Mesh& mesh);  ///< keeps a reference
    ~SurfaceIndex();
    SurfaceIndex(SurfaceIndex&&) noexcept;
    struct Hit {
        glm::vec3 point{};
        float distance = 0;        ///< metres, unsigned; +inf when the mesh is empty
        uint32_t triangle = 0;
        glm::vec3 barycentric{};   ///< of the hit in the triangle
    };
    Hit closest(const glm::vec3& x, float at_most) const;  ///< at_most: give up beyond (inf: never)
    const Mesh& mesh() const;
private:
    struct Impl;
    Impl* impl_;
};

struct Topology {
    uint32_t open_edges = 0, non_manifold_edges = 0, components = 0;
    double volume = 0;  ///< m³
};
Topology topology(const Mesh& mesh);
/// Volumes of the connected components, largest first.
std::vector<double> component_volumes(const Mesh& mesh);

struct DirectedDistance {
    double mean = 0, p99 = 0, max = 0;   ///< metres, area-weighted
    double normal_degrees = 0;           ///< area-weighted mean angle between vertex normals
};
/// How much area lies at which distance, in steps of 1/16 octave: frames add up to a sequence without
/// keeping their samples.
struct DistanceHistogram {
    std::vector<double> area;  ///< by distance; empty = nothing yet
    void add(float distance, double weight);
    void add(const DistanceHistogram& other);
    /// The distance that the share `q` of the area keeps below, within 1 %; 0 when empty.
    double quantile(double q) const;
    static float distance_of(size_t bin);  ///< lower end of a bin, metres
};
struct SurfaceDistance {
    DirectedDistance forward, backward;  ///< source → decoded, decoded → source
    double mean = 0, p99 = 0, max = 0, normal_degrees = 0;  ///< symmetric: both sample sets pooled
    DistanceHistogram histogram;         ///< both sample sets
    std::vector<float> per_source_vertex;  ///< unsigned distance, only if asked for
};
/// Samples: every vertex and every triangle centroid of each side, weighted by the area it stands for.
/// Both empty: all zero. One empty: distances are +inf.
SurfaceDistance surface_distance(const Mesh& source, const SurfaceIndex& source_index,
                                 const Mesh& decoded, const SurfaceIndex& decoded_index,
                                 bool keep_per_vertex = false);

}  // namespace rill::cooker
