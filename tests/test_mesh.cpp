// SPDX-License-Identifier: MIT
// The mesher: closed 2-manifolds from the real field and from the worst of noise, within stated bounds,
// the same bytes at any number of workers (1, 2, 8 of std::thread), and drawable at every capacity.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "mesh_harness.h"

using namespace mesh_test;

namespace {

/// Fields made by hand for topology: seeds wherever wanted, values from a plain function.
struct HandField {
    surface::Field field{};
    std::vector<float> x, y, z, one, nothing, support;
    std::vector<surface::Patch> patches;
    void seed(double px, double py, double pz) {
        x.push_back(float(px)), y.push_back(float(py)), z.push_back(float(pz));
        one.push_back(1), nothing.push_back(0), support.push_back(1e-3f);
    }
    const surface::Field& finish() {
        field.point_count = uint32_t(x.size());
        field.x = x.data(), field.y = y.data(), field.z = z.data();
        field.nx = field.ny = nothing.data(), field.nz = one.data();
        patches.assign(x.size(), surface::Patch{});
        field.patches = patches.data();
        field.support = support.data(), field.activity = one.data();
        return field;
    }
};
uint64_t noise_seed;  // of the grid being meshed; these tests run on one thread
double noise_share;
uint32_t scramble(uint64_t h) {
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
    return uint32_t(h >> 32);
}
/// Independent random signs at the lattice corners of a box of 7³, air around it: nothing is worse.
constexpr int grid_from = 5, grid_to = 12;  // across the border of two tiles
void random_grid(const surface::Field&, const uint32_t*, uint32_t, const float* x, const float* y,
                 const float* z, uint32_t n, float* value) noexcept {
    for (uint32_t i = 0; i < n; ++i) {
        const int c[3] = {int(std::lround(x[i])), int(std::lround(y[i])), int(std::lround(z[i]))};
        bool in = true;
        for (int k : c) in = in && k > grid_from && k < grid_to;
        const uint32_t r =
            scramble(noise_seed * 0x9e3779b97f4a7c15u + uint32_t((c[2] * 64 + c[1]) * 64 + c[0]));
        const double share = (r & 0xffff) / 65536.0;
        value[i] = in && share < noise_share ? -0.1f - float(r >> 16) / 65536 : 0.1f + float(r >> 16) / 65536;
    }
}
void no_gradient(const surface::Field&, const uint32_t*, uint32_t, const float*, const float*, const float*,
                 uint32_t n, float* value, float* gx, float* gy, float* gz, float* velocity, float) noexcept {
    for (uint32_t i = 0; i < n; ++i) value[i] = surface::unsupported, gx[i] = gy[i] = gz[i] = 0;
    for (uint32_t i = 0; velocity && i < 3 * n; ++i) velocity[i] = 0;
}

/// A ball with bubbles of one, two and three corners; the first stands where eight tiles meet.
bool bubbles;
constexpr int bubble_corners[][3] = {{8, 8, 8}, {12, 8, 8}, {13, 8, 8}, {8, 3, 8}, {8, 4, 8}, {4, 8, 8}, {4, 9, 8}, {4, 10, 8}};
void bubbled_ball(const surface::Field&, const uint32_t*, uint32_t, const float* x, const float* y, const float* z,
                  uint32_t n, float* value) noexcept {
    for (uint32_t i = 0; i < n; ++i) {
        value[i] = float(length(Vec{x[i] - 8.0, y[i] - 8.0, z[i] - 8.0})) - 9.3f;
        for (const int* c : bubble_corners)
            if (bubbles && std::lround(x[i]) == c[0] && std::lround(y[i]) == c[1] && std::lround(z[i]) == c[2]) value[i] = 0.5f;
    }
}

/// Smooth noise inside a ball: gyroids of several sizes, many handles and thin walls.
double gyroids(const Vec& p) {
    double f = 0, size = 1;
    for (double k = 9; k < 45; k *= 1.7, size *= 0.2)
        f += size *
             (std::sin(k * p[0]) * std::cos(k * p[1]) + std::sin(k * p[1]) * std::cos(k * p[2]) +
              std::sin(k * p[2]) * std::cos(k * p[0])) /
             k;
    return std::max(f, length(p) - 1);
}
void gyroid_values(const surface::Field&, const uint32_t*, uint32_t, const float* x, const float* y,
                   const float* z, uint32_t n, float* value) noexcept {
    for (uint32_t i = 0; i < n; ++i) value[i] = float(gyroids({x[i], y[i], z[i]}));
}
void gyroid_gradients(const surface::Field&, const uint32_t*, uint32_t, const float* x, const float* y,
                      const float* z, uint32_t n, float* value, float* gx, float* gy, float* gz,
                      float* velocity, float) noexcept {
    for (uint32_t i = 0; i < n; ++i) {
        const Vec p = {x[i], y[i], z[i]};
        float* g[3] = {gx + i, gy + i, gz + i};
        value[i] = float(gyroids(p));
        for (int a = 0; a < 3; ++a) {
            Vec q = p, r = p;
            q[a] += 1e-4, r[a] -= 1e-4;
            *g[a] = float((gyroids(q) - gyroids(r)) / 2e-4);
        }
    }
    for (uint32_t i = 0; velocity && i < 3 * n; ++i) velocity[i] = 0;
}

double sphere(const Vec& p) { return length(p) - 1; }
double torus(const Vec& p) { return std::hypot(std::hypot(p[0], p[1]) - 1, p[2]) - 0.4; }

}  // namespace

