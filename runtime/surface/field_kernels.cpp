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

/// Where both clusters have weight: the side of A that the points of B lie on tells whether the liquid between them is
/// thin (below) or the air is.
RILL_INLINE void choose_side(const Field& f, const uint32_t* list, uint32_t count, const float* height,
                             const float* weight_b, const float* sum_b, Batch& b) {
    alignas(64) float side[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const Patch& p = f.patches[list[c]];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = b.x[l] - p.x, ry = b.y[l] - p.y, rz = b.z[l] - p.z;
            const float h = p.nx * rx + p.ny * ry + p.nz * rz, d2 = rx * rx + ry * ry + rz * rz;
            const float u2 = (d2 + flatten * h * h) * p.inverse;
            const float agree = p.nx * b.nx[l] + p.ny * b.ny[l] + p.nz * b.nz[l];
            const float along = b.nx[l] * rx + b.ny[l] * ry + b.nz[l] * rz;
            side[l] += weight_b_of(u2, weight_of(u2, p.activity), agree) * (height[l] - along);
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        const float some = weight_b[l] > 0 ? weight_b[l] : 1.f, value = sum_b[l] / some, a = b.value[l];
        // Thin liquid: intersection, max; thin air: union, min.
        const float gain = side[l] < 0 ? value - a : a - value, better = b.sign[l] != 0 ? gain : 1.f;
        const float take = weight_b[l] > 0 ? better : 0.f;
        b.value[l] = take > 0 ? value : a, b.weight[l] = take > 0 ? weight_b[l] : b.weight[l];
        b.sign[l] = take > 0 ? -1.f : b.sign[l];
        b.doubt[l] = take > 0 ? int32_t(b.u2[l] > trusted) : b.doubt[l];
    }
}

RILL_INLINE void blend(const Field& f, const uint32_t* list, uint32_t count, Batch& b) {
    alignas(64) float height[lanes];
    alignas(64) float weight_a[lanes] = {}, sum_a[lanes] = {}, weight_b[lanes] = {}, sum_b[lanes] = {};
    alignas(64) float voters[lanes] = {}, inside[lanes] = {};  // of A: how many, and the weight of those who say liquid
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
            voters[l] += wa > 0 ? 1.f : 0.f, inside[l] += g < 0 ? wa : 0.f;
        }
    }
    int32_t any_b = 0;
    for (uint32_t l = 0; l < lanes; ++l) {
        const float weight = weight_a[l], some = weight > 0 ? weight : 1.f, value = sum_a[l] / some;
        b.value[l] = weight > 0 ? value : unsupported;
        b.weight[l] = weight, b.sign[l] = weight > 0 ? 1.f : 0.f;
        const float against = value < 0 ? weight - inside[l] : inside[l];
        const int32_t agreed = (voters[l] >= enough_voters) & (against <= few_against * weight);
        b.doubt[l] = (b.u2[l] > trusted) & ~agreed;
        any_b |= weight_b[l] > 0;
    }
    if (any_b) choose_side(f, list, count, height, weight_b, sum_b, b);
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

/// About 1 / √x³, to half a percent, the same on every machine: a guess from the exponent and one Newton step.
RILL_INLINE float inverse_cube_root_squared(float x) {
    uint32_t bits;
    float y;
    std::memcpy(&bits, &x, sizeof(bits));
    bits = 0x5f375a86u - (bits >> 1);
    std::memcpy(&y, &bits, sizeof(y));
    y = y * (1.5f - 0.5f * x * y * y);
    return y * y * y;
}

/// Sums of discs at sixteen positions.
struct Discs {
    alignas(64) float x[lanes], y[lanes], z[lanes], sum[lanes], nearest[lanes];

    /// For the lanes whose `share` is 1, not 0.
    RILL_INLINE void add(float cx, float cy, float cz, float ax, float ay, float az, const float* share) {
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = cx - x[l], ry = cy - y[l], rz = cz - z[l];
            const float d2 = rx * rx + ry * ry + rz * rz + 1e-20f;
            sum[l] += share[l] * ((ax * rx + ay * ry + az * rz) * inverse_cube_root_squared(d2));
            nearest[l] = lesser(share[l] > 0 ? d2 : unsupported, nearest[l]);
        }
    }
    /// Adds a cluster for those of the lanes `asked` that see it from afar. True when some do not; they are `near`.
    /// Who does is decided lane by lane: the batch must not matter.
    RILL_INLINE bool add_from_afar(const Cluster& k, const float* asked, float* near) {
        alignas(64) float afar[lanes];
        int32_t any_near = 0, any_afar = 0;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = k.centre[0] - x[l], ry = k.centre[1] - y[l], rz = k.centre[2] - z[l];
            const bool is_near = rx * rx + ry * ry + rz * rz < k.limit;
            near[l] = is_near ? asked[l] : 0.f, afar[l] = is_near ? 0.f : asked[l];
            any_near |= near[l] > 0, any_afar |= afar[l] > 0;
        }
        if (any_afar) add(k.centre[0], k.centre[1], k.centre[2], k.area[0], k.area[1], k.area[2], afar);
        return any_near;
    }
};

