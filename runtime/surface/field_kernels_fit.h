// SPDX-License-Identifier: MIT
// Supports and local quadratics of sixteen points at a time. Departures from the paper, each measured on real liquids:
//   rows      weighted by distance, only neighbours that face the same way
//   support   follows the local spacing (distance to the 6th neighbour of the same side)
//   curvature clamped, so that a degenerate neighbourhood gives a flat patch and never a spike; at 1.8 / R
//             (at .45, .9 and 1.3 honest fillets and drops cost 8, 2 and 1 % more bytes at equal error; 2.6 +1 %)
//
// Tried for the search: first the bundles that touch one's own, then the rest: a quarter slower than those beside it in the
// order; who is wanted asked of sixteen points side by side, rows of floats instead of words: the same. Not tried: lists of neighbours that last a window. By profile the search is 2 to 4 % of a frame, and 11 % with cells
// four times as large.
#pragma once
#include <cmath>

#include "surface/field_kernels_search.h"
#include "surface/field_rules.h"

namespace rill::surface::inner {

constexpr float same_side = 0.3f;      // least n·n of a row
constexpr float farthest = 8;          // neighbour, in spacings
constexpr float most_alone = 1.8f;     // support relative to that of the points of either side
constexpr float most_apart = 2.2f;     // likewise to the distance of the 2nd nearest point: two or three points of a bubble
                                       // or a tip must not reach farther than it is wide. (At 4.5 such patches reach nine
                                       // edges into solid liquid, and it takes 2.8 % more bytes at equal p99; 1.8 −1.4 %, but
                                       // then a smooth surface of few points stays a quarter above its target.)
constexpr float most_area = 0.3f;      // of the squared distance to the 6th neighbour of either side, over π

/// Squared distance and place in the list of who was offered in one word, as in find_reached(): inserting one into a row
/// takes a third of what distance and name apart take. What the place takes away is 6e-5 of the distance either way.
constexpr int32_t most_offered = 1024, offered_bits = most_offered - 1, offer_bits = no_word & ~offered_bits;
RILL_INLINE float distance2_of(int32_t word) { return float_of((word & offer_bits) | most_offered / 2); }

/// Inserts a key into so many ascending rows of a lane; the last drops out. (Written out, for a loop in a loop over the lanes
/// would not become vectors, and lanes in a loop over rows compilers take one by one.)
template <uint32_t rows, typename Key>
RILL_INLINE void insert(Key (*row)[lanes], uint32_t l, Key own) {
    const Key here = row[0][l];
    row[0][l] = own < here ? own : here;
    if constexpr (rows > 1) insert<rows - 1>(row + 1, l, own > here ? own : here);
}

/// The sixteen points of a bundle in search of their neighbours.
struct Search {
    const Field& f;
    const float *x, *y, *z, *nx, *ny, *nz;
    uint32_t first;
    float beyond, reach;  ///< no neighbour is farther: squared; than the last
    uint32_t offered = 0;
    alignas(64) int32_t same[most_neighbours][lanes];
    alignas(64) float any[support_neighbour][lanes];
    uint32_t name[most_offered];

