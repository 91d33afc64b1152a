// SPDX-License-Identifier: MIT
// Liquid in a box: which sides of its bounds are walls, and that what is decoded ends at them exactly.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "asset/asset_directory.h"
#include "asset/asset_player.h"
#include "cook/cook.h"
#include "frames/walls.h"
#include "measure/surface_distance.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;
using rill::surface::Container, rill::surface::container_of;

namespace {

constexpr uint32_t all_but_top = 0b011111;

/// A tank of 2 × 2 m with waves on top of 1 m of liquid.
Mesh tank(double seconds) {
    Mesh mesh = sphere(96, 1);
    mesh.velocities.assign(mesh.positions.size(), glm::vec3(0));
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const glm::vec3 p = mesh.positions[v];
        glm::vec3& x = mesh.positions[v];
        const float largest = std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
        x = p / largest;  // a cube, its edges between vertices here and there
        x = glm::clamp(x * 1.02f, glm::vec3(-1), glm::vec3(1));
        x.z *= 0.5f;
        if (p.z < largest) continue;
        const float phase = 3 * x.x + 2 * x.y - 4 * float(seconds);
        x.z += 0.1f * std::sin(phase), mesh.velocities[v].z = -0.4f * std::cos(phase);
    }
    return mesh;
}
/// Where two of its walls would meet it goes straight from one to the other, from `legs` metres off the edge on, as cubes marched.
Mesh bevelled_tank(double seconds, float legs) {
    Mesh mesh = tank(seconds);
    for (glm::vec3& x : mesh.positions)
        for (int a = 0; a < 2; ++a)
            for (int b = a + 1; b < 3; ++b) {
                if (b == 2 && x.z > 0) continue;
                const float beyond = std::fabs(x[a]) + std::fabs(x[b]) - (b == 2 ? 1.5f : 2.f) + legs;
                if (beyond > 0) x[a] -= std::copysign(beyond / 2, x[a]), x[b] -= std::copysign(beyond / 2, x[b]);
            }
    return mesh;
}
/// A pool of 2 × 2 m, as a height field with sides and floor: its rims are edges of the mesh.
Mesh pool(uint32_t n) {
    Mesh mesh;
    const auto height = [](float x, float y) { return 0.5f + 0.1f * std::sin(3 * x + 2 * y); };
    for (const bool floor : {false, true})
        for (uint32_t i = 0; i <= n * n + 2 * n; ++i) {
            const float x = 2 * float(i % (n + 1)) / float(n) - 1, y = 2 * float(i / (n + 1)) / float(n) - 1;
            mesh.positions.push_back({x, y, floor ? -0.5f : height(x, y)});
        }
    const uint32_t floor = (n + 1) * (n + 1);
    const auto quad = [&](uint32_t a, uint32_t b, uint32_t c, uint32_t d) { mesh.triangles.push_back({a, b, c}), mesh.triangles.push_back({a, c, d}); };
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            const uint32_t a = x + y * (n + 1), b = a + 1, c = b + n + 1, d = a + n + 1;
            quad(a, b, c, d), quad(d + floor, c + floor, b + floor, a + floor);
        }
    for (uint32_t k = 0; k < n; ++k) {
        const uint32_t south = k, north = n - k + n * (n + 1), east = n + k * (n + 1), west = (n - k) * (n + 1);
        quad(south + floor, south + 1 + floor, south + 1, south), quad(north + floor, north - 1 + floor, north - 1, north);
        quad(east + floor, east + n + 1 + floor, east + n + 1, east), quad(west + floor, west - n - 1 + floor, west - n - 1, west);
    }
    return mesh;
}
Mesh cube(const glm::vec3& lower, const glm::vec3& upper) {
    Mesh mesh = tank(0);
    for (glm::vec3& x : mesh.positions) x = lower + (upper - lower) * glm::clamp(2.f * x + 0.5f, glm::vec3(0), glm::vec3(1));
    return mesh;
}
WallFacts facts_of(const Mesh& mesh) { return wall_facts(mesh, median_edge(mesh)); }
uint32_t walls_of(const Mesh& mesh) { return facts_of(mesh).walls(median_edge(mesh)); }

}  // namespace

