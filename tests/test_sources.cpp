// SPDX-License-Identifier: MIT
// Sources that are not as a fluid mesher makes them: uneven triangles, a vertex per corner.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "asset/asset_player.h"
#include "cook/cook.h"
#include "frames/split_edges.h"
#include "frames/turn_alike.h"
#include "frames/weld_seams.h"
#include "measure/surface_distance.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;

namespace {

/// A pool of 1 × 0.5 × 0.4 m: waves of small triangles above, two large ones below, and fans of long ones for walls.
Mesh pool(double seconds) {
    constexpr uint32_t nx = 20, ny = 10;
    Mesh mesh;
    const auto put = [&](float x, float y, float z, float up) {
        mesh.positions.push_back({x, y, z}), mesh.velocities.push_back({0, 0, up});
    };
    for (uint32_t j = 0; j <= ny; ++j)
        for (uint32_t i = 0; i <= nx; ++i) {
            const float x = float(i) / nx, y = 0.5f * float(j) / ny, phase = 5 * x + 3 * y - 4 * float(seconds);
            const float high = i % nx && j % ny ? 0.05f : 0;  // none at the rim: the walls are flat
            put(x, y, 0.4f + high * std::sin(phase), -4 * high * std::cos(phase));
        }
    const auto at = [](uint32_t i, uint32_t j) { return j * (nx + 1) + i; };
    for (uint32_t j = 0; j < ny; ++j)
        for (uint32_t i = 0; i < nx; ++i) {
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    const uint32_t floor = uint32_t(mesh.positions.size());
    put(0, 0, 0, 0), put(1, 0, 0, 0), put(1, 0.5f, 0, 0), put(0, 0.5f, 0, 0);
    mesh.triangles.push_back({floor, floor + 2, floor + 1}), mesh.triangles.push_back({floor, floor + 3, floor + 2});
    const auto wall = [&](uint32_t steps, uint32_t from, uint32_t to, const auto& rim) {  // left to right, seen from outside
        for (uint32_t i = 0; i < steps; ++i) mesh.triangles.push_back({from, rim(i + 1), rim(i)});
        mesh.triangles.push_back({from, to, rim(steps)});
    };
    wall(nx, floor, floor + 1, [&](uint32_t i) { return at(i, 0); });
    wall(ny, floor + 1, floor + 2, [&](uint32_t j) { return at(nx, j); });
    wall(nx, floor + 2, floor + 3, [&](uint32_t i) { return at(nx - i, ny); });
    wall(ny, floor + 3, floor, [&](uint32_t j) { return at(0, ny - j); });
    return mesh;
}

float longest_edge_of(const Mesh& mesh) {
    float longest = 0;
    for (const Triangle& t : mesh.triangles)
        for (size_t k = 0; k < 3; ++k) longest = std::max(longest, glm::distance(mesh.positions[t[k]], mesh.positions[t[(k + 1) % 3]]));
    return longest;
}
SurfaceDistance between(const Mesh& a, const Mesh& b) { return surface_distance(a, SurfaceIndex(a), b, SurfaceIndex(b)); }

}  // namespace

TEST_CASE("no edge is longer than asked for, and the surface is the same one, closed") {
    const Mesh whole = pool(0);
    REQUIRE(topology(whole).open_edges == 0);
    REQUIRE(signed_volume(whole) > 0);
    for (const float longest : {1.f, 0.3f, 0.1f, 0.04f}) {
        CAPTURE(longest);
        Mesh mesh = whole;
        split_long_edges(mesh, longest);
        CHECK(longest_edge_of(mesh) <= longest);
        const Topology shape = topology(mesh);
        CHECK(shape.open_edges == 0);
        CHECK(shape.non_manifold_edges == 0);
        CHECK(shape.components == 1);
        CHECK(shape.volume == doctest::Approx(signed_volume(whole)).epsilon(1e-5));
        CHECK(between(whole, mesh).max < 1e-3);
        CHECK(mesh.velocities.size() == mesh.positions.size());
        CHECK(mesh.triangles.size() < 40 * 2.2 / (longest * longest) + 2 * double(whole.triangles.size()));  // of 2.2 m²
    }
}

TEST_CASE("velocities are interpolated, normals are left to be found anew") {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {8, 0, 0}, {0, 1, 0}};
    mesh.velocities = {{0, 0, 1}, {8, 0, 1}, {0, 2, 1}};
    mesh.normals.assign(3, {0, 0, 1});
    mesh.triangles = {{0, 1, 2}};
    split_long_edges(mesh, 0.7f);
    REQUIRE(mesh.positions.size() > 20);
    CHECK(mesh.normals.empty());
    for (size_t i = 0; i < mesh.positions.size(); ++i)
        CHECK(glm::distance(mesh.velocities[i], glm::vec3(mesh.positions[i].x, 2 * mesh.positions[i].y, 1)) < 1e-5f);
}