TEST_CASE("patch tables: every pattern closes, and only 36 have a doubled face") {
    int doubled = 0;
    for (uint32_t signs = 0; signs < 256; ++signs) {
        const CellPatches &patches = cell_patches[signs], &turned = cell_patches[256 + signs];
        CHECK((patches.count > 0) == (signs != 0 && signs != 255));
        CHECK(patches.count <= 4);
        if (patches.doubled == 0) continue;
        ++doubled;
        CHECK(patches.count == 1);
        CHECK(turned.count == 2);
        CHECK(turned.doubled == 0);
    }
    CHECK(doubled == 36);
}

TEST_CASE("patch tables: a walk round each patch takes all of its edges once, whatever faces are turned") {
    for (uint32_t signs = 0; signs < 256; ++signs)
        for (uint32_t turned = 0; turned < 64; ++turned) {
            const CellPattern pattern = pattern_of(signs, turned);
            const CellPatches patches = patches_of(pattern);
            uint32_t walked = 0;
            for (uint32_t p = 0; p < patches.count; ++p) {
                const Ring ring = ring_of(pattern, patches, p);
                CHECK(ring.count >= 3);
                uint32_t edges = 0;
                for (uint32_t k = 0; k < ring.count; ++k) {
                    // The edge that the walk leaves by this face, from the other side: the face's two bits of it agree.
                    const uint32_t edge = patches_detail::edge_beyond(ring.edge[k], ring.face[k]);
                    edges |= 1u << edge;
                    CHECK(patches.patch[edge] == p);
                    CHECK(patches_detail::face_after(signs, edge) == ring.face[k]);
                }
                CHECK((edges & ~uint32_t(patches.crossed)) == 0);
                CHECK((walked & edges) == 0);
                walked |= edges;
            }
            CHECK(walked == patches.crossed);
        }
}

