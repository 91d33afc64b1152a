// SPDX-License-Identifier: MIT
// Evaluating the field: patches blended by inverse distance, thin sheets and gaps told apart by normals.
//
// At x the nearest point's normal splits the patches in two clusters: A agrees with it, B opposes it. Each
// cluster is blended on its own; where both have weight the liquid between them is thin (the clusters face
// away from each other: intersection, max) or the air is (they face each other: union, min). Plain blending
// is 5–20 times worse where the thickness is below 1.5 point spacings.
//
// Away from points the winding number of all points gives the sign. Tried on a splash (p99 of the worst frame, % of
// the diagonal): round supports and the nearest plane's sign 10.8; flattened supports 0.28 with stray scraps of 4 %;
// with patches of other faces fading out and the winding number 0.28 without scraps.
#include <algorithm>
#include <cmath>

#include "surface/field.h"

// One source, compiled for several instruction sets and chosen at load time. Contraction is off, so that
// all of them give the same bits.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__linux__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define RILL_KERNEL __attribute__((target_clones("default", "arch=haswell", "arch=skylake-avx512")))
#else
#define RILL_KERNEL
#endif

namespace rill::surface {
namespace {

constexpr uint32_t lanes = 32;
// u² = (|r|² + flatten · (n·r)²) / R²: a patch reaches half as far along its normal as along the surface, or the
// wide patches of a calm far side would speak for fine surface nearby.
constexpr float flatten = 3;
// Where the nearest point is farther (in u²) than `trusted`, the winding number may overrule the blend if it is sure;
// farther than `core` it need not even disagree.
constexpr float core = 0.3f, trusted = 0.08f;
constexpr float sure = 0.2f, likely = 0.35f;  // of the winding number, from 0 or 1: to overrule within and beyond core
constexpr float opposed = -0.2f;        // n·n0 below this: cluster B
constexpr float agreeing = 0.7f;        // above this: full weight in A; between, patches of another face fade out
constexpr float gate_scale = 1 / (agreeing - opposed);
constexpr float opposed_reach = 0.51f;  // (1/1.4)²: cluster B has weight only within R/1.4
constexpr float soften = 1e-4f;         // of u² in the weight (1 − u)² / u²

struct Positions {
    float x[lanes], y[lanes], z[lanes];
};
/// The point nearest to each position among those whose support holds it.
struct Nearest {
    float key[lanes];  // squared distance / activity; a point that fades recedes
    float h[lanes];    // over the plane of that point
    float u2[lanes];   // least of any point: in a thin sheet the nearest may be of the other face
    bool far(uint32_t l) const { return u2[l] > core; }
    bool doubtful(uint32_t l) const { return u2[l] > trusted; }
    float x[lanes], y[lanes], z[lanes], nx[lanes], ny[lanes], nz[lanes];
};
/// Sums of the two clusters, and on which side of A the points of B lie.
struct Blend {
    float weight_a[lanes], sum_a[lanes], weight_b[lanes], sum_b[lanes], side[lanes];
};
/// Sums of the chosen cluster with their gradients.
struct Gradients {
    float weight[lanes];
    float gx[lanes], gy[lanes], gz[lanes];     // Σ w ∇G + G ∇w
    float wx[lanes], wy[lanes], wz[lanes];     // Σ ∇w
    float vx[lanes], vy[lanes], vz[lanes];     // Σ w v
};

inline float gate_of(float agree) {
    const float gate = (agree - opposed) * gate_scale;
    return gate < 0 ? 0.f : gate < 1 ? gate : 1.f;
}

RILL_KERNEL void find_nearest(const Field& f, const uint32_t* candidates, uint32_t count, const Positions& p,
                              Nearest& n) {
    for (uint32_t l = 0; l < lanes; ++l) {
        n.key[l] = n.u2[l] = n.h[l] = unsupported;
        n.x[l] = n.y[l] = n.z[l] = n.nx[l] = n.ny[l] = n.nz[l] = 0;
    }
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t j = candidates[c];
        const float xj = f.x[j], yj = f.y[j], zj = f.z[j], nx = f.nx[j], ny = f.ny[j], nz = f.nz[j];
        const float reach = f.support[j] * f.support[j], recede = 1 / f.activity[j], inverse = 1 / reach;
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = p.x[l] - xj, ry = p.y[l] - yj, rz = p.z[l] - zj;
            const float d2 = rx * rx + ry * ry + rz * rz, h = nx * rx + ny * ry + nz * rz;
            const float key = d2 < reach ? d2 * recede : unsupported;
            const bool nearer = key < n.key[l];
            const float u2 = (d2 + flatten * h * h) * inverse;
            n.u2[l] = u2 < n.u2[l] ? u2 : n.u2[l];
            n.h[l] = nearer ? h : n.h[l];
            n.key[l] = nearer ? key : n.key[l];
            n.x[l] = nearer ? xj : n.x[l], n.y[l] = nearer ? yj : n.y[l], n.z[l] = nearer ? zj : n.z[l];
            n.nx[l] = nearer ? nx : n.nx[l], n.ny[l] = nearer ? ny : n.ny[l], n.nz[l] = nearer ? nz : n.nz[l];
        }
    }
}

