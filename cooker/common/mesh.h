// SPDX-License-Identifier: MIT
// The cooker's plain mesh. Metres, metres per second, counter-clockwise seen from the air.
#pragma once
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace rill::cooker {

using Triangle = std::array<uint32_t, 3>;

struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;     ///< per vertex, unit; may be empty
    std::vector<glm::vec3> velocities;  ///< per vertex; may be empty
    std::vector<Triangle> triangles;
};

/// Bad input or output: names the file (and place) and the cause, one line. Becomes exit code 2.
struct InputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};
/// Wrong use of the command line or of a setting. Becomes exit code 1.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Direction of an area vector; zero if it has none.
glm::vec3 unit_normal(const glm::vec3& area);
/// Area-weighted vertex normals (unit; zero where no triangle gives one).
std::vector<glm::vec3> vertex_normals(const Mesh& mesh);
/// Per vertex a third of the area of its triangles, m².
std::vector<float> vertex_areas(const Mesh& mesh);
/// Median edge length over (at most 100k evenly strided) edges; 0 for an empty mesh.
float median_edge(const Mesh& mesh);
/// Signed volume, m³, positive for outward winding. Of an open mesh: with cones from its open edges to `apex`.
double signed_volume(const Mesh& mesh);
double signed_volume(const Mesh& mesh, const glm::vec3& apex);
/// Whether every edge is walked as often one way as the other.
bool is_closed(const Mesh& mesh);
/// An edge that no other triangle has, in the direction of its own.
struct OpenEdge {
    uint32_t from, to, triangle;
};
std::vector<OpenEdge> open_edges(const Mesh& mesh);
/// Per vertex: the connected component it belongs to, named by its first vertex.
std::vector<uint32_t> label_components(const Mesh& mesh);
/// By that name, their signed volumes, m³; 0 for all other vertices.
std::vector<double> label_volumes(const Mesh& mesh, const std::vector<uint32_t>& label);
/// Takes out triangles that name a vertex twice.
void drop_degenerate(Mesh& mesh);
/// `triangles` of the mesh, with the vertices they use and what those carry.
Mesh part_of(const Mesh& mesh, const std::vector<Triangle>& triangles);

}  // namespace rill::cooker