TEST_CASE("a mesh of short edges is left as it is, to the bit") {
    const Mesh before = sphere(24, 1);
    Mesh mesh = before;
    split_long_edges(mesh, longest_edge_of(before));
    CHECK(mesh.positions == before.positions);
    CHECK(mesh.triangles == before.triangles);
}

TEST_CASE("a frame of much area is not split without end") {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    split_long_edges(mesh, 1e-6f);
    CHECK(mesh.triangles.size() > 200'000);
    CHECK(mesh.triangles.size() < 5'000'000);
}

TEST_CASE("needles, and places that floats cannot halve, end") {
    Mesh needle;
    needle.positions = {{0, 0, 0}, {1e9f, 0, 0}, {1e9f, 1e-9f, 0}};
    needle.triangles = {{0, 1, 2}};
    split_long_edges(needle, 0.01f);
    CHECK(needle.triangles.size() > 100'000);
    CHECK(needle.triangles.size() < 10'000'000);
    Mesh far;
    far.positions = {{1e6f, 0, 0}, {1e6f + 0.0625f, 0, 0}, {1e6f, 0.0625f, 0.0625f}};  // x: neighbouring floats
    far.triangles = {{0, 1, 2}};
    split_long_edges(far, 0.01f);
    CHECK(far.triangles.size() > 4);
    CHECK(far.triangles.size() < 1000);
}

TEST_CASE("a vertex per corner becomes a vertex per place, with the mean of the velocities") {
    const Mesh whole = pool(0);
    Mesh soup;
    for (const Triangle& t : whole.triangles) {
        const uint32_t first = uint32_t(soup.positions.size());
        for (const uint32_t v : t) soup.positions.push_back(whole.positions[v]), soup.velocities.push_back(whole.velocities[v]);
        soup.velocities.back() += glm::vec3(0, 0, 0.01f);
        soup.triangles.push_back({first, first + 1, first + 2});
    }
    CHECK(weld_seams(soup) == 3 * whole.triangles.size());
    CHECK(soup.positions.size() == whole.positions.size());
    CHECK(soup.triangles.size() == whole.triangles.size());
    CHECK(topology(soup).open_edges == 0);
    CHECK(signed_volume(soup) == doctest::Approx(signed_volume(whole)));
    for (size_t i = 0; i < soup.positions.size(); ++i) {
        const auto at = std::find(whole.positions.begin(), whole.positions.end(), soup.positions[i]) - whole.positions.begin();
        const float off = soup.velocities[i].z - whole.velocities[size_t(at)].z;
        CHECK(off >= 0);
        CHECK(off <= 0.0101f);
    }
}

TEST_CASE("what touches at a vertex stays apart, and a hole stays one") {
    Mesh two = sphere(16, 1), other = two;
    for (glm::vec3& x : other.positions) x.z -= 2;
    other.positions[0] = two.positions.back();  // pole to pole
    append(two, other);
    const Mesh before = two;
    CHECK(weld_seams(two) == 0);
    CHECK(two.positions == before.positions);
    CHECK(two.triangles == before.triangles);
    two.triangles.erase(two.triangles.begin() + ptrdiff_t(two.triangles.size() / 4));  // open edges that no weld closes
    CHECK(weld_seams(two) == 0);
    CHECK(two.positions == before.positions);
}

TEST_CASE("triangles that face otherwise than their neighbours are turned, of each part the lesser area") {
    Mesh sound = sphere(24, 1), other = sphere(16, 0.5f, {3, 0, 0});
    append(sound, other);
    const auto is_put_right = [](const Mesh& whole, const std::vector<size_t>& turned) {
        Mesh mesh = whole;
        for (const size_t i : turned) std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
        CHECK(turn_alike(mesh) == turned.size());
        return mesh.triangles == whole.triangles;
    };
    std::vector<size_t> some;
    for (size_t i = 0; i < sound.triangles.size(); ++i)
        if (i * 7919 % 100 < 10) some.push_back(i);
    REQUIRE(some.size() > 50);
    CHECK(is_put_right(sound, {}));
    CHECK(is_put_right(sound, some));
    Mesh open = sound;  // a hole is no reason
    open.triangles.erase(open.triangles.begin() + 100, open.triangles.begin() + 130);
    CHECK(is_put_right(open, {}));
    CHECK(is_put_right(open, {3, 4, 500}));

    Mesh twice = sound;  // faces that stand there twice
    twice.triangles.push_back(twice.triangles[7]);
    CHECK(is_put_right(twice, {}));
    twice.triangles.resize(8), twice.triangles.push_back(twice.triangles[7]);
    CHECK(is_put_right(twice, {}));

    Mesh inward = sound;  // wholly, and alike: not this stage's business
    for (Triangle& t : inward.triangles) std::swap(t[1], t[2]);
    CHECK(turn_alike(inward) == 0);
    CHECK(signed_volume(inward) == doctest::Approx(-signed_volume(sound)));

    Mesh strip;  // one-sided: nothing helps
    for (int i = 0; i < 12; ++i)
        for (const float side : {-1.f, 1.f}) {
            const float a = float(i) / 12 * 6.2831853f, r = 3 + side * std::cos(a / 2);
            strip.positions.push_back({r * std::cos(a), r * std::sin(a), side * std::sin(a / 2)});
        }
    for (uint32_t i = 0; i < 12; ++i) {
        const uint32_t a = 2 * i, b = a + 1, c = i < 11 ? a + 2 : 1, d = i < 11 ? a + 3 : 0;
        strip.triangles.push_back({a, b, c}), strip.triangles.push_back({c, b, d});
    }
    const std::vector<Triangle> before = strip.triangles;
    CHECK(turn_alike(strip) == 0);
    CHECK(strip.triangles == before);
}

TEST_CASE("liquid with a floor of two triangles comes out whole") {
    const TestFolder folder;
    constexpr int frames = 4;
    for (int i = 0; i < frames; ++i) put_file(folder / "in" + "/f" + std::to_string(1 + i) + ".ply", plain_ply(pool(i / 24.)));
    CookSettings settings;
    settings.jobs = 2;
    cook(folder / "in", folder / "out.rill", settings, [](const CookProgress&) {});
    AssetPlayer player(folder / "out.rill");
    for (uint32_t i = 0; i < frames; ++i) {
        CAPTURE(i);
        const Mesh source = pool(i / 24.), decoded = player.mesh(player.frame_seconds(i));
        CHECK(signed_volume(decoded) == doctest::Approx(signed_volume(source)).epsilon(0.01));
        Mesh even = source;  // samples everywhere
        split_long_edges(even, 0.05f);
        const SurfaceDistance d = between(even, decoded);
        CHECK(d.histogram.quantile(0.9) < 0.25 * median_edge(source));  // a tenth lies along sharp rims
        CHECK(d.max < 2 * median_edge(source));
    }
}
