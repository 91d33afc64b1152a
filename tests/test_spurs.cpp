// SPDX-License-Identifier: MIT
// Decoded liquid that the source does not have: the cooker meshes what points decode to, finds it, and bears points there.
#include <doctest/doctest.h>

#include <algorithm>

#include "measure/surface_distance.h"
#include "shapes.h"
#include "tracks/pipeline.h"
#include "tracks/points_to_mesh.h"
#include "tracks/torn_necks.h"

using namespace rill::cooker;

namespace {

constexpr float radius = 0.5f;

/// Every vertex of a ball as a point.
std::vector<SurfacePoint> points_of(uint32_t n, float r, const glm::vec3& centre = {}) {
    std::vector<SurfacePoint> points;
    for (const glm::vec3& x : sphere(n, r, centre).positions) points.push_back({x, glm::normalize(x - centre), {}});
    return points;
}
SurfaceFrame frame_of_ball() {
    Mesh mesh = sphere(64, radius);
    const float edge = float(median_edge(mesh));
    return SurfaceFrame(std::move(mesh), edge);
}
size_t count(const std::vector<uint8_t>& flags) { return size_t(std::count(flags.begin(), flags.end(), 1)); }

std::vector<Path> repaired(const SurfaceFrame& frame, int sample, const std::vector<SurfacePoint>& points, float beyond, int jobs) {
    return repair_surface(frame, sample, points, mesh_points(points, frame.edge), beyond, jobs);
}

}  // namespace

TEST_CASE("points mesh to the closed surface they mean, the same with any number of threads" * doctest::test_suite("threads")) {
    const std::vector<SurfacePoint> points = points_of(24, radius);
    const Mesh mesh = mesh_points(points, 0.03f);
    const Topology shape = topology(mesh);
    CHECK(shape.open_edges == 0);
    CHECK(shape.components == 1);
    CHECK(shape.volume == doctest::Approx(4 / 3.0 * 3.14159265 * radius * radius * radius).epsilon(0.01));
    for (const glm::vec3& x : mesh.positions) CHECK(glm::length(x) == doctest::Approx(radius).epsilon(0.01));
    for (int jobs = 2; jobs <= 8; jobs *= 4) {
        const Mesh other = mesh_points(points, 0.03f, jobs);
        CHECK(other.positions == mesh.positions);
        CHECK(other.triangles == mesh.triangles);
    }
    CHECK(mesh_points({}, 0.03f).positions.empty());
}

TEST_CASE("a mesh of more vertices than were made room for is whole") {
    const Mesh mesh = mesh_points(points_of(24, radius), 0.004f);
    CHECK(mesh.positions.size() > (1u << 16));
    CHECK(topology(mesh).open_edges == 0);
}

TEST_CASE("decoded liquid that the source lacks marks the vertices nearest to it, and only those") {
    const SurfaceFrame frame = frame_of_ball();
    std::vector<SurfacePoint> points = points_of(24, radius);
    Residual clean = measure_residual(frame, points);
    mark_spurs(frame, points, frame.edge, clean, 2);
    CHECK(count(clean.spur) == 0);

    for (const SurfacePoint& p : points_of(12, 0.1f, {0, 0, radius + 0.3f})) points.push_back(p);
    Residual spurred = measure_residual(frame, points);
    mark_spurs(frame, points, frame.edge, spurred, 2);
    CHECK(count(spurred.spur) > 0);
    for (size_t v = 0; v < spurred.spur.size(); ++v)
        if (spurred.spur[v]) CHECK(glm::distance(frame.mesh.positions[v], glm::vec3(0, 0, radius)) < 0.25f);
}

TEST_CASE("at a spur a point is born where others would stand too close") {
    const SurfaceFrame frame = frame_of_ball();
    const std::vector<SurfacePoint> points = points_of(14, radius);  // about five edges apart
    // A vertex half way between points at the equator.
    const glm::vec3 between = radius * glm::normalize(points[1 + 2 * 14].position + points[2 + 2 * 14].position);
    uint32_t vertex = 0;
    for (uint32_t v = 0; v < frame.mesh.positions.size(); ++v)
        if (glm::distance(frame.mesh.positions[v], between) < glm::distance(frame.mesh.positions[vertex], between)) vertex = v;
    Residual residual;
    residual.distance.assign(frame.mesh.positions.size(), 0.f);
    residual.wrong_side.assign(residual.distance.size(), 0), residual.spur = residual.wrong_side;
    CHECK(choose_births(frame, residual, points, 0.1f * frame.edge, 0.25f * frame.edge).empty());
    residual.wrong_side[vertex] = 1;
    CHECK(choose_births(frame, residual, points, 0.1f * frame.edge, 0.25f * frame.edge).empty());
    residual.spur[vertex] = 1;
    const std::vector<SurfacePoint> born = choose_births(frame, residual, points, 0.1f * frame.edge, 0.25f * frame.edge);
    REQUIRE(born.size() == 1);
    CHECK(born[0].position == frame.mesh.positions[vertex]);

    // Not with one close by.
    std::vector<SurfacePoint> close = points;
    const glm::vec3 n = glm::normalize(frame.mesh.positions[vertex] + glm::vec3(0, 0, 1.2f * frame.edge));
    close.push_back({radius * n, n, {}});
    CHECK(choose_births(frame, residual, close, 0.1f * frame.edge, 0.25f * frame.edge).empty());
}