TEST_CASE("sphere: closed, outward, within bounds") {
    Cloud cloud = sphere_cloud(600);
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = 0.04f});
    const Topology t = topology(m);
    CHECK(t.closed_manifold());
    CHECK(t.euler == 2);
    CHECK(inverted(m) == 0);
    CHECK(m.counts.cut == 0);
    CHECK(m.counts.vertices_wanted == m.vertex_count());
    CHECK(m.counts.indices_wanted == m.indices.size());
    CHECK(m.counts.ranges_wanted == m.ranges.size());
    const Error e = error(m, sphere);
    INFO("triangles ", m.indices.size() / 3, ", distance ", e.distance, ", degrees ", e.degrees, ", volume ",
         volume(m));
    CHECK(e.distance < 1e-3);
    CHECK(e.degrees < 3);
    CHECK(std::abs(volume(m) / (4 * pi / 3) - 1) < 2e-3);
    check_ranges(m);
    for (uint32_t v = 0; v < m.vertex_count(); v += 7) {  // points move outward at 2 m/s
        const Vec speed = {m.velocity[3 * v], m.velocity[3 * v + 1], m.velocity[3 * v + 2]};
        CHECK(length(speed - 2.0 * m.at(v)) < 0.1);
    }
    // Vertices are distinct.
    std::vector<Vec> sorted;
    for (uint32_t v = 0; v < m.vertex_count(); ++v) sorted.push_back(m.at(v));
    std::sort(sorted.begin(), sorted.end());
    CHECK(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end());
}

TEST_CASE("sphere at many cell sizes, also far from the origin and with cells above the point spacing") {
    for (const double offset : {0.0, -37.3}) {
        Cloud cloud;
        add_sphere(cloud, {offset, offset, -offset}, 1, 400);
        const RealField real(cloud);
        for (const float cell : {0.5f, 0.21f, 0.1f, 0.05f, 0.03f}) {
            CAPTURE(cell);
            const Mesh m = mesh(real.field, {.cell = cell});
            const Topology t = topology(m);
            CHECK(t.closed_manifold());
            CHECK(t.euler == 2);
            const double relative = std::abs(volume(m) / (4 * pi / 3) - 1);
            CHECK(relative < 0.02 + 1.5 * double(cell) * double(cell));
            if (cell > 0.3f) continue;  // clamped to their cells, vertices cannot all reach the surface
            const Error e = error(m, [&](const Vec& p) { return sphere(p - Vec{offset, offset, -offset}); });
            INFO("distance ", e.distance, " in cells ", e.distance / double(cell));
            // The mean of a patch's crossings lies up to cell²/4R deep; a step leaves a third of that.
            CHECK(e.distance < 2e-3 + 0.01 * double(cell) + 0.1 * double(cell) * double(cell));
        }
    }
}

TEST_CASE("torus: closed, genus one, within bounds") {
    Cloud cloud;
    add_torus(cloud, 1, 0.4, 50);
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = 0.035f});
    const Topology t = topology(m);
    CHECK(t.closed_manifold());
    CHECK(t.euler == 0);
    CHECK(inverted(m) == 0);
    const Error e = error(m, torus);
    INFO("distance ", e.distance, ", degrees ", e.degrees, ", volume ", volume(m));
    CHECK(e.distance < 4e-3);
    CHECK(e.degrees < 6);
    CHECK(std::abs(volume(m) / (2 * pi * pi * 0.16) - 1) < 5e-3);
    check_ranges(m);
}

TEST_CASE("quads are split along the diagonal that bends less") {
    constexpr double minor = 0.12;
    constexpr float cell = 0.06f;
    Cloud cloud;
    add_torus(cloud, 1, minor, 160);
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = cell});
    const auto normal = [&](const Vec& p) {
        const double across = std::hypot(p[0], p[1]), out = across - 1, length = std::hypot(out, p[2]);
        return Vec{out * p[0] / (across * length), out * p[1] / (across * length), p[2] / length};
    };
    const auto bend = [&](uint32_t a, uint32_t b) { return std::abs(dot(normal(m.at(b)) - normal(m.at(a)), m.at(b) - m.at(a))); };
    size_t quads = 0, wrong = 0;
    for (size_t i = 0; i + 5 < m.indices.size(); i += 6) {
        const uint32_t* q = &m.indices[i];
        REQUIRE(q[0] == q[3]);
        REQUIRE(q[2] == q[4]);
        ++quads, wrong += bend(q[0], q[2]) > bend(q[1], q[5]) + 0.4 * cell;
    }
    INFO(wrong, " of ", quads);
    CHECK(quads > 500);
    CHECK(wrong * 100 < quads);
}

