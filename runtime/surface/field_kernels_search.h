// SPDX-License-Identifier: MIT
// Through the bundles: which points reach a box, which lie near some of them, and the winding number of all. Sixteen are
// asked at a time, from groups to bundles to points.
#pragma once
#include "format/bits.h"
#include "surface/field.h"
#include "surface/field_kernels_lanes.h"
#include "surface/field_rules.h"

namespace rill::surface::inner {

/// Which of bundles [first, first + 16) touch the box.
RILL_INLINE uint32_t touching(const Bundles& b, uint32_t first, const float lower[3], const float upper[3]) {
    alignas(64) uint32_t bit[lanes];
    const float *lx = b.lower[0] + first, *ly = b.lower[1] + first, *lz = b.lower[2] + first;
    const float *ux = b.upper[0] + first, *uy = b.upper[1] + first, *uz = b.upper[2] + first;
    for (uint32_t l = 0; l < lanes; ++l) {
        const bool x = (lx[l] <= upper[0]) & (ux[l] >= lower[0]), y = (ly[l] <= upper[1]) & (uy[l] >= lower[1]);
        const bool z = (lz[l] <= upper[2]) & (uz[l] >= lower[2]);
        bit[l] = (x & y & z) ? bit_of_lane[l] : 0u;
    }
    return word_of(bit);
}
/// Work(first point) for the bundles that touch the box, ascending.
template <typename Work>
RILL_INLINE void for_touching(const Field& f, const float lower[3], const float upper[3], Work&& work) {
    for (uint32_t g = 0; g < f.groups.count; g += lanes)
        for (uint32_t groups = touching(f.groups, g, lower, upper); groups; groups &= groups - 1) {
            const uint32_t b = lanes * (g + lowest_bit(groups));
            for (uint32_t some = touching(f.bundles, b, lower, upper); some; some &= some - 1)
                work(lanes * (b + lowest_bit(some)));
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

/// Which of sixteen points may have weight in the box; rows x y z, nx ny nz, 1/R². Interval arithmetic in the very order
/// in which the kernels compute u²: no point with weight anywhere in the box is missed, not even by rounding.
template <bool fused>
RILL_INLINE uint32_t reaching(const float* const point[7], uint32_t first, const float lower[3], const float upper[3]) {
    const float *px = point[0] + first, *py = point[1] + first, *pz = point[2] + first;
    const float *nx = point[3] + first, *ny = point[4] + first, *nz = point[5] + first, *inverse = point[6] + first;
    alignas(64) uint32_t bit[lanes];
    for (uint32_t l = 0; l < lanes; ++l) {
        const float ax = lower[0] - px[l], ay = lower[1] - py[l], az = lower[2] - pz[l];
        const float bx = upper[0] - px[l], by = upper[1] - py[l], bz = upper[2] - pz[l];
        const float dx = greater(greater(ax, -bx), 0), dy = greater(greater(ay, -by), 0), dz = greater(greater(az, -bz), 0);
        const float lz = nz[l] * az, hz = nz[l] * bz;
        const Interval z{lesser(lz, hz), greater(lz, hz)}, yz = reach_along<fused>(ny[l], ay, by, z);
        const Interval height = reach_along<fused>(nx[l], ax, bx, yz);
        const float h = greater(greater(height.low, -height.high), 0);
        const float u2 = madd<fused>(flatten * h, h, dot<fused>(dx, dy, dz, dx, dy, dz)) * inverse[l];
        bit[l] = u2 < 1 ? bit_of_lane[l] : 0u;
    }
    return word_of(bit);
}
template <bool fused>
RILL_INLINE uint32_t gather(const Field& f, const float lower[3], const float upper[3], uint32_t* out, uint32_t capacity) {
    const float* const rows[7] = {f.x, f.y, f.z, f.nx, f.ny, f.nz, f.steep};
    uint32_t found = 0;
    for_touching(f, lower, upper, [&](uint32_t first) RILL_INLINED {
        for (uint32_t some = reaching<fused>(rows, first, lower, upper); some; some &= some - 1, ++found)
            if (found < capacity) out[found] = first + lowest_bit(some);
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

/// The winding number of discs at one position.
template <bool fused>
struct Winding {
    float x, y, z;
    alignas(64) float sum[lanes], nearest[lanes];

    RILL_INLINE void add_points(const Field& f, uint32_t first) {
        const float *px = f.x + first, *py = f.y + first, *pz = f.z + first, *area = f.area + first;
        const float *nx = f.nx + first, *ny = f.ny + first, *nz = f.nz + first;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = px[l] - x, ry = py[l] - y, rz = pz[l] - z;
            const float d2 = madd<fused>(rx, rx, madd<fused>(ry, ry, madd<fused>(rz, rz, 1e-20f)));
            const float facing = area[l] * dot<fused>(nx[l], ny[l], nz[l], rx, ry, rz);
            sum[l] = madd<fused>(facing, inverse_cube_root_squared<fused>(d2), sum[l]);
            nearest[l] = lesser(d2, nearest[l]);
        }
    }
    /// Adds those of sixteen bundles that are far away; which are not?
    RILL_INLINE uint32_t add_afar(const Bundles& b, uint32_t first) {
        const float *cx = b.x + first, *cy = b.y + first, *cz = b.z + first, *limit = b.limit + first;
        const float *ax = b.ax + first, *ay = b.ay + first, *az = b.az + first;
        alignas(64) uint32_t near[lanes];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = cx[l] - x, ry = cy[l] - y, rz = cz[l] - z;
            const float distance2 = dot<fused>(rx, ry, rz, rx, ry, rz), d2 = distance2 + 1e-20f;
            const float share = dot<fused>(ax[l], ay[l], az[l], rx, ry, rz) * inverse_cube_root_squared<fused>(d2);
            const float counted = distance2 < limit[l] ? 0.f : share, far2 = distance2 < limit[l] ? unsupported : d2;
            sum[l] += counted, nearest[l] = lesser(far2, nearest[l]);
            near[l] = distance2 < limit[l] ? bit_of_lane[l] : 0u;
        }
        return word_of(near);
    }
};

/// Winding number of the points as oriented discs (Barill et al. 2018): about 1 in the liquid, 0 in the air. A sum of
/// lane sums, always the same ones: the position alone decides it.
template <bool fused>
RILL_INLINE float winding(const Field& f, float x, float y, float z, float& distance2) {
    Winding<fused> w;
    w.x = x, w.y = y, w.z = z;
    for (uint32_t l = 0; l < lanes; ++l) w.sum[l] = 0, w.nearest[l] = unsupported;
    for (uint32_t g = 0; g < f.groups.count; g += lanes)
        for (uint32_t groups = w.add_afar(f.groups, g); groups; groups &= groups - 1) {
            const uint32_t b = lanes * (g + lowest_bit(groups));
            for (uint32_t near = w.add_afar(f.bundles, b); near; near &= near - 1)
                w.add_points(f, lanes * (b + lowest_bit(near)));
        }
    for (uint32_t half = lanes / 2; half; half /= 2)
        for (uint32_t l = 0; l < half; ++l)
            w.sum[l] += w.sum[l + half], w.nearest[l] = lesser(w.nearest[l], w.nearest[l + half]);
    distance2 = w.nearest[0];
    return w.sum[0];
}

}  // namespace rill::surface::inner
