// SPDX-License-Identifier: MIT
// Evaluating the field: positions in batches, each with the few patches that reach it, through the kernels.
#include <algorithm>
#include <cmath>

#include "format/bits.h"
#include "surface/field.h"
#include "surface/field_kernels.h"
#include "surface/field_rules.h"

namespace rill::surface {
namespace {

/// What results go to; null: not wanted.
struct Results {
    float *value, *gx, *gy, *gz, *vx, *vy, *vz;
};

/// Where the blend alone does not decide: asks the winding number, and overrules where that is sure.
void settle(const Field& f, const Batch& b, uint32_t l, uint32_t i, const Results& out) {
    float distance2;
    const float winding = f.kernels->winding(f, b.x[l], b.y[l], b.z[l], distance2);
    // Between wide patches the discs are too coarse to ask: then the blend stands, if there is one.
    const bool far = b.u2[l] > core;
    const float doubt = far ? likely : sure, distance = std::sqrt(distance2);
    const bool certain = winding < doubt || winding > 1 - doubt, inside = winding > 0.5f;
    const bool unknown = out.value[i] >= unsupported;
    if (!unknown && !(certain && (far || inside != (out.value[i] < 0)))) return;
    out.value[i] = inside ? -std::min(distance, f.spacing) : distance < f.largest_support ? distance : unsupported;
    for (float* row : {out.gx, out.gy, out.gz, out.vx, out.vy, out.vz})
        if (row) row[i] = 0;
}

/// Where ellipsoid d says more than what stands there: a bubble takes liquid away, a drop adds it.
void add_drop(const Field& f, uint32_t d, const float* x, const float* y, const float* z, uint32_t n, const Results& out) {
    const float xx = f.inverse[0][d], yy = f.inverse[1][d], zz = f.inverse[2][d], xy = f.inverse[3][d],
                xz = f.inverse[4][d], yz = f.inverse[5][d];
    const bool bubble = f.radius[d] < 0;
    for (uint32_t i = 0; i < n; ++i) {
        const float rx = x[i] - f.dx[d], ry = y[i] - f.dy[d], rz = z[i] - f.dz[d];
        // gather() knows no drop beyond its reach: the box asked for must not matter.
        if (rx * rx + ry * ry + rz * rz >= f.reach[d] * f.reach[d]) continue;
        const float ex = xx * rx + xy * ry + xz * rz, ey = xy * rx + yy * ry + yz * rz, ez = xz * rx + yz * ry + zz * rz;
        const float length = std::sqrt(ex * ex + ey * ey + ez * ez);
        const float g = (length - 1) * f.radius[d];
        if (bubble ? g <= out.value[i] : g >= out.value[i]) continue;
        out.value[i] = g;
        if (!out.gx) continue;
        const float k = f.radius[d] / std::max(length, 1e-6f);
        out.gx[i] = k * (xx * ex + xy * ey + xz * ez);
        out.gy[i] = k * (xy * ex + yy * ey + yz * ez);
        out.gz[i] = k * (xz * ex + yz * ey + zz * ez);
        if (out.vx) out.vx[i] = f.dvx[d], out.vy[i] = f.dvy[d], out.vz[i] = f.dvz[d];
    }
}

/// Bubbles before drops: a drop may fly inside a bubble.
void add_drops(const Field& f, const uint32_t* candidates, uint32_t count, const float* x, const float* y,
               const float* z, uint32_t n, const Results& out) {
    for (const bool bubbles : {true, false})
        for (uint32_t c = 0; c < count; ++c) {
            const uint32_t d = candidates[c] - f.point_count;
            if ((f.radius[d] < 0) == bubbles) add_drop(f, d, x, y, z, n, out);
        }
}

/// Edges between walls are cut off, by a plane that is as steep to either.
void cut_at_bevels(const Container& container, const float* const position[3], uint32_t n, const Results& out) {
    float* const gradient[3] = {out.gx, out.gy, out.gz};
    for_bevels(container, [&](const Bevel& bevel) {
        const float *x = position[bevel.axis[0]], *y = position[bevel.axis[1]];
        for (uint32_t i = 0; i < n && out.gx; ++i) {
            if (!(bevel.value(x[i], y[i]) > out.value[i])) continue;
            for (int a = 0; a < 3; ++a) gradient[a][i] = 0;
            for (int k = 0; k < 2; ++k) gradient[bevel.axis[k]][i] = bevel.outward[k];
        }
        for (uint32_t i = 0; i < n; ++i) out.value[i] = std::max(out.value[i], bevel.value(x[i], y[i]));
    });
}

/// Beyond a wall there is air, and along it the liquid ends: the intersection with the container.
void cut_at_walls(const Field& f, const float* const position[3], uint32_t n, const Results& out) {
    float* const gradient[3] = {out.gx, out.gy, out.gz};
    for (int a = 0; a < 3; ++a)
        for (const bool upper : {false, true}) {
            const float wall = upper ? f.container.upper[a] : f.container.lower[a], outward = upper ? 1.f : -1.f;
            if (std::fabs(wall) >= unsupported) continue;
            for (uint32_t i = 0; i < n && out.gx; ++i)
                if (outward * (position[a][i] - wall) > out.value[i])
                    for (int b = 0; b < 3; ++b) gradient[b][i] = b == a ? outward : 0;
            for (uint32_t i = 0; i < n; ++i) out.value[i] = std::max(out.value[i], outward * (position[a][i] - wall));
        }
    cut_at_bevels(f.container, position, n, out);
}

/// The first position fills unused lanes: no branch in the kernels.
void load(float* to, const float* from, uint32_t n) {
    if (n == lanes) {
        std::copy(from, from + lanes, to);
        return;
    }
    std::fill(std::copy(from, from + n, to), to + lanes, from[0]);
}

struct Evaluation {
    const Field& f;
    const uint32_t* candidates;
    uint32_t candidate_count;
    float trusted_value;  ///< up to this, values are not doubted
    const Results& out;
    Batch batch;
    uint32_t list[most_listed + listing_block];