TEST_CASE("thin sheet of 1.5 cells: closed, one piece of its volume") {
    Cloud cloud;
    add_sheet(cloud, 1, 0.075, 0.09);
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = 0.05f});
    const Topology t = topology(m);
    CHECK(t.closed_manifold());
    INFO("euler ", t.euler, ", volume ", volume(m));
    CHECK(t.euler == 2);
    CHECK(volume(m) == doctest::Approx(pi * 0.075).epsilon(0.08));
}

TEST_CASE("touching spheres: closed and manifold whether they join or not") {
    for (const double gap : {-0.05, -0.01, 0.0, 0.01, 0.05}) {
        CAPTURE(gap);
        Cloud cloud;
        add_sphere(cloud, {-1 - gap / 2, 0.013, 0}, 1, 300);
        add_sphere(cloud, {1 + gap / 2, 0.013, 0}, 1, 300);
        const RealField real(cloud);
        const Mesh m = mesh(real.field, {.cell = 0.06f});
        const Topology t = topology(m);
        CHECK(t.closed_manifold());
        CHECK(volume(m) == doctest::Approx(8 * pi / 3).epsilon(0.03));
    }
}

TEST_CASE("a bubble in a ball: a second surface that faces inward") {
    Cloud cloud = sphere_cloud(600);
    cloud.add_drop({0.31, 0.02, 0.13}, {-0.2, -0.3, -0.1});
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = 0.03f});
    const Topology t = topology(m);
    CHECK(t.closed_manifold());
    CHECK(t.euler == 4);
    CHECK(volume(m) == doctest::Approx(4 * pi / 3 * (1 - 0.006)).epsilon(0.004));
}

TEST_CASE("random signs: always a closed 2-manifold") {
    HandField hand;
    for (int z = grid_from; z < grid_to; ++z)
        for (int y = grid_from; y < grid_to; ++y)
            for (int x = grid_from; x < grid_to; ++x) hand.seed(x + 0.5, y + 0.5, z + 0.5);
    const FieldAccess access{gather_points, random_grid, no_gradient};
    size_t triangles = 0, bad = 0, empty = 0;
    for (noise_seed = 0; noise_seed < 3000; ++noise_seed) {
        noise_share = 0.05 + 0.9 * double(noise_seed % 31) / 30;
        const Mesh m = mesh(hand.finish(), {.cell = 1,
                                            .vertices = 4000,
                                            .tiles = 8,
                                            .vertex_capacity = 2000,
                                            .index_capacity = 12000,
                                            .range_capacity = 8,
                                            .access = &access});
        CHECK(m.counts.cut == 0);
        triangles += m.indices.size() / 3, empty += m.indices.empty();
        bad += !topology(m).closed_manifold();
    }
    CHECK(bad == 0);
    CHECK(empty < 3000 / 10);  // grids of nothing but specks
    CHECK(triangles > 3000 * 200);
}

TEST_CASE("specks of one corner or two are no surface, bubbles of three are") {
    HandField hand;
    hand.seed(8, 8, -1.3);
    const FieldAccess access{gather_points, bubbled_ball, no_gradient};
    bubbles = false;
    const Mesh clean = mesh(hand.finish(), {.cell = 1, .access = &access});
    for (const int* c : bubble_corners)
        for (const double off : {-0.2, -0.1, 0.1, 0.2}) hand.seed(c[0] + off, c[1] + off, c[2] + off);  // however many points are there
    bubbles = true;
    const Mesh m = mesh(hand.finish(), {.cell = 1, .access = &access});
    CHECK(topology(m).closed_manifold());
    CHECK(topology(clean).euler == 2);
    CHECK(topology(m).euler == 4);
    CHECK(clean.indices.size() > 500);
    CHECK(m.indices.size() - clean.indices.size() == 3 * 28);
}