/// Sums are kept in arrays of the function's own: nothing the compiler must fear to be aliased.
RILL_KERNEL void blend_values(const Field& f, const uint32_t* candidates, uint32_t count, const Positions& p,
                              const Nearest& n, Blend& out) {
    float weight_a[lanes] = {}, sum_a[lanes] = {}, weight_b[lanes] = {}, sum_b[lanes] = {}, side[lanes] = {};
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t j = candidates[c];
        const float xj = f.x[j], yj = f.y[j], zj = f.z[j], nx = f.nx[j], ny = f.ny[j], nz = f.nz[j];
        const float xx = f.qxx[j], yy = f.qyy[j], zz = f.qzz[j], xy = 2 * f.qxy[j], xz = 2 * f.qxz[j],
                    yz = 2 * f.qyz[j], inverse = 1 / (f.support[j] * f.support[j]), activity = f.activity[j];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = p.x[l] - xj, ry = p.y[l] - yj, rz = p.z[l] - zj;
            const float h = nx * rx + ny * ry + nz * rz;
            const float u2 = (rx * rx + ry * ry + rz * rz + flatten * h * h) * inverse;
            const float v = 1 - std::sqrt(u2 < 1 ? u2 : 1.f);
            const float w = activity * v * v / (u2 + soften);
            const float g = h + rx * (xx * rx + xy * ry + xz * rz) + ry * (yy * ry + yz * rz) + zz * rz * rz;
            const float agree = nx * n.nx[l] + ny * n.ny[l] + nz * n.nz[l];
            const float gate = gate_of(agree), wa = w * gate * gate;
            const float wb = agree < opposed && u2 < opposed_reach ? w : 0.f;
            weight_a[l] += wa, sum_a[l] += wa * g;
            weight_b[l] += wb, sum_b[l] += wb * g;
            side[l] += wb * (n.nx[l] * (xj - n.x[l]) + n.ny[l] * (yj - n.y[l]) + n.nz[l] * (zj - n.z[l]));
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        out.weight_a[l] = weight_a[l], out.sum_a[l] = sum_a[l];
        out.weight_b[l] = weight_b[l], out.sum_b[l] = sum_b[l], out.side[l] = side[l];
    }
}