    RILL_INLINE Search(const Field& field, uint32_t bundle)
        : f(field), first(lanes * bundle), beyond(farthest * farthest * f.spacing * f.spacing), reach(farthest * f.spacing) {
        x = f.x + first, y = f.y + first, z = f.z + first, nx = f.nx + first, ny = f.ny + first, nz = f.nz + first;
        for (uint32_t l = 0; l < lanes; ++l) {
            for (auto& row : any) row[l] = beyond;
            for (auto& row : same) row[l] = none();
        }
    }
    RILL_INLINE int32_t none() const { return int32_t(bits_of(beyond)) & offer_bits; }
    /// Of one neighbour of one of the points: squared distance, and the word if it faces the same way. The less active, the farther off: a
    /// place in the list is not left at once, for another to come in. (p99 of what changes at once when points of pour_sphere are gone: .018
    /// edges instead of .24; with 1 / activity² .012, but then they are gone so soon that a third more of the surface jumps.)
    RILL_INLINE float distance2(uint32_t j, uint32_t l) const {
        const float rx = f.x[j] - x[l], ry = f.y[j] - y[l], rz = f.z[j] - z[l], d2 = (rx * rx + ry * ry + rz * rz) * f.farther[j];
        return d2 + (first + l == j ? beyond : 0.f);  // of a sum to choose from Clang would make a branch
    }
    RILL_INLINE int32_t key_of(uint32_t j, uint32_t l, float d2) const {
        const float agree = f.nx[j] * nx[l] + f.ny[j] * ny[l] + f.nz[j] * nz[l];
        const int32_t apart = agree >= same_side ? 0 : -1;
        return ((int32_t(bits_of(d2)) & offer_bits) | int32_t(offered) | apart) & no_word;
    }
    /// Whether it is nearer to any of the points than the last that is known.
    RILL_INLINE bool is_wanted(uint32_t j) const {
        // Its sign: none of these is negative, and positive floats compare as their bits do. (Of conditions Clang makes no vectors here:
        // scalar, the search took a sixth of a frame.)
        int32_t wanted = 0;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float d2 = distance2(j, l);
            wanted |= key_of(j, l, d2) - same[most_neighbours - 1][l];
            wanted |= int32_t(bits_of(d2)) - int32_t(bits_of(any[support_neighbour - 1][l]));
        }
        return wanted < 0;
    }
    RILL_INLINE void take(uint32_t j) {
        // A crowd of which a thousand were nearer than any before them: who comes later is not heard.
        if (offered == uint32_t(most_offered)) return;
        alignas(64) float d2[lanes];
        for (uint32_t l = 0; l < lanes; ++l) d2[l] = distance2(j, l);
        for (uint32_t l = 0; l < lanes; ++l) insert<most_neighbours>(same, l, key_of(j, l, d2[l]));
        for (uint32_t l = 0; l < lanes; ++l) insert<support_neighbour>(any, l, d2[l]);
        name[offered++] = j;
    }
    /// Those of sixteen points that lie near enough to the bundle's box.
    RILL_INLINE void offer_all(uint32_t from, const float lower[3], const float upper[3]) {
        alignas(64) uint32_t bit[lanes];
        const float *px = f.x + from, *py = f.y + from, *pz = f.z + from;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float dx = greater(greater(lower[0] - px[l], px[l] - upper[0]), 0);
            const float dy = greater(greater(lower[1] - py[l], py[l] - upper[1]), 0);
            const float dz = greater(greater(lower[2] - pz[l], pz[l] - upper[2]), 0);
            bit[l] = dx * dx + dy * dy + dz * dz <= reach * reach ? bit_of_lane[l] : 0u;
        }
        // First all are asked, then those wanted are taken: taking one costs less than a branch for each that goes astray.
        uint32_t wanted = 0;
        for (uint32_t some = word_of(bit); some; some &= some - 1)
            wanted |= uint32_t(is_wanted(from + lowest_bit(some))) << lowest_bit(some);
        for (; wanted; wanted &= wanted - 1) take(from + lowest_bit(wanted));
        alignas(64) float last2[lanes];
        for (uint32_t l = 0; l < lanes; ++l) last2[l] = x[l] < nowhere ? float_of(same[most_neighbours - 1][l] | offered_bits) : 0.f;
        reach = std::sqrt(greatest_of(last2));
    }
};

RILL_INLINE void find_neighbours(const Field& f, uint32_t bundle, Nearest& found) {
    const uint32_t first = lanes * bundle;
    Search search(f, bundle);
    float lower[3] = {1e30f, 1e30f, 1e30f}, upper[3] = {-1e30f, -1e30f, -1e30f};
    for (uint32_t i = first; i < first + lanes && i < f.point_count; ++i) {
        lower[0] = lesser(lower[0], f.x[i]), lower[1] = lesser(lower[1], f.y[i]), lower[2] = lesser(lower[2], f.z[i]);
        upper[0] = greater(upper[0], f.x[i]), upper[1] = greater(upper[1], f.y[i]), upper[2] = greater(upper[2], f.z[i]);
    }
    // The bundles beside it are near ones, mostly: with them the reach is down to little more than it takes. (With two either
    // way a twentieth slower, with six a tenth.)
    constexpr uint32_t beside = 4;
    const uint32_t from = bundle > beside ? bundle - beside : 0, to = bundle + beside < f.bundles.count ? bundle + beside : f.bundles.count - 1;
    search.offer_all(first, lower, upper);
    for (uint32_t b = from; b <= to; ++b)
        if (b != bundle) search.offer_all(lanes * b, lower, upper);
    float low[3], high[3];
    for (int a = 0; a < 3; ++a) low[a] = lower[a] - search.reach, high[a] = upper[a] + search.reach;
    for_touching(f, low, high, [&](const uint32_t* bundles, uint32_t count) RILL_INLINED {
        for (uint32_t k = 0; k < count; ++k)
            if (bundles[k] < from || bundles[k] > to) search.offer_all(lanes * bundles[k], lower, upper);
    });
    found.beyond = search.beyond;
    for (uint32_t k = 0; k < most_neighbours; ++k)
        for (uint32_t l = 0; l < lanes; ++l) {
            const int32_t word = search.same[k][l];
            found.d2[k][l] = word < search.none() ? distance2_of(word) : search.beyond;
            found.id[k][l] = word < search.none() ? search.name[word & offered_bits] : first + l;
        }
    for (uint32_t k = 0; k < support_neighbour; ++k)
        for (uint32_t l = 0; l < lanes; ++l) found.any[k][l] = search.any[k][l];
}

