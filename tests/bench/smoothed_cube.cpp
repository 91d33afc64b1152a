// SPDX-License-Identifier: MIT
#include "smoothed_cube.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include "common/parallel.h"

namespace rill::bench {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr int moves = 5;  // of a point: along its normal, two tilts, two along the surface
/// Points slide less readily than they tilt: sliding opens gaps that no patch covers.
constexpr double slide = 0.3;

struct Tangents {
    glm::dvec3 t1, t2;
};
Tangents tangents(const glm::dvec3& n) {
    const glm::dvec3 other = std::fabs(n.z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0);
    const glm::dvec3 t1 = glm::normalize(glm::cross(n, other));
    return {t1, glm::cross(n, t1)};
}

Point moved(const Point& p, const double* by) {
    const Tangents t = tangents(p.normal);
    return {p.position + by[0] * p.normal + slide * (by[3] * t.t1 + by[4] * t.t2),
            glm::normalize(p.normal + by[1] * t.t1 + by[2] * t.t2)};
}

Eigen::VectorXd residuals(const CubeMesh& mesh, const std::vector<Point>& points) {
    const std::vector<double> d = DecodedField(points).distances(mesh.positions);
    Eigen::VectorXd r(d.size());
    for (size_t i = 0; i < d.size(); ++i) r[long(i)] = std::clamp(d[i], -1.0, 1.0);
    return r;
}

double objective(const CubeMesh& mesh, const Eigen::VectorXd& r, double power) {
    double sum = 0;
    for (size_t i = 0; i < mesh.areas.size(); ++i) sum += mesh.areas[i] * std::pow(std::fabs(r[long(i)]), power);
    return sum;
}

Eigen::MatrixXd jacobian(const CubeMesh& mesh, const std::vector<Point>& points, const Eigen::VectorXd& r) {
    constexpr double nudge = 1e-3;
    Eigen::MatrixXd j(r.size(), long(points.size()) * moves);
    cooker::parallel_for(points.size() * moves, 0, [&](size_t column) {
        double by[moves] = {};
        by[column % moves] = nudge;
        std::vector<Point> changed = points;
        changed[column / moves] = moved(points[column / moves], by);
        j.col(long(column)) = (residuals(mesh, changed) - r) / nudge;
    });
    return j;
}

/// The point of the rounded cube nearest to q, which lies outside its core.
Point on_cube(const glm::dvec3& q) {
    const glm::dvec3 core = glm::clamp(q, -cube_half_side + cube_rounding, cube_half_side - cube_rounding);
    const glm::dvec3 normal = glm::normalize(q - core);
    return {core + cube_rounding * normal, normal};
}

/// Lloyd's relaxation: every point to the middle of the vertices nearest to it.
void relax(const CubeMesh& mesh, std::vector<Point>& points) {
    for (int pass = 0; pass < 50; ++pass) {
        std::vector<glm::dvec4> sum(points.size(), glm::dvec4(0));
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const auto nearer = [&](const Point& a, const Point& b) {
                return glm::distance(a.position, mesh.positions[v]) < glm::distance(b.position, mesh.positions[v]);
            };
            const size_t i = size_t(std::min_element(points.begin(), points.end(), nearer) - points.begin());
            sum[i] += mesh.areas[v] * glm::dvec4(mesh.positions[v], 1);
        }
        for (size_t i = 0; i < points.size(); ++i)
            if (sum[i].w > 0) points[i] = on_cube(glm::dvec3(sum[i]) / sum[i].w);
    }
}

}  // namespace

