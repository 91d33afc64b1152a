// SPDX-License-Identifier: MIT
// The error metric against closed forms and brute force.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "cook/error_target.h"
#include "measure/overlap.h"
#include "measure/surface_distance.h"
#include "shapes.h"

using namespace rill::cooker;
constexpr float infinity = std::numeric_limits<float>::infinity();

namespace {

SurfaceDistance between(const Mesh& a, const Mesh& b) { return surface_distance(a, SurfaceIndex(a), b, SurfaceIndex(b), true); }

/// Distance to a segment, in double: with the plane test below an independent reference for a triangle.
double to_segment(const glm::dvec3& x, const glm::dvec3& a, const glm::dvec3& b) {
    const double length2 = glm::dot(b - a, b - a);
    const double t = length2 > 0 ? std::clamp(glm::dot(x - a, b - a) / length2, 0.0, 1.0) : 0.0;
    return glm::length(x - (a + (b - a) * t));
}
double to_triangle(const glm::dvec3& x, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    double best = std::min({to_segment(x, a, b), to_segment(x, b, c), to_segment(x, c, a)});
    const glm::dvec3 n = glm::cross(b - a, c - a);
    if (glm::length(n) == 0) return best;
    const bool inside = glm::dot(glm::cross(b - a, x - a), n) >= 0 && glm::dot(glm::cross(c - b, x - b), n) >= 0 &&
                        glm::dot(glm::cross(a - c, x - c), n) >= 0;
    return inside ? std::min(best, std::abs(glm::dot(x - a, n)) / glm::length(n)) : best;
}

}  // namespace

TEST_CASE("closest point equals brute force, also on slivers and degenerate triangles") {
    std::mt19937 random(7);
    auto number = [&] { return float(random() % 2001) / 1000.0f - 1.0f; };
    Mesh mesh;
    for (int i = 0; i < 303; ++i) {  // not by fours: the last leaf is not full
        const glm::vec3 a(number(), number(), number());
        const float size = i % 3 == 0 ? 0.5f : 0.05f;
        mesh.positions.push_back(a);
        mesh.positions.push_back(a + size * glm::vec3(number(), number(), number()));
        // Every fifth has no area: two corners alike, or all on a line.
        mesh.positions.push_back(i % 10 == 0 ? a : i % 5 == 0 ? 2.0f * mesh.positions.back() - a
                                                              : a + size * glm::vec3(number(), number(), number()));
        mesh.triangles.push_back({uint32_t(3 * i), uint32_t(3 * i + 1), uint32_t(3 * i + 2)});
    }
    const SurfaceIndex index(mesh);
    SurfaceIndex::Near near, near_within;
    for (int i = 0; i < 2000; ++i) {
        const glm::vec3 x = 1.5f * glm::vec3(number(), number(), number());
        double expected = infinity;
        for (const Triangle& t : mesh.triangles)
            expected = std::min(expected, to_triangle(x, mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]));
        const SurfaceIndex::Hit hit = index.closest(x, infinity);
        REQUIRE(hit.distance == doctest::Approx(expected).epsilon(1e-4));
        const Triangle& t = mesh.triangles[hit.triangle];
        const glm::vec3 at = mesh.positions[t[0]] * hit.barycentric.x + mesh.positions[t[1]] * hit.barycentric.y +
                             mesh.positions[t[2]] * hit.barycentric.z;
        REQUIRE(glm::distance(at, hit.point) < 1e-5f);
        REQUIRE(glm::distance(x, hit.point) == doctest::Approx(hit.distance).epsilon(1e-4));
        CHECK(index.closest(x, hit.distance * 0.99f).distance == infinity);
        CHECK(index.closest(x, hit.distance * 1.01f).distance == hit.distance);
        CHECK(!index.within(x, hit.distance * 0.99f));
        CHECK(index.within(x, hit.distance * 1.01f));
        // Wherever the query before it has ended:
        REQUIRE(index.closest(x, infinity, &near).distance == hit.distance);
        REQUIRE(near.leaf != SurfaceIndex::Near{}.leaf);
        CHECK(index.closest(x, hit.distance * 0.99f, &near).distance == infinity);
        CHECK(!index.within(x, hit.distance * 0.99f, &near_within));
        CHECK(index.within(x, hit.distance * 1.01f, &near_within));
    }
}

TEST_CASE("an index built by many threads answers as one built by one" * doctest::test_suite("threads")) {
    const Mesh mesh = sphere(120, 1, {0.3f, 0, 0});  // with corners that many triangles share: equals must be told apart alike
    REQUIRE(mesh.triangles.size() > 10000);
    const SurfaceIndex alone(mesh);
    for (int jobs = 2; jobs <= 8; jobs *= 4) {
        const SurfaceIndex index(mesh, jobs);
        for (size_t i = 0; i < mesh.positions.size(); i += 3) {
            const glm::vec3 x = 1.1f * mesh.positions[i];
            const SurfaceIndex::Hit a = alone.closest(x, infinity), b = index.closest(x, infinity);
            REQUIRE(a.triangle == b.triangle);
            REQUIRE(a.point == b.point);
            REQUIRE(a.barycentric == b.barycentric);
        }
    }
}