/// Distance within which `support_neighbour` neighbours' worth of activity lies; interpolated, so that it moves smoothly
/// while a point fades.
RILL_INLINE void find_spacing(const Field& f, const Nearest& near, float* spacing) {
    alignas(64) float sum[lanes] = {}, before[lanes] = {}, reached[lanes] = {};
    for (uint32_t k = 0; k < most_neighbours; ++k)
        for (uint32_t l = 0; l < lanes; ++l) {
            const bool there = near.d2[k][l] < near.beyond;
            const float distance = there ? std::sqrt(near.d2[k][l]) : before[l];
            const float more = there ? f.activity[near.id[k][l]] : 0.f, some = more > 0 ? more : 1.f;
            const bool now = (reached[l] == 0) & (sum[l] + more >= support_neighbour);
            const float between = before[l] + (distance - before[l]) * (support_neighbour - sum[l]) / some;
            spacing[l] = now ? between : spacing[l];
            reached[l] = now ? 1.f : reached[l];
            sum[l] += more, before[l] = distance;
        }
    for (uint32_t l = 0; l < lanes; ++l)
        spacing[l] = reached[l] > 0 ? spacing[l] : before[l] * 1.2f;  // fewer than six: a little patch of its own
}

/// The normal equations of a tangential quadratic, and their minimal-norm (ridge) solution.
struct Equations {
    alignas(64) float m[6][lanes] = {}, rhs[3][lanes] = {};

    RILL_INLINE void add(uint32_t l, float w, float t1, float t2, float h) {
        const float aa = t1 * t1, ab = t1 * t2, bb = t2 * t2;
        m[0][l] += w * aa * aa, m[1][l] += w * aa * ab, m[2][l] += w * aa * bb;
        m[3][l] += w * ab * ab, m[4][l] += w * ab * bb, m[5][l] += w * bb * bb;
        rhs[0][l] -= w * aa * h, rhs[1][l] -= w * ab * h, rhs[2][l] -= w * bb * h;
    }
    /// In units of 1 / `scale`; 0 without a solution.
    RILL_INLINE void solve(const float* scale, float (&out)[3][lanes]) const {
        for (uint32_t l = 0; l < lanes; ++l) {
            const float trace = m[0][l] + m[3][l] + m[5][l], k = ridge * trace;
            const double a = m[0][l] + k, b = m[1][l], c = m[2][l], d = m[3][l] + k, e = m[4][l], g = m[5][l] + k;
            const double i0 = d * g - e * e, i1 = c * e - b * g, i2 = b * e - c * d;
            const double determinant = a * i0 + b * i1 + c * i2;
            const bool sound = (trace > 0) & (determinant > 0);
            const double turn = sound ? 1 / determinant : 0, r0 = rhs[0][l], r1 = rhs[1][l], r2 = rhs[2][l];
            out[0][l] = float((i0 * r0 + i1 * r1 + i2 * r2) * turn) * scale[l];
            out[1][l] = float((i1 * r0 + (a * g - c * c) * r1 + (b * c - a * e) * r2) * turn) * scale[l];
            out[2][l] = float((i2 * r0 + (b * c - a * e) * r1 + (a * d - b * b) * r2) * turn) * scale[l];
        }
    }
};

