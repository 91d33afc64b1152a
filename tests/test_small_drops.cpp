// SPDX-License-Identifier: MIT
// Drops and bubbles without a single point: by cells or by meshes of their own, at their size and closed.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "mesh_harness.h"

using namespace mesh_test;

TEST_CASE("drops: ellipsoids without a single point") {
    Cloud cloud;
    cloud.add_drop({0.31, 0.02, 0.53}, {0.2, 0.3, 0.1});
    cloud.add_drop({3.31, 0.02, 0.53}, {0.1, 0.1, 0.1});
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = 0.02f});
    const Topology t = topology(m);
    CHECK(t.closed_manifold());
    CHECK(t.euler == 4);
    CHECK(volume(m) == doctest::Approx(4 * pi / 3 * (0.006 + 0.001)).epsilon(0.02));
}

TEST_CASE("drops and bubbles smaller than a cell: shown wherever they are, at their size") {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(-0.3, 0.3);
    for (int i = 0; i < 200; ++i) {
        CAPTURE(i);
        const Vec at = {any(random), any(random), any(random)};
        Cloud cloud = sphere_cloud(600);
        cloud.add_drop(at, {-0.02, -0.02, -0.025});
        cloud.add_drop(at + Vec{2, 0, 0}, {0.03, 0.02, 0.02});
        const RealField real(cloud);
        const Mesh m = mesh(real.field, {.cell = 0.06f});
        const Topology t = topology(m);
        CHECK(t.closed_manifold());
        CHECK(t.euler == 6);
        // Each is there, within a cell of its place, and no larger than it is.
        for (const Vec& centre : {at, at + Vec{2, 0, 0}}) {
            double farthest = 0;
            int near = 0;
            for (uint32_t v = 0; v < m.vertex_count(); ++v) {
                const double d = length(m.at(v) - centre);
                if (d < 0.2) ++near, farthest = std::max(farthest, d);
            }
            CHECK(near >= 8);
            CHECK(farthest < 0.06 + 0.03);
        }
    }
}

/// Volume and its centre, of the pieces within `reach` of a place.
struct Piece {
    double volume = 0;
    Vec middle{0, 0, 0};
    size_t triangles = 0;
};
Piece piece_at(const Mesh& m, const Vec& place, double reach) {
    Piece piece;
    for (size_t i = 0; i < m.indices.size(); i += 3) {
        const Vec a = m.at(m.indices[i]) - place, b = m.at(m.indices[i + 1]) - place, c = m.at(m.indices[i + 2]) - place;
        if (length(a) > reach) continue;
        const double six = dot(a, cross(b, c));
        piece.volume += six / 6, piece.middle = piece.middle + (six / 24) * (a + b + c), ++piece.triangles;
    }
    piece.middle = place + (1 / piece.volume) * piece.middle;
    return piece;
}

TEST_CASE("small drops and bubbles that touch nothing: where they are and as large, whatever the lattice") {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-0.3, 0.3);
    for (int i = 0; i < 100; ++i) {
        CAPTURE(i);
        const double radius = 0.01 + 0.0013 * i;  // .17 to 2.3 cells
        const Vec at = {any(random), any(random), any(random)}, away = at + Vec{2, 0, 0};
        Cloud cloud = sphere_cloud(600);
        cloud.add_drop(at, {-radius, -0.8 * radius, -0.9 * radius});
        cloud.add_drop(away, {radius, 0.8 * radius, 0.9 * radius});
        cloud.shape[3][1] = float(0.1 * radius), cloud.drop_v[2][1] = 3;
        const RealField real(cloud);
        const Mesh m = mesh(real.field, {.cell = 0.06f});
        const Topology t = topology(m);
        CHECK(t.closed_manifold());
        CHECK(t.euler == 6);
        check_ranges(m);
        const Piece bubble = piece_at(m, at, 0.25), drop = piece_at(m, away, 0.25);
        CHECK(bubble.volume == doctest::Approx(-4 * pi / 3 * 0.72 * radius * radius * radius).epsilon(1e-3));
        CHECK(drop.volume == doctest::Approx(4 * pi / 3 * (0.8 - 0.01) * 0.9 * radius * radius * radius).epsilon(1e-3));
        CHECK(length(bubble.middle - at) < 1e-3 * radius);
        CHECK(length(drop.middle - away) < 1e-3 * radius);
        CHECK(drop.triangles == (i < 28 ? 20u : i < 74 ? 80u : 320u));
        for (uint32_t v = 0; v < m.vertex_count(); ++v) {
            if (length(m.at(v) - away) > 0.25) continue;
            CHECK(m.velocity[3 * v + 2] == doctest::Approx(3));
            CHECK(length(m.normal_at(v)) == doctest::Approx(1).epsilon(1e-5));
            CHECK(dot(m.normal_at(v), m.at(v) - away) > 0.5 * length(m.at(v) - away));
        }
    }
}

