// SPDX-License-Identifier: MIT
// Through the bundles: which points reach a box, which lie near some of them, and the winding number of all. Sixteen are
// asked at a time, from groups to bundles to points.
#pragma once
#include "format/bits.h"
#include "surface/field.h"
#include "surface/field_kernels_lanes.h"
#include "surface/field_rules.h"

namespace rill::surface::inner {

// Level by level, all of one before any of the next: a loop over what was found in each sixteen ends where no machine foresees it, and
// what follows had to wait for that.

/// Bits of the lanes of as many sixteens.
using SixteenBits = uint32_t[lanes][lanes];
/// The numbers of the bits set, of `count` sixteens that begin at 16 × sixteens[k]; returns how many.
RILL_INLINE uint32_t list_bits(const SixteenBits& bit, const uint32_t* sixteens, uint32_t count, uint32_t* out) {
    uint32_t found = 0;
    for (uint32_t k = 0; k < count; ++k)
        for (uint32_t some = word_of(bit[k]); some; some &= some - 1) out[found++] = lanes * sixteens[k] + lowest_bit(some);
    return found;
}

/// Lists those of up to sixteen sixteens of bundles that touch the box.
RILL_INLINE uint32_t list_touching(const Bundles& b, const uint32_t* sixteens, uint32_t count, const float lower[3], const float upper[3], uint32_t* out) {
    alignas(64) SixteenBits bit;
    for (uint32_t k = 0; k < count; ++k) {
        const uint32_t first = lanes * sixteens[k];
        const float *lx = b.lower[0] + first, *ly = b.lower[1] + first, *lz = b.lower[2] + first;
        const float *ux = b.upper[0] + first, *uy = b.upper[1] + first, *uz = b.upper[2] + first;
        for (uint32_t l = 0; l < lanes; ++l) {
            const bool x = (lx[l] <= upper[0]) & (ux[l] >= lower[0]), y = (ly[l] <= upper[1]) & (uy[l] >= lower[1]);
            const bool z = (lz[l] <= upper[2]) & (uz[l] >= lower[2]);
            bit[k][l] = (x & y & z) ? bit_of_lane[l] : 0u;
        }
    }
    return list_bits(bit, sixteens, count, out);
}
/// Work(bundles, count) for the bundles that touch the box, ascending, some at a time.
template <typename Work>
RILL_INLINE void for_touching(const Field& f, const float lower[3], const float upper[3], Work&& work) {
    uint32_t groups[lanes], bundles[lanes * lanes];
    for (uint32_t sixteen = 0; lanes * sixteen < f.groups.count; ++sixteen) {
        const uint32_t count = list_touching(f.groups, &sixteen, 1, lower, upper, groups);
        work(bundles, list_touching(f.bundles, groups, count, lower, upper, bundles));
    }
}

/// The least and the largest of n·r for r in a box: one axis after the other, as dot() adds them up.
struct Interval {
    float low, high;
};
template <bool fused>
RILL_INLINE Interval reach_along(float n, float a, float b, Interval rest) {
    return {lesser(madd<fused>(n, a, rest.low), madd<fused>(n, b, rest.low)),
            greater(madd<fused>(n, a, rest.high), madd<fused>(n, b, rest.high))};
}

/// Which points of up to sixteen sixteens may have weight in the box. Interval arithmetic in the very order
/// in which the kernels compute u²: no point with weight anywhere in the box is missed, not even by rounding.
template <bool fused>
RILL_INLINE void find_reaching(const Field& f, const uint32_t* sixteens, uint32_t count, const float lower[3], const float upper[3], SixteenBits& bit) {
    for (uint32_t k = 0; k < count; ++k) {
        const uint32_t first = lanes * sixteens[k];
        const float *px = f.x + first, *py = f.y + first, *pz = f.z + first;
        const float *nx = f.nx + first, *ny = f.ny + first, *nz = f.nz + first, *inverse = f.steep + first;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float ax = lower[0] - px[l], ay = lower[1] - py[l], az = lower[2] - pz[l];
            const float bx = upper[0] - px[l], by = upper[1] - py[l], bz = upper[2] - pz[l];
            const float dx = greater(greater(ax, -bx), 0), dy = greater(greater(ay, -by), 0), dz = greater(greater(az, -bz), 0);
            const float lz = nz[l] * az, hz = nz[l] * bz;
            const Interval z{lesser(lz, hz), greater(lz, hz)}, yz = reach_along<fused>(ny[l], ay, by, z);
            const Interval height = reach_along<fused>(nx[l], ax, bx, yz);
            const float h = greater(greater(height.low, -height.high), 0);
            const float u2 = madd<fused>(flatten * h, h, dot<fused>(dx, dy, dz, dx, dy, dz)) * inverse[l];
            bit[k][l] = u2 < 1 ? bit_of_lane[l] : 0u;
        }
    }
}
template <bool fused>
RILL_INLINE uint32_t gather(const Field& f, const float lower[3], const float upper[3], uint32_t* out, uint32_t capacity) {
    uint32_t found = 0;
    for_touching(f, lower, upper, [&](const uint32_t* bundles, uint32_t count) RILL_INLINED {
        alignas(64) SixteenBits bit;
        uint32_t some[lanes * lanes];
        while (count) {
            const uint32_t now = count < lanes ? count : lanes;
            find_reaching<fused>(f, bundles, now, lower, upper, bit);
            const uint32_t listed = list_bits(bit, bundles, now, some), room = found < capacity ? capacity - found : 0;
            for (uint32_t k = 0; k < listed && k < room; ++k) out[found + k] = some[k];
            found += listed, bundles += now, count -= now;
        }
    });
    return found;
}