/// Points, and one drop, wherever it is asked for.
uint32_t gather_with_drop(const surface::Field& f, const surface::Box& box, uint32_t* out, uint32_t capacity) noexcept {
    const uint32_t n = gather_points(f, box, out, capacity);
    if (n < capacity) out[n] = f.point_count;
    return n + 1;
}

TEST_CASE("a drop that reaches a speck keeps it only if it holds a corner of it") {
    for (const bool holds : {false, true}) {
        CAPTURE(holds);
        HandField hand;
        hand.seed(8, 8, -1.3);
        for (const int* c : bubble_corners) hand.seed(c[0] + 0.1, c[1] + 0.1, c[2] + 0.1);
        float centre[3] = {8, 8, holds ? 8.3f : 9.3f}, inverse[6] = {2.f, 2.f, 2.f, 0, 0, 0};  // a ball of half a cell
        hand.field.dx = centre, hand.field.dy = centre + 1, hand.field.dz = centre + 2;
        for (int k = 0; k < 6; ++k) hand.field.inverse[k] = inverse + k;
        bubbles = true;
        const FieldAccess access{gather_with_drop, bubbled_ball, no_gradient};
        const Mesh m = mesh(hand.finish(), {.cell = 1, .access = &access});
        CHECK(topology(m).closed_manifold());
        CHECK(topology(m).euler == (holds ? 6 : 4));  // of one corner, besides the ball and the bubble of three
    }
}

TEST_CASE("gyroid noise: closed 2-manifold found from one seed per piece, on the field") {
    HandField hand;
    for (int i = 0; i < 500; ++i) {
        const Vec p = direction(i, 500);
        hand.seed(p[0], p[1], p[2]);
    }
    const FieldAccess access{gather_points, gyroid_values, gyroid_gradients};
    for (const float cell : {0.11f, 0.05f, 0.021f}) {
        CAPTURE(cell);
        const Mesh m = mesh(hand.finish(), {.cell = cell, .access = &access});
        const Topology t = topology(m);
        CHECK(m.counts.cut == 0);
        CHECK(t.closed_manifold());
        INFO("euler ", t.euler, ", triangles ", m.indices.size() / 3);
        CHECK(t.euler < -10);
    }
}

TEST_CASE("the same bytes at any number of workers" * doctest::test_suite("threads")) {
    Cloud cloud = sphere_cloud(500);
    add_torus(cloud, 1.6, 0.25, 60);
    cloud.add_drop({0.31, 0.02, 2.53}, {0.2, 0.3, 0.1});
    for (int i = 0; i < 300; ++i) cloud.add_drop({0.02 * i - 3, 0.1 * (i % 7), 2}, {0.03, 0.02, 0.01 + 0.0001 * i});
    const RealField real(cloud);
    const uint64_t one = hash(mesh(real.field, {.cell = 0.05f}));
    for (const uint32_t workers : {2u, 8u}) {
        CAPTURE(workers);
        const Mesh m = mesh(real.field, {.cell = 0.05f, .workers = workers});
        CHECK(hash(m) == one);
    }
}

TEST_CASE("where a part of the points crosses more tiles than it has room for, they are found all the same") {
    // Points are looked at in parts that have as much room each: of these nearly all stand in a ball smaller than a tile.
    Cloud cloud;
    add_sphere(cloud, {3, 3, 3}, 0.02, 16000);
    constexpr int balls = 12;
    for (int i = 0; i < balls; ++i) add_sphere(cloud, {0.4 * (i % 4), 0.4 * (i / 4), 0}, 0.15, 40);
    const RealField real(cloud);
    for (const uint32_t tiles : {3000u, 30000u}) {
        const Mesh m = mesh(real.field, {.cell = 0.01f, .tiles = tiles});
        CHECK(m.counts.cut == 0);
        CHECK(topology(m).closed_manifold());
        CHECK(topology(m).euler == 2 * (balls + 1));
    }
}