CubeMesh cube_mesh(int a, int b, int c) {
    const std::array<int, 3> cells{a, b, c};
    std::map<std::array<int, 3>, uint32_t> index;
    CubeMesh mesh{};
    const auto vertex = [&](const std::array<int, 3>& at) {
        const auto [found, fresh] = index.try_emplace(at, uint32_t(mesh.positions.size()));
        if (fresh) {
            const glm::dvec3 q = cube_half_side * (2.0 * glm::dvec3(at[0], at[1], at[2]) / glm::dvec3(a, b, c) - 1.0);
            const Point p = on_cube(q);
            mesh.positions.push_back(p.position);
            mesh.normals.push_back(p.normal);
            mesh.areas.push_back(0);
        }
        return found->second;
    };
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
            for (int u = 0; u < cells[(axis + 1) % 3]; ++u)
                for (int v = 0; v < cells[(axis + 2) % 3]; ++v) {
                    std::array<uint32_t, 4> quad;
                    for (int k = 0; k < 4; ++k) {
                        std::array<int, 3> at{};
                        at[axis] = side * cells[axis];
                        at[(axis + 1) % 3] = u + k % 2;
                        at[(axis + 2) % 3] = v + k / 2;
                        quad[k] = vertex(at);
                    }
                    const auto& p = mesh.positions;
                    const double area = glm::length(glm::cross(p[quad[3]] - p[quad[0]], p[quad[2]] - p[quad[1]])) / 2;
                    for (const uint32_t i : quad) mesh.areas[i] += area / 4;
                    mesh.triangles += 2;
                }
    return mesh;
}

Pose cube_pose(double frame) {
    const double u = frame / (cube_frames - 1);
    glm::dmat4 turn(1);
    turn = glm::rotate(turn, 1.3 * 2 * pi * u, glm::dvec3(0, 0, 1));
    turn = glm::rotate(turn, 0.7 * 2 * pi * u * u, glm::dvec3(1, 0, 0));
    return {glm::dmat3(turn), {4 * u, std::sin(0.9 * 2 * pi * u), 6 * u * (1 - u)}};
}

std::vector<Point> even_points(const CubeMesh& mesh, uint32_t count) {
    std::vector<double> nearest(mesh.positions.size(), 1e30);
    std::vector<Point> points;
    size_t next = 0;
    while (points.size() < count) {
        points.push_back({mesh.positions[next], mesh.normals[next]});
        for (size_t i = 0; i < nearest.size(); ++i)
            nearest[i] = std::min(nearest[i], glm::distance(mesh.positions[i], points.back().position));
        next = size_t(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
    }
    relax(mesh, points);
    return points;
}

void fit_points(const CubeMesh& mesh, double power, int steps, std::vector<Point>& points) {
    double damping = 1e-2;
    for (int step = 0; step < steps; ++step) {
        const double p = 2 + (power - 2) * std::min(1.0, 2.0 * step / steps);
        const Eigen::VectorXd r = residuals(mesh, points);
        const double before = objective(mesh, r, p);
        // Reweighted least squares: the mean of distance^p as a mean of squares.
        const double typical = std::sqrt(r.squaredNorm() / double(r.size()));
        Eigen::VectorXd weight(r.size());
        for (long i = 0; i < r.size(); ++i)
            weight[i] = mesh.areas[size_t(i)] * std::pow(std::fabs(r[i]) / typical + 0.05, p - 2);
        const Eigen::MatrixXd j = jacobian(mesh, points, r);
        const Eigen::MatrixXd normal = j.transpose() * weight.asDiagonal() * j;
        const Eigen::VectorXd slope = j.transpose() * weight.cwiseProduct(r);
        bool better = false;
        for (int trial = 0; trial < 6 && !better; ++trial) {
            Eigen::MatrixXd damped = normal;
            damped.diagonal().array() += damping * normal.diagonal().mean();
            const Eigen::VectorXd by = -damped.ldlt().solve(slope);
            std::vector<Point> changed = points;
            for (size_t i = 0; i < points.size(); ++i) changed[i] = moved(points[i], by.data() + moves * i);
            better = objective(mesh, residuals(mesh, changed), p) < before;
            damping *= better ? 0.3 : 5;
            if (better) points = std::move(changed);
        }
        if (!better && p == power) return;
    }
}

}  // namespace rill::bench