TEST_CASE("small drops that touch something are the cells': joined to other liquid, cut by walls, and the field's again afterwards") {
    Cloud cloud = sphere_cloud(600);
    cloud.add_drop({0, 0, 1.03}, {0.05, 0.05, 0.05});
    cloud.add_drop({0, 0, -1.2}, {0.05, 0.05, 0.05});
    cloud.add_drop({0, 0.05, -1.2}, {0.05, 0.05, 0.05});  // of two that overlap neither is alone
    cloud.add_drop({1.38, 0, 0}, {0.05, 0.05, 0.05});
    cloud.add_drop({1.395, 0.51, 0.03}, {0.015, 0.015, 0.015});  // holds no corner
    surface::Container container = surface::everywhere;
    container.upper[0] = 1.4f;
    const RealField real(cloud, container);
    const auto drops = [&] {
        std::vector<float> all;
        for (const float* row : {real.field.dx, real.field.dy, real.field.dz, real.field.radius, real.field.reach, real.field.inverse[0], real.field.inverse[5]})
            all.insert(all.end(), row, row + real.field.drop_count);
        return all;
    };
    const std::vector<float> before = drops();
    const Mesh m = mesh(real.field, {.cell = 0.06f});
    CHECK(topology(m).closed_manifold());
    CHECK(topology(m).euler == 8);  // the ball with the first, the two that overlap, the two at the wall
    for (uint32_t v = 0; v < m.vertex_count(); ++v) CHECK(m.at(v)[0] < 1.4 + 1e-6);
    CHECK(drops() == before);
    CHECK(hash(mesh(real.field, {.cell = 0.06f})) == hash(m));
}

TEST_CASE("a frame that is late has the mesh of the larger cells that it gives way to, drops too small for these included") {
    Cloud cloud = sphere_cloud(500);
    for (int i = 0; i < 20; ++i) cloud.add_drop({0.3 * i - 3, 2, 0.013 * i}, {0.07, 0.08, 0.06 + 0.003 * i});  // some three cells, then one and a half
    const RealField real(cloud);
    const Mesh larger = mesh(real.field, {.cell = 0.1f});
    for (const int rounds : {1, 2, 3}) {
        const Mesh late = mesh(real.field, {.cell = 0.05f, .rounds_until_late = rounds});
        CHECK(late.counts.cut == cut_time);
        CHECK(late.position == larger.position);
        CHECK(late.indices == larger.indices);
    }
    CHECK(mesh(real.field, {.cell = 0.05f}).position != larger.position);
}

TEST_CASE("small drops out of sight are not drawn, and what is far and tiny neither") {
    Cloud cloud;
    for (int i = 0; i < 100; ++i) cloud.add_drop({0.5 * i, 0, 0}, {0.03, 0.03, 0.03});
    const RealField real(cloud);
    const FrustumPlanes half{{{1, 0, 0, -20}, {-1, 0, 0, 90}, {0, 1, 0, 9}, {0, -1, 0, 9}, {0, 0, 1, 9}, {0, 0, -1, 9}}};
    const Mesh m = mesh(real.field, {.cell = 0.06f, .views = {half}});
    CHECK(topology(m).euler == 2 * 60);  // from x = 20 on
    CHECK(m.ranges.size() == 1);
    CHECK(mesh(real.field, {.cell = 0.31f}).indices.empty());
    CHECK(topology(mesh(real.field, {.cell = 0.29f})).euler == 200);
}

TEST_CASE("drops of a corner or two that touch each other are drawn") {
    for (const double radius : {0.02, 0.03, 0.05}) {
        CAPTURE(radius);
        Cloud cloud;
        for (int i = 0; i < 20; ++i)
            for (const double side : {-0.8, 0.8}) cloud.add_drop({0.31 * i, 0.07 * i, side * radius}, {radius, radius, radius});
        const RealField real(cloud);
        const Mesh m = mesh(real.field, {.cell = 0.06f});
        CHECK(topology(m).closed_manifold());
        CHECK(topology(m).euler == 2 * 20);
    }
}