/// Supports, areas and patches of points [from, to), all of one bundle.
RILL_INLINE void fit(Field& f, uint32_t from, uint32_t to, const Nearest& near) {
    const uint32_t first = from / lanes * lanes;
    alignas(64) float spacing[lanes] = {}, last2[lanes] = {}, count[lanes] = {};
    alignas(64) float support[lanes], area[lanes], scale[lanes], inverse_reach[lanes];
    alignas(64) float s[3][lanes], t[3][lanes], quadratic[3][lanes];
    find_spacing(f, near, spacing);
    for (uint32_t k = 0; k < most_neighbours; ++k)
        for (uint32_t l = 0; l < lanes; ++l) {
            const bool there = near.d2[k][l] < near.beyond;
            count[l] += there ? 1.f : 0.f, last2[l] = there ? near.d2[k][l] : last2[l];
        }
    const float least = 1e-4f * f.spacing;
    for (uint32_t l = 0; l < lanes; ++l) {
        const float around2 = near.any[support_neighbour - 1][l], beside2 = near.any[1][l], active = f.activity[first + l];
        // A lone point of its side must not reach across its whole surroundings, and a droplet of a few points must not
        // take its measure from the next droplet.
        const float alone = around2 < near.beyond ? most_alone * std::sqrt(around2) : unsupported;
        const float apart = beside2 < near.beyond ? most_apart * std::sqrt(beside2) : unsupported;
        spacing[l] = lesser(spacing[l], lesser(alone, apart));
        // A point that fades draws in, or what it alone covers would stay to the last and then be gone at once.
        support[l] = (spacing[l] > least ? support_scale * spacing[l] : f.spacing) * active;
        // k neighbours within d: on a surface one point in π d² / (k + ½). Far more even than a rule on the 6th; but the
        // neighbours of a droplet's points are other droplets'.
        const float even = count[l] >= support_neighbour ? last2[l] / (count[l] + 0.5f) : 0.15f * spacing[l] * spacing[l];
        area[l] = 0.25f * lesser(even, around2 < near.beyond ? most_area * around2 : unsupported) * active;
        const bool some = (count[l] >= 1) & (spacing[l] > least);
        scale[l] = some ? 1 / spacing[l] : 0.f;
        inverse_reach[l] = some ? 1 / (fit_reach * std::sqrt(last2[l])) : 0.f;
        // Any two unit tangents (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
        const float nx = f.nx[first + l], ny = f.ny[first + l], nz = f.nz[first + l];
        const float sign = nz >= 0 ? 1.f : -1.f, a = -1 / (sign + nz), b = nx * ny * a;
        s[0][l] = 1 + sign * nx * nx * a, s[1][l] = sign * b, s[2][l] = -sign * nx;
        t[0][l] = b, t[1][l] = sign + ny * ny * a, t[2][l] = -ny;
    }
    Equations equations;
    for (uint32_t k = 0; k < most_neighbours; ++k)
        for (uint32_t l = 0; l < lanes; ++l) {
            const uint32_t i = first + l, j = near.id[k][l];
            const float rx = (f.x[j] - f.x[i]) * scale[l], ry = (f.y[j] - f.y[i]) * scale[l], rz = (f.z[j] - f.z[i]) * scale[l];
            const float u = std::sqrt(near.d2[k][l]) * inverse_reach[l], v = 1 - u;
            const float wendland = f.activity[j] * (v * v) * (v * v) * (4 * u + 1);  // C2
            const float w = near.d2[k][l] < near.beyond ? wendland : 0.f;
            equations.add(l, w, rx * s[0][l] + ry * s[1][l] + rz * s[2][l], rx * t[0][l] + ry * t[1][l] + rz * t[2][l],
                          rx * f.nx[i] + ry * f.ny[i] + rz * f.nz[i]);
        }
    equations.solve(scale, quadratic);  // from spacings to metres
    for (uint32_t l = 0; l < lanes; ++l) {
        // Largest |eigenvalue| of [a b/2; b/2 c].
        const float a = quadratic[0][l], b = quadratic[1][l], c = quadratic[2][l];
        const float middle = 0.5f * (a + c), half = 0.5f * (a - c);
        const float bend = (std::fabs(middle) + std::sqrt(half * half + 0.25f * b * b)) * support[l];
        const float less = bend > most_bend ? most_bend / bend : 1.f;
        quadratic[0][l] = a * less, quadratic[1][l] = b * less, quadratic[2][l] = c * less;
    }
    for (uint32_t i = from; i < to; ++i) {
        const uint32_t l = i - first;
        const float a = quadratic[0][l], b = quadratic[1][l], c = quadratic[2][l], steep = 1 / (support[l] * support[l]);
        const float s0 = s[0][l], s1 = s[1][l], s2 = s[2][l], t0 = t[0][l], t1 = t[1][l], t2 = t[2][l];
        f.support[i] = support[l], f.area[i] = area[l], f.steep[i] = steep;
        f.patches[i] = {f.x[i], f.y[i], f.z[i], f.nx[i], f.ny[i], f.nz[i],
                        a * s0 * s0 + b * s0 * t0 + c * t0 * t0, a * s1 * s1 + b * s1 * t1 + c * t1 * t1,
                        a * s2 * s2 + b * s2 * t2 + c * t2 * t2, 2 * a * s0 * s1 + b * (s0 * t1 + s1 * t0) + 2 * c * t0 * t1,
                        2 * a * s0 * s2 + b * (s0 * t2 + s2 * t0) + 2 * c * t0 * t2,
                        2 * a * s1 * s2 + b * (s1 * t2 + s2 * t1) + 2 * c * t1 * t2,
                        steep, f.activity[i], 1 / f.activity[i], area[l]};
    }
}

}  // namespace rill::surface::inner
