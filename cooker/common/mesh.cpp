// SPDX-License-Identifier: MIT
#include "common/mesh.h"

#include <algorithm>
#include <numeric>

#include "common/mesh_edges.h"

namespace rill::cooker {

glm::vec3 unit_normal(const glm::vec3& area) {
    const double length = glm::length(glm::dvec3(area));  // squares of tiny areas underflow in float
    return length > 0 ? glm::vec3(glm::dvec3(area) / length) : glm::vec3(0);
}

std::vector<glm::vec3> vertex_normals(const Mesh& mesh) {
    std::vector<glm::vec3> normals(mesh.positions.size(), glm::vec3(0));
    for (const Triangle& t : mesh.triangles) {
        const glm::vec3 a = mesh.positions[t[0]];
        // Its length is twice the area: adding it unscaled is what weights by area.
        const glm::vec3 face = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
        for (uint32_t v : t) normals[v] += face;
    }
    for (glm::vec3& n : normals) n = unit_normal(n);
    return normals;
}

std::vector<float> vertex_areas(const Mesh& mesh) {
    std::vector<float> area(mesh.positions.size(), 0.f);
    for (const Triangle& t : mesh.triangles) {
        const glm::vec3 &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        const float third = glm::length(glm::cross(b - a, c - a)) / 6;
        for (uint32_t v : t) area[v] += third;
    }
    return area;
}

float median_edge(const Mesh& mesh) {
    constexpr size_t most = 100000;
    const size_t edges = mesh.triangles.size() * 3;
    if (edges == 0) return 0;
    const size_t count = std::min(edges, most);
    std::vector<float> lengths(count);
    for (size_t i = 0; i < count; ++i) {
        const size_t edge = edges * i / count;
        const Triangle& t = mesh.triangles[edge / 3];
        lengths[i] = glm::distance(mesh.positions[t[edge % 3]], mesh.positions[t[(edge + 1) % 3]]);
    }
    std::nth_element(lengths.begin(), lengths.begin() + count / 2, lengths.end());
    return lengths[count / 2];
}

double signed_volume(const Mesh& mesh) {
    if (mesh.triangles.empty()) return 0;
    return signed_volume(mesh, mesh.positions[mesh.triangles[0][0]]);  // near the mesh: less cancellation
}

double signed_volume(const Mesh& mesh, const glm::vec3& apex) {
    const glm::dvec3 origin = apex;
    double six_volumes = 0;
    for (const Triangle& t : mesh.triangles) {
        const glm::dvec3 a = glm::dvec3(mesh.positions[t[0]]) - origin;
        const glm::dvec3 b = glm::dvec3(mesh.positions[t[1]]) - origin;
        const glm::dvec3 c = glm::dvec3(mesh.positions[t[2]]) - origin;
        six_volumes += glm::dot(a, glm::cross(b, c));
    }
    return six_volumes / 6;
}

/// Sums of hashes: wrong once in 2^64 meshes, in a tenth of the time of sorting.
bool is_closed(const Mesh& mesh) {
    uint64_t sum = 0;
    for (const Triangle& t : mesh.triangles)
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t a = t[k], b = t[(k + 1) % 3];
            uint64_t hash = (uint64_t(std::min(a, b)) << 32 | std::max(a, b)) * 0x9e3779b97f4a7c15u;
            hash = (hash ^ hash >> 32) * 0xd6e8feb86659fd93u, hash ^= hash >> 32;
            sum += a < b ? hash : -hash;
        }
    return sum == 0;
}

std::vector<OpenEdge> open_edges(const Mesh& mesh) {
    if (is_closed(mesh)) return {};
    const std::vector<MeshEdge> edges = sorted_edges(mesh.triangles);
    std::vector<OpenEdge> open;
    for (size_t i = 0, next; i < edges.size(); i = next) {
        for (next = i + 1; next < edges.size() && edges[next].ends == edges[i].ends;) ++next;
        const Triangle& t = mesh.triangles[edges[i].triangle];
        if (next - i == 1) open.push_back({t[edges[i].corner], t[(edges[i].corner + 1) % 3], edges[i].triangle});
    }
    return open;
}

std::vector<uint32_t> label_components(const Mesh& mesh) {
    std::vector<uint32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const Triangle& t : mesh.triangles)
        for (int k = 1; k < 3; ++k) {
            const uint32_t a = root(t[0]), b = root(t[size_t(k)]);
            parent[std::max(a, b)] = std::min(a, b);
        }
    for (uint32_t v = 0; v < parent.size(); ++v) parent[v] = root(v);
    return parent;
}

std::vector<double> label_volumes(const Mesh& mesh, const std::vector<uint32_t>& label) {
    std::vector<double> six_volumes(mesh.positions.size(), 0.0);
    for (const Triangle& t : mesh.triangles) {
        const uint32_t root = label[t[0]];
        const glm::dvec3 origin = mesh.positions[root];
        const glm::dvec3 a = glm::dvec3(mesh.positions[t[0]]) - origin;
        const glm::dvec3 b = glm::dvec3(mesh.positions[t[1]]) - origin;
        const glm::dvec3 c = glm::dvec3(mesh.positions[t[2]]) - origin;
        six_volumes[root] += glm::dot(a, glm::cross(b, c));
    }
    for (double& volume : six_volumes) volume /= 6;
    return six_volumes;
}

void drop_degenerate(Mesh& mesh) {
    std::erase_if(mesh.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

Mesh part_of(const Mesh& mesh, const std::vector<Triangle>& triangles) {
    std::vector<uint32_t> place(mesh.positions.size(), ~0u);
    Mesh part;
    part.triangles.reserve(triangles.size());
    for (Triangle t : triangles) {
        for (uint32_t& v : t) {
            if (place[v] == ~0u) {
                place[v] = uint32_t(part.positions.size());
                part.positions.push_back(mesh.positions[v]);
                if (!mesh.normals.empty()) part.normals.push_back(mesh.normals[v]);
                if (!mesh.velocities.empty()) part.velocities.push_back(mesh.velocities[v]);
            }
            v = place[v];
        }
        part.triangles.push_back(t);
    }
    return part;
}

}  // namespace rill::cooker