TEST_CASE("numbers of points that take more than sixteen bits") {
    Cloud cloud;
    for (const double x : {-4, -3}) add_sphere(cloud, {x, x, x}, 0.02, 40000);
    add_sphere(cloud, {0, 0, 0}, 1, 500);
    const RealField real(cloud);
    REQUIRE(real.field.x[UINT16_MAX] < -2);  // the ball's come after
    const Mesh m = mesh(real.field, {.cell = 0.1f});
    CHECK(topology(m).closed_manifold());
    size_t of_ball = 0;
    double worst = 0;
    for (uint32_t v = 0; v < m.vertex_count(); ++v)
        if (length(m.at(v)) < 2) ++of_ball, worst = std::max(worst, length(m.normal_at(v) - m.at(v)));
    CHECK(of_ball > 1500);
    CHECK(worst < 0.02);
}

TEST_CASE("nothing in, nothing out") {
    Cloud cloud;
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = 0.1f});
    CHECK(m.indices.empty());
    CHECK(m.vertex_count() == 0);
    CHECK(m.ranges.empty());
    CHECK(m.counts.cut == 0);
    Cloud ball = sphere_cloud(50);
    const RealField points(ball);
    for (const float cell : {0.f, -1.f, NAN, INFINITY})
        CHECK(mesh(points.field, {.cell = cell}).indices.empty());
}

TEST_CASE("absurdly small cells stop at the limits") {
    Cloud cloud = sphere_cloud(100);
    const RealField real(cloud);
    for (const float cell : {1e-3f, 1e-5f, 1e-8f, 1e-30f}) {
        CAPTURE(cell);
        const Mesh m = mesh(real.field, {.cell = cell, .vertices = 2000, .vertex_capacity = 2000});
        REQUIRE(in_range(m));
        check_ranges(m, false);
    }
    const Mesh m = mesh(real.field, {.cell = 1e-3f, .vertices = 2000, .vertex_capacity = 2000});
    CHECK(m.counts.cut != 0);
    CHECK(m.counts.vertices_wanted > 2000);
}

