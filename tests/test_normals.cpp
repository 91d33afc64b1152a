// SPDX-License-Identifier: MIT
// Vertex normals: how far they lean from the gradient towards the triangles, and that they do so without a jump. The
// surfaces here are balls whose gradients all lie: tilted by the same angle from what the triangles say.
#include <doctest/doctest.h>

#include "mesh_harness.h"

using namespace mesh_test;

namespace {

constexpr double tilt = 20 * pi / 180;

void ball(const surface::Field&, const uint32_t*, uint32_t, const float* x, const float* y, const float* z, uint32_t n, float* value) noexcept {
    for (uint32_t i = 0; i < n; ++i) value[i] = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]) - 1;
}
/// Turned away from the radius, towards z.
void tilted(const surface::Field& field, const uint32_t* list, uint32_t count, const float* x, const float* y, const float* z, uint32_t n, float* value,
            float* gx, float* gy, float* gz, float*, float) noexcept {
    ball(field, list, count, x, y, z, n, value);
    for (uint32_t i = 0; i < n; ++i) {
        const double r = value[i] + 1, across = std::hypot(x[i], y[i]), angle = std::atan2(z[i], across) + tilt;
        gx[i] = float(std::cos(angle) * x[i] / (across + 1e-9)), gy[i] = float(std::cos(angle) * y[i] / (across + 1e-9));
        gz[i] = float(std::sin(angle)), value[i] = float(r - 1);
    }
}
const FieldAccess lying{gather_points, ball, tilted};

/// An empty field: `lying` answers instead. One point, for the mesher to begin at.
struct Start {
    Cloud cloud;
    RealField real;
    Start() : real((cloud.add({1, 0, 0}, {1, 0, 0}), cloud)) {}
};

/// Radians that a normal is off the radius. Not near the poles, where tilts of neighbours differ.
bool angle_at(const Mesh& m, uint32_t v, double& angle) {
    const Vec radius = (1 / length(m.at(v))) * m.at(v), n = m.normal_at(v);
    CHECK(length(n) == doctest::Approx(1).epsilon(1e-5));
    angle = std::acos(std::min(1.0, dot(radius, n)));
    return std::fabs(radius[2]) < 0.8;
}

/// With so much of the triangles' normal.
double expected_angle(double share) { return std::atan2((1 - share) * std::sin(tilt), (1 - share) * std::cos(tilt) + share); }

}  // namespace

TEST_CASE("normals are .6 the gradient's, .4 the triangles'") {
    const Start start;
    const Mesh m = mesh(start.real.field, {.cell = 0.06f, .access = &lying});
    CHECK(topology(m).closed_manifold());
    double sum = 0, most = 0;
    size_t n = 0;
    for (uint32_t v = 0; v < m.vertex_count(); ++v) {
        double angle;
        if (!angle_at(m, v, angle)) continue;
        sum += angle, ++n, most = std::max(most, std::fabs(angle - expected_angle(0.4)));
    }
    REQUIRE(n > 2000);
    CHECK(std::fabs(sum / double(n) - expected_angle(0.4)) < 0.002);
    CHECK(most < 0.03);
    for (const uint32_t workers : {2u, 8u}) CHECK(mesh(start.real.field, {.cell = 0.06f, .workers = workers, .access = &lying}).normal == m.normal);
}

TEST_CASE("towards larger cells the gradient's share grows to all of it") {
    const Start start;
    constexpr float cell = 0.012f, reach = 60;
    for (const float far : {1.2f, 1.5f, 1.9f}) {
        CAPTURE(far);
        Levels levels{};
        levels.cell_size = cell, levels.eye_count = 1, levels.eyes[0][0] = far, levels.reach[0] = reach;
        const Mesh m = mesh(start.real.field, {.cell = cell, .eyes = {{far, 0, 0, reach}}, .access = &lying});
        CHECK(topology(m).closed_manifold());
        double leant = 0, most = 0, sum = 0;
        size_t n = 0;
        for (uint32_t v = 0; v < m.vertex_count(); ++v) {
            double angle;
            if (!angle_at(m, v, angle)) continue;
            const float at[3] = {m.position[3 * v], m.position[3 * v + 1], m.position[3 * v + 2]};
            const double here = 1 - levels.morph(0, at), off = angle - expected_angle(0.4 * here);
            leant += here, sum += std::fabs(off), ++n, most = std::max(most, std::fabs(off));
        }
        REQUIRE(n > 1000);
        CHECK(leant / double(n) > 0.05);  // near the eye some are leant, others are not
        CHECK(leant / double(n) < 0.95);
        CHECK(sum / double(n) < 0.01);
        CHECK(most < 0.1);
    }
}

TEST_CASE("a mesh cut off in the middle has normals at its border") {
    const Start start;
    for (const uint32_t most : {300u, 1000u, 2000u}) {
        const Mesh m = mesh(start.real.field, {.cell = 0.06f, .vertex_capacity = most, .access = &lying});
        CHECK((m.counts.cut & cut_vertices) != 0);
        REQUIRE(m.vertex_count() > most / 2);
        for (uint32_t v = 0; v < m.vertex_count(); ++v) {
            double angle;
            if (angle_at(m, v, angle)) CHECK(angle < tilt + 0.06);
        }
    }
}
