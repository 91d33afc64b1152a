// SPDX-License-Identifier: MIT
// For tests of the mesher: analytic surfaces through the real field, one meshing run into guarded buffers,
// and what must hold of any mesh.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "src/mesher.h"

namespace mesh_test {

using namespace rill;

using Vec = std::array<double, 3>;
inline Vec operator+(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec operator*(double k, const Vec& a) { return {k * a[0], k * a[1], k * a[2]}; }
inline double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double length(const Vec& a) { return std::sqrt(dot(a, a)); }
inline Vec cross(const Vec& a, const Vec& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline constexpr double pi = 3.14159265358979323846;

/// Every point in the box, for fields without an index.
inline uint32_t gather_points(const surface::Field& f, const surface::Box& box, uint32_t* out, uint32_t capacity) noexcept {
    uint32_t n = 0;
    for (uint32_t i = 0; i < f.point_count; ++i) {
        const float p[3] = {f.x[i], f.y[i], f.z[i]};
        bool in = true;
        for (int a = 0; a < 3; ++a) in = in && p[a] >= box.lower[a] && p[a] <= box.upper[a];
        if (in && n++ < capacity) out[n - 1] = i;
    }
    return n;
}

struct Free {
    void operator()(void* block) const { std::free(block); }
};
using Block = std::unique_ptr<void, Free>;
Block exactly(size_t bytes, size_t alignment = 64) {
    return Block(std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment));
}

/// Points of an analytic surface on their way into the real field.
struct Cloud {
    std::vector<float> p[3], n[3], v[3], activity;
    std::vector<float> drop[3], shape[6], drop_v[3], drop_activity;

    void add(const Vec& position, const Vec& normal, const Vec& velocity = {0, 0, 0}) {
        for (int a = 0; a < 3; ++a) {
            p[a].push_back(float(position[a])), n[a].push_back(float(normal[a])),
                v[a].push_back(float(velocity[a]));
        }
        activity.push_back(1);
    }
    void add_drop(const Vec& centre, const Vec& radii) {
        for (int a = 0; a < 3; ++a) {
            drop[a].push_back(float(centre[a])), drop_v[a].push_back(0);
            shape[a].push_back(float(radii[a])), shape[a + 3].push_back(0);
        }
        drop_activity.push_back(1);
    }
};
struct RealField {
    surface::Field field{};
    Block memory;
    explicit RealField(Cloud& c, const surface::Container& container = surface::everywhere) {
        const format::PointSet points{uint32_t(c.activity.size()),
                                      c.p[0].data(),
                                      c.p[1].data(),
                                      c.p[2].data(),
                                      c.n[0].data(),
                                      c.n[1].data(),
                                      c.n[2].data(),
                                      c.v[0].data(),
                                      c.v[1].data(),
                                      c.v[2].data(),
                                      c.activity.data()};
        format::DropSet drops{uint32_t(c.drop_activity.size()),
                              c.drop[0].data(),
                              c.drop[1].data(),
                              c.drop[2].data(),
                              {},
                              c.drop_v[0].data(),
                              c.drop_v[1].data(),
                              c.drop_v[2].data(),
                              c.drop_activity.data()};
        for (int a = 0; a < 6; ++a) drops.shape[a] = c.shape[a].data();
        memory = exactly(surface::field_bytes(points.count, drops.count) + 64);
        surface::begin_field(field, memory.get(), points, drops, container);
        surface::fit_patches(field, 0, field.point_count);
        surface::finish_field(field);
    }
};

/// Evenly spread directions (Fibonacci lattice).
inline Vec direction(int i, int n) {
    const double z = 1 - (2 * i + 1.0) / n, r = std::sqrt(1 - z * z), a = i * pi * (3 - std::sqrt(5.0));
    return {r * std::cos(a), r * std::sin(a), z};
}
inline void add_sphere(Cloud& c, const Vec& centre, double radius, int n) {
    for (int i = 0; i < n; ++i) {
        const Vec d = direction(i, n);
        c.add(centre + radius * d, d, 2.0 * d);
    }
}
inline Cloud sphere_cloud(int n) {
    Cloud c;
    add_sphere(c, {0, 0, 0}, 1, n);
    return c;
}
inline void add_torus(Cloud& c, double major, double minor, int n) {
    for (int i = 0; i < n; ++i) {
        const double u = 2 * pi * i / n;
        const int around = int(n * minor / major + 0.5);
        for (int k = 0; k < around; ++k) {
            const double v = 2 * pi * (k + 0.5 * (i & 1)) / around;
            const Vec out = {std::cos(u), std::sin(u), 0};
            const Vec normal = {std::cos(v) * out[0], std::cos(v) * out[1], std::sin(v)};
            c.add(major * out + minor * normal, normal);
        }
    }
}
/// A round sheet: two flat faces and a half-round rim.
inline void add_sheet(Cloud& c, double radius, double thickness, double spacing) {
    const double half = thickness / 2;
    const int n = int(radius / spacing);
    for (int i = -n; i <= n; ++i)
        for (int j = -n; j <= n; ++j) {
            const double x = (i + 0.5 * (j & 1)) * spacing, y = j * spacing * 0.866;
            if (std::hypot(x, y) > radius) continue;
            c.add({x, y, half}, {0, 0, 1});
            c.add({x, y, -half}, {0, 0, -1});
        }
    const int around = int(2 * pi * radius / spacing);
    for (int i = 0; i < around; ++i)
        for (int k = -1; k <= 1; ++k) {
            const double u = 2 * pi * i / around, v = k * pi / 3;
            const Vec normal = {std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v)};
            c.add(Vec{radius * std::cos(u), radius * std::sin(u), 0} + half * normal, normal);
        }
}

struct Mesh {
    std::vector<float> position, normal, velocity;
    std::vector<uint32_t> indices;
    std::vector<Range> ranges;
    MeshCounts counts{};
    Vec at(uint32_t v) const { return {position[3 * v], position[3 * v + 1], position[3 * v + 2]}; }
    Vec normal_at(uint32_t v) const { return {normal[3 * v], normal[3 * v + 1], normal[3 * v + 2]}; }
    size_t vertex_count() const { return position.size() / 3; }
};

/// Every stage as `workers` threads would run it, in whatever order they come.
inline void run_threaded(const Stage* stages, uint32_t count, void* context, uint32_t workers) {
    for (uint32_t s = 0; s < count; ++s)
        for (;;) {
            const uint32_t tasks = stages[s].prepare(context);
            std::atomic<uint32_t> next{0};
            std::vector<std::thread> threads;
            for (uint32_t w = 0; w < workers && tasks && stages[s].run; ++w)
                threads.emplace_back([&, w] {
                    for (uint32_t i = next++; i < tasks; i = next++) stages[s].run(context, i, w);
                });
            for (std::thread& t : threads) t.join();
            if (tasks == 0 || !stages[s].repeats) break;
        }
}

struct Setup {
    float cell;
    uint32_t vertices = 200000, workers = 1, tiles = 0;
    uint32_t vertex_capacity = 100000, index_capacity = 1200000, range_capacity = 4096;
    std::vector<FrustumPlanes> views{};
    std::vector<std::array<float, 4>> eyes{};  ///< position, reach
    const FieldAccess* access = nullptr;
    bool streams = true;
    int rounds_until_late = 0;  ///< 0: never
};

inline Mesh mesh(const surface::Field& field, const Setup& setup) {
    const MeshLimits limits{setup.vertices, field.drop_count, setup.tiles, setup.workers};
    const Block memory = exactly(mesher_bytes(limits));
    Mesher* mesher = place_mesher(memory.get(), limits);
    if (setup.access) mesher->access = *setup.access;

    constexpr uint32_t stride = 16, gap_byte = 0xA5;  // the gap of each stride must stay untouched
    std::vector<uint8_t> stream[3];
    for (auto& s : stream) s.assign(size_t(setup.vertex_capacity) * stride, gap_byte);
    Mesh out;
    out.indices.resize(setup.index_capacity);
    out.ranges.resize(setup.range_capacity);
    Target target{};
    if (setup.streams) {
        target.position = {stream[0].data(), stride}, target.normal = {stream[1].data(), stride};
        target.velocity = {stream[2].data(), stride};
    }
    // Null means not wanted; a capacity of 0 is a buffer all the same.
    uint32_t no_index;
    Range no_range;
    target.indices = out.indices.empty() ? &no_index : out.indices.data();
    target.ranges = out.ranges.empty() ? &no_range : out.ranges.data();
    target.vertex_capacity = setup.vertex_capacity, target.index_capacity = setup.index_capacity;
    target.range_capacity = setup.range_capacity;
    Levels levels{};
    levels.cell_size = setup.cell;
    for (const auto& eye : setup.eyes) {
        std::copy(eye.begin(), eye.begin() + 3, levels.eyes[levels.eye_count]);
        levels.reach[levels.eye_count++] = eye[3];
    }
    MeshInput input{&field, levels, setup.views.data(), uint32_t(setup.views.size()), true, &target};
    int rounds = setup.rounds_until_late;
    if (rounds) input.most_octaves = 3, input.user = &rounds, input.late = [](void* left) { return --*static_cast<int*>(left) == 0; };
    begin_mesh(mesher, input);
    uint32_t count;
    const Stage* stages = mesh_stages(&count);
    if (setup.workers > 1)
        run_threaded(stages, count, mesher, setup.workers);
    else
        run_inline(stages, count, mesher);

    out.counts = mesh_counts(mesher);
    REQUIRE(target.vertices_used <= setup.vertex_capacity);
    REQUIRE(target.indices_used <= setup.index_capacity);
    REQUIRE(target.ranges_used <= setup.range_capacity);
    std::vector<float>* to[3] = {&out.position, &out.normal, &out.velocity};
    for (int k = 0; k < 3 && setup.streams; ++k) {
        to[k]->resize(3 * size_t(target.vertices_used));
        bool gaps_kept = true;
        for (uint32_t i = 0; i < setup.vertex_capacity; ++i) {
            const uint8_t* element = stream[k].data() + size_t(i) * stride;
            uint32_t b = 0;
            if (i < target.vertices_used) std::memcpy(to[k]->data() + 3 * i, element, b = 12);
            while (b < stride) gaps_kept = gaps_kept && element[b++] == gap_byte;
        }
        CHECK(gaps_kept);
    }
    out.indices.resize(target.indices_used);
    out.ranges.resize(target.ranges_used);
    return out;
}

struct Topology {
    size_t unpaired = 0;    ///< directed edges whose reverse is missing: open borders
    size_t repeated = 0;    ///< directed edges used more than once: not manifold
    size_t split_fans = 0;  ///< vertices whose triangles do not form one cycle
    size_t unused = 0, degenerate = 0;
    long euler = 0;
    bool closed_manifold() const { return unpaired + repeated + split_fans + unused + degenerate == 0; }
};
inline Topology topology(const Mesh& m) {
    Topology t;
    std::vector<std::array<uint32_t, 3>> directed;  // from, to, apex
    for (size_t i = 0; i + 2 < m.indices.size(); i += 3) {
        const uint32_t* v = &m.indices[i];
        t.degenerate += v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
        for (int k = 0; k < 3; ++k) directed.push_back({v[k], v[(k + 1) % 3], v[(k + 2) % 3]});
    }
    std::sort(directed.begin(), directed.end());
    const auto find = [&](uint32_t a, uint32_t b) {
        const auto it = std::lower_bound(directed.begin(), directed.end(), std::array<uint32_t, 3>{a, b, 0});
        return it != directed.end() && (*it)[0] == a && (*it)[1] == b ? it : directed.end();
    };
    for (size_t i = 0; i < directed.size(); ++i) {
        if (i && directed[i][0] == directed[i - 1][0] && directed[i][1] == directed[i - 1][1]) ++t.repeated;
        if (find(directed[i][1], directed[i][0]) == directed.end()) ++t.unpaired;
    }
    size_t used = 0;
    for (size_t i = 0; i < directed.size();) {
        size_t last = i;
        while (last < directed.size() && directed[last][0] == directed[i][0]) ++last;
        ++used;
        if (t.unpaired + t.repeated == 0) {  // walk the fan: one cycle must see every triangle
            size_t steps = 0;
            auto edge = directed.begin() + long(i);
            do {
                edge = find((*edge)[0], (*edge)[2]), ++steps;
            } while (edge != directed.begin() + long(i) && steps <= last - i);
            t.split_fans += steps != last - i;
        }
        i = last;
    }
    t.unused = m.vertex_count() - used;
    t.euler = long(used) - long(directed.size() / 2) + long(m.indices.size() / 3);
    return t;
}
inline double volume(const Mesh& m) {
    double six = 0;
    for (size_t i = 0; i < m.indices.size(); i += 3)
        six += dot(m.at(m.indices[i]), cross(m.at(m.indices[i + 1]), m.at(m.indices[i + 2])));
    return six / 6;
}
/// Largest |distance| of a vertex to an analytic surface, and the largest angle of its normal in degrees.
struct Error {
    double distance = 0, degrees = 0;
};
inline Error error(const Mesh& m, const std::function<double(const Vec&)>& f) {
    Error e;
    double worst_length = 0;
    for (uint32_t v = 0; v < m.vertex_count(); ++v) {
        const Vec p = m.at(v);
        e.distance = std::max(e.distance, std::abs(f(p)));
        Vec g;
        for (int a = 0; a < 3; ++a) {
            Vec q = p, r = p;
            q[a] += 1e-4, r[a] -= 1e-4;
            g[a] = f(q) - f(r);
        }
        const double c = dot(g, m.normal_at(v)) / length(g);
        worst_length = std::max(worst_length, std::abs(length(m.normal_at(v)) - 1));
        e.degrees = std::max(e.degrees, std::acos(std::clamp(c, -1.0, 1.0)) * 180 / pi);
    }
    CHECK(worst_length < 1e-5);
    return e;
}
/// Triangles that face away from the mean of their vertices' normals.
inline size_t inverted(const Mesh& m) {
    size_t n = 0;
    for (size_t i = 0; i < m.indices.size(); i += 3) {
        const uint32_t* v = &m.indices[i];
        const Vec face = cross(m.at(v[1]) - m.at(v[0]), m.at(v[2]) - m.at(v[0]));
        n += dot(face, m.normal_at(v[0]) + m.normal_at(v[1]) + m.normal_at(v[2])) < 0;
    }
    return n;
}
inline bool in_range(const Mesh& m) {
    return std::all_of(m.indices.begin(), m.indices.end(), [&](uint32_t i) { return i < m.vertex_count(); });
}
/// `tight`: bounds are those of what is drawn, no wider; where tiles ran out, some vertices are in no triangle.
inline void check_ranges(const Mesh& m, bool tight = true) {
    uint32_t next = 0;
    for (uint32_t r = 0; r < m.ranges.size(); ++r) {
        const Range& range = m.ranges[r];
        CHECK(range.block == r);
        CHECK(range.first_index == next);
        CHECK(range.index_count > 0);
        next += range.index_count;
        REQUIRE(next <= m.indices.size());
        Vec lower = {1e30, 1e30, 1e30}, upper = {-1e30, -1e30, -1e30};
        for (uint32_t i = range.first_index; i < next; ++i)
            for (int a = 0; a < 3; ++a) {
                lower[a] = std::min(lower[a], m.at(m.indices[i])[a]);
                upper[a] = std::max(upper[a], m.at(m.indices[i])[a]);
            }
        for (int a = 0; a < 3; ++a) {
            CHECK((lower[a] >= range.lower[a] && upper[a] <= range.upper[a]));
            if (tight) CHECK((lower[a] == range.lower[a] && upper[a] == range.upper[a]));
        }
    }
    CHECK(next == m.indices.size());
}
inline uint64_t hash(const Mesh& m) {
    uint64_t h = 1469598103934665603u;
    const auto add = [&](const void* data, size_t bytes) {
        for (size_t i = 0; i < bytes; ++i) h = (h ^ static_cast<const uint8_t*>(data)[i]) * 1099511628211u;
    };
    for (const auto* s : {&m.position, &m.normal, &m.velocity}) add(s->data(), s->size() * sizeof(float));
    add(m.indices.data(), m.indices.size() * sizeof(uint32_t));
    add(m.ranges.data(), m.ranges.size() * sizeof(Range));
    return h;
}

}  // namespace mesh_test
