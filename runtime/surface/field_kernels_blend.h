// SPDX-License-Identifier: MIT
// The blend at sixteen positions, and its slopes; the rules are those of field_rules.h.
#pragma once
#include <cmath>

#include "surface/bits.h"
#include "surface/field.h"
#include "surface/field_kernels_lanes.h"
#include "surface/field_rules.h"

namespace rill::surface::inner {

/// 1: a patch that faces the same way as the nearest; 0: opposed to it.
RILL_INLINE float gate_of(float agree) { return lesser(greater((agree - opposed) * gate_scale, 0), 1); }

/// (1 − u²)³ / u²: needs no root, and on real liquids its normals are 2 % nearer to the source's than (1 − u)² / u².
RILL_INLINE float weight_of(float u2, float activity) {
    const float c = greater(1 - u2, 0);
    return activity * (c * c * c) / (u2 + soften);
}
/// Half its derivative by u².
RILL_INLINE float weight_slope_of(float u2, float activity) {
    const float c = greater(1 - u2, 0), s = 1 / (u2 + soften);
    return -0.5f * activity * (c * c) * s * (3 + c * s);
}
RILL_INLINE float weight_b_of(float u2, float w, float agree) {
    const float apart = agree < opposed ? w : 0.f;
    return u2 < opposed_reach ? apart : 0.f;
}

// Tried: u² and heights of find_nearest() kept for the blend (no faster, computing them again costs as much as loading them);
// eight positions at a time (a sixth fewer patches for each, yet the blend takes 20 % longer); a path without clusters where
// all normals of a list agree (a third to a half of the lists of two splashes, an eighth of the third's: 5, 3 and 1 % of a frame).

/// Squared distance and place in a block of a list in one word: the least word is that of the nearest, and the first of
/// equals. What the place takes away is less than 1e-5 of the distance. (In three words: frames 5 to 8 % slower.)
constexpr uint32_t block = 32, place_bits = block - 1, no_word = ~0u;

/// What a block of patches is to each position: bits of those that have weight there, the word of the nearest among them,
/// and the least u² of any.
struct alignas(64) Reached {
    uint32_t bits[lanes], nearest[lanes];
    float u2[lanes];
};
RILL_INLINE void find_reached(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, Reached& out) {
    alignas(64) uint32_t bits[lanes], nearest[lanes];
    alignas(64) float least[lanes];
    for (uint32_t l = 0; l < lanes; ++l) bits[l] = 0, nearest[l] = no_word, least[l] = unsupported;
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        const uint32_t bit = 1u << c;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = p.nx * rx + p.ny * ry + p.nz * rz, d2 = rx * rx + ry * ry + rz * rz;
            const float u2 = (d2 + flatten * h * h) * p.inverse;
            const uint32_t missed = u2 < 1 ? 0u : ~0u, word = (bits_of(d2 * p.recede) & ~place_bits) | c | missed;
            bits[l] |= bit & ~missed, nearest[l] = word < nearest[l] ? word : nearest[l], least[l] = lesser(u2, least[l]);
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) out.bits[l] = bits[l], out.nearest[l] = nearest[l], out.u2[l] = least[l];
}

/// The nearest point among those with weight: its normal, the height above its plane and its 1/R². Keeps in the list who
/// has weight anywhere, a good half of it; returns how many.
RILL_INLINE uint32_t find_nearest(const Field& f, uint32_t* list, uint32_t count, Batch& b, float* height, float* inverse) {
    Reached reached;
    alignas(64) uint32_t nearest[lanes], found[lanes];
    alignas(64) float least[lanes];
    uint32_t used[most_listed / block];
    for (uint32_t l = 0; l < lanes; ++l) nearest[l] = no_word, found[l] = 0, least[l] = unsupported;
    for (uint32_t first = 0; first < count; first += block) {
        find_reached(f, list + first, count - first < block ? count - first : block, b, reached);
        for (uint32_t l = 0; l < lanes; ++l) {
            const uint32_t place = first + (reached.nearest[l] & place_bits), word = reached.nearest[l] | place_bits;
            found[l] = word < nearest[l] ? place : found[l];
            nearest[l] = word < nearest[l] ? word : nearest[l];
            least[l] = lesser(reached.u2[l], least[l]);
        }
        used[first / block] = word_of(reached.bits);
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        const Patch& p = f.patches[list[found[l]]];
        b.u2[l] = least[l], b.nx[l] = p.nx, b.ny[l] = p.ny, b.nz[l] = p.nz;
        height[l] = p.nx * (b.x[l] - p.x) + p.ny * (b.y[l] - p.y) + p.nz * (b.z[l] - p.z), inverse[l] = p.inverse;
    }
    uint32_t kept = 0;
    for (uint32_t first = 0; first < count; first += block)
        for (uint32_t some = used[first / block]; some; some &= some - 1) list[kept++] = list[first + lowest_bit(some)];
    return kept;
}

