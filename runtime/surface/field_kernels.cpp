// SPDX-License-Identifier: MIT
// Each kernel walks a list of patches; its inner loop over the lanes has a fixed length and no branch, so that
// compilers make one or two vector operations of every line. Sums stay in arrays of the function's own: nothing
// the compiler must fear to be aliased.
#include "surface/field_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "surface/field.h"
#include "surface/field_rules.h"

#if defined(__GNUC__)
#define RILL_INLINE inline __attribute__((always_inline))
#else
#define RILL_INLINE inline
#endif

namespace rill::surface {
namespace {

RILL_INLINE float lesser(float a, float b) { return a < b ? a : b; }
RILL_INLINE float greater(float a, float b) { return a > b ? a : b; }

/// 1: a patch that faces the same way as the nearest; 0: opposed to it.
RILL_INLINE float gate_of(float agree) { return lesser(greater((agree - opposed) * gate_scale, 0), 1); }

/// (1 − u)² / u².
RILL_INLINE float weight_of(float u2, float activity) {
    const float v = 1 - std::sqrt(lesser(u2, 1));
    return activity * (v * v) / (u2 + soften);
}
/// Its derivative by u², halved.
RILL_INLINE float weight_slope_of(float u2, float activity) {
    const float u = std::sqrt(lesser(u2, 1)), v = 1 - u, s = 1 / (u2 + soften);
    return -0.5f * activity * v * s * (1 / greater(u, 1e-4f) + v * s);
}
RILL_INLINE float weight_b_of(float u2, float w, float agree) {
    const float apart = agree < opposed ? w : 0.f;
    return u2 < opposed_reach ? apart : 0.f;
}

/// The nearest point among those with weight.
RILL_INLINE void find_nearest(const Field& f, const uint32_t* list, uint32_t count, Batch& b, float* height) {
    alignas(64) float best[lanes], least[lanes];
    alignas(64) uint32_t found[lanes];
    for (uint32_t l = 0; l < lanes; ++l) best[l] = least[l] = unsupported, found[l] = list[0];
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t j = list[c];
        const Patch p = f.patches[j];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = p.nx * rx + p.ny * ry + p.nz * rz, d2 = rx * rx + ry * ry + rz * rz;
            const float u2 = (d2 + flatten * h * h) * p.inverse;
            const float key = u2 < 1 ? d2 * p.recede : unsupported;
            found[l] = key < best[l] ? j : found[l];
            best[l] = lesser(key, best[l]), least[l] = lesser(u2, least[l]);
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        const Patch& p = f.patches[found[l]];
        b.u2[l] = least[l], b.nx[l] = p.nx, b.ny[l] = p.ny, b.nz[l] = p.nz;
        height[l] = p.nx * (b.x[l] - p.x) + p.ny * (b.y[l] - p.y) + p.nz * (b.z[l] - p.z);
    }
}

/// Which side of A the points of B lie on: below, the liquid between them is thin; above, the air is.
RILL_INLINE void side_of(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, const float* height,
                         float* side) {
    for (uint32_t l = 0; l < lanes; ++l) side[l] = 0;
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
}

RILL_INLINE void blend(const Field& f, const uint32_t* list, uint32_t count, Batch& b) {
    alignas(64) float height[lanes], side[lanes];
    alignas(64) float weight_a[lanes] = {}, sum_a[lanes] = {}, weight_b[lanes] = {}, sum_b[lanes] = {};
    find_nearest(f, list, count, b, height);
    for (uint32_t c = 0; c < count; ++c) {
        const Patch p = f.patches[list[c]];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = p.nx * rx + p.ny * ry + p.nz * rz, d2 = rx * rx + ry * ry + rz * rz;
            const float u2 = (d2 + flatten * h * h) * p.inverse, w = weight_of(u2, p.activity);
            const float g = h + rx * (p.xx * rx + p.xy * ry + p.xz * rz) + ry * (p.yy * ry + p.yz * rz) + p.zz * rz * rz;
            const float agree = p.nx * b.nx[l] + p.ny * b.ny[l] + p.nz * b.nz[l], gate = gate_of(agree);
            const float wa = w * (gate * gate), wb = weight_b_of(u2, w, agree);
            weight_a[l] += wa, sum_a[l] += wa * g;
            weight_b[l] += wb, sum_b[l] += wb * g;
        }
    }
    float any_b = 0;
    for (uint32_t l = 0; l < lanes; ++l) {
        const bool has = weight_a[l] > 0;
        b.value[l] = has ? sum_a[l] / weight_a[l] : unsupported;
        b.weight[l] = weight_a[l], b.sign[l] = has ? 1.f : 0.f;
        any_b += weight_b[l];
    }
    if (any_b > 0) side_of(f, list, count, b, height, side);
    for (uint32_t l = 0; any_b > 0 && l < lanes; ++l) {
        if (!(weight_b[l] > 0)) continue;
        const float value = sum_b[l] / weight_b[l];
        // Thin liquid: intersection, max; thin air: union, min.
        if (b.sign[l] != 0 && !(side[l] < 0 ? value > b.value[l] : value < b.value[l])) continue;
        b.value[l] = value, b.weight[l] = weight_b[l], b.sign[l] = -1;
    }
    for (uint32_t l = 0; l < lanes; ++l) b.u2[l] = b.sign[l] == 0 ? unsupported : b.u2[l];
}