/// Winding number of the points as oriented discs at each position (Barill et al. 2018): about 1 in the liquid, 0 in
/// the air.
RILL_INLINE void winding(const Field& f, const float* x, const float* y, const float* z, float* number,
                         float* distance2) {
    Discs discs;
    alignas(64) float all[lanes], near_group[lanes], near[lanes];
    for (uint32_t l = 0; l < lanes; ++l) {
        discs.x[l] = x[l], discs.y[l] = y[l], discs.z[l] = z[l];
        discs.sum[l] = 0, discs.nearest[l] = unsupported, all[l] = 1;
    }
    for (uint32_t g = 0; g < f.group_count; ++g) {
        if (!discs.add_from_afar(f.groups[g], all, near_group)) continue;
        for (uint32_t c = f.groups[g].first; c < f.groups[g].last; ++c) {
            const Cluster& k = f.clusters[c];
            if (!discs.add_from_afar(k, near_group, near)) continue;
            for (uint32_t m = k.first; m < k.last; ++m) {
                const uint32_t j = f.cluster_member[m];
                const Patch& p = f.patches[j];
                const float area = f.area[j];
                discs.add(p.x, p.y, p.z, area * p.nx, area * p.ny, area * p.nz, near);
            }
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) number[l] = discs.sum[l], distance2[l] = discs.nearest[l];
}

alignas(64) constexpr uint32_t bit_of_lane[lanes] = {1,      1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                                                    1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};

/// Interval arithmetic in the very order in which the kernels compute u²: no point with weight anywhere in the box is
/// missed, not even by rounding.
RILL_INLINE void reach(const float* const point[7], uint32_t n, const float lower[3], const float upper[3],
                       uint32_t* within) {
    for (uint32_t first = 0; first < n; first += lanes) {
        const float *px = point[0] + first, *py = point[1] + first, *pz = point[2] + first;
        const float *nx = point[3] + first, *ny = point[4] + first, *nz = point[5] + first, *inverse = point[6] + first;
        alignas(64) uint32_t bit[lanes];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float ax = lower[0] - px[l], ay = lower[1] - py[l], az = lower[2] - pz[l];
            const float bx = upper[0] - px[l], by = upper[1] - py[l], bz = upper[2] - pz[l];
            const float dx = greater(greater(ax, -bx), 0), dy = greater(greater(ay, -by), 0), dz = greater(greater(az, -bz), 0);
            const float lx = nx[l] * ax, ly = ny[l] * ay, lz = nz[l] * az, hx = nx[l] * bx, hy = ny[l] * by, hz = nz[l] * bz;
            const float low = lesser(lx, hx) + lesser(ly, hy) + lesser(lz, hz);
            const float high = greater(lx, hx) + greater(ly, hy) + greater(lz, hz);
            const float h = greater(greater(low, -high), 0);
            const float u2 = (dx * dx + dy * dy + dz * dz + flatten * h * h) * inverse[l];
            bit[l] = u2 < 1 ? bit_of_lane[l] : 0u;
        }
        for (uint32_t l = 0; l < 8; ++l) bit[l] |= bit[l + 8];  // a sum in one loop would not become vectors
        for (uint32_t l = 0; l < 4; ++l) bit[l] |= bit[l + 4];
        within[first / lanes] = bit[0] | bit[1] | bit[2] | bit[3];
    }
}

// One set of entry points per instruction set; everything above is inlined into each.
#define RILL_LEVEL(id, target)                                                                                 \
    target void reach_##id(const float* const point[7], uint32_t n, const float lower[3], const float upper[3], \
                           uint32_t* within) {                                                                 \
        reach(point, n, lower, upper, within);                                                                 \
    }                                                                                                          \
    target void blend_##id(const Field& f, const uint32_t* list, uint32_t count, Batch& b) {                   \
        blend(f, list, count, b);                                                                              \
    }                                                                                                          \
    target void slope_##id(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, bool velocity, \
                           Slopes& out) {                                                                      \
        slope(f, list, count, b, velocity, out);                                                               \
    }                                                                                                          \
    target void winding_##id(const Field& f, const float* x, const float* y, const float* z, float* number,    \
                             float* distance2) {                                                               \
        winding(f, x, y, z, number, distance2);                                                                \
    }                                                                                                          \
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