TEST_CASE("an index of a mesh that has moved answers as one built for it") {
    const Mesh before = bumpy_sphere(60, 1);
    Mesh moved = before;
    for (glm::vec3& x : moved.positions) x = glm::vec3(0.4f * x.x + 3, x.y + 0.3f * std::sin(4 * x.z), 2 * x.z);
    const SurfaceIndex old(before), anew(moved);
    for (const int jobs : {1, 3}) {
        const SurfaceIndex index(moved, old, jobs);
        CHECK(&index.mesh() == &moved);
        for (size_t i = 0; i < moved.positions.size(); i += 5) {
            const glm::vec3 x = 1.2f * moved.positions[i] - before.positions[i];
            REQUIRE(index.closest(x, infinity).distance == doctest::Approx(anew.closest(x, infinity).distance).epsilon(1e-5));
        }
    }
    CHECK(old.closest(before.positions[7], infinity).distance == 0);
    const Mesh none;
    CHECK(SurfaceIndex(none, SurfaceIndex(none), 1).closest({0, 0, 0}, infinity).distance == infinity);
}

TEST_CASE("many triangles in one place do not unbalance the tree") {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(5000, {0, 1, 2});
    CHECK(SurfaceIndex(mesh).closest({0.2f, 0.2f, 3}, infinity).distance == doctest::Approx(3));
}

TEST_CASE("a mesh is at distance zero from itself") {
    const Mesh mesh = bumpy_sphere(24, 1.0f);
    const SurfaceDistance d = between(mesh, mesh);
    CHECK(d.max < 1e-6);
    CHECK(d.normal_degrees < 0.05);
}

TEST_CASE("concentric spheres are as far apart as their radii") {
    const Mesh small = sphere(64, 1.0f), large = sphere(64, 1.05f);
    const SurfaceDistance d = between(small, large);
    // Chords of 64 segments sag by r(1 − cos(π/64)) = 0.0012.
    CHECK(d.mean == doctest::Approx(0.05).epsilon(0.03));
    CHECK(d.p99 == doctest::Approx(0.05).epsilon(0.05));
    CHECK(d.max < 0.053);
    CHECK(d.forward.mean == doctest::Approx(d.backward.mean).epsilon(0.05));
    CHECK(d.normal_degrees < 0.5);
    REQUIRE(d.per_source_vertex.size() == small.positions.size());
    CHECK(d.per_source_vertex[5] == doctest::Approx(0.05).epsilon(0.05));
}

TEST_CASE("a spurious sheet shows in one direction, and in the pooled p99") {
    const Mesh source = sphere(48, 1.0f);
    Mesh decoded = source;
    const Mesh extra = sphere(48, 0.3f, {3, 0, 0});
    append(decoded, extra);
    const SurfaceDistance d = between(source, decoded);
    CHECK(d.forward.max < 1e-6);
    CHECK(d.backward.max == doctest::Approx(2.3).epsilon(0.01));  // the far side of the sheet to the sphere
    CHECK(d.p99 > 1.7);  // .09 of the decoded area lies beyond 1.7 m: 4 % of both together
}

TEST_CASE("percentiles weigh by area, not by vertex") {
    Mesh flat = plane(2, 1.0f);
    Mesh source = flat;
    // A finely divided patch of 0.04 % of the area lies 1 m away: many vertices, little surface.
    Mesh patch = plane(40, 0.02f);
    for (glm::vec3& x : patch.positions) x.z = 1;
    append(source, patch);
    const SurfaceDistance d = between(source, flat);
    CHECK(d.max == doctest::Approx(1));
    CHECK(d.p99 < 1e-6);
    CHECK(d.mean == doctest::Approx(0.0004 / 2.0004).epsilon(0.01));
}

TEST_CASE("normals: a tilted plane deviates by its tilt") {
    const Mesh flat = plane(8, 1.0f);
    Mesh tilted = flat;
    const float angle = glm::radians(10.0f);
    for (glm::vec3& x : tilted.positions) x = {x.x * std::cos(angle), x.y, x.x * std::sin(angle)};
    CHECK(between(flat, tilted).normal_degrees == doctest::Approx(10).epsilon(0.001));
}