    Evaluation(const Field& field, const uint32_t* all, uint32_t count, float trusted, const Results& results)
        : f(field), candidates(all), candidate_count(count), trusted_value(trusted), out(results) {}

    /// n ≤ lanes positions; results go to index `first` on.
    void run(const float* x, const float* y, const float* z, uint32_t n, uint32_t first) {
        load(batch.x, x, n), load(batch.y, y, n), load(batch.z, z, n);
        uint32_t listed = 0, doubts = ~0u;
        if (candidate_count)
            doubts = f.kernels->blend(f, candidates, candidate_count, list, listed, trusted_value, batch);
        else
            for (uint32_t l = 0; l < lanes; ++l) batch.value[l] = batch.u2[l] = unsupported;
        if (listed > most_listed && n > 1) {
            // A crowd: one by one, so that what each leaves out depends on itself alone.
            for (uint32_t l = 0; l < n; ++l) run(x + l, y + l, z + l, 1, first + l);
            return;
        }
        std::copy(batch.value, batch.value + n, out.value + first);
        if (out.gx) write_slopes(std::min(listed, most_listed), n, first);
        if (f.point_count) for_bits(doubts & ((1u << n) - 1), [&](uint32_t l) { settle(f, batch, l, first + l, out); });
    }
    void write_slopes(uint32_t count, uint32_t n, uint32_t first) {
        Slopes mean;
        f.kernels->slope(f, list, count, batch, out.vx != nullptr, mean);
        const float* from[6] = {mean.gx, mean.gy, mean.gz, mean.vx, mean.vy, mean.vz};
        float* const to[6] = {out.gx, out.gy, out.gz, out.vx, out.vy, out.vz};
        for (int k = 0; k < (out.vx ? 6 : 3); ++k) std::copy(from[k], from[k] + n, to[k] + first);
    }
};

void evaluate_all(const Field& f, const uint32_t* candidates, uint32_t count, const float* x, const float* y,
                  const float* z, uint32_t n, float trusted_value, const Results& out) {
    const uint32_t points = uint32_t(std::lower_bound(candidates, candidates + count, f.point_count) - candidates);
    Evaluation evaluation(f, candidates, points, trusted_value, out);
    for (uint32_t first = 0; first < n; first += lanes)
        evaluation.run(x + first, y + first, z + first, std::min(lanes, n - first), first);
    add_drops(f, candidates + points, count - points, x, y, z, n, out);
    const float* const position[3] = {x, y, z};
    cut_at_walls(f, position, n, out);
}

bool touches_drops(const Field& f, uint32_t bundle, const Box& box) {
    bool apart = false;
    for (int a = 0; a < 3; ++a) apart |= box.upper[a] < f.drops_lower[a][bundle] || box.lower[a] > f.drops_upper[a][bundle];
    return !apart;
}

bool is_reached(const Field& f, uint32_t drop, const Box& box) {
    const float p[3] = {f.dx[drop], f.dy[drop], f.dz[drop]};
    float d2 = 0;
    for (int a = 0; a < 3; ++a) {
        const float r = std::max({box.lower[a] - p[a], p[a] - box.upper[a], 0.f});
        d2 += r * r;
    }
    return d2 < f.reach[drop] * f.reach[drop];
}

}  // namespace

uint32_t gather(const Field& f, const Box& box, uint32_t* out, uint32_t capacity) noexcept {
    uint32_t found = f.kernels->gather(f, box.lower, box.upper, out, capacity);
    for (uint32_t first = 0; first < f.drop_count; first += lanes) {
        if (!touches_drops(f, first / lanes, box)) continue;
        for (uint32_t d = first; d < std::min(first + lanes, f.drop_count); ++d) {
            if (!is_reached(f, d, box)) continue;
            if (found < capacity) out[found] = f.point_count + d;
            ++found;
        }
    }
    return found;
}

void evaluate(const Field& f, const uint32_t* candidates, uint32_t candidate_count, const float* x, const float* y,
              const float* z, uint32_t n, float* value) noexcept {
    evaluate_all(f, candidates, candidate_count, x, y, z, n, -1, {value, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr});
}

void evaluate_gradient(const Field& f, const uint32_t* candidates, uint32_t candidate_count, const float* x,
                       const float* y, const float* z, uint32_t n, float* value, float* gx, float* gy, float* gz,
                       float* velocity) noexcept {
    float *vx = velocity, *vy = velocity ? velocity + n : nullptr, *vz = velocity ? velocity + 2 * n : nullptr;
    evaluate_all(f, candidates, candidate_count, x, y, z, n, -1, {value, gx, gy, gz, vx, vy, vz});
}

void evaluate_at_surface(const Field& f, const uint32_t* candidates, uint32_t candidate_count, const float* x,
                         const float* y, const float* z, uint32_t n, float* value, float* gx, float* gy, float* gz,
                         float* velocity, float distance) noexcept {
    float *vx = velocity, *vy = velocity ? velocity + n : nullptr, *vz = velocity ? velocity + 2 * n : nullptr;
    evaluate_all(f, candidates, candidate_count, x, y, z, n, distance, {value, gx, gy, gz, vx, vy, vz});
}

}  // namespace rill::surface