TEST_CASE("what is torn is repaired by points that leave less off the source, the same with any number of threads" * doctest::test_suite("threads")) {
    const SurfaceFrame frame = frame_of_ball();
    const std::vector<SurfacePoint> whole = points_of(24, radius);
    const float beyond = 0.7f * frame.edge;
    CHECK(repaired(frame, 0, whole, beyond, 2).empty());

    // The ball is cut flat there; the second void is farther from the source than a few edges.
    float rim = 0.4f;
    SUBCASE("a lid") {}
    SUBCASE("most of the ball") { rim = -0.4f; }
    std::vector<SurfacePoint> torn;
    for (const SurfacePoint& p : whole)
        if (p.normal.x < rim) torn.push_back(p);
    const auto farthest = [&](const std::vector<SurfacePoint>& points) {
        const Mesh decoded = mesh_points(points, frame.edge);
        return surface_distance(frame.mesh, frame.index, decoded, SurfaceIndex(decoded)).max;
    };
    REQUIRE(farthest(torn) > beyond);
    const std::vector<Path> born = repaired(frame, 5, torn, beyond, 1);
    REQUIRE(!born.empty());
    std::vector<SurfacePoint> mended = torn;
    for (const Path& path : born) {
        CHECK(path.birth == 5);
        CHECK(path.death == 5);
        CHECK(glm::length(path.target(5).position) == doctest::Approx(radius).epsilon(0.01));
        mended.push_back(path.target(5));
    }
    CHECK(farthest(mended) < 0.7 * farthest(torn));
    const std::vector<Path> again = repaired(frame, 5, torn, beyond, 3);
    REQUIRE(again.size() == born.size());
    for (size_t i = 0; i < born.size(); ++i) CHECK(again[i].target(5).position == born[i].target(5).position);
    CHECK(repaired(frame, 0, {}, beyond, 1).empty());
}