TEST_CASE("walls are the sides of the bounds that liquid lies flat in") {
    CHECK(walls_of(tank(0)) == all_but_top);
    CHECK(walls_of(cube({0, 0, 0}, {1, 1, 1})) == 0b111111);
    CHECK(walls_of(sphere(96, 1)) == 0);
    CHECK(walls_of(Mesh{}) == 0);
    Mesh sheet = plane(20, 1);
    CHECK(walls_of(sheet) == 0);  // both its sides are one
}

TEST_CASE("bevels are what the triangles across the edges between walls have in common") {
    const glm::vec3 lower(-1, -1, -0.5f), upper(1, 1, 0.6f);
    const auto legs_of = [&](const Mesh& mesh, uint32_t walls) { return bevel_legs(bevel_facets(mesh, container_of(&lower.x, &upper.x, walls, 1), median_edge(mesh)), median_edge(mesh)); };
    for (const float legs : {0.03f, 0.07f}) {
        CAPTURE(legs);
        const Mesh mesh = bevelled_tank(0.3, legs);
        CHECK(legs_of(mesh, all_but_top) == doctest::Approx(legs).epsilon(0.01));
        CHECK(legs_of(mesh, 0b011100) == doctest::Approx(legs).epsilon(0.01));
        CHECK(legs_of(mesh, 0b000011) == 0);  // these meet nowhere
    }
    CHECK(legs_of(tank(0.3), all_but_top) == 0);
    CHECK(bevel_legs({{0.03f, 1}, {0.07f, 1.2f}}, 0.07f) == 0);  // of two kinds, none is the usual
    CHECK(bevel_legs({{0.03f, 1}, {0.07f, 2}}, 0.07f) == 0.07f);
    CHECK(bevel_legs({}, 1) == 0);
}

TEST_CASE("of many frames, only those count that reach the bounds of all") {
    const Mesh low = cube({0, 0, 0}, {1, 1, 1}), high = cube({0, 0, 0.5f}, {1, 1, 1.5f});
    const float edge = median_edge(low);
    for (const bool low_first : {true, false}) {
        CAPTURE(low_first);
        WallFacts facts;
        facts.add(facts_of(low_first ? low : high), edge), facts.add(facts_of(low_first ? high : low), edge);
        CHECK(facts.area == doctest::Approx(12).epsilon(0.02));
        CHECK(facts.flat[0] == doctest::Approx(2).epsilon(0.1));
        CHECK(facts.flat[4] == doctest::Approx(1).epsilon(0.1));  // the floor of the low one
        CHECK(facts.flat[5] == doctest::Approx(1).epsilon(0.1));  // the top of the high one
        CHECK(facts.lower.z == 0);
        CHECK(facts.upper.z == 1.5f);
        CHECK(facts.walls(edge) == 0b111111);
        CHECK(facts.share(0b111111) == doctest::Approx(10 / 12.0).epsilon(0.03));
        CHECK(facts.share(0b100000) == doctest::Approx(1 / 12.0).epsilon(0.1));
    }
    CHECK(WallFacts{}.share(0b111111) == 0);
    // A drop that touches the floor once is no reason.
    WallFacts facts;
    for (int i = 0; i < 500; ++i) facts.add(facts_of(sphere(32, 1)), edge);
    facts.add(facts_of(cube({-0.2f, -0.2f, -1}, {0.2f, 0.2f, -0.6f})), edge);
    CHECK(facts.flat[4] > 0);
    CHECK(facts.walls(edge) == 0);
}

TEST_CASE("what lies flat in a wall goes through it, and nothing else moves") {
    const Mesh before = tank(0);
    const glm::vec3 lower(-1, -1, -0.5f), upper(1, 1, 0.6f);
    const Container container = container_of(&lower.x, &upper.x, all_but_top, 1);
    Mesh mesh = before;
    push_through_walls(mesh, container, median_edge(before), 0.01f);
    size_t moved = 0;
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        for (int a = 0; a < 3; ++a) {
            const float was = before.positions[v][a], is = mesh.positions[v][a];
            if (was == is) continue;
            ++moved;
            CHECK(std::fabs(was - (is < 0 ? lower[a] : upper[a])) <= 0.05f * median_edge(before));
            CHECK(is == doctest::Approx(is < 0 ? lower[a] - 0.01f : upper[a] + 0.01f));
        }
    CHECK(moved > 2000);
    Mesh ball = sphere(32, 1);
    push_through_walls(ball, {{-1, -1, -1}, {1, 1, 1}}, median_edge(ball), 0.01f);
    CHECK(ball.positions == sphere(32, 1).positions);  // it only touches
}