/// Gradients of the cluster that `sign` names for each lane: 1 for A, −1 for B, 0 for neither.
RILL_KERNEL void blend_gradients(const Field& f, const uint32_t* candidates, uint32_t count, const Positions& p,
                                 const Nearest& n, const float* sign, Gradients& out) {
    Gradients k{};
    for (uint32_t c = 0; c < count; ++c) {
        const uint32_t j = candidates[c];
        const float xj = f.x[j], yj = f.y[j], zj = f.z[j], nx = f.nx[j], ny = f.ny[j], nz = f.nz[j];
        const float xx = 2 * f.qxx[j], yy = 2 * f.qyy[j], zz = 2 * f.qzz[j], xy = 2 * f.qxy[j],
                    xz = 2 * f.qxz[j], yz = 2 * f.qyz[j], inverse = 1 / (f.support[j] * f.support[j]);
        const float activity = f.activity[j], vx = f.vx[j], vy = f.vy[j], vz = f.vz[j];
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = p.x[l] - xj, ry = p.y[l] - yj, rz = p.z[l] - zj;
            const float h = nx * rx + ny * ry + nz * rz, lean = flatten * h;
            const float u2 = (rx * rx + ry * ry + rz * rz + lean * h) * inverse;
            const float u = std::sqrt(u2 < 1 ? u2 : 1.f), v = 1 - u, s = 1 / (u2 + soften);
            const float agree = nx * n.nx[l] + ny * n.ny[l] + nz * n.nz[l];
            const float gate = gate_of(agree), in_b = agree < opposed && u2 < opposed_reach ? 1.f : 0.f;
            const float keep = activity * (sign[l] > 0 ? gate * gate : sign[l] < 0 ? in_b : 0.f);
            const float w = keep * v * v * s;
            const float slope = -2 * keep * v * s * inverse * (1 / (u > 1e-4f ? u : 1e-4f) + v * s);
            const float hx = xx * rx + xy * ry + xz * rz, hy = xy * rx + yy * ry + yz * rz,
                        hz = xz * rx + yz * ry + zz * rz;
            const float g = h + 0.5f * (rx * hx + ry * hy + rz * hz);
            const float dx = slope * (rx + lean * nx), dy = slope * (ry + lean * ny), dz = slope * (rz + lean * nz);
            k.weight[l] += w;
            k.gx[l] += w * (nx + hx) + g * dx, k.wx[l] += dx, k.vx[l] += w * vx;
            k.gy[l] += w * (ny + hy) + g * dy, k.wy[l] += dy, k.vy[l] += w * vy;
            k.gz[l] += w * (nz + hz) + g * dz, k.wz[l] += dz, k.vz[l] += w * vz;
        }
    }
    out = k;
}

/// Winding number of the points as oriented discs at each position (Barill et al. 2018): about 1 in the liquid, 0 in
/// the air. Beyond all supports it gives a sign that holes and stray points cannot turn. Clusters seen from afar
/// count as one disc.
RILL_KERNEL void winding_numbers(const Field& f, const Positions& p, float* out) {
    constexpr float from_afar = 5;  // of radius²
    float winding[lanes] = {}, near[lanes], afar[lanes];
    const auto add = [&](const float* share, float xj, float yj, float zj, float nx, float ny, float nz)
                         __attribute__((always_inline)) {
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = xj - p.x[l], ry = yj - p.y[l], rz = zj - p.z[l];
            const float d2 = rx * rx + ry * ry + rz * rz + 1e-20f;
            winding[l] += share[l] * (nx * rx + ny * ry + nz * rz) / (d2 * std::sqrt(d2));
        }
    };
    for (uint32_t c = 0; c < f.cluster_count; ++c) {
        const Cluster& k = f.clusters[c];
        const float limit = from_afar * k.radius * k.radius;
        float far_lanes = 0;
        // Which lanes see it from afar is decided lane by lane: the batch must not matter.
        for (uint32_t l = 0; l < lanes; ++l) {
            const float rx = k.centre[0] - p.x[l], ry = k.centre[1] - p.y[l], rz = k.centre[2] - p.z[l];
            afar[l] = rx * rx + ry * ry + rz * rz > limit ? 1.f : 0.f;
            near[l] = 1 - afar[l];
        }
        for (uint32_t l = 0; l < lanes; ++l) far_lanes += afar[l];
        if (far_lanes > 0) add(afar, k.centre[0], k.centre[1], k.centre[2], k.area[0], k.area[1], k.area[2]);
        if (far_lanes == float(lanes)) continue;
        for (uint32_t m = k.first; m < k.last; ++m) {
            const uint32_t j = f.cluster_member[m];
            const float area = f.area[j];
            add(near, f.x[j], f.y[j], f.z[j], area * f.nx[j], area * f.ny[j], area * f.nz[j]);
        }
    }
    for (uint32_t l = 0; l < lanes; ++l) out[l] = winding[l];
}

