// SPDX-License-Identifier: MIT
// The error metric: one definition for the closed loop of the cooker, `rill verify` and `rill compare`.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {

/// Bounding volume hierarchy over the triangles of a mesh; read only after construction, thread safe.
class SurfaceIndex {
public:
    explicit SurfaceIndex(const Mesh& mesh, int jobs = 1);  ///< keeps a reference
    /// Of a mesh with the same triangles whose vertices have moved: takes over how `before` divides them, in a fraction of
    /// the time; the farther they went apart, the slower are queries.
    SurfaceIndex(const Mesh& moved, const SurfaceIndex& before, int jobs);
    ~SurfaceIndex();
    SurfaceIndex(SurfaceIndex&&) noexcept;
    struct Hit {
        glm::vec3 point{};
        float distance = 0;        ///< metres, unsigned; +inf when the mesh is empty
        uint32_t triangle = 0;
        glm::vec3 barycentric{};   ///< of the hit in the triangle
    };
    /// Where one query of a row ended, for the next, near by, to begin there. Of triangles that are equally near it may name another.
    struct Near {
        uint32_t leaf = ~0u;
    };
    Hit closest(const glm::vec3& x, float at_most, Near* near = nullptr) const;  ///< at_most: give up beyond (inf: never)
    bool within(const glm::vec3& x, float distance, Near* near = nullptr) const;  ///< closest(x, distance).distance < distance, in less time
    const Mesh& mesh() const;
private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Of vertices, interpolated at a hit in triangle `t`.
inline glm::vec3 value_at(const SurfaceIndex::Hit& hit, const Triangle& t, const std::vector<glm::vec3>& values) {
    return hit.barycentric.x * values[t[0]] + hit.barycentric.y * values[t[1]] + hit.barycentric.z * values[t[2]];
}

/// Which of the positions stand `beyond` metres or more off the surface, ascending.
std::vector<uint32_t> find_beyond(const SurfaceIndex& surface, const std::vector<glm::vec3>& positions, float beyond, int jobs);

struct Topology {
    uint32_t open_edges = 0, non_manifold_edges = 0, components = 0;
    uint32_t large_components = 0;  ///< of more than large_cells cells
    double volume = 0;  ///< m³
};
inline constexpr double large_cells = 8;
/// `cell`: side of the cubes that tell which components are large, metres; 0: all that have volume.
Topology topology(const Mesh& mesh, double cell = 0);
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
    double share_below(double distance) const;  ///< of the area, within a bin; 1 when empty
    static float distance_of(size_t bin);  ///< lower end of a bin, metres
};
struct SurfaceDistance {
    DirectedDistance forward, backward;  ///< source → decoded, decoded → source
    double mean = 0, p99 = 0, max = 0, normal_degrees = 0;  ///< symmetric: both sample sets pooled
    DistanceHistogram histogram;         ///< both sample sets
    std::vector<float> per_source_vertex, per_decoded_vertex;  ///< unsigned distance, only if asked for
};
/// Figures over some area, of any number of frames: they are added up, not kept.
struct Spread {
    DistanceHistogram histogram;
    double weight = 0, sum = 0, max = 0;
    void add(float value, double area);
    void add(const SurfaceDistance& distance);
    void add(const Spread& other);
    double mean() const { return weight > 0 ? sum / weight : 0; }
    double p99() const { return histogram.area.empty() ? p99_ : histogram.quantile(0.99); }
    void forget() { p99_ = p99(), histogram = {}; }  ///< keeps the figures; nothing more may be added

private:
    double p99_ = 0;
};
/// Samples: every vertex and every triangle centroid of each side, weighted by the area it stands for.
/// Both empty: all zero. One empty: distances are +inf. `stride`: only every so many of them, for an estimate.
SurfaceDistance surface_distance(const Mesh& source, const SurfaceIndex& source_index,
                                 const Mesh& decoded, const SurfaceIndex& decoded_index,
                                 bool keep_per_vertex = false, size_t stride = 1);

}  // namespace rill::cooker