/// Of the chosen cluster: Σ w ∇G + (G − value) ∇w, and Σ w v.
RILL_INLINE void slope(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, bool velocity, Slopes& out) {
    alignas(64) float gx[lanes] = {}, gy[lanes] = {}, gz[lanes] = {}, vx[lanes] = {}, vy[lanes] = {}, vz[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t j = list[c];
        const Patch p = f.patches[j];
        const float mx = velocity ? f.vx[j] : 0, my = velocity ? f.vy[j] : 0, mz = velocity ? f.vz[j] : 0;
        const float xx = 2 * p.xx, yy = 2 * p.yy, zz = 2 * p.zz, steep = 4 * p.inverse;
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
        out.gx[l] = gx[l], out.gy[l] = gy[l], out.gz[l] = gz[l];
        out.vx[l] = vx[l], out.vy[l] = vy[l], out.vz[l] = vz[l];
    }
}

/// Winding number of the points as oriented discs at each position (Barill et al. 2018): about 1 in the liquid, 0 in
/// the air. Which lanes see a cluster from afar is decided lane by lane: the batch must not matter.
RILL_INLINE void winding(const Field& f, const float* x, const float* y, const float* z, float* number,
                         float* distance2) {
    alignas(64) float sum[lanes] = {}, near[lanes], nearest[lanes];
    for (uint32_t l = 0; l < lanes; ++l) nearest[l] = unsupported;
    for (uint32_t c = 0; c < f.cluster_count; ++c) {
        const Cluster k = f.clusters[c];
        const float limit = from_afar * k.radius * k.radius;
        float any = 0;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = k.centre[0] - x[l], ry = k.centre[1] - y[l], rz = k.centre[2] - z[l];
            const float d2 = rx * rx + ry * ry + rz * rz, share = k.area[0] * rx + k.area[1] * ry + k.area[2] * rz;
            near[l] = d2 > limit ? 0.f : 1.f;
            nearest[l] = lesser(d2 > limit ? d2 : unsupported, nearest[l]);
            sum[l] += d2 > limit ? share / (d2 * std::sqrt(d2)) : 0.f;
        }
        for (uint32_t l = 0; l < lanes; ++l) any += near[l];
        if (any == 0) continue;
        for (uint32_t m = k.first; m < k.last; ++m) {
            const uint32_t j = f.cluster_member[m];
            const Patch p = f.patches[j];
            const float area = f.area[j];
            for (uint32_t l = 0; l < lanes; ++l) {
                const float rx = p.x - x[l], ry = p.y - y[l], rz = p.z - z[l];
                const float d2 = rx * rx + ry * ry + rz * rz + 1e-20f;
                nearest[l] = lesser(near[l] > 0 ? d2 : unsupported, nearest[l]);
                sum[l] += near[l] * (area * (p.nx * rx + p.ny * ry + p.nz * rz)) / (d2 * std::sqrt(d2));
            }
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) number[l] = sum[l], distance2[l] = nearest[l];
}

