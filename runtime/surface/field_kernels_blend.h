// SPDX-License-Identifier: MIT
// The blend at sixteen positions, and its slopes; the rules are those of field_rules.h.
#pragma once
#include <cmath>

#include "format/bits.h"
#include "surface/field.h"
#include "surface/field_kernels_search.h"
#include "surface/field_rules.h"

namespace rill::surface::inner {

/// 1: a patch that faces the same way as the nearest; 0: opposed to it.
template <bool fused>
RILL_INLINE float gate_of(float agree) {
    return within_one(madd<fused>(agree, gate_scale, -opposed * gate_scale));
}

/// (1 − u²)³ / u²: needs no root, and on real liquids its normals are 2 % nearer to the source's than (1 − u)² / u².
template <bool fused>
RILL_INLINE float weight_of(float u2, float activity) {
    const float c = greater(1 - u2, 0);
    return activity * (c * c * c) * inverse_of<fused>(u2 + soften);
}
/// Of slopes: the same, softer, and half its derivative by u².
struct SlopeWeight {
    float weight, half_slope;
};
template <bool fused>
RILL_INLINE SlopeWeight slope_weight_of(float u2, float activity) {
    const float c = greater(1 - u2, 0), s = inverse_of<fused>(u2 + soften_slopes), share = activity * (c * c) * s;
    return {share * c, -0.5f * share * madd<fused>(c, s, 3)};
}
RILL_INLINE float weight_b_of(float u2, float w, float agree) {
    const float apart = agree < opposed ? w : 0.f;
    return u2 < opposed_reach ? apart : 0.f;
}

// Tried: u² and heights of find_nearest() kept for the blend (no faster, computing them again costs as much as loading them);
// eight positions at a time (a sixth fewer patches for each, yet the blend takes 20 % longer); a path without clusters where
// all normals of a list agree (a third to a half of the lists of two splashes, an eighth of the third's: 5, 3 and 1 % of a frame);
// candidates narrowed to the box of the sixteen positions first (of 48 a tile 26 are left, 20 have weight; kept in rows of sixteen for that,
// candidates narrowed to the box of the sixteen positions first, by rows of places and normals (of 51 and 35 a tile 21 and 17 have weight;
// 2 and 4 % of a frame slower, .5 and 1 % with AVX2);
// sums of eight positions after the other eight, so that they stay in registers (2 % slower; with AVX2 and SSE, whose sixteen registers do not hold
// those of sixteen, 1 to 3 %; on an AMD Zen 1 2 % faster, and with a list of their own for either eight 3 %).

/// Squared distance and place in a block of a list in one word: the greatest is that of the nearest, and the first of
/// equals. What the place takes away is less than 1e-5 of the distance. (In three words: frames 5 to 8 % slower.)
// Signed, for most machines compare no other words.
constexpr int32_t place_bits = listing_block - 1, distance_bits = no_word & ~place_bits;
struct Places {
    uint32_t bit[listing_block];
    int32_t from_last[listing_block];
};
constexpr Places all_places() {
    Places places{};
    for (int32_t c = 0; c <= place_bits; ++c) places.bit[c] = 1u << c, places.from_last[c] = place_bits - c;
    return places;
}
constexpr Places places = all_places();  // to be read, for many instructions take from memory what else had to be spread over lanes first

/// What a block of patches is to each position: bits of those that have weight there, the word of the nearest among them
/// (0: none), and the least u² of any.
struct alignas(64) Reached {
    uint32_t bits[lanes];
    int32_t nearest[lanes];
    float u2[lanes];
};
template <bool fused>
RILL_INLINE void find_reached(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, Reached& out) {
    alignas(64) uint32_t bits[lanes];
    alignas(64) int32_t nearest[lanes];
    alignas(64) float least[lanes];
    for (uint32_t l = 0; l < lanes; ++l) bits[l] = 0, nearest[l] = 0, least[l] = unsupported;
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        const uint32_t bit = places.bit[c];
        const int32_t from_last = places.from_last[c];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = dot<fused>(p.nx, p.ny, p.nz, rx, ry, rz), d2 = dot<fused>(rx, ry, rz, rx, ry, rz);
            const float u2 = madd<fused>(flatten * h, h, d2) * p.inverse;
            const int32_t reached = u2 < 1 ? -1 : 0, word = ((~int32_t(bits_of(d2 * p.recede)) & distance_bits) | from_last) & reached;
            bits[l] |= bit & uint32_t(reached), nearest[l] = word > nearest[l] ? word : nearest[l], least[l] = lesser(u2, least[l]);
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) out.bits[l] = bits[l], out.nearest[l] = nearest[l], out.u2[l] = least[l];
}