TEST_CASE("thin liquid that no single point mends is mended by several at once") {
    glm::vec3 half;  // edges
    SUBCASE("a strand") { half = {0.6f, 0.6f, 5}; }
    SUBCASE("a sheet") { half = {4, 4, 0.8f}; }
    Mesh mesh = sphere(64, radius), thin = sphere(24, 1);
    const float edge = float(median_edge(mesh));
    const uint32_t first = uint32_t(mesh.positions.size());
    for (const glm::vec3& x : thin.positions) mesh.positions.push_back(glm::vec3(1.5f, 0, 0) + edge * half * x);
    for (const Triangle& t : thin.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    const SurfaceFrame frame(std::move(mesh), edge);
    const std::vector<SurfacePoint> ball = points_of(24, radius);
    const std::vector<Path> born = repaired(frame, 0, ball, 0.7f * edge, 2);
    REQUIRE(born.size() >= 2);
    CHECK(glm::dot(born[0].target(0).normal, born[1].target(0).normal) < -0.3f);
    std::vector<SurfacePoint> mended = ball;
    for (const Path& path : born) mended.push_back(path.target(0));
    for (size_t i = ball.size(); i < mended.size(); ++i) CHECK(mended[i].position.x > 1);
    const std::vector<uint32_t> lost = find_beyond(SurfaceIndex(mesh_points(mended, edge)), frame.mesh.positions, edge, 2);
    CHECK(lost.size() < thin.positions.size() / 2);
}

TEST_CASE("a neck that is torn is found where it is, and mended") {
    constexpr float edge = 0.05f, ball = 3, apart = 3.6f;
    float neck = 0;
    bool air = false;
    SUBCASE("thick") { neck = 0.9f; }
    SUBCASE("thin") { neck = 0.5f; }
    SUBCASE("of air") { neck = 0.9f, air = true; }
    CAPTURE(neck);
    CAPTURE(air);
    Mesh source = dumbbell(edge, ball, neck, apart);
    std::vector<SurfacePoint> points;
    for (const float side : {-1.f, 1.f})
        for (const SurfacePoint& p : points_of(16, ball * edge, {side * apart * edge, 0, 0})) points.push_back(p);
    if (air) {  // a cavity in a ball
        constexpr float around = 11 * edge;
        for (Triangle& t : source.triangles) std::swap(t[0], t[1]);
        for (glm::vec3& n : source.normals) n = -n;
        for (SurfacePoint& p : points) p.normal = -p.normal;
        append(source, sphere(40, around));
        for (const SurfacePoint& p : points_of(24, around)) points.push_back(p);
    }
    const SurfaceFrame frame(std::move(source), edge);
    const Mesh torn = mesh_points(points, edge);
    REQUIRE(topology(torn, edge).large_components == (air ? 3 : 2));
    REQUIRE(topology(frame.mesh, edge).large_components == (air ? 2 : 1));
    const MeshPieces pieces(torn, 1);
    const std::vector<TornNeck> necks = find_torn_necks(MeshPieces(frame), pieces, edge);
    REQUIRE(!necks.empty());
    for (const TornNeck& found : necks) {
        CHECK(glm::length(found.middle) < edge);
        CHECK(found.pieces[0] != found.pieces[1]);
        CHECK(found.of == (air ? TornNeck::Of::air : TornNeck::Of::liquid));
    }
    // Farther off than any vertex is: only the neck can be the reason.
    const std::vector<Path> born = repaired(frame, 0, points, 5 * edge, 2);
    REQUIRE(!born.empty());
    for (const Path& path : born) points.push_back(path.target(0));
    const Mesh mended = mesh_points(points, edge);
    CHECK(topology(mended, edge).large_components == (air ? 2 : 1));
    CHECK(find_torn_necks(MeshPieces(frame), MeshPieces(mended, 1), edge).empty());
}

TEST_CASE("a neck between pieces that are apart is found where it is") {
    constexpr float edge = 0.05f, ball = 3, apart = 3.6f;
    Mesh source = sphere(24, ball * edge, {-apart * edge, 0, 0});
    append(source, sphere(24, ball * edge, {apart * edge, 0, 0}));
    const SurfaceFrame frame(std::move(source), edge);
    const Mesh joined = dumbbell(edge, ball, 0.9f, apart);
    const MeshPieces pieces(joined, 1);
    const MeshPieces source_pieces(frame);
    const std::vector<TornNeck> necks = find_false_necks(source_pieces, pieces, edge);
    REQUIRE(!necks.empty());
    for (const TornNeck& found : necks) {
        CHECK(glm::length(found.middle) < edge);
        CHECK(found.of == TornNeck::Of::none);
        // Liquid that goes through the neck is amiss; air that parts it is not.
        const NeckCorners corners(found, edge, 2.5f * edge, source_pieces);
        std::vector<float> through(corners.x.size()), parted(corners.x.size());
        for (size_t i = 0; i < through.size(); ++i) {
            const glm::vec3 x(corners.x[i], corners.y[i], corners.z[i]);
            const float balls = glm::length(glm::vec3(std::fabs(x.x) - apart * edge, x.y, x.z)) - ball * edge;
            const float strand = std::hypot(x.y, x.z) - 0.9f * edge;
            through[i] = std::min(balls, strand), parted[i] = balls;
        }
        CHECK(corners.is_amiss(through, through));
        CHECK(!corners.is_amiss(parted, through));
    }
    const Mesh nothing;
    CHECK(find_false_necks(source_pieces, source_pieces, edge).empty());
    CHECK(find_false_necks(source_pieces, MeshPieces(nothing, 1), edge).empty());
}

TEST_CASE("pieces that are the source's own are not torn") {
    constexpr float edge = 0.05f;
    Mesh mesh = sphere(64, 0.5f);
    const Mesh drop = sphere(16, 0.15f, {0.7f, 0, 0});
    append(mesh, drop);
    const SurfaceFrame frame(std::move(mesh), edge);
    std::vector<SurfacePoint> points = points_of(24, 0.5f);
    for (const SurfacePoint& p : points_of(10, 0.15f, {0.7f, 0, 0})) points.push_back(p);
    const Mesh decoded = mesh_points(points, edge);
    REQUIRE(topology(decoded, edge).large_components == 2);
    const Mesh nothing;
    CHECK(find_torn_necks(MeshPieces(frame), MeshPieces(decoded, 1), edge).empty());
    CHECK(find_torn_necks(MeshPieces(frame), MeshPieces(nothing, 1), edge).empty());
}