TEST_CASE("rims are sharp where surface leaves nearly all of a wall at a crease") {
    const glm::vec3 lower(-1, -1, -0.5f), upper(1, 1, 0.6f);
    const Container container = container_of(&lower.x, &upper.x, all_but_top, 1);
    const auto sharp_of = [&](const Mesh& mesh) { return rim_facts(mesh, container, median_edge(mesh)).sharp_walls(); };
    const Mesh sharp = pool(40), bevelled = bevelled_tank(0.3, 0.07f);
    REQUIRE(open_edges(sharp).empty());
    CHECK(rim_facts(sharp, container, 0.05f).all[4] == doctest::Approx(8));
    CHECK(sharp_of(sharp) == all_but_top);
    CHECK(sharp_of(bevelled) == 0);
    CHECK(sharp_of(Mesh{}) == 0);
    RimFacts both = rim_facts(sharp, container, 0.05f);
    both.add(rim_facts(bevelled, container, median_edge(bevelled)));
    CHECK(both.sharp_walls() == 0);
}

TEST_CASE("liquid with sharp rims goes far through its walls, along its own surface") {
    const glm::vec3 lower(-1, -1, -0.5f), upper(1, 1, 0.6f);
    const Mesh before = pool(80);
    const float edge = median_edge(before);
    for (const uint32_t sharp : {all_but_top, 0b000001u}) {
        const Container container = container_of(&lower.x, &upper.x, all_but_top | sharp << rill::format::sharp_rims_shift, edge);
        Mesh mesh = before;
        push_through_walls(mesh, container, edge, 0.01f * edge);
        size_t rims = 0;
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const glm::vec3 &was = before.positions[v], &is = mesh.positions[v];
            if (was.x == -1) CHECK(is.x < -1 - 2 * edge);
            if (was.x == 1) CHECK(is.x - 1 == doctest::Approx(sharp == all_but_top ? -1 - mesh.positions[0].x : 0.01 * edge).epsilon(0.01));
            if (was.z == -0.5f || was.x != -1 || std::fabs(was.y) > 0.99f) continue;
            const float slope = 0.3f * std::cos(3 * was.x + 2 * was.y);
            CHECK(std::fabs(is.z - was.z - slope * (is.x - was.x)) < 0.1f * edge);
            ++rims;
        }
        CHECK(rims == 79);
        CHECK(mesh.positions[40 + 81 * 40] == before.positions[40 + 81 * 40]);
    }
}

TEST_CASE("of a volume, what lies in the container") {
    const Mesh mesh = cube({-1, -1, -1}, {1, 1, 1});
    const auto inside = [&](const Container& container) { return volume_inside(mesh, container); };
    CHECK(inside(rill::surface::everywhere) == doctest::Approx(signed_volume(mesh)));
    CHECK(signed_volume(mesh) == doctest::Approx(8).epsilon(1e-4));
    CHECK(inside({{-0.5f, -1e30f, -1e30f}, {1e30f, 0.25f, 1e30f}}) == doctest::Approx(1.5 * 1.25 * 2).epsilon(1e-4));
    CHECK(inside({{-2, -2, -2}, {2, 2, 2}}) == doctest::Approx(8).epsilon(1e-4));
    CHECK(std::fabs(inside({{1.5f, -2, -2}, {2, 2, 2}})) < 1e-4);
    // Four edges of 2 m between its sides, without the corners, where bevels of .2 m meet: prisms of .02 m², and as many from wall to floor.
    const float far = 1e30f;
    CHECK(inside({{-1, -1, -far}, {1, 1, far}, 0, 0.2f}) == doctest::Approx(8 - 4 * 2 * 0.02).epsilon(2e-3));
    CHECK(inside({{-1, -1, -far}, {1, 1, far}, 0b0001, 0.2f}) == doctest::Approx(8 - 2 * 2 * 0.02).epsilon(1e-3));
}

