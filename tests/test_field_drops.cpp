// SPDX-License-Identifier: MIT
// Drops and bubbles in the field, and points that come and go.
#include "field_harness.h"

using namespace field_test;

TEST_CASE("drop: an ellipsoid, turned and moving") {
    Cloud cloud;
    cloud.add_drop({1, 2, 3}, {0.3, 0.2, 0.1});
    // Turned by 30° about z: S = R diag R^T.
    const double c = std::cos(pi / 6), s = std::sin(pi / 6);
    cloud.shape[0][0] = float(0.3 * c * c + 0.2 * s * s), cloud.shape[1][0] = float(0.3 * s * s + 0.2 * c * c);
    cloud.shape[3][0] = float(0.1 * c * s), cloud.drop_v[1][0] = 5;
    const RealField real(cloud);
    REQUIRE(real.field.drop_count == 1);
    Random random(6);
    for (int i = 0; i < 200; ++i) {
        const Vec u = random.direction();
        const Vec e = {0.3 * u[0], 0.2 * u[1], 0.1 * u[2]}, r = {c * e[0] - s * e[1], s * e[0] + c * e[1], e[2]};
        const Value on = evaluate(real.field, Vec{1, 2, 3} + r);
        CHECK(std::fabs(on.value) < 1e-6);
        CHECK(on.velocity[1] == 5);
        const Vec n = {u[0] / 0.3, u[1] / 0.2, u[2] / 0.1}, normal = {c * n[0] - s * n[1], s * n[0] + c * n[1], n[2]};
        CHECK(dot({on.gradient[0], on.gradient[1], on.gradient[2]}, normal) / (on.steepness() * length(normal)) > 0.9999);
        CHECK(evaluate(real.field, Vec{1, 2, 3} + 0.8 * r).value < 0);
        CHECK(evaluate(real.field, Vec{1, 2, 3} + 1.2 * r).value > 0);
    }
    // Half gone: half the volume, and nothing at the end.
    cloud.drop_activity[0] = 0.5f;
    const RealField fading(cloud);
    CHECK(std::fabs(evaluate(fading.field, Vec{1, 2, 3 + 0.1 * std::cbrt(0.5)}).value) < 1e-6);
}

TEST_CASE("bubble: takes liquid away, and a drop may fly in it") {
    Cloud cloud;
    add(cloud, sphere_of(1), 0.15);
    cloud.add_drop({0.1, 0, 0}, {-0.3, -0.2, -0.25});
    cloud.add_drop({0.1, 0, 0}, {0.05, 0.05, 0.05});
    cloud.add_drop({5, 0, 0}, {-0.3, -0.3, -0.3});  // of nothing
    const RealField real(cloud);
    REQUIRE(real.field.drop_count == 3);
    const Value on = evaluate(real.field, Vec{0.4, 0, 0}), inside = evaluate(real.field, Vec{0.25, 0, 0});
    CHECK(std::fabs(on.value) < 1e-6);
    CHECK(on.gradient[0] < -0.8);  // outward is into the bubble
    CHECK(inside.value > 0);
    CHECK(evaluate(real.field, Vec{0.5, 0, 0}).value < 0);
    CHECK(evaluate(real.field, Vec{0.1, 0.02, 0}).value < 0);  // the drop
    CHECK(evaluate(real.field, Vec{5, 0, 0}).value > 0);
    CHECK(std::fabs(evaluate(real.field, Vec{0, 1, 0}).value) < 0.01);
}