/// Which side of A the points of B lie on, where both clusters have weight: below, the liquid between them is thin, above,
/// the air is. Seldom asked: summed with the rest it would cost a tenth of the blend.
RILL_INLINE void find_side(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, const float* height,
                           float* out) {
    alignas(64) float side[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = p.nx * rx + p.ny * ry + p.nz * rz, d2 = rx * rx + ry * ry + rz * rz;
            const float u2 = (d2 + flatten * h * h) * p.inverse;
            const float agree = p.nx * b.nx[l] + p.ny * b.ny[l] + p.nz * b.nz[l];
            const float along = b.nx[l] * rx + b.ny[l] * ry + b.nz[l] * rz;
            side[l] += weight_b_of(u2, weight_of(u2, p.activity), agree) * (height[l] - along);
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) out[l] = side[l];
}

/// What all patches with weight say, whichever way they face: weight, moments of the value, and the weight of who says
/// liquid; of cluster A how many. `inverse`: 1 / R² of the nearest.
struct Opinions {
    const float *all, *sum, *square, *inside, *voters, *inverse;
};
/// Bits of the lanes to ask the winding number for.
RILL_INLINE uint32_t find_doubts(const Opinions& of, float trusted_value, Batch& b) {
    alignas(64) float against[lanes], most[lanes];
    for (uint32_t l = 0; l < lanes; ++l) against[l] = b.value[l] < 0 ? of.all[l] - of.inside[l] : of.inside[l];
    for (uint32_t l = 0; l < lanes; ++l) most[l] = lesser(b.sign[l], b.value[l]) < 0 ? dispute : dispute_air;
    alignas(64) uint32_t doubt[lanes];
    for (uint32_t l = 0; l < lanes; ++l) {
        const float size = b.value[l] < 0 ? -b.value[l] : b.value[l], u2 = b.u2[l], all = of.all[l], sum = of.sum[l];
        const float variance = (of.square[l] * all - sum * sum) * of.inverse[l];  // all² times, in R²
        const float split = against[l] * variance > most[l] * (all * all * all) ? u2 : 0.f;
        const float unsure = of.voters[l] < enough_voters ? u2 : split, asked = size > trusted_value ? unsure : 0.f;
        const float doubted = b.sign[l] == 0 ? unsupported : asked;
        b.u2[l] = b.sign[l] == 0 ? unsupported : u2, doubt[l] = doubted > trusted ? bit_of_lane[l] : 0u;
    }
    return word_of(doubt);
}

