// SPDX-License-Identifier: MIT
// What `rill verify` says of velocity, thin liquid, coarse cells and the time between frames, on surfaces known by formula.
#include <doctest/doctest.h>

#include <cmath>

#include "harness.h"
#include "measure/thin_liquid.h"
#include "measure/velocity_error.h"
#include "sequence_files.h"
#include "shapes.h"
#include "verify/motion.h"
#include "verify/verify.h"

using namespace rill::cooker;

namespace {

Mesh moving(Mesh mesh, const glm::vec3& velocity) {
    mesh.velocities.assign(mesh.positions.size(), velocity);
    return mesh;
}

/// A closed slab of the given thickness, side 1, both faces n × n.
Mesh slab(uint32_t n, float thick) {
    Mesh mesh = plane(n, 1), under = plane(n, 1);
    for (glm::vec3& x : under.positions) x.z = -thick;
    for (Triangle& t : under.triangles) std::swap(t[1], t[2]);
    append(mesh, under);
    const uint32_t below = (n + 1) * (n + 1);
    const auto wall = [&](uint32_t a, uint32_t b) {  // a → b with the slab on the left, seen from above
        mesh.triangles.push_back({a, a + below, b});
        mesh.triangles.push_back({b, a + below, b + below});
    };
    for (uint32_t i = 0; i < n; ++i) {
        wall(i, i + 1), wall(n + i * (n + 1), n + (i + 1) * (n + 1));
        wall((n + 1) * n + i + 1, (n + 1) * n + i), wall((i + 1) * (n + 1), i * (n + 1));
    }
    return mesh;
}
bool inner(const glm::vec3& x) { return std::min(x.x, x.y) > 0.25f && std::max(x.x, x.y) < 0.75f; }

Displacement between(const Mesh& a, const Mesh& b, float cell, Spread& spread, std::vector<LonePiece>* lone) {
    return displacement(a, SurfaceIndex(a), b, SurfaceIndex(b), cell, spread, lone);
}

/// A swaying ball; in windows before `lost` there is a drop beside it too.
std::string swaying(const TestFolder& folder, uint32_t lost) {
    harness::Clip clip;
    clip.frames = 13, clip.window = 4, clip.points = 300, clip.layers = 2, clip.cell = 0.12f;
    const std::string path = folder / "ball.rill";
    AssetWriter writer(path);
    for (uint32_t first = 0; first + 1 < clip.frames; first += clip.window) {
        clip.drop = first < lost;
        writer.add_window(first, clip.window + 1, 2, harness::ball_chunks(clip, first, clip.window + 1));
    }
    clip.drop = true;
    writer.finish(harness::ball_facts(clip));
    return path;
}

}  // namespace

TEST_CASE("velocity: direction and length are told apart") {
    const Mesh source = moving(bumpy_sphere(32, 1), {2, 0, 0});
    const float angle = glm::radians(10.0f);
    const Mesh turned = moving(bumpy_sphere(48, 1), {2 * std::cos(angle), 2 * std::sin(angle), 0}), fast = moving(sphere(32, 1), {2.5f, 0, 0});
    const VelocityError same = velocity_error(source, 1, source, SurfaceIndex(source));
    CHECK(same.degrees.weight > 12);
    CHECK(same.degrees.max < 1e-3);
    CHECK(same.length.max < 1e-5);
    const VelocityError direction = velocity_error(source, 1, turned, SurfaceIndex(turned));
    CHECK(direction.degrees.mean() == doctest::Approx(10).epsilon(1e-3));
    CHECK(direction.degrees.p99() == doctest::Approx(10).epsilon(0.05));
    CHECK(direction.length.max < 1e-5);
    const VelocityError length = velocity_error(source, 1, fast, SurfaceIndex(fast));
    CHECK(length.degrees.max < 1e-3);
    CHECK(length.length.mean() == doctest::Approx(0.25).epsilon(1e-3));
    // A source in other units.
    CHECK(velocity_error(source, 1.25, fast, SurfaceIndex(fast)).length.max < 1e-5);
    CHECK(velocity_error(sphere(8, 1), 1, fast, SurfaceIndex(fast)).degrees.weight == 0);
}

TEST_CASE("velocity: what stands has no direction") {
    Mesh source = moving(sphere(32, 1), {1, 0, 0}), other = source;
    for (size_t v = 0; v < source.positions.size(); ++v)
        if (source.positions[v].z < 0) source.velocities[v] = {0, 0.01f, 0}, other.velocities[v] = {0, 0, -0.01f};
    const VelocityError error = velocity_error(source, 1, other, SurfaceIndex(other));
    CHECK(error.degrees.max < 1e-3);
    CHECK(error.degrees.weight == doctest::Approx(6.28).epsilon(0.1));
}

TEST_CASE("thickness of a slab, of a ball, of a ball in a ball") {
    const Mesh flat = slab(40, 0.07f);
    REQUIRE(topology(flat).open_edges == 0);
    REQUIRE(signed_volume(flat) == doctest::Approx(0.07));
    const std::vector<float> thin = thickness(flat, SurfaceIndex(flat), 0.3f);
    for (size_t v = 0; v < thin.size(); ++v)
        if (inner(flat.positions[v])) REQUIRE(thin[v] == doctest::Approx(0.07).epsilon(0.01));
    for (float t : thickness(flat, SurfaceIndex(flat), 0.05f)) CHECK(t <= 0.05f);

    const Mesh ball = sphere(48, 0.5f);
    for (float t : thickness(ball, SurfaceIndex(ball), 3)) REQUIRE(t == doctest::Approx(1).epsilon(0.02));
    for (float t : thickness(ball, SurfaceIndex(ball), 0.4f)) REQUIRE(t == 0.4f);

    Mesh shell = ball, hole = sphere(48, 0.4f);
    for (Triangle& t : hole.triangles) std::swap(t[1], t[2]);
    append(shell, hole);
    for (float t : thickness(shell, SurfaceIndex(shell), 1)) REQUIRE(t == doctest::Approx(0.1).epsilon(0.05));
}