TEST_CASE("gather: of many drops those that reach into the box, none else, wherever they are moved") {
    Random random(9);
    Cloud cloud;
    for (int i = 0; i < 500; ++i) {
        const double r = 0.01 + 0.05 * random() * random();
        cloud.add_drop({random(), random(), random()}, {r, 0.5 * r, r});
    }
    const RealField real(cloud);
    const surface::Field& f = real.field;
    REQUIRE(f.drop_count == 500);
    const auto check = [&] {
        size_t most = 0;
        for (int k = 0; k < 100; ++k) {
            surface::Box box;
            for (int a = 0; a < 3; ++a) box.lower[a] = float(random()), box.upper[a] = box.lower[a] + float(0.2 * random());
            std::vector<uint32_t> expected, found(f.drop_count);
            for (uint32_t d = 0; d < f.drop_count; ++d) {
                const float at[3] = {f.dx[d], f.dy[d], f.dz[d]};
                double d2 = 0;
                for (int a = 0; a < 3; ++a) d2 += std::pow(std::max({box.lower[a] - at[a], at[a] - box.upper[a], 0.f}), 2);
                if (d2 < double(f.reach[d]) * f.reach[d]) expected.push_back(f.point_count + d);
            }
            found.resize(surface::gather(f, box, found.data(), f.drop_count));
            CHECK(found == expected);
            most = std::max(most, found.size());
        }
        CHECK(most > 10);
        CHECK(most < 100);
    };
    check();
    for (uint32_t d = 0; d < f.drop_count; ++d) {
        const uint32_t i = f.drop_source[d];
        CHECK(f.dx[d] == cloud.drop[0][i]);
        CHECK(f.inverse[0][d] == doctest::Approx(1 / cloud.shape[0][i]));
        f.dx[d] += d % 7 ? 0.f : 0.3f, f.reach[d] *= d % 5 ? 1.f : d % 3 ? 2.f : 0.f;
    }
    surface::bound_drops(f);
    check();
}

TEST_CASE("fading: the surface moves smoothly while a point comes and goes") {
    const double h = 0.15;
    Cloud cloud;
    add(cloud, sphere_of(1), h);
    const Vec at = {cloud.p[0][10], cloud.p[1][10], cloud.p[2][10]};
    for (int a = 0; a < 3; ++a) cloud.p[a][10] *= 1.02f;  // not where its neighbours would put the surface
    Random random(8);
    std::vector<Vec> positions;
    for (int i = 0; i < 100; ++i) {
        const Vec p = at + 1.5 * h * random() * random.direction();
        positions.push_back((1 / length(p)) * p);
    }
    std::vector<Value> before;
    double largest_step = 0, last_step = 0;
    for (int step = 0; step <= 40; ++step) {
        cloud.activity[10] = 1 - float(step) / 40;  // 0 at the end: no longer there
        const RealField real(cloud);
        const auto now = evaluate(real.field, positions);
        last_step = 0;
        for (size_t i = 0; i < before.size(); ++i) last_step = std::max(last_step, std::fabs(double(now[i].value) - before[i].value));
        largest_step = std::max(largest_step, last_step);
        before = now;
    }
    INFO("largest step ", largest_step / h, ", last ", last_step / h, " spacings");
    CHECK(largest_step < 0.03 * h);
}

TEST_CASE("fading: points that are all but gone leave the surface as it is without them") {
    const double h = 0.15;
    Cloud cloud;
    add(cloud, sphere_of(1), h);
    Random random(5);
    const size_t whole = cloud.activity.size();
    for (size_t i = 0; i < whole / 2; ++i) {  // among the others, and not where these put the surface
        const Vec d = random.direction();
        cloud.add((1 + 0.04 * (random() - 0.5)) * d, d);
    }
    std::vector<Vec> positions;
    for (int i = 0; i < 500; ++i) positions.push_back(random.direction());
    std::vector<Value> values[2];
    for (const int gone : {0, 1}) {
        std::fill(cloud.activity.begin() + long(whole), cloud.activity.end(), gone ? 0.f : 1e-3f);
        values[gone] = evaluate(RealField(cloud).field, positions);
    }
    double worst = 0;
    for (size_t i = 0; i < positions.size(); ++i) worst = std::max(worst, std::fabs(double(values[0][i].value) - values[1][i].value));
    INFO("worst ", worst / h, " spacings");
    CHECK(worst < 3e-4 * h);  // .0012 where they keep their places among neighbours
}

TEST_CASE("fading: what a point alone covers goes little by little") {
    Cloud cloud;
    add(cloud, sphere_of(1), 0.15);
    const Vec apart = {0, 0, 2.2};
    cloud.add(apart, {0, 0, 1});
    double reach = infinity, whole = 0;
    for (const double activity : {1.0, 0.3, 0.1, 0.01, 0.001}) {
        cloud.activity.back() = float(activity);
        const RealField real(cloud);
        double support = 0;
        for (uint32_t i = 0; i < real.field.point_count; ++i)
            if (real.field.source[i] == cloud.activity.size() - 1) support = real.field.support[i];
        CHECK(support > 0);
        CHECK(support < 0.8 * reach);
        reach = support;
        if (activity == 1) whole = support;
    }
    CHECK(reach < 0.05 * whole);
}
