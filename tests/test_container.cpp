// SPDX-License-Identifier: MIT
// The box that liquid stands in: field and mesh end at its walls, and at the bevels between them, exactly.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh_harness.h"

using namespace mesh_test;

namespace {

constexpr surface::Container cube{{-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}};

/// Of the field at (x, y, 0).
struct Sample {
    float value, gx, gy, gz;
};
Sample sample(const surface::Field& field, float x, float y) {
    const float z = 0;
    std::vector<uint32_t> candidates(field.point_count);
    const uint32_t found = surface::gather(field, {{x, y, z}, {x, y, z}}, candidates.data(), field.point_count);
    Sample at{};
    surface::evaluate_gradient(field, candidates.data(), found, &x, &y, &z, 1, &at.value, &at.gx, &at.gy, &at.gz, nullptr);
    return at;
}

/// The sides of a cube of one metre, moved outward.
Cloud cube_of_points(double beyond) {
    Cloud points;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1., 1.})
            for (int i = -4; i <= 4; ++i)
                for (int j = -4; j <= 4; ++j) {
                    Vec place{}, normal{};
                    normal[size_t(axis)] = side, place[size_t(axis)] = side * (0.5 + beyond);
                    place[size_t(axis + 1) % 3] = 0.11 * i, place[size_t(axis + 2) % 3] = 0.11 * j;
                    points.add(place, normal);
                }
    return points;
}

}  // namespace

TEST_CASE("liquid is cut off at the sides of its container, exactly") {
    Cloud ball;
    add_sphere(ball, {0, 0, 0}, 1, 2000);
    surface::Container container = surface::everywhere;
    container.upper[0] = 0.3f, container.lower[2] = -0.2f;
    const RealField real(ball, container);
    // Of the ball and the wall, what is nearer speaks; on the wall's other side it alone.
    const float x[3] = {0.299f, 0.2f, 0.4f}, y[3] = {0.94f, 0.96f, 0.9f}, wall[3] = {-0.001f, 0, 0.1f};
    for (const int i : {0, 2}) {
        const Sample at = sample(real.field, x[i], y[i]);
        CHECK(at.value == doctest::Approx(wall[i]).epsilon(1e-3));
        CHECK(at.gx == 1);
        CHECK(at.gy == 0);
    }
    const Sample free = sample(real.field, x[1], y[1]);
    CHECK(free.value == doctest::Approx(std::hypot(0.2, 0.96) - 1).epsilon(0.1));
    CHECK(free.gy > 0.9);
    for (const float cell : {0.05f, 0.11f}) {
        CAPTURE(cell);
        const Mesh m = mesh(real.field, {cell});
        CHECK(topology(m).closed_manifold());
        size_t flat = 0;
        for (uint32_t v = 0; v < m.vertex_count(); ++v) {
            const Vec x = m.at(v), n = m.normal_at(v);
            CHECK(x[0] <= 0.3 + 1e-6);
            CHECK(x[2] >= -0.2 - 1e-6);
            if (x[0] < 0.3 - cell / 100 || x[2] < -0.2 + 2 * cell || std::hypot(x[1], x[2]) > std::sqrt(1 - 0.09) - 2 * cell) continue;
            ++flat;
            CHECK(n[0] == 1);
            CHECK(n[1] == 0);
            CHECK(n[2] == 0);
        }
        CHECK(flat > 40);
    }
}

TEST_CASE("points that stand beyond their wall lead to it") {
    constexpr double beyond = 0.03;  // most of the smallest cell
    Cloud points = cube_of_points(beyond);
    const RealField real(points, cube);
    for (const float cell : {0.1f, 0.0937f, 0.04f}) {  // walls between cells, and in them
        CAPTURE(cell);
        const Mesh m = mesh(real.field, {cell});
        CHECK(topology(m).closed_manifold());
        REQUIRE(m.vertex_count() > 20);
        for (uint32_t v = 0; v < m.vertex_count(); ++v)
            for (const double x : m.at(v)) CHECK(std::fabs(x) <= 0.5 + 1e-6);
        CHECK(volume(m) == doctest::Approx(1).epsilon(0.9 * cell));
        for (const uint32_t workers : {2u, 8u}) CHECK(mesh(real.field, {cell, 200000, workers}).position == m.position);
    }
}