TEST_CASE("error where the liquid is thin: by spacings, and only there") {
    Mesh source = slab(40, 0.07f);
    append(source, slab(40, 0.6f));
    for (size_t v = source.positions.size() / 2; v < source.positions.size(); ++v) source.positions[v].x += 3;
    std::vector<float> distances(source.positions.size(), 0.001f);
    for (size_t v = 0; v < distances.size() / 2; ++v) distances[v] = 0.02f;
    const ThinError error = thin_error(source, SurfaceIndex(source), distances, 0.05f);
    CHECK(error.below[0].max < 0.021);  // rims alone: nothing of the faces
    CHECK(error.area_share(0) < 0.05);
    CHECK(error.area_share(1) > 0.25);  // 2 of the 6.4 m² belong to the thin one
    CHECK(error.area_share(1) < 0.4);
    CHECK(error.below[1].p99() == doctest::Approx(0.02).epsilon(0.05));
    CHECK(error.below[2].weight >= error.below[1].weight);
}

TEST_CASE("components are counted apart when they are large") {
    Mesh mesh = sphere(16, 1);
    append(mesh, sphere(8, 0.1f, {3, 0, 0}));
    CHECK(topology(mesh, 0.1).components == 2);
    CHECK(topology(mesh, 0.1).large_components == 1);  // .0042 m³, less than eight cells of .001
    CHECK(topology(mesh, 0.07).large_components == 2);
}

TEST_CASE("displacement: a step is a step, and a piece that comes at once is known") {
    Spread spread;
    std::vector<LonePiece> lone;
    const Mesh ball = sphere(64, 1);
    const Displacement step = between(ball, sphere(64, 1, {0.05f, 0, 0}), 0.1f, spread, &lone);
    CHECK(step.max == doctest::Approx(0.05).epsilon(0.03));
    CHECK(step.mean == doctest::Approx(0.025).epsilon(0.05));  // |cos| over a sphere
    CHECK(lone.empty());
    Mesh more = ball;
    append(more, sphere(32, 0.2f, {3, 0, 0}));
    for (const bool comes : {true, false}) {
        lone.clear();
        const Displacement jump = comes ? between(ball, more, 0.1f, spread, &lone) : between(more, ball, 0.1f, spread, &lone);
        CHECK(jump.max == doctest::Approx(2.2).epsilon(0.01));
        REQUIRE(lone.size() == 1);
        CHECK(lone[0].away == doctest::Approx(1.8).epsilon(0.01));
        CHECK(lone[0].volume == doctest::Approx(0.0335).epsilon(0.1));
    }
    lone.clear();
    CHECK(std::isinf(between(ball, Mesh{}, 0.1f, spread, &lone).max));
    CHECK(std::isfinite(spread.mean()));
}

TEST_CASE("motion: even from substep to substep, also across window borders; a drop that is lost is a jump") {
    const TestFolder folder;
    const Motion smooth = measure_motion(swaying(folder, 99), 5, 17, 4, 2);
    REQUIRE(smooth.intervals.size() == 12);
    CHECK(smooth.jumps() == 0);
    CHECK(smooth.jump_share() == 0);
    CHECK(smooth.lone().empty());
    REQUIRE(smooth.borders.size() == 2);
    for (const BorderJump& border : smooth.borders) CHECK(border.jump.max < 5e-3);
    for (const IntervalMotion& interval : smooth.intervals) {
        REQUIRE(interval.substeps.size() == 4);
        double sum = 0;
        for (const Displacement& d : interval.substeps) sum += d.mean;
        // The ball goes 1.2 cos(3t) m/s: where it turns round, substeps add up to more than the step from frame to frame.
        const double speed = std::abs(harness::Clip::velocity((interval.from - 5 + 0.5) / 24.0).x);
        if (speed > 0.3) {
            CHECK(interval.frame.max == doctest::Approx(speed / 24).epsilon(0.06));
            CHECK(sum == doctest::Approx(interval.frame.mean).epsilon(0.05));
            for (const Displacement& d : interval.substeps) CHECK(d.mean == doctest::Approx(sum / 4).epsilon(0.25));
        }
    }
    const Motion lost = measure_motion(swaying(folder, 8), 5, 17, 2, 1);
    REQUIRE(lost.borders.size() == 2);
    CHECK(lost.borders[0].jump.max < 5e-3);
    CHECK(lost.borders[1].frame == 13);
    CHECK(lost.borders[1].jump.max > 1.5);
    CHECK(lost.jumps() == 1);
    CHECK(lost.lone().size() == 1);
    CHECK(lost.jump_share() > 0);
}

TEST_CASE("motion: the same figures on one core and on three") {
    const TestFolder folder;
    const std::string path = swaying(folder, 8);
    const Motion one = measure_motion(path, 5, 17, 2, 1), three = measure_motion(path, 5, 17, 2, 3);
    CHECK(one.frame.mean() == three.frame.mean());
    CHECK(one.substep.sum == three.substep.sum);
    CHECK(one.substep.p99() == three.substep.p99());
}