TEST_CASE("decoded liquid ends at its walls exactly, closed and whole in cells of any size") {
    const TestFolder folder;
    constexpr int frames = 4;
    for (int i = 0; i < frames; ++i) put_file(folder / "in" + "/f" + std::to_string(1 + i) + ".ply", plain_ply(tank(i / 24.)));
    CookSettings settings;
    settings.jobs = 2;
    cook(folder / "in", folder / "out.rill", settings, [](const CookProgress&) {});
    CHECK(read_directory(folder / "out.rill").header.walls == all_but_top);
    AssetPlayer player(folder / "out.rill", 2);
    for (uint32_t i = 0; i < frames; ++i)
        for (const float coarser : {1.f, 2.f, 4.f}) {
            CAPTURE(i);
            CAPTURE(coarser);
            const Mesh source = tank(i / 24.);
            const float edge = median_edge(source);
            const Mesh decoded = player.mesh(player.frame_seconds(i), coarser * edge);
            const Topology shape = topology(decoded);
            CHECK(shape.open_edges == 0);
            CHECK(shape.non_manifold_edges == 0);
            CHECK(shape.components == 1);
            CHECK(shape.volume == doctest::Approx(signed_volume(source)).epsilon(coarser > 1 ? 0.02 * coarser : 0.005));
            size_t flat = 0, near = 0;
            for (const glm::vec3& x : decoded.positions) {
                const float side = std::max(std::fabs(x.x), std::fabs(x.y));
                CHECK(side <= 1 + 1e-6f);
                CHECK(x.z >= -0.5f - 1e-6f);
                const bool is_rim = x.z > 0.3f || std::min(std::fabs(x.x), std::fabs(x.y)) > 1 - 2 * coarser * edge || x.z < -0.5f + 2 * coarser * edge;
                if (is_rim || side < 1 - edge) continue;
                ++near, flat += side > 1 - coarser * edge / 100;  // vertices keep a 128th off the faces of their cells
            }
            CHECK(near > 50 / (coarser * coarser));
            CHECK(double(flat + 1) > (coarser > 1 ? 0.8 : 0.9) * double(near));  // the rest is told to end before the wall, by less than the tolerance
            if (coarser == 1) CHECK(surface_distance(source, SurfaceIndex(source), decoded, SurfaceIndex(decoded)).mean < 0.1 * edge);
        }
}

TEST_CASE("edges between walls that the source cuts off are cut off so, exactly") {
    const TestFolder folder;
    constexpr int frames = 3;
    constexpr float legs = 0.07f;
    for (int i = 0; i < frames; ++i) put_file(folder / "in" + "/f" + std::to_string(1 + i) + ".ply", plain_ply(bevelled_tank(i / 24., legs)));
    CookSettings settings;
    settings.jobs = 2;
    cook(folder / "in", folder / "out.rill", settings, [](const CookProgress&) {});
    const rill::format::Header header = read_directory(folder / "out.rill").header;
    CHECK((header.walls & rill::format::every_wall) == all_but_top);
    CHECK(rill::format::bevel_of(header.walls, header.cell_size) == doctest::Approx(legs).epsilon(0.01));
    AssetPlayer player(folder / "out.rill", 2);
    const Mesh source = bevelled_tank(0, legs);
    const float edge = median_edge(source);
    const Mesh decoded = player.mesh(player.frame_seconds(0));
    const Topology shape = topology(decoded);
    CHECK(shape.open_edges == 0);
    CHECK(shape.non_manifold_edges == 0);
    const SurfaceIndex index(decoded);
    size_t cut = 0, exact = 0;
    for (const glm::vec3& x : source.positions) {
        if (std::fabs(x.y) > 1 - 3 * edge || x.z > 0) continue;
        if (std::fabs(x.x) + std::fabs(x.z) - 1.5f + legs < -edge / 100) continue;
        const float off = index.closest(x, INFINITY).distance;
        ++cut, exact += off < 0.02f * edge;
        CHECK(off < 0.3f * edge);  // edges that are sharp are .67 off
    }
    CHECK(cut > 60);
    CHECK(double(exact) > 0.7 * double(cut));
}