TEST_CASE("liquid that ends a hair before its wall ends at it, and at the same angle") {
    constexpr float cell = 0.0937f;
    for (const double before : {0.01, 0.1}) {  // cells
        CAPTURE(before);
        Cloud points = cube_of_points(-before * cell);
        const RealField real(points, cube);
        const Mesh m = mesh(real.field, {cell});
        CHECK(topology(m).closed_manifold());
        size_t middle = 0, flat = 0;
        for (uint32_t v = 0; v < m.vertex_count(); ++v) {
            const Vec at = m.at(v), n = m.normal_at(v);
            if (at[0] < 0.4 || std::max(std::fabs(at[1]), std::fabs(at[2])) > 0.25) continue;
            ++middle, flat += at[0] == 0.5 && n[0] == 1;
        }
        CHECK(middle > 10);
        CHECK(flat == (before < 0.03 ? middle : 0));
    }
}

TEST_CASE("edges between walls are cut off where they are not sharp") {
    Cloud ball;
    add_sphere(ball, {0, 0, 0}, 1, 2000);  // its surface lies outside all walls
    constexpr float legs = 0.05f;
    for (const uint32_t sharp : {0u, 0b000001u, 0b111111u}) {
        const surface::Container container{{-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}, sharp, legs};
        const RealField real(ball, container);
        const bool cut = !(sharp & 1), cut_above = sharp != 0b111111u;
        const Sample low = sample(real.field, -0.49f, 0.47f), high = sample(real.field, 0.49f, 0.47f);
        CHECK(low.value == doctest::Approx(cut ? 0.01 / std::sqrt(2) : -0.01).epsilon(1e-3));
        CHECK(high.value == doctest::Approx(cut_above ? 0.01 / std::sqrt(2) : -0.01).epsilon(1e-3));
        CHECK(low.gx == doctest::Approx(cut ? -std::sqrt(0.5) : -1));
        CHECK(low.gy == doctest::Approx(cut ? std::sqrt(0.5) : 0));
        for (const float cell : {0.05f, 0.0437f, 0.0537f, 0.1f}) {  // walls between cells, and in them; bevels larger than a cell, and smaller
            CAPTURE(sharp);
            CAPTURE(cell);
            const Mesh m = mesh(real.field, {cell});
            CHECK(topology(m).closed_manifold());
            size_t on_bevel = 0;
            for (uint32_t v = 0; v < m.vertex_count(); ++v) {
                const Vec at = m.at(v), n = m.normal_at(v);
                // Far from corners, and from the sharp wall: along the edge of x+ and y+.
                if (std::fabs(at[2]) > 0.5 - 2 * cell || at[0] < 0 || at[1] < 0) continue;
                const double beyond = at[0] + at[1] - 1 + legs;
                if (cut_above) CHECK(beyond < (cell > legs + 0.01f ? legs / 2 : 0) + cell / 64);  // as much is cut off, with neighbours farther away
                if (!cut_above || beyond < -cell / 64) continue;
                ++on_bevel;
                CHECK(std::min(n[0], n[1]) > 0.35);
                CHECK(n[2] == 0);
            }
            if (cut_above && cell < 2 * legs) CHECK(on_bevel > (1 - 4 * cell) / cell);
            const double corner = sharp == 0 ? 12 : sharp == 1 ? 8 : 0;
            CHECK(volume(m) == doctest::Approx(1 - corner * legs * legs / 2).epsilon(cell == 0.1f ? 0.012 : cell == 0.05f ? 0.003 : 0.0005));
            for (const uint32_t workers : {2u, 8u}) CHECK(mesh(real.field, {cell, 200000, workers}).position == m.position);
        }
    }
}

TEST_CASE("sharp rims are where the liquid meets the wall, whether it rises towards it or falls") {
    Cloud ball;
    add_sphere(ball, {0, 0, 0}, 1, 4000);
    const double rim = 0.8;  // radius
    for (const float wall : {-0.6f, 0.6f})
        for (const float cell : {0.1f, 0.0937f, 0.05f, 0.0437f}) {
            CAPTURE(wall);
            CAPTURE(cell);
            surface::Container container = surface::everywhere;
            container.upper[0] = wall, container.sharp = 0b000010u;
            const RealField real(ball, container);
            const Mesh m = mesh(real.field, {cell});
            CHECK(topology(m).closed_manifold());
            const auto bins = size_t(pi * rim / cell);  // of two cells: none is without a vertex
            std::vector<double> farthest(bins, 0);
            for (uint32_t v = 0; v < m.vertex_count(); ++v) {
                const Vec at = m.at(v);
                if (at[0] < wall - cell / 100) continue;
                const double turn = std::atan2(at[2], at[1]) / (2 * pi) + 0.5;
                double& r = farthest[std::min(size_t(turn * double(bins)), bins - 1)];
                r = std::max(r, std::hypot(at[1], at[2]));
            }
            for (const double r : farthest) CHECK(std::fabs(r - rim) < 0.2 * cell);
            for (const uint32_t workers : {2u, 8u}) CHECK(mesh(real.field, {cell, 200000, workers}).position == m.position);
        }
}
