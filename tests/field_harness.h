// SPDX-License-Identifier: MIT
// For tests of the field: places on surfaces that are known, the field of a cloud at them, and how far off it is.
#pragma once
#include <limits>
#include <map>

#include "mesh_harness.h"

namespace field_test {

using namespace mesh_test;

inline constexpr float infinity = std::numeric_limits<float>::infinity(), not_a_number = std::numeric_limits<float>::quiet_NaN();

/// Repeatable, the same with every standard library.
struct Random {
    uint64_t state;
    explicit Random(uint64_t seed) : state(seed * 0x9E3779B97F4A7C15u + 1) {}
    double operator()() {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return double(state >> 11) / 9007199254740992.0;
    }
    Vec direction() {
        const double z = 2 * (*this)() - 1, r = std::sqrt(1 - z * z), a = 2 * pi * (*this)();
        return {r * std::cos(a), r * std::sin(a), z};
    }
};

struct Sample {
    Vec position, normal;
};
/// Any place of a surface, evenly by area.
using Surface = std::function<Sample(Random&)>;

inline Surface sphere_of(double radius, const Vec& centre = {0, 0, 0}) {
    return [=](Random& random) {
        const Vec d = random.direction();
        return Sample{centre + radius * d, d};
    };
}
inline Surface torus_of(double major, double minor) {
    return [=](Random& random) {
        for (;;) {
            const double u = 2 * pi * random(), v = 2 * pi * random();
            if (random() * (major + minor) > major + minor * std::cos(v)) continue;
            const Vec out = {std::cos(u), std::sin(u), 0}, normal = std::cos(v) * out + Vec{0, 0, std::sin(v)};
            return Sample{major * out + minor * normal, normal};
        }
    };
}
/// The square |x|, |y| < half at height z.
inline Surface plane_of(double half, double z, double up) {
    return [=](Random& random) { return Sample{{half * (2 * random() - 1), half * (2 * random() - 1), z}, {0, 0, up}}; };
}

/// A round sheet: all that is within `half` of the disc of that radius at z = 0.
inline Surface sheet_of(double radius, double half) {
    return [=](Random& random) {
        for (;;) {
            const double a = 2 * pi * random(), r = radius + half, x = r * (2 * random() - 1), y = r * (2 * random() - 1);
            const double bend = pi * (random() - 0.5), out = radius + half * std::cos(bend);
            if (random() < 0.5) {
                if (random() * r > out * pi * half / r) continue;
                const Vec normal = {std::cos(bend) * std::cos(a), std::cos(bend) * std::sin(a), std::sin(bend)};
                return Sample{Vec{radius * std::cos(a), radius * std::sin(a), 0} + half * normal, normal};
            }
            const double up = random() < 0.5 ? 1 : -1;
            if (x * x + y * y < radius * radius) return Sample{{x, y, up * half}, {0, 0, up}};
        }
    };
}
/// Distance from it, negative inside.
inline double outside_sheet(const Vec& p, double radius, double half) {
    return std::hypot(std::max(std::hypot(p[0], p[1]) - radius, 0.0), p[2]) - half;
}

/// Places no two of which are nearer than `spacing`, until a run of misses says that the surface is full.
inline std::vector<Sample> poisson_disk(const Surface& surface, double spacing, uint64_t seed) {
    Random random(seed);
    std::map<std::array<int, 3>, std::vector<Vec>> cells;
    const auto cell_of = [&](const Vec& p) {
        return std::array<int, 3>{int(std::floor(p[0] / spacing)), int(std::floor(p[1] / spacing)), int(std::floor(p[2] / spacing))};
    };
    const auto is_free = [&](const Vec& p) {
        const auto cell = cell_of(p);
        for (int k = 0; k < 27; ++k) {
            const auto found = cells.find({cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1});
            if (found == cells.end()) continue;
            for (const Vec& q : found->second)
                if (length(p - q) < spacing) return false;
        }
        return true;
    };
    std::vector<Sample> samples;
    for (int misses = 0; misses < 1000;) {
        const Sample sample = surface(random);
        if (!is_free(sample.position)) {
            ++misses;
            continue;
        }
        misses = 0;
        cells[cell_of(sample.position)].push_back(sample.position);
        samples.push_back(sample);
    }
    return samples;
}
inline void add(Cloud& cloud, const Surface& surface, double spacing, uint64_t seed = 1) {
    for (const Sample& s : poisson_disk(surface, spacing, seed)) cloud.add(s.position, s.normal);
}

struct Value {
    float value = 0, gradient[3] = {}, velocity[3] = {};
    double steepness() const { return std::sqrt(double(gradient[0]) * gradient[0] + double(gradient[1]) * gradient[1] + double(gradient[2]) * gradient[2]); }
    /// To the surface, metres: first order.
    double distance() const { return value / std::max(steepness(), 1e-6); }
};
inline surface::Box box_of(const std::vector<Vec>& positions) {
    surface::Box box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
    for (const Vec& p : positions)
        for (int a = 0; a < 3; ++a) box.lower[a] = std::min(box.lower[a], float(p[size_t(a)])), box.upper[a] = std::max(box.upper[a], float(p[size_t(a)]));
    return box;
}
inline std::vector<uint32_t> candidates_of(const surface::Field& field, const surface::Box& box) {
    std::vector<uint32_t> candidates(field.point_count + field.drop_count);
    candidates.resize(surface::gather(field, box, candidates.data(), uint32_t(candidates.size())));
    return candidates;
}
/// With given candidates, in batches of `batch`.
inline std::vector<Value> evaluate(const surface::Field& field, const std::vector<uint32_t>& candidates, const std::vector<Vec>& positions, size_t batch) {
    std::vector<Value> values(positions.size());
    for (size_t first = 0; first < positions.size(); first += batch) {
        const size_t n = std::min(batch, positions.size() - first);
        std::vector<float> x(n), y(n), z(n), value(n), alone(n), gx(n), gy(n), gz(n), velocity(3 * n);
        for (size_t i = 0; i < n; ++i) x[i] = float(positions[first + i][0]), y[i] = float(positions[first + i][1]), z[i] = float(positions[first + i][2]);
        surface::evaluate_gradient(field, candidates.data(), uint32_t(candidates.size()), x.data(), y.data(), z.data(), uint32_t(n),
                                   value.data(), gx.data(), gy.data(), gz.data(), velocity.data());
        surface::evaluate(field, candidates.data(), uint32_t(candidates.size()), x.data(), y.data(), z.data(), uint32_t(n), alone.data());
        CHECK(std::memcmp(value.data(), alone.data(), n * sizeof(float)) == 0);  // with and without gradient alike
        for (size_t i = 0; i < n; ++i) values[first + i] = {value[i], {gx[i], gy[i], gz[i]}, {velocity[i], velocity[n + i], velocity[2 * n + i]}};
    }
    return values;
}
inline std::vector<Value> evaluate(const surface::Field& field, const std::vector<Vec>& positions) {
    std::vector<Value> values;  // in small groups, each with its own candidates
    for (size_t first = 0; first < positions.size(); first += 32) {
        const std::vector<Vec> some(positions.begin() + long(first), positions.begin() + long(std::min(first + 32, positions.size())));
        for (const Value& v : evaluate(field, candidates_of(field, box_of(some)), some, 32)) values.push_back(v);
    }
    return values;
}
inline Value evaluate(const surface::Field& field, const Vec& position) { return evaluate(field, std::vector<Vec>{position}).front(); }

struct Fit {
    double rms = 0, worst = 0, degrees = 0;  ///< distances, metres; worst angle of the normal
    int bare = 0;                            ///< places with a sign alone: too far from all points
};
/// At places of the surface, `count` of them.
inline Fit fit_of(const surface::Field& field, const Surface& surface, int count, uint64_t seed = 99) {
    Random random(seed);
    std::vector<Sample> samples;
    std::vector<Vec> positions;
    for (int i = 0; i < count; ++i) samples.push_back(surface(random)), positions.push_back(samples.back().position);
    const std::vector<Value> values = evaluate(field, positions);
    Fit fit;
    for (size_t i = 0; i < values.size(); ++i) {
        const Value& v = values[i];
        if (v.steepness() == 0) {
            ++fit.bare;
            continue;
        }
        const double distance = std::fabs(v.distance()), cosine = dot({v.gradient[0], v.gradient[1], v.gradient[2]}, samples[i].normal) / v.steepness();
        fit.rms += distance * distance / count, fit.worst = std::max(fit.worst, distance);
        fit.degrees = std::max(fit.degrees, std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / pi);
    }
    fit.rms = std::sqrt(fit.rms);
    CHECK(fit.bare < count / 50);
    return fit;
}

inline bool same_bits(const std::vector<Value>& a, const std::vector<Value>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

}  // namespace field_test