/// The nearest point among those with weight, of the candidates: which, its normal and its 1/R². Lists who has weight
/// anywhere, and returns how many there are; beyond `most_listed` no more than a block of them.
template <bool fused>
RILL_INLINE uint32_t find_nearest(const Field& f, const uint32_t* candidates, uint32_t count, uint32_t* list, Batch& b,
                                  int32_t* found, float* inverse) {
    Reached reached;
    alignas(64) int32_t nearest[lanes];
    alignas(64) float least[lanes];
    for (uint32_t l = 0; l < lanes; ++l) nearest[l] = 0, found[l] = 0, least[l] = unsupported;
    uint32_t listed = 0;
    for (uint32_t first = 0; first < count; first += listing_block) {
        find_reached<fused>(f, candidates + first, count - first < listing_block ? count - first : listing_block, b, reached);
        for (uint32_t l = 0; l < lanes; ++l) {
            const int32_t word = reached.nearest[l] & distance_bits, place = int32_t(first) + place_bits - (reached.nearest[l] & place_bits);
            const int32_t nearer = word > nearest[l] ? -1 : 0;
            found[l] = (place & nearer) | (found[l] & ~nearer), nearest[l] = word > nearest[l] ? word : nearest[l];
            least[l] = lesser(reached.u2[l], least[l]);
        }
        for (uint32_t some = listed > most_listed ? 0 : word_of(reached.bits); some; some &= some - 1) list[listed++] = candidates[first + lowest_bit(some)];
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        const Patch& p = f.patches[candidates[found[l]]];
        b.u2[l] = least[l], b.nx[l] = p.nx, b.ny[l] = p.ny, b.nz[l] = p.nz, inverse[l] = p.inverse;
    }
    return listed;
}

