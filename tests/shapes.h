// SPDX-License-Identifier: MIT
// Small meshes that tests know everything about.
#pragma once
#include <cmath>

#include "common/mesh.h"

/// Closed, outward wound: poles and `n` segments round, n/2 rows.
inline rill::cooker::Mesh sphere(uint32_t n, float radius, const glm::vec3& centre = {}, float bumps = 0) {
    rill::cooker::Mesh mesh;
    const uint32_t rows = n / 2;
    auto at = [&](float polar, float round) {
        const float r = radius * (1 + bumps * std::sin(3 * polar) * std::sin(3 * polar) * std::cos(4 * round));
        return centre + r * glm::vec3(std::sin(polar) * std::cos(round), std::sin(polar) * std::sin(round), std::cos(polar));
    };
    const float pi = 3.14159265f;
    mesh.positions.push_back(at(0, 0));
    for (uint32_t i = 1; i < rows; ++i)
        for (uint32_t k = 0; k < n; ++k) mesh.positions.push_back(at(pi * float(i) / float(rows), 2 * pi * float(k) / float(n)));
    mesh.positions.push_back(centre - glm::vec3(0, 0, radius));
    const uint32_t last = uint32_t(mesh.positions.size()) - 1;
    auto vertex = [&](uint32_t row, uint32_t k) { return 1 + (row - 1) * n + k % n; };
    for (uint32_t k = 0; k < n; ++k) {
        mesh.triangles.push_back({0, vertex(1, k), vertex(1, k + 1)});
        for (uint32_t i = 1; i + 1 < rows; ++i) {
            mesh.triangles.push_back({vertex(i, k), vertex(i + 1, k), vertex(i + 1, k + 1)});
            mesh.triangles.push_back({vertex(i, k), vertex(i + 1, k + 1), vertex(i, k + 1)});
        }
        mesh.triangles.push_back({vertex(rows - 1, k), last, vertex(rows - 1, k + 1)});
    }
    return mesh;
}
inline rill::cooker::Mesh bumpy_sphere(uint32_t n, float radius, const glm::vec3& centre = {}) { return sphere(n, radius, centre, 0.1f); }

/// Two balls of `ball` edges joined by a neck of `neck` edges along x, as a surface of revolution.
inline rill::cooker::Mesh dumbbell(float edge, float ball, float neck, float apart) {
    rill::cooker::Mesh mesh = sphere(96, 1);
    for (glm::vec3& x : mesh.positions) {
        const float along = (ball + apart) * x.x, beyond = std::fabs(along) - apart;  // a ball's middle
        const float at_ball = std::sqrt(std::max(ball * ball - beyond * beyond, 0.f));
        const float round = beyond > 0 ? at_ball : std::max(at_ball, neck), length = std::sqrt(x.y * x.y + x.z * x.z);
        const float scale = length > 1e-4f ? round / length : 0;
        x = edge * glm::vec3(along, scale * x.y, scale * x.z);
    }
    return mesh;
}

/// The square [0, side]² at z = 0, normal +z, n × n cells.
inline rill::cooker::Mesh plane(uint32_t n, float side) {
    rill::cooker::Mesh mesh;
    for (uint32_t y = 0; y <= n; ++y)
        for (uint32_t x = 0; x <= n; ++x) mesh.positions.emplace_back(side * float(x) / float(n), side * float(y) / float(n), 0);
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = y * (n + 1) + x, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    return mesh;
}

inline void append(rill::cooker::Mesh& to, const rill::cooker::Mesh& from) {
    const uint32_t base = uint32_t(to.positions.size());
    to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
    to.velocities.insert(to.velocities.end(), from.velocities.begin(), from.velocities.end());
    for (const rill::cooker::Triangle& t : from.triangles) to.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}