RILL_INLINE uint32_t blend(const Field& f, uint32_t* list, uint32_t& count, float trusted_value, Batch& b) {
    alignas(64) float height[lanes], inverse[lanes], side[lanes] = {};
    alignas(64) float weight_a[lanes] = {}, sum_a[lanes] = {}, weight_b[lanes] = {}, sum_b[lanes] = {};
    alignas(64) float all[lanes] = {}, sum[lanes] = {}, square[lanes] = {}, inside[lanes] = {}, voters[lanes] = {};
    count = find_nearest(f, list, count, b, height, inverse);
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = p.nx * rx + p.ny * ry + p.nz * rz, d2 = rx * rx + ry * ry + rz * rz;
            const float u2 = (d2 + flatten * h * h) * p.inverse, w = weight_of(u2, p.activity);
            const float g = h + rx * (p.xx * rx + p.xy * ry + p.xz * rz) + ry * (p.yy * ry + p.yz * rz) + p.zz * rz * rz;
            const float agree = p.nx * b.nx[l] + p.ny * b.ny[l] + p.nz * b.nz[l], gate = gate_of(agree);
            const float wa = w * (gate * gate), wb = weight_b_of(u2, w, agree), wg = w * g;
            weight_a[l] += wa, sum_a[l] += wa * g, voters[l] += wa > 0 ? 1.f : 0.f;
            weight_b[l] += wb, sum_b[l] += wb * g;
            all[l] += w, sum[l] += wg, square[l] += wg * g, inside[l] += g < 0 ? w : 0.f;
        }
    }
    if (greatest_of(weight_b) > 0) find_side(f, list, count, b, height, side);
    constexpr float least_weight = 1e-30f;
    // A condition asked twice in a loop would become a branch.
    alignas(64) float value_a[lanes], value_b[lanes], take[lanes];  // take > 0: cluster B
    for (uint32_t l = 0; l < lanes; ++l) {
        const float mean_a = sum_a[l] / greater(weight_a[l], least_weight), mean_b = sum_b[l] / greater(weight_b[l], least_weight);
        const float a = weight_a[l] > 0 ? mean_a : unsupported;
        // Thin liquid: intersection, max; thin air: union, min.
        const float gain = side[l] < 0 ? mean_b - a : a - mean_b;
        value_a[l] = a, value_b[l] = mean_b, take[l] = weight_b[l] > 0 ? gain : 0.f;
    }
    for (uint32_t l = 0; l < lanes; ++l) b.value[l] = take[l] > 0 ? value_b[l] : value_a[l];
    for (uint32_t l = 0; l < lanes; ++l) b.weight[l] = take[l] > 0 ? weight_b[l] : weight_a[l];
    for (uint32_t l = 0; l < lanes; ++l) b.sign[l] = take[l] > 0 ? -1.f : weight_a[l] > 0 ? 1.f : 0.f;
    return find_doubts({all, sum, square, inside, voters, inverse}, trusted_value, b);
}

/// Of the chosen cluster: Σ w ∇G + ripple (G − value) ∇w, and Σ w v.
RILL_INLINE void slope(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, bool velocity, Slopes& out) {
    alignas(64) float gx[lanes] = {}, gy[lanes] = {}, gz[lanes] = {}, vx[lanes] = {}, vy[lanes] = {}, vz[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t j = list[c];
        const Patch p = f.patches[j];
        const float mx = velocity ? f.vx[j] : 0, my = velocity ? f.vy[j] : 0, mz = velocity ? f.vz[j] : 0;
        const float xx = 2 * p.xx, yy = 2 * p.yy, zz = 2 * p.zz, steep = 4 * ripple * p.inverse;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = p.nx * rx + p.ny * ry + p.nz * rz, d2 = rx * rx + ry * ry + rz * rz;
            const float lean = flatten * h, u2 = (d2 + lean * h) * p.inverse;
            const float agree = p.nx * b.nx[l] + p.ny * b.ny[l] + p.nz * b.nz[l], gate = gate_of(agree);
            const float keep = b.sign[l] < 0 ? weight_b_of(u2, 1, agree) : gate * gate;
            const float w = keep * weight_of(u2, p.activity), slope = keep * weight_slope_of(u2, p.activity) * steep;
            const float hx = xx * rx + p.xy * ry + p.xz * rz, hy = p.xy * rx + yy * ry + p.yz * rz,
                        hz = p.xz * rx + p.yz * ry + zz * rz;
            const float k = slope * (h + 0.5f * (rx * hx + ry * hy + rz * hz) - b.value[l]);
            gx[l] += w * (p.nx + hx) + k * (rx + lean * p.nx);
            gy[l] += w * (p.ny + hy) + k * (ry + lean * p.ny);
            gz[l] += w * (p.nz + hz) + k * (rz + lean * p.nz);
            vx[l] += w * mx, vy[l] += w * my, vz[l] += w * mz;
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        const float share = b.weight[l] > 0 ? 1 / b.weight[l] : 0.f;
        out.gx[l] = gx[l] * share, out.gy[l] = gy[l] * share, out.gz[l] = gz[l] * share;
        out.vx[l] = vx[l] * share, out.vy[l] = vy[l] * share, out.vz[l] = vz[l] * share;
    }
}

}  // namespace rill::surface::inner