/// Interval arithmetic in the very order in which the kernels compute u²: no point with weight anywhere in the box is
/// missed, not even by rounding.
RILL_INLINE void reach(const float* const point[7], uint32_t n, const float lower[3], const float upper[3],
                       float* least) {
    const float *px = point[0], *py = point[1], *pz = point[2], *nx = point[3], *ny = point[4], *nz = point[5];
    const float* inverse = point[6];
    for (uint32_t first = 0; first < n; first += lanes) {
        alignas(64) float u2[lanes];
        for (uint32_t l = 0; l < lanes; ++l) {
            const uint32_t i = first + l;
            const float ax = lower[0] - px[i], ay = lower[1] - py[i], az = lower[2] - pz[i];
            const float bx = upper[0] - px[i], by = upper[1] - py[i], bz = upper[2] - pz[i];
            const float dx = greater(greater(ax, -bx), 0), dy = greater(greater(ay, -by), 0), dz = greater(greater(az, -bz), 0);
            const float lx = nx[i] * ax, ly = ny[i] * ay, lz = nz[i] * az, hx = nx[i] * bx, hy = ny[i] * by, hz = nz[i] * bz;
            const float low = lesser(lx, hx) + lesser(ly, hy) + lesser(lz, hz);
            const float high = greater(lx, hx) + greater(ly, hy) + greater(lz, hz);
            const float h = greater(greater(low, -high), 0);
            u2[l] = (dx * dx + dy * dy + dz * dz + flatten * h * h) * inverse[i];
        }
        std::memcpy(least + first, u2, sizeof(u2));
    }
}

// One set of entry points per instruction set; everything above is inlined into each.
#define RILL_LEVEL(id, target)                                                                                    \
    target void reach_##id(const float* const point[7], uint32_t n, const float lower[3], const float upper[3],   \
                           float* least) {                                                                        \
        reach(point, n, lower, upper, least);                                                                     \
    }                                                                                                             \
    target void blend_##id(const Field& f, const uint32_t* list, uint32_t count, Batch& b) {                      \
        blend(f, list, count, b);                                                                                 \
    }                                                                                                             \
    target void slope_##id(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, bool velocity,   \
                           Slopes& out) {                                                                         \
        slope(f, list, count, b, velocity, out);                                                                  \
    }                                                                                                             \
    target void winding_##id(const Field& f, const float* x, const float* y, const float* z, float* number,       \
                             float* distance2) {                                                                  \
        winding(f, x, y, z, number, distance2);                                                                                 \
    }                                                                                                             \
    constexpr Kernels kernels_##id{#id, reach_##id, blend_##id, slope_##id, winding_##id};

#if defined(__GNUC__) && !defined(__clang__)
RILL_LEVEL(scalar, __attribute__((optimize("no-tree-vectorize", "no-tree-slp-vectorize"))))
#endif
RILL_LEVEL(baseline, )
#if defined(__GNUC__) && defined(__x86_64__)
#define RILL_X86_LEVELS 1
RILL_LEVEL(avx2, __attribute__((target("avx2"))))
RILL_LEVEL(avx512, __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq"))))
#endif

}  // namespace

uint32_t kernel_levels(const Kernels* out[most_kernel_levels]) noexcept {
    uint32_t count = 0;
#if defined(__GNUC__) && !defined(__clang__)
    out[count++] = &kernels_scalar;
#endif
    out[count++] = &kernels_baseline;
#if RILL_X86_LEVELS
    if (__builtin_cpu_supports("avx2")) out[count++] = &kernels_avx2;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq"))
        out[count++] = &kernels_avx512;
#endif
    return count;
}

const Kernels& best_kernels() noexcept {
    const Kernels* levels[most_kernel_levels];
    return *levels[kernel_levels(levels) - 1];
}

}  // namespace rill::surface