/// About 1 / √x³, to half a percent: a guess from the exponent and one Newton step.
template <bool fused>
RILL_INLINE float inverse_cube_root_squared(float x) {
    float y = float_of(0x5f375a86 - int32_t(bits_of(x) >> 1));
    y = y * madd<fused>(-0.5f * x * y, y, 1.5f);
    return y * y * y;
}

/// The winding number of discs at one position. Sums go on in arrays of each function's own, from call to call.
template <bool fused>
struct Winding {
    float x, y, z;
    alignas(64) float sum[lanes];
    alignas(64) int32_t nearest[lanes];  ///< squared distances by their bits: these compare as the numbers do, and are chosen without a branch

    RILL_INLINE Winding(float px, float py, float pz) : x(px), y(py), z(pz) {
        for (uint32_t l = 0; l < lanes; ++l) sum[l] = 0, nearest[l] = int32_t(bits_of(unsupported));
    }
    /// Adds the points of so many bundles.
    RILL_INLINE void add_points(const Field& f, const uint32_t* bundles, uint32_t count) {
        alignas(64) float total[lanes];
        alignas(64) int32_t least[lanes];
        for (uint32_t l = 0; l < lanes; ++l) total[l] = sum[l], least[l] = nearest[l];
        for (uint32_t k = 0; k < count; ++k) {
            const uint32_t first = lanes * bundles[k];
            const float *px = f.x + first, *py = f.y + first, *pz = f.z + first, *area = f.area + first;
            const float *nx = f.nx + first, *ny = f.ny + first, *nz = f.nz + first;
            for (uint32_t l = 0; l < lanes; ++l) {
                const float rx = px[l] - x, ry = py[l] - y, rz = pz[l] - z;
                const float d2 = madd<fused>(rx, rx, madd<fused>(ry, ry, madd<fused>(rz, rz, 1e-20f)));
                const float facing = area[l] * dot<fused>(nx[l], ny[l], nz[l], rx, ry, rz);
                const int32_t word = int32_t(bits_of(d2));
                total[l] = madd<fused>(facing, inverse_cube_root_squared<fused>(d2), total[l]);
                least[l] = word < least[l] ? word : least[l];
            }
        }
        for (uint32_t l = 0; l < lanes; ++l) sum[l] = total[l], nearest[l] = least[l];
    }
    /// Of so many sixteens of bundles adds those that are far away, and lists the others; returns how many these are.
    RILL_INLINE uint32_t add_afar(const Bundles& b, const uint32_t* sixteens, uint32_t count, uint32_t* close) {
        alignas(64) float total[lanes];
        alignas(64) int32_t least[lanes];
        alignas(64) SixteenBits near;
        for (uint32_t l = 0; l < lanes; ++l) total[l] = sum[l], least[l] = nearest[l];
        for (uint32_t k = 0; k < count; ++k) {
            const uint32_t first = lanes * sixteens[k];
            const float *cx = b.x + first, *cy = b.y + first, *cz = b.z + first, *limit = b.limit + first;
            const float *ax = b.ax + first, *ay = b.ay + first, *az = b.az + first;
            for (uint32_t l = 0; l < lanes; ++l) {
                const float rx = cx[l] - x, ry = cy[l] - y, rz = cz[l] - z;
                const float distance2 = dot<fused>(rx, ry, rz, rx, ry, rz), d2 = distance2 + 1e-20f;
                const float share = dot<fused>(ax[l], ay[l], az[l], rx, ry, rz) * inverse_cube_root_squared<fused>(d2);
                const int32_t is_near = distance2 < limit[l] ? -1 : 0, word = int32_t(bits_of(d2)) | (is_near & no_word);
                total[l] += float_of(int32_t(bits_of(share)) & ~is_near);
                least[l] = word < least[l] ? word : least[l], near[k][l] = uint32_t(is_near) & bit_of_lane[l];
            }
        }
        for (uint32_t l = 0; l < lanes; ++l) sum[l] = total[l], nearest[l] = least[l];
        return list_bits(near, sixteens, count, close);
    }
};

/// Winding number of the points as oriented discs (Barill et al. 2018): about 1 in the liquid, 0 in the air. A sum of
/// lane sums, always the same ones: the position alone decides it.
template <bool fused>
RILL_INLINE float winding(const Field& f, float x, float y, float z, float& distance2) {
    Winding<fused> w(x, y, z);
    uint32_t groups[lanes], bundles[lanes * lanes];
    for (uint32_t sixteen = 0; lanes * sixteen < f.groups.count; ++sixteen) {
        const uint32_t group_count = w.add_afar(f.groups, &sixteen, 1, groups);
        const uint32_t bundle_count = w.add_afar(f.bundles, groups, group_count, bundles);
        w.add_points(f, bundles, bundle_count);
    }
    for (uint32_t half = lanes / 2; half; half /= 2)
        for (uint32_t l = 0; l < half; ++l) {
            w.sum[l] += w.sum[l + half];
            w.nearest[l] = w.nearest[l] < w.nearest[l + half] ? w.nearest[l] : w.nearest[l + half];
        }
    distance2 = float_of(w.nearest[0]);
    return w.sum[0];
}

}  // namespace rill::surface::inner