/// Signs for the first n positions where no patch has weight.
void decide_far(const Field& f, const Positions& p, uint32_t n, const Nearest& nearest, float* value,
                float* sign) {
    bool any = false;
    for (uint32_t l = 0; l < n; ++l) any |= nearest.doubtful(l);
    if (!any) return;
    float winding[lanes] = {};
    if (f.point_count) winding_numbers(f, p, winding);
    for (uint32_t l = 0; l < n; ++l) {
        if (!nearest.doubtful(l)) continue;
        // Between wide patches the discs are too coarse to ask: then the blend stands, if there is one.
        const float doubt = nearest.far(l) ? likely : sure;
        const bool certain = winding[l] < doubt || winding[l] > 1 - doubt, inside = winding[l] > 0.5f;
        const bool overrule = certain && (nearest.far(l) || inside != (value[l] < 0));
        if (sign[l] != 0 && !overrule) continue;
        const float distance = std::fabs(nearest.h[l]);
        value[l] = inside ? -std::min(distance, f.grid_cell) : distance;
        sign[l] = 0;
    }
}

void add_drops(const Field& f, const uint32_t* candidates, uint32_t first, uint32_t count, const float* x,
               const float* y, const float* z, uint32_t n, float* value, float* gx, float* gy, float* gz,
               float* vx, float* vy, float* vz) {
    for (uint32_t c = first; c < count; ++c) {
        const uint32_t d = candidates[c] - f.point_count;
        const float xx = f.inverse[0][d], yy = f.inverse[1][d], zz = f.inverse[2][d], xy = f.inverse[3][d],
                    xz = f.inverse[4][d], yz = f.inverse[5][d];
        for (uint32_t i = 0; i < n; ++i) {
            const float rx = x[i] - f.dx[d], ry = y[i] - f.dy[d], rz = z[i] - f.dz[d];
            // gather() knows no drop beyond its reach: the box asked for must not matter.
            if (rx * rx + ry * ry + rz * rz >= f.reach[d] * f.reach[d]) continue;
            const float ex = xx * rx + xy * ry + xz * rz, ey = xy * rx + yy * ry + yz * rz,
                        ez = xz * rx + yz * ry + zz * rz;
            const float length = std::sqrt(ex * ex + ey * ey + ez * ez);
            const float g = (length - 1) * f.radius[d];
            if (g >= value[i]) continue;
            value[i] = g;
            if (!gx) continue;
            const float k = f.radius[d] / std::max(length, 1e-6f);
            gx[i] = k * (xx * ex + xy * ey + xz * ez);
            gy[i] = k * (xy * ex + yy * ey + yz * ez);
            gz[i] = k * (xz * ex + yz * ey + zz * ez);
            if (vx) vx[i] = f.dvx[d], vy[i] = f.dvy[d], vz[i] = f.dvz[d];
        }
    }
}

/// The last position fills unused lanes: no branch in the kernels.
void load(Positions& p, const float* x, const float* y, const float* z, uint32_t n) {
    for (uint32_t l = 0; l < lanes; ++l) {
        const uint32_t i = std::min(l, n - 1);
        p.x[l] = x[i], p.y[l] = y[i], p.z[l] = z[i];
    }
}

/// Values of up to `lanes` positions, and which cluster gave each.
struct Batch {
    Positions p;
    Nearest nearest;
    float value[lanes], sign[lanes];  // 1: cluster A, −1: B, 0: far
};
void blend(const Field& f, const uint32_t* candidates, uint32_t points, const float* x, const float* y,
           const float* z, uint32_t n, Batch& k) {
    load(k.p, x, y, z, n);
    find_nearest(f, candidates, points, k.p, k.nearest);
    Blend sums;
    blend_values(f, candidates, points, k.p, k.nearest, sums);
    for (uint32_t l = 0; l < lanes; ++l) {
        const bool has_a = sums.weight_a[l] > 0, has_b = sums.weight_b[l] > 0;
        if (!has_a && !has_b) k.nearest.u2[l] = unsupported;
        const float a = has_a ? sums.sum_a[l] / sums.weight_a[l] : unsupported;
        const float b = has_b ? sums.sum_b[l] / sums.weight_b[l] : a;
        const bool use_b = !has_a || (sums.side[l] < 0 ? b > a : b < a);
        k.value[l] = use_b ? b : a;
        k.sign[l] = !has_a && !has_b ? 0.f : use_b ? -1.f : 1.f;
    }
    decide_far(f, k.p, n, k.nearest, k.value, k.sign);
}

uint32_t count_points(const Field& f, const uint32_t* candidates, uint32_t count) {
    return uint32_t(std::lower_bound(candidates, candidates + count, f.point_count) - candidates);
}

}  // namespace