/// Which side of A the points of B lie on, where both clusters have weight: below, the liquid between them is thin, above,
/// the air is. Seldom asked: summed with the rest it would cost a tenth of the blend. `nearest`: of the candidates.
template <bool fused>
RILL_INLINE void find_side(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, const uint32_t* candidates,
                           const int32_t* nearest, float* out) {
    alignas(64) float side[lanes] = {}, height[lanes];
    for (uint32_t l = 0; l < lanes; ++l) {
        const Patch& p = f.patches[candidates[nearest[l]]];
        height[l] = dot<fused>(p.nx, p.ny, p.nz, b.x[l] - p.x, b.y[l] - p.y, b.z[l] - p.z);
    }
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = dot<fused>(p.nx, p.ny, p.nz, rx, ry, rz), d2 = dot<fused>(rx, ry, rz, rx, ry, rz);
            const float u2 = madd<fused>(flatten * h, h, d2) * p.inverse;
            const float agree = dot<fused>(p.nx, p.ny, p.nz, b.nx[l], b.ny[l], b.nz[l]);
            const float along = dot<fused>(b.nx[l], b.ny[l], b.nz[l], rx, ry, rz);
            side[l] = madd<fused>(weight_b_of(u2, weight_of<fused>(u2, p.activity), agree), height[l] - along, side[l]);
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
template <bool fused>
RILL_INLINE uint32_t find_doubts(const Opinions& of, float trusted_value, Batch& b) {
    alignas(64) float against[lanes], most[lanes];
    for (uint32_t l = 0; l < lanes; ++l) against[l] = b.value[l] < 0 ? of.all[l] - of.inside[l] : of.inside[l];
    for (uint32_t l = 0; l < lanes; ++l) most[l] = lesser(b.sign[l], b.value[l]) < 0 ? dispute : dispute_air;
    alignas(64) uint32_t doubt[lanes];
    for (uint32_t l = 0; l < lanes; ++l) {
        const float size = b.value[l] < 0 ? -b.value[l] : b.value[l], u2 = b.u2[l], all = of.all[l], sum = of.sum[l];
        const float variance = madd<fused>(of.square[l], all, -sum * sum) * of.inverse[l];  // all² times, in R²
        const float split = against[l] * variance > most[l] * (all * all * all) ? u2 : 0.f;
        const float needed = greater(greater(against[l], -b.value[l]), u2 - core) > 0 ? enough_voters : 0.f;
        const float unsure = of.voters[l] < needed ? u2 : split, asked = size > trusted_value ? unsure : 0.f;
        const float doubted = b.sign[l] == 0 ? unsupported : asked;
        b.u2[l] = b.sign[l] == 0 ? unsupported : u2, doubt[l] = doubted > trusted ? bit_of_lane[l] : 0u;
    }
    return word_of(doubt);
}

/// What the patches of a batch come to: of cluster A and B weight and weighted value, of A how many patches, and the
/// moments of find_doubts().
struct alignas(64) Sums {
    float weight_a[lanes], sum_a[lanes], voters[lanes], weight_b[lanes], sum_b[lanes];
    float all[lanes], sum[lanes], square[lanes], inside[lanes];
};
template <bool fused>
RILL_INLINE void sum_up(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, Sums& out) {
    alignas(64) float weight_a[lanes] = {}, sum_a[lanes] = {}, voters[lanes] = {}, weight_b[lanes] = {}, sum_b[lanes] = {};
    alignas(64) float all[lanes] = {}, sum[lanes] = {}, square[lanes] = {}, inside[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = dot<fused>(p.nx, p.ny, p.nz, rx, ry, rz), d2 = dot<fused>(rx, ry, rz, rx, ry, rz);
            const float u2 = madd<fused>(flatten * h, h, d2) * p.inverse, w = weight_of<fused>(u2, p.activity);
            const float bent = madd<fused>(ry, madd<fused>(p.yy, ry, p.yz * rz), madd<fused>(p.zz * rz, rz, h));
            const float g = madd<fused>(rx, dot<fused>(p.xx, p.xy, p.xz, rx, ry, rz), bent);
            const float agree = dot<fused>(p.nx, p.ny, p.nz, b.nx[l], b.ny[l], b.nz[l]), gate = gate_of<fused>(agree);
            const float wa = w * (gate * gate), wb = weight_b_of(u2, w, agree), wg = w * g;
            weight_a[l] += wa, sum_a[l] = madd<fused>(wa, g, sum_a[l]), voters[l] += wa > 0 ? 1.f : 0.f;
            weight_b[l] += wb, sum_b[l] = madd<fused>(wb, g, sum_b[l]);
            all[l] += w, sum[l] += wg, square[l] = madd<fused>(wg, g, square[l]), inside[l] += g < 0 ? w : 0.f;
        }
    }
    const float* const sums[9] = {weight_a, sum_a, voters, weight_b, sum_b, all, sum, square, inside};
    float* const to[9] = {out.weight_a, out.sum_a, out.voters, out.weight_b, out.sum_b, out.all, out.sum, out.square, out.inside};
    for (int k = 0; k < 9; ++k)
        for (uint32_t l = 0; l < lanes; ++l) to[k][l] = sums[k][l];
}

/// Of the doubts, those that the winding number may confirm: the solid angle of the patches with weight is most of what it
/// changes by across the surface, and costs a fraction of it.
template <bool fused>
RILL_INLINE uint32_t confirm_doubts(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, uint32_t doubts) {
    alignas(64) float turn[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = dot<fused>(p.nx, p.ny, p.nz, rx, ry, rz), d2 = dot<fused>(rx, ry, rz, rx, ry, rz);
            const float seen = madd<fused>(flatten * h, h, d2) * p.inverse < 1 ? p.area * h : 0.f;
            turn[l] = madd<fused>(-seen, inverse_cube_root_squared<fused>(d2 + 1e-20f), turn[l]);
        }
    }
    alignas(64) uint32_t kept[lanes];
    for (uint32_t l = 0; l < lanes; ++l) {
        // Nothing in reach turns nothing: is asked.
        const float liquid = b.u2[l] > core ? unsupported : liquid_around, air = b.u2[l] > core ? air_around_far : air_around;
        const float wrong = b.value[l] < 0 ? liquid - turn[l] : turn[l] - air;
        kept[l] = wrong > 0 ? bit_of_lane[l] : 0u;
    }
    return doubts & word_of(kept);
}

