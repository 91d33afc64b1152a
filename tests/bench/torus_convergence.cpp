// SPDX-License-Identifier: MIT
#include "torus_convergence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "common/parallel.h"
#include "decoded_field.h"

namespace rill::bench {
namespace {

constexpr double pi = 3.14159265358979323846;

Point torus_point(double round, double across) {
    const glm::dvec3 out(std::cos(round), std::sin(round), 0);
    const glm::dvec3 normal = std::cos(across) * out + glm::dvec3(0, 0, std::sin(across));
    return {torus_radius * out + torus_tube * normal, normal};
}

/// Dart throwing until practically no free place is left.
std::vector<Point> poisson_disk(double spacing) {
    std::mt19937 random(20160724);
    const auto uniform = [&] { return random() / 4294967296.0; };
    const auto cell_of = [&](const glm::dvec3& x) {
        const glm::ivec3 c = glm::floor(x / spacing);
        return std::array<int, 3>{c.x, c.y, c.z};
    };
    std::map<std::array<int, 3>, std::vector<glm::dvec3>> cells;
    const auto is_free = [&](const glm::dvec3& x) {
        const auto c = cell_of(x);
        for (int i = 0; i < 27; ++i) {
            const auto found = cells.find({c[0] + i % 3 - 1, c[1] + i / 3 % 3 - 1, c[2] + i / 9 - 1});
            if (found == cells.end()) continue;
            for (const glm::dvec3& y : found->second)
                if (glm::distance(x, y) < spacing) return false;
        }
        return true;
    };
    std::vector<Point> points;
    const double area = 4 * pi * pi * torus_radius * torus_tube;
    const long darts = long(60 * area / (spacing * spacing));
    for (long dart = 0; dart < darts; ++dart) {
        const double round = 2 * pi * uniform(), across = 2 * pi * uniform();
        // Uniform by area: the inner side of the ring is shorter.
        const double share = (torus_radius + torus_tube * std::cos(across)) / (torus_radius + torus_tube);
        if (uniform() > share) continue;
        const Point p = torus_point(round, across);
        if (!is_free(p.position)) continue;
        cells[cell_of(p.position)].push_back(p.position);
        points.push_back(p);
    }
    return points;
}

TorusError torus_error(double spacing) {
    constexpr int rounds = 96, acrosses = 48;  // patches of 5 × 2 positions
    const std::vector<Point> points = poisson_disk(spacing);
    const DecodedField field(points);
    std::vector<glm::dvec3> positions;
    std::vector<double> areas;
    for (int a = 0; a < acrosses; ++a)
        for (int r = 0; r < rounds; ++r)
            for (int k = 0; k < 10; ++k) {
                const double across = 2 * pi * (a + (k / 5 + 0.5) / 2) / acrosses;
                const double round = 2 * pi * (r + (k % 5 + 0.5) / 5) / rounds;
                positions.push_back(torus_point(round, across).position);
                areas.push_back(torus_radius + torus_tube * std::cos(across));
            }
    TorusError error{spacing, uint32_t(points.size()), 0, 0};
    double area = 0;
    const std::vector<double> distances = field.distances(positions);
    for (size_t i = 0; i < distances.size(); ++i) {
        error.mean += areas[i] * std::fabs(distances[i]);
        error.max = std::max(error.max, std::fabs(distances[i]));
        area += areas[i];
    }
    error.mean /= area;
    return error;
}

}  // namespace

std::vector<TorusError> torus_convergence(const std::vector<double>& spacings) {
    std::vector<TorusError> errors(spacings.size());
    cooker::parallel_for(spacings.size(), 0, [&](size_t i) { errors[i] = torus_error(spacings[i]); });
    return errors;
}

Order fitted_order(const std::vector<TorusError>& errors, double TorusError::*which) {
    double n = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const TorusError& e : errors) {
        const double u = std::log(e.spacing), v = std::log(e.*which);
        n += 1, x += u, y += v, xx += u * u, xy += u * v;
    }
    const double order = (n * xy - x * y) / (n * xx - x * x);
    return {order, std::exp((y - order * x) / n)};
}

}  // namespace rill::bench