TEST_CASE("every capacity gives a drawable prefix and says what was wanted") {
    Cloud cloud = sphere_cloud(100);
    for (int i = 0; i < 3; ++i) cloud.add_drop({2, 0.7 * i, 0}, {0.1, 0.1, 0.1 + 0.05 * i});
    const RealField real(cloud);
    const Setup whole{.cell = 0.2f,
                      .vertices = 4000,
                      .vertex_capacity = 4000,
                      .index_capacity = 24000,
                      .range_capacity = 64};
    const Mesh all = mesh(real.field, whole);
    REQUIRE(all.ranges.size() >= 8);
    const uint32_t vertices = uint32_t(all.vertex_count()), indices = uint32_t(all.indices.size()),
                   ranges = uint32_t(all.ranges.size());
    const auto check = [&](const Setup& setup, uint32_t expected_cut) {
        const Mesh m = mesh(real.field, setup);
        CHECK(m.counts.cut == expected_cut);
        CHECK(m.counts.vertices_wanted == vertices);
        CHECK(m.counts.indices_wanted == indices);
        CHECK(m.counts.ranges_wanted == ranges);
        REQUIRE(m.vertex_count() <= vertices);
        REQUIRE(m.indices.size() <= indices);
        CHECK(std::equal(m.indices.begin(), m.indices.end(), all.indices.begin()));
        CHECK(std::equal(m.position.begin(), m.position.end(), all.position.begin()));
        REQUIRE(in_range(m));
        check_ranges(m);
        return m.indices.size();
    };
    size_t before = 0;
    for (uint32_t n = 0; n <= vertices; n += 1 + (n % 3) * 5) {
        Setup setup = whole;
        setup.vertex_capacity = n;
        const size_t drawn = check(setup, n < vertices ? uint32_t(cut_vertices) : 0u);
        CHECK(drawn >= before);
        before = drawn;
        setup.vertex_capacity = vertices, setup.vertices = n;  // too little scratch cuts the same way
        setup.tiles = 64;
        CHECK(check(setup, n < vertices ? uint32_t(cut_vertices) : 0u) == drawn);
    }
    for (uint32_t n = 0; n <= indices; n += 1 + (n % 3) * 31) {
        Setup setup = whole;
        setup.index_capacity = n;
        check(setup, n < indices ? uint32_t(cut_indices) : 0u);
    }
    for (uint32_t n = 0; n <= ranges; ++n) {
        Setup setup = whole;
        setup.range_capacity = n;
        check(setup, n < ranges ? uint32_t(cut_ranges) : 0u);
    }
    for (uint32_t n = 1; n < 60; ++n) {  // tiles run out: less is drawn, nothing breaks
        Setup setup = whole;
        setup.tiles = n;
        const Mesh m = mesh(real.field, setup);
        REQUIRE(in_range(m));
        CHECK(((m.counts.cut == cut_vertices) || m.indices.size() == indices));
        check_ranges(m);
    }
    Setup no_streams = whole;
    no_streams.streams = false;
    CHECK(mesh(real.field, no_streams).indices == all.indices);
}

TEST_CASE("views: complete inside the frustum, nothing far outside") {
    Cloud cloud = sphere_cloud(600);
    const RealField real(cloud);
    const Mesh all = mesh(real.field, {.cell = 0.04f});
    // x ≥ 0.2 and nothing else; the other five planes lie far away.
    FrustumPlanes half{
        {{1, 0, 0, -0.2f}, {-1, 0, 0, 9}, {0, 1, 0, 9}, {0, -1, 0, 9}, {0, 0, 1, 9}, {0, 0, -1, 9}}};
    const Mesh m = mesh(real.field, {.cell = 0.04f, .views = {half}});
    CHECK(m.counts.cut == 0);
    CHECK(m.indices.size() < 0.65 * double(all.indices.size()));
    const Topology t = topology(m);
    CHECK(t.repeated == 0);
    CHECK(t.unpaired > 0);
    std::map<Vec, int> seen;
    for (uint32_t i : m.indices) ++seen[m.at(i)];
    for (uint32_t i : all.indices)
        if (all.at(i)[0] > 0.2) --seen[all.at(i)];
    size_t missing = 0, far_out = 0;
    for (const auto& [p, n] : seen) missing += p[0] > 0.2 && n != 0, far_out += p[0] < 0.2 - 0.04 * 18;
    CHECK(missing == 0);
    CHECK(far_out == 0);
    const Mesh none = mesh(real.field, {.cell = 0.04f, .views = {FrustumPlanes{{{1, 0, 0, -50}}}}});
    CHECK(none.indices.empty());
    const Mesh both = mesh(real.field, {.cell = 0.04f, .views = {half, FrustumPlanes{}}});
    CHECK(both.indices.size() == all.indices.size());
}

TEST_CASE("a hole in the points is bridged: the mesh stays closed and has no second skin") {
    Cloud cloud;
    for (int i = 0; i < 900; ++i) {
        const Vec d = direction(i, 900);
        if (length(d - Vec{0, 0, 1}) > 0.45) cloud.add(d, d);
    }
    const RealField real(cloud);
    const Mesh m = mesh(real.field, {.cell = 0.05f});
    CHECK(topology(m).closed_manifold());
    CHECK(volume(m) == doctest::Approx(4 * pi / 3).epsilon(0.1));
}