uint32_t gather(const Field& f, const Box& box, uint32_t* out, uint32_t capacity) noexcept {
    uint32_t found = 0;
    const auto outside = [&](float x, float y, float z, float reach) {
        const float p[3] = {x, y, z};
        float d2 = 0;
        for (int a = 0; a < 3; ++a) {
            const float d = std::max({box.lower[a] - p[a], p[a] - box.upper[a], 0.f});
            d2 += d * d;
        }
        return d2 >= reach * reach;
    };
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
        const float size = float(f.grid_size[a]);
        from[a] = int(std::clamp((box.lower[a] - f.largest_support - f.grid_origin[a]) / f.grid_cell - 0.01f, 0.f, size));
        to[a] = int(std::clamp((box.upper[a] + f.largest_support - f.grid_origin[a]) / f.grid_cell + 0.01f, -1.f, size - 1));
    }
    for (int z = from[2]; f.point_count && z <= to[2]; ++z)
        for (int y = from[1]; y <= to[1]; ++y) {
            const uint32_t row = (uint32_t(z) * f.grid_size[1] + uint32_t(y)) * f.grid_size[0];
            if (from[0] > to[0]) continue;
            for (uint32_t j = f.cell_start[row + uint32_t(from[0])]; j < f.cell_start[row + uint32_t(to[0]) + 1]; ++j) {
                if (outside(f.x[j], f.y[j], f.z[j], f.support[j])) continue;
                if (found < capacity) out[found] = j;
                ++found;
            }
        }
    for (uint32_t d = 0; d < f.drop_count; ++d) {
        if (outside(f.dx[d], f.dy[d], f.dz[d], f.reach[d])) continue;
        if (found < capacity) out[found] = f.point_count + d;
        ++found;
    }
    return found;
}

void evaluate(const Field& f, const uint32_t* candidates, uint32_t candidate_count, const float* x, const float* y,
              const float* z, uint32_t n, float* value) noexcept {
    const uint32_t points = count_points(f, candidates, candidate_count);
    Batch k;
    for (uint32_t first = 0; first < n; first += lanes) {
        const uint32_t some = std::min(lanes, n - first);
        blend(f, candidates, points, x + first, y + first, z + first, some, k);
        std::copy(k.value, k.value + some, value + first);
    }
    add_drops(f, candidates, points, candidate_count, x, y, z, n, value, nullptr, nullptr, nullptr, nullptr,
              nullptr, nullptr);
}

void evaluate_gradient(const Field& f, const uint32_t* candidates, uint32_t candidate_count, const float* x,
                       const float* y, const float* z, uint32_t n, float* value, float* gx, float* gy, float* gz,
                       float* velocity) noexcept {
    const uint32_t points = count_points(f, candidates, candidate_count);
    float *vx = velocity, *vy = velocity ? velocity + n : nullptr, *vz = velocity ? velocity + 2 * n : nullptr;
    Batch k;
    for (uint32_t first = 0; first < n; first += lanes) {
        const uint32_t some = std::min(lanes, n - first);
        blend(f, candidates, points, x + first, y + first, z + first, some, k);
        Gradients sum;
        blend_gradients(f, candidates, points, k.p, k.nearest, k.sign, sum);
        for (uint32_t l = 0; l < some; ++l) {
            const uint32_t i = first + l;
            value[i] = k.value[l];
            if (k.sign[l] == 0 || !(sum.weight[l] > 0)) {
                gx[i] = gy[i] = gz[i] = 0;
                if (vx) vx[i] = vy[i] = vz[i] = 0;
                continue;
            }
            const float s = 1 / sum.weight[l];
            gx[i] = (sum.gx[l] - k.value[l] * sum.wx[l]) * s;
            gy[i] = (sum.gy[l] - k.value[l] * sum.wy[l]) * s;
            gz[i] = (sum.gz[l] - k.value[l] * sum.wz[l]) * s;
            if (vx) vx[i] = sum.vx[l] * s, vy[i] = sum.vy[l] * s, vz[i] = sum.vz[l] * s;
        }
    }
    add_drops(f, candidates, points, candidate_count, x, y, z, n, value, gx, gy, gz, vx, vy, vz);
}

}  // namespace rill::surface