TEST_CASE("empty meshes") {
    const Mesh none, some = sphere(8, 1);
    CHECK(between(none, none).max == 0);
    CHECK(between(none, some).p99 == infinity);
    CHECK(between(some, none).mean == infinity);
    CHECK(SurfaceIndex(none).closest({0, 0, 0}, infinity).distance == infinity);
    CHECK(!SurfaceIndex(none).within({0, 0, 0}, infinity));
    CHECK(between(some, none).histogram.quantile(0.99) == infinity);
}

TEST_CASE("histograms of frames add up to the percentile of all") {
    const Mesh a = sphere(32, 1), b = sphere(32, 1.01f), c = sphere(32, 1.1f);
    const SurfaceDistance near = between(a, b), far = between(a, c);
    CHECK(near.histogram.quantile(0.99) == doctest::Approx(near.p99).epsilon(0.04));
    DistanceHistogram both = near.histogram;
    both.add(far.histogram);
    CHECK(both.quantile(0.99) == doctest::Approx(far.p99).epsilon(0.05));
    CHECK(both.quantile(0.25) == doctest::Approx(0.01).epsilon(0.2));
}

TEST_CASE("topology tells open, non-manifold and separate pieces") {
    const Mesh ball = sphere(16, 1);
    const Topology closed = topology(ball);
    CHECK(closed.open_edges == 0);
    CHECK(closed.non_manifold_edges == 0);
    CHECK(closed.components == 1);
    CHECK(closed.volume == doctest::Approx(4.18879).epsilon(0.08));

    Mesh open = ball;
    open.triangles.pop_back();
    CHECK(topology(open).open_edges == 3);

    Mesh fin = ball;  // a third triangle on an edge
    const Triangle t = fin.triangles[40];
    fin.positions.push_back({2, 2, 2});
    fin.triangles.push_back({t[1], t[0], uint32_t(fin.positions.size() - 1)});
    CHECK(topology(fin).non_manifold_edges == 1);
    CHECK(topology(fin).open_edges == 2);

    Mesh flipped = ball;  // its three edges are walked twice the same way
    std::swap(flipped.triangles[40][0], flipped.triangles[40][1]);
    CHECK(topology(flipped).non_manifold_edges == 3);

    Mesh two = ball;
    append(two, sphere(8, 0.5f, {3, 0, 0}));
    two.positions.push_back({9, 9, 9});  // an unused vertex is no component
    CHECK(topology(two).components == 2);
    const std::vector<double> volumes = component_volumes(two);
    REQUIRE(volumes.size() == 2);
    CHECK(volumes[0] > volumes[1]);
    CHECK(volumes[0] + volumes[1] == doctest::Approx(signed_volume(two)));
}

TEST_CASE("small measures of a mesh") {
    CHECK(median_edge(Mesh{}) == 0);
    CHECK(signed_volume(Mesh{}) == 0);
    const Mesh flat = plane(10, 1);
    CHECK(median_edge(flat) == doctest::Approx(0.1));
    for (const glm::vec3& n : vertex_normals(flat)) CHECK(n.z == doctest::Approx(1));
    Mesh unused = flat;
    unused.positions.push_back({5, 5, 5});
    CHECK(vertex_normals(unused).back() == glm::vec3(0));
}

TEST_CASE("shells that overlap: the share of them that lies in the other") {
    const auto two = [](float apart, float radius) {
        Mesh mesh = sphere(48, 1), other = sphere(48, radius, {apart, 0, 0});
        append(mesh, other);
        return mesh;
    };
    const auto inside = [](const Mesh& mesh) { return share_inside(mesh, median_edge(mesh)); };
    CHECK(inside(sphere(48, 1)) == 0);
    CHECK(inside(two(3, 1)) == 0);
    CHECK(inside(two(2.002f, 1)) == 0);  // a hair apart
    for (const float apart : {0.5f, 1.f, 1.5f}) CHECK(inside(two(apart, 1)) == doctest::Approx((2 - apart) / 4).epsilon(0.1));
    Mesh bubble = sphere(48, 0.5f), ball = sphere(48, 1);
    for (Triangle& t : bubble.triangles) std::swap(t[1], t[2]);
    append(ball, bubble);
    CHECK(inside(ball) == 0);
    CHECK(inside(Mesh{}) == 0);
}

TEST_CASE("what --error says, in metres") {
    CHECK(error_target("0.25e", 0.02, 5) == doctest::Approx(0.005));
    CHECK(error_target("0.1%", 0.02, 5) == doctest::Approx(0.005));
    CHECK(error_target("2mm", 0.02, 5) == doctest::Approx(0.002));
    CHECK(error_target("0.002m", 0.02, 5) == doctest::Approx(0.002));
    for (const char* bad : {"", "e", "0.25", "0.25x", "-1e", "0mm", "1e5e5", "nan%", "inf m", "2 mm"})
        CHECK_THROWS_AS(error_target(bad, 1, 1), UsageError);
}