template <bool fused>
RILL_INLINE uint32_t blend(const Field& f, const uint32_t* candidates, uint32_t candidate_count, uint32_t* list, uint32_t& listed,
                           float trusted_value, Batch& b) {
    alignas(64) float inverse[lanes], side[lanes] = {};
    alignas(64) int32_t nearest[lanes];
    Sums sums;
    listed = find_nearest<fused>(f, candidates, candidate_count, list, b, nearest, inverse);
    const uint32_t count = listed < most_listed ? listed : most_listed;
    sum_up<fused>(f, list, count, b, sums);
    if (greatest_of(sums.weight_b) > 0) find_side<fused>(f, list, count, b, candidates, nearest, side);
    constexpr float least_weight = 1e-30f;
    // A condition asked twice in a loop would become a branch.
    alignas(64) float value_a[lanes], value_b[lanes], take[lanes];  // take > 0: cluster B
    for (uint32_t l = 0; l < lanes; ++l) {
        const float of_a = sums.weight_a[l], of_b = sums.weight_b[l];
        const float mean_a = sums.sum_a[l] / greater(of_a, least_weight), mean_b = sums.sum_b[l] / greater(of_b, least_weight);
        const float a = of_a > 0 ? mean_a : unsupported;
        // Thin liquid: intersection, max; thin air: union, min.
        const float gain = side[l] < 0 ? mean_b - a : a - mean_b;
        value_a[l] = a, value_b[l] = mean_b, take[l] = of_b > 0 ? gain : 0.f;
    }
    for (uint32_t l = 0; l < lanes; ++l) b.value[l] = take[l] > 0 ? value_b[l] : value_a[l];
    for (uint32_t l = 0; l < lanes; ++l) b.sign[l] = take[l] > 0 ? -1.f : sums.weight_a[l] > 0 ? 1.f : 0.f;
    const uint32_t doubts = find_doubts<fused>({sums.all, sums.sum, sums.square, sums.inside, sums.voters, inverse}, trusted_value, b);
    return doubts ? confirm_doubts<fused>(f, list, count, b, doubts) : 0;
}

/// Of the chosen cluster, over Σ w: Σ w ∇G + ripple (G − value) ∇w, and Σ w v; w are the weights of slopes.
template <bool fused>
RILL_INLINE void slope(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, bool velocity, Slopes& out) {
    alignas(64) float weight[lanes] = {}, gx[lanes] = {}, gy[lanes] = {}, gz[lanes] = {}, vx[lanes] = {}, vy[lanes] = {}, vz[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t j = list[c];
        const Patch p = f.patches[j];
        const float mx = velocity ? f.vx[j] : 0, my = velocity ? f.vy[j] : 0, mz = velocity ? f.vz[j] : 0;
        const float xx = 2 * p.xx, yy = 2 * p.yy, zz = 2 * p.zz, steep = 4 * ripple * p.inverse;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = dot<fused>(p.nx, p.ny, p.nz, rx, ry, rz), d2 = dot<fused>(rx, ry, rz, rx, ry, rz);
            const float lean = flatten * h, u2 = madd<fused>(lean, h, d2) * p.inverse;
            const float agree = dot<fused>(p.nx, p.ny, p.nz, b.nx[l], b.ny[l], b.nz[l]), gate = gate_of<fused>(agree);
            const float keep = b.sign[l] < 0 ? weight_b_of(u2, 1, agree) : gate * gate;
            const SlopeWeight of = slope_weight_of<fused>(u2, p.activity);
            const float w = keep * of.weight, slope = keep * of.half_slope * steep;
            const float hx = dot<fused>(xx, p.xy, p.xz, rx, ry, rz), hy = dot<fused>(p.xy, yy, p.yz, rx, ry, rz),
                        hz = dot<fused>(p.xz, p.yz, zz, rx, ry, rz);
            const float k = slope * madd<fused>(0.5f, dot<fused>(rx, ry, rz, hx, hy, hz), h - b.value[l]);
            weight[l] += w;
            gx[l] = madd<fused>(w, p.nx + hx, madd<fused>(k, madd<fused>(lean, p.nx, rx), gx[l]));
            gy[l] = madd<fused>(w, p.ny + hy, madd<fused>(k, madd<fused>(lean, p.ny, ry), gy[l]));
            gz[l] = madd<fused>(w, p.nz + hz, madd<fused>(k, madd<fused>(lean, p.nz, rz), gz[l]));
            vx[l] = madd<fused>(w, mx, vx[l]), vy[l] = madd<fused>(w, my, vy[l]), vz[l] = madd<fused>(w, mz, vz[l]);
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        const float share = weight[l] > 0 ? 1 / weight[l] : 0.f;
        out.gx[l] = gx[l] * share, out.gy[l] = gy[l] * share, out.gz[l] = gz[l] * share;
        out.vx[l] = vx[l] * share, out.vy[l] = vy[l] * share, out.vz[l] = vz[l] * share;
    }
}

}  // namespace rill::surface::inner
