// SPDX-License-Identifier: MIT
// Building the field: grid, supports, local quadratics. Evaluation stands in field_evaluate.cpp and field_kernels.cpp.
//
// Departures from the paper, each measured on real liquids:
//   rows      weighted by distance, only neighbours that face the same way
//   support   follows the local spacing (distance to the 6th neighbour of the same side)
//   curvature clamped, so that a degenerate neighbourhood gives a flat patch and never a spike; at .9 of a radius
//             (at .45 honest fillets and drops cost 6 % more bytes at equal error)
#include "surface/field.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "surface/field_kernels.h"
#include "surface/field_rules.h"

namespace rill::surface {
namespace {

constexpr uint32_t most_neighbours = 14;   // rows of the fit
constexpr uint32_t support_neighbour = 6;  // R = support_scale · distance to this one
constexpr float support_scale = 1.4f;
constexpr float same_side = 0.3f;          // least n·n of a row
constexpr float most_alone = 1.8f;         // support relative to that of the points of either side
constexpr float most_apart = 4.5;  // likewise to the distance of the 2nd nearest point
constexpr float most_area = 0.3f;           // of the squared distance to the 6th neighbour of either side, over π
constexpr float most_bend = 0.9f;          // |curvature|·R at most: a patch never curls over
constexpr float ridge = 1e-3f;             // of the normalised normal equations: minimal norm when degenerate

size_t aligned(size_t bytes) { return (bytes + 63) & ~size_t(63); }

/// Cells of the dense grid: enough that a cell holds a few points of a surface.
uint32_t grid_capacity(uint32_t points) { return 8 * points + 64; }

/// Clusters are blocks of so many grid cells a side; a block of many points makes several.
constexpr uint32_t cluster_cells = 3, cluster_size = 32;
constexpr uint32_t group_cells = 3 * cluster_cells;  // groups of clusters likewise
uint32_t cluster_capacity(uint32_t points) { return points; }

struct Carver {
    uint8_t* at;
    template <class T> T* take(size_t count) {
        T* block = reinterpret_cast<T*>(at);
        at += aligned(count * sizeof(T));
        return block;
    }
};

void carve(Field& field, Carver carver, uint32_t points, uint32_t drops) {
    field.patches = carver.take<Patch>(points);
    float** arrays[] = {&field.x,  &field.y,  &field.z,  &field.nx,      &field.ny,       &field.nz,
                        &field.vx, &field.vy, &field.vz, &field.support, &field.activity, &field.area, &field.steep};
    for (float** array : arrays) {
        *array = carver.take<float>(points + lanes);  // kernels read whole batches
        std::fill(*array, *array + points + lanes, 0.f);
    }
    field.source = carver.take<uint32_t>(points);
    float** drop_arrays[] = {&field.dx, &field.dy, &field.dz, &field.dvx, &field.dvy, &field.dvz,
                             &field.radius, &field.reach, &field.drop_activity};
    for (float** array : drop_arrays) *array = carver.take<float>(drops);
    for (float*& array : field.inverse) array = carver.take<float>(drops);
    field.cell_start = carver.take<uint32_t>(grid_capacity(points) + 1);
    field.clusters = carver.take<Cluster>(cluster_capacity(points));
    field.groups = carver.take<Cluster>(cluster_capacity(points));
    field.cluster_member = carver.take<uint32_t>(points);
}

bool finite(const format::PointSet& p, uint32_t i) {
    return std::isfinite(p.x[i] + p.y[i] + p.z[i] + p.nx[i] + p.ny[i] + p.nz[i]) && p.activity[i] > 0;
}

uint32_t cell_of(float x, float origin, float cell, uint32_t size) {
    const float c = std::floor((x - origin) / cell);
    return c <= 0 ? 0u : std::min(uint32_t(std::min(c, 1e6f)), size - 1);
}
uint32_t cell_index(const Field& f, float x, float y, float z) {
    const uint32_t cx = cell_of(x, f.grid_origin[0], f.grid_cell, f.grid_size[0]);
    const uint32_t cy = cell_of(y, f.grid_origin[1], f.grid_cell, f.grid_size[1]);
    const uint32_t cz = cell_of(z, f.grid_origin[2], f.grid_cell, f.grid_size[2]);
    return (cz * f.grid_size[1] + cy) * f.grid_size[0] + cx;
}

void lay_grid(Field& field, const format::PointSet& points) {
    float lower[3] = {1e30f, 1e30f, 1e30f}, upper[3] = {-1e30f, -1e30f, -1e30f};
    uint32_t count = 0;
    for (uint32_t i = 0; i < points.count; ++i) {
        if (!finite(points, i)) continue;
        const float p[3] = {points.x[i], points.y[i], points.z[i]};
        for (int a = 0; a < 3; ++a) lower[a] = std::min(lower[a], p[a]), upper[a] = std::max(upper[a], p[a]);
        ++count;
    }
    field.point_count = count;
    if (count == 0) std::fill(lower, lower + 3, 0.f), std::fill(upper, upper + 3, 0.f);
    const float longest = std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2], 1e-6f});
    // Start from the finest sensible cell (surface spacing) and coarsen until the grid fits.
    float cell = longest / std::max(1.f, std::sqrt(float(count)));
    for (;; cell *= 1.2f) {
        double cells = 1;
        for (int a = 0; a < 3; ++a) {
            field.grid_size[a] = uint32_t(std::min((upper[a] - lower[a]) / cell, 1e6f)) + 1;
            cells *= field.grid_size[a];
        }
        if (cells <= grid_capacity(count)) break;
    }
    field.grid_cell = cell;
    std::memcpy(field.grid_origin, lower, sizeof lower);
}

void sort_points(Field& f, const format::PointSet& p) {
    const uint32_t cells = f.grid_size[0] * f.grid_size[1] * f.grid_size[2];
    std::memset(f.cell_start, 0, (cells + 1) * sizeof(uint32_t));
    for (uint32_t i = 0; i < p.count; ++i)
        if (finite(p, i)) ++f.cell_start[cell_index(f, p.x[i], p.y[i], p.z[i]) + 1];
    for (uint32_t c = 0; c < cells; ++c) f.cell_start[c + 1] += f.cell_start[c];
    for (uint32_t i = 0; i < p.count; ++i) {
        if (!finite(p, i)) continue;
        const uint32_t at = f.cell_start[cell_index(f, p.x[i], p.y[i], p.z[i])]++;
        const float length = std::sqrt(p.nx[i] * p.nx[i] + p.ny[i] * p.ny[i] + p.nz[i] * p.nz[i]);
        const float scale = length > 0 ? 1 / length : 0;
        f.x[at] = p.x[i], f.y[at] = p.y[i], f.z[at] = p.z[i];
        f.nx[at] = p.nx[i] * scale, f.ny[at] = p.ny[i] * scale, f.nz[at] = p.nz[i] * scale;
        f.vx[at] = p.vx[i], f.vy[at] = p.vy[i], f.vz[at] = p.vz[i];
        f.activity[at] = std::min(p.activity[i], 1.f);
        f.source[at] = i;
    }
    for (uint32_t c = cells; c > 0; --c) f.cell_start[c] = f.cell_start[c - 1];
    f.cell_start[0] = 0;
}

/// Ellipsoid {c + S u}: stores S⁻¹, so that |S⁻¹ r| = 1 on the surface. A flat or broken S is skipped.
void place_drops(Field& f, const format::DropSet& drops) {
    f.drop_count = 0;
    for (uint32_t i = 0; i < drops.count; ++i) {
        float s[6];
        for (int k = 0; k < 6; ++k) s[k] = drops.shape[k][i];
        const float xx = s[0], yy = s[1], zz = s[2], xy = s[3], xz = s[4], yz = s[5];
        const float c0 = yy * zz - yz * yz, c1 = xz * yz - xy * zz, c2 = xy * yz - yy * xz;
        const float determinant = xx * c0 + xy * c1 + xz * c2;
        const float size = std::sqrt(xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz));
        if (!(determinant > 1e-4f * size * size * size) || !std::isfinite(determinant) ||
            !std::isfinite(drops.x[i] + drops.y[i] + drops.z[i]) || !(drops.activity[i] > 0)) continue;
        const uint32_t at = f.drop_count++;
        const float k = 1 / determinant;
        const float inverse[6] = {c0 * k, (xx * zz - xz * xz) * k, (xx * yy - xy * xy) * k,
                                  c1 * k, c2 * k, (xy * xz - xx * yz) * k};
        // A drop that is born or dies grows and shrinks with its activity.
        const float grow = 1 / std::cbrt(std::max(std::min(drops.activity[i], 1.f), 1e-3f));
        for (int a = 0; a < 6; ++a) f.inverse[a][at] = inverse[a] * grow;
        f.dx[at] = drops.x[i], f.dy[at] = drops.y[i], f.dz[at] = drops.z[i];
        f.dvx[at] = drops.vx[i], f.dvy[at] = drops.vy[i], f.dvz[at] = drops.vz[i];
        f.radius[at] = std::cbrt(determinant) / grow;
        f.reach[at] = 1.5f * size;
        f.drop_activity[at] = drops.activity[i];
    }
}

struct Neighbours {
    uint32_t count = 0;
    float any[support_neighbour];  // squared distances of the nearest of either side
    Neighbours() { std::fill(any, any + support_neighbour, 1e30f); }
    void offer_any(float distance2) {
        if (distance2 >= any[support_neighbour - 1]) return;
        uint32_t at = support_neighbour - 1;
        for (; at > 0 && any[at - 1] > distance2; --at) any[at] = any[at - 1];
        any[at] = distance2;
    }
    uint32_t id[most_neighbours];
    float d2[most_neighbours];
    void offer(uint32_t i, float distance2) {
        if (count == most_neighbours && distance2 >= d2[count - 1]) return;
        uint32_t at = count < most_neighbours ? count++ : count - 1;
        for (; at > 0 && d2[at - 1] > distance2; --at) d2[at] = d2[at - 1], id[at] = id[at - 1];
        d2[at] = distance2, id[at] = i;
    }
};

/// The points of a box of grid cells, side by side: points of one cell share them.
struct Surroundings {
    static constexpr uint32_t capacity = 256;
    uint32_t count = 0, id[capacity];
    alignas(64) float x[capacity], y[capacity], z[capacity], nx[capacity], ny[capacity], nz[capacity];
    int32_t cell[3] = {-1, -1, -1}, reach = 0;
    bool whole, complete;  // the box holds the grid; the box's points fit

    void begin(const Field& f, const int32_t at[3], int32_t far) {
        std::memcpy(cell, at, sizeof(cell));
        reach = far, count = 0, complete = true;
        for_rows(f, [&](uint32_t first, uint32_t last) { complete = complete && add(f, first, last); });
    }
    /// Work(first, last): sorted points, row by row of the box.
    template <typename Work>
    void for_rows(const Field& f, Work&& work) {
        int32_t from[3], to[3];
        whole = true;
        for (int a = 0; a < 3; ++a) {
            from[a] = std::max(0, cell[a] - reach), to[a] = std::min(int32_t(f.grid_size[a]) - 1, cell[a] + reach);
            whole = whole && to[a] - from[a] + 1 == int32_t(f.grid_size[a]);
        }
        for (int32_t z = from[2]; z <= to[2]; ++z)
            for (int32_t y = from[1]; y <= to[1]; ++y) {
                const uint32_t row = (uint32_t(z) * f.grid_size[1] + uint32_t(y)) * f.grid_size[0];
                const uint32_t first = f.cell_start[row + uint32_t(from[0])], last = f.cell_start[row + uint32_t(to[0]) + 1];
                if (first < last) work(first, last);
            }
    }
    bool add(const Field& f, uint32_t first, uint32_t last) {
        if (last - first > capacity - count) return false;
        for (uint32_t j = first; j < last; ++j, ++count) {
            x[count] = f.x[j], y[count] = f.y[j], z[count] = f.z[j];
            nx[count] = f.nx[j], ny[count] = f.ny[j], nz[count] = f.nz[j], id[count] = j;
        }
        return true;
    }
    /// Those within the ball of squared radius `bound`.
    void offer_all(const Field& f, uint32_t i, float bound, Neighbours& found) {
        const float px = f.x[i], py = f.y[i], pz = f.z[i], nx_i = f.nx[i], ny_i = f.ny[i], nz_i = f.nz[i];
        for (uint32_t c = 0; c < count; ++c) {
            const float dx = x[c] - px, dy = y[c] - py, dz = z[c] - pz;
            d2[c] = dx * dx + dy * dy + dz * dz;
            agree[c] = nx[c] * nx_i + ny[c] * ny_i + nz[c] * nz_i;
        }
        uint32_t close = 0;
        for (uint32_t c = 0; c < count; ++c) {  // no branch: who is close is past foretelling
            place[close] = c;
            close += (d2[c] < bound) & (id[c] != i);
        }
        if (found.count == 0 && close <= most_sorted) return take_sorted(close, found);
        for (uint32_t k = 0; k < close; ++k) {
            const uint32_t c = place[k];
            found.offer_any(d2[c]);
            if (agree[c] >= same_side) found.offer(id[c], d2[c]);
        }
    }
    /// What offering them one by one comes to, without a branch that depends on distances: each one's rank is the number
    /// of those before it, of equals the first listed.
    void take_sorted(uint32_t close, Neighbours& found) const {
        float key[most_sorted];
        int32_t rank[most_sorted];
        uint32_t order[most_sorted];
        for (uint32_t k = 0; k < close; ++k) {
            const float own = key[k] = d2[place[k]];
            int32_t before = 0;
            for (uint32_t j = 0; j < k; ++j) {
                const int32_t first = key[j] <= own;
                before += first, rank[j] += 1 - first;
            }
            rank[k] = before;
        }
        for (uint32_t k = 0; k < close; ++k) order[rank[k]] = place[k];
        for (uint32_t k = 0; k < std::min(close, support_neighbour); ++k) found.any[k] = d2[order[k]];
        for (uint32_t k = 0; k < close && found.count < most_neighbours; ++k) {
            const uint32_t c = order[k];
            found.id[found.count] = id[c], found.d2[found.count] = d2[c];
            found.count += agree[c] >= same_side;
        }
    }
    static constexpr uint32_t most_sorted = 64;
    float d2[capacity], agree[capacity];
    uint32_t place[capacity + 1];
    float guess = 1e30f;  ///< of the squared radius that holds all neighbours, from the last point; changes no result
};

Neighbours offer_box(const Field& f, uint32_t i, float bound, Surroundings& around) {
    Neighbours found;
    if (around.complete) {
        around.offer_all(f, i, bound, found);
        return found;
    }
    around.count = 0;  // a crowd: part by part
    around.for_rows(f, [&](uint32_t first, uint32_t last) {
        for (uint32_t some; first < last; first += some) {
            some = std::min(last - first, Surroundings::capacity);
            if (around.add(f, first, first + some)) continue;
            around.offer_all(f, i, bound, found);
            around.count = some = 0;
        }
    });
    around.offer_all(f, i, bound, found);
    return found;
}

/// The nearest points that face the same way as point i: those of a box of grid cells around its own, which grows
/// until it holds the ball that they span.
Neighbours find_neighbours(const Field& f, uint32_t i, Surroundings& around) {
    constexpr int32_t first_reach = 2, last_reach = 8;
    const float p[3] = {f.x[i], f.y[i], f.z[i]};
    int32_t at[3];
    for (int a = 0; a < 3; ++a) at[a] = int32_t(cell_of(p[a], f.grid_origin[a], f.grid_cell, f.grid_size[a]));
    // A box that had to grow for another point of the cell serves as well: the nearest are the nearest.
    if (std::memcmp(at, around.cell, sizeof(at)) != 0) around.begin(f, at, first_reach);
    for (;; around.begin(f, at, around.reach + 1)) {
        Neighbours found = offer_box(f, i, around.guess, around);
        if (found.count < most_neighbours) found = offer_box(f, i, 1e30f, around);
        const float ball = float(around.reach) * f.grid_cell;  // the own cell lies between
        const bool full = found.count == most_neighbours, enough = full && found.d2[found.count - 1] <= ball * ball;
        if (full) around.guess = 2 * found.d2[found.count - 1];
        if (enough || around.whole || around.reach >= last_reach) return found;
    }
}

/// Distance within which `support_neighbour` neighbours' worth of activity lies; interpolated, so that it
/// moves smoothly while a point fades.
float spacing_of(const Field& f, const Neighbours& n) {
    float sum = 0, before = 0;
    for (uint32_t k = 0; k < n.count; ++k) {
        const float distance = std::sqrt(n.d2[k]), more = f.activity[n.id[k]];
        if (sum + more >= support_neighbour) return before + (distance - before) * (support_neighbour - sum) / more;
        sum += more, before = distance;
    }
    return before * 1.2f;  // fewer than six: a little patch of its own
}

struct Frame3 {
    float t1[3], t2[3];
};
/// Any two unit tangents (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
Frame3 tangents(float nx, float ny, float nz) {
    const float s = nz >= 0 ? 1.f : -1.f, a = -1 / (s + nz), b = nx * ny * a;
    return {{1 + s * nx * nx * a, s * b, -s * nx}, {b, s + ny * ny * a, -ny}};
}

/// Minimal-norm (ridge) solution of the 3×3 normal equations.
bool solve3(const float m[6], const float r[3], float out[3]) {
    const float trace = m[0] + m[3] + m[5], k = ridge * trace;
    if (!(trace > 0)) return false;
    const double a = m[0] + k, b = m[1], c = m[2], d = m[3] + k, e = m[4], g = m[5] + k;
    const double i0 = d * g - e * e, i1 = c * e - b * g, i2 = b * e - c * d;
    const double determinant = a * i0 + b * i1 + c * i2;
    if (!(determinant > 0)) return false;
    out[0] = float((i0 * r[0] + i1 * r[1] + i2 * r[2]) / determinant);
    out[1] = float((i1 * r[0] + (a * g - c * c) * r[1] + (b * c - a * e) * r[2]) / determinant);
    out[2] = float((i2 * r[0] + (b * c - a * e) * r[1] + (a * d - b * b) * r[2]) / determinant);
    return true;
}

void fit_patch(Field& f, uint32_t i, Surroundings& surroundings) {
    const Neighbours neighbours = find_neighbours(f, i, surroundings);
    // A lone point of its side must not reach across its whole surroundings.
    const float around = std::sqrt(neighbours.any[support_neighbour - 1]);
    // And a droplet of a few points must not take its measure from the next droplet.
    const float beside = std::sqrt(neighbours.any[1]);
    const float spacing = std::min({spacing_of(f, neighbours), most_alone * around, most_apart * beside});
    // A point that fades draws in, or what it alone covers would stay to the last and then be gone at once.
    const float grown = f.activity[i];
    const float support = (spacing > 1e-4f * f.grid_cell ? support_scale * spacing : f.grid_cell) * grown;
    f.support[i] = support;
    // k neighbours within d: on a surface one point in π d² / (k + ½). Far more even than a rule on the 6th; but the
    // neighbours of a droplet's points are other droplets'.
    const float last = neighbours.count >= support_neighbour ? neighbours.d2[neighbours.count - 1] / (float(neighbours.count) + 0.5f)
                                                             : 0.15f * spacing * spacing;
    f.area[i] = 0.25f * std::min(last, most_area * neighbours.any[support_neighbour - 1]) * f.activity[i];
    float quadratic[3] = {0, 0, 0};
    const Frame3 frame = tangents(f.nx[i], f.ny[i], f.nz[i]);
    if (neighbours.count >= 1 && spacing > 1e-4f * f.grid_cell) {
        const float scale = 1 / spacing;
        const float reach = 1.15f * std::sqrt(neighbours.d2[neighbours.count - 1]) * scale;
        float m[6] = {}, rhs[3] = {};
        for (uint32_t k = 0; k < neighbours.count; ++k) {
            const uint32_t j = neighbours.id[k];
            const float r[3] = {(f.x[j] - f.x[i]) * scale, (f.y[j] - f.y[i]) * scale, (f.z[j] - f.z[i]) * scale};
            const float u = std::sqrt(neighbours.d2[k]) * scale / reach, v = 1 - u;
            const float w = f.activity[j] * v * v * v * v * (4 * u + 1);  // Wendland C2
            const float t1 = r[0] * frame.t1[0] + r[1] * frame.t1[1] + r[2] * frame.t1[2];
            const float t2 = r[0] * frame.t2[0] + r[1] * frame.t2[1] + r[2] * frame.t2[2];
            const float h = r[0] * f.nx[i] + r[1] * f.ny[i] + r[2] * f.nz[i];
            const float row[3] = {t1 * t1, t1 * t2, t2 * t2};
            m[0] += w * row[0] * row[0], m[1] += w * row[0] * row[1], m[2] += w * row[0] * row[2];
            m[3] += w * row[1] * row[1], m[4] += w * row[1] * row[2], m[5] += w * row[2] * row[2];
            for (int a = 0; a < 3; ++a) rhs[a] -= w * row[a] * h;
        }
        if (!solve3(m, rhs, quadratic)) quadratic[0] = quadratic[1] = quadratic[2] = 0;
        for (float& q : quadratic) q *= scale;  // from spacings to metres
        // Largest |eigenvalue| of [a b/2; b/2 c].
        const float middle = 0.5f * (quadratic[0] + quadratic[2]), half = 0.5f * (quadratic[0] - quadratic[2]);
        const float bend = std::fabs(middle) + std::sqrt(half * half + 0.25f * quadratic[1] * quadratic[1]);
        if (bend * support > most_bend)
            for (float& q : quadratic) q *= most_bend / (bend * support);
    }
    const float *s = frame.t1, *t = frame.t2, a = quadratic[0], b = quadratic[1], c = quadratic[2];
    f.steep[i] = 1 / (support * support);
    f.patches[i] = {f.x[i], f.y[i], f.z[i], f.nx[i], f.ny[i], f.nz[i],
                    a * s[0] * s[0] + b * s[0] * t[0] + c * t[0] * t[0],
                    a * s[1] * s[1] + b * s[1] * t[1] + c * t[1] * t[1],
                    a * s[2] * s[2] + b * s[2] * t[2] + c * t[2] * t[2],
                    2 * a * s[0] * s[1] + b * (s[0] * t[1] + s[1] * t[0]) + 2 * c * t[0] * t[1],
                    2 * a * s[0] * s[2] + b * (s[0] * t[2] + s[2] * t[0]) + 2 * c * t[0] * t[2],
                    2 * a * s[1] * s[2] + b * (s[1] * t[2] + s[2] * t[1]) + 2 * c * t[1] * t[2],
                    f.steep[i], f.activity[i], 1 / f.activity[i], 0};
}

struct Disc {
    float centre[3], area[3], size, radius;  ///< size: of all areas, whatever their direction
};

/// One disc in place of `count`. Their areas give the centre; the ball holds them all.
template <typename Of>
Cluster joined(uint32_t first, uint32_t last, Of&& disc) {
    Cluster k{};
    k.first = first, k.last = last;
    float total = 0, furthest = 0;
    for (uint32_t m = first; m < last; ++m) {
        const Disc d = disc(m);
        for (int a = 0; a < 3; ++a) k.centre[a] += d.size * d.centre[a], k.area[a] += d.area[a];
        total += d.size;
    }
    for (float& x : k.centre) x /= std::max(total, 1e-30f);
    for (uint32_t m = first; m < last; ++m) {
        const Disc d = disc(m);
        const float r[3] = {d.centre[0] - k.centre[0], d.centre[1] - k.centre[1], d.centre[2] - k.centre[2]};
        furthest = std::max(furthest, std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) + d.radius);
    }
    k.limit = from_afar * furthest * furthest;
    return k;
}
Cluster join_points(const Field& f, uint32_t first, uint32_t last) {
    return joined(first, last, [&](uint32_t m) {
        const uint32_t j = f.cluster_member[m];
        const float area = f.area[j];
        return Disc{{f.x[j], f.y[j], f.z[j]}, {area * f.nx[j], area * f.ny[j], area * f.nz[j]}, area, 0};
    });
}
Cluster join_clusters(const Field& f, uint32_t first, uint32_t last) {
    return joined(first, last, [&](uint32_t m) {
        const Cluster& k = f.clusters[m];
        const float size = std::sqrt(k.area[0] * k.area[0] + k.area[1] * k.area[1] + k.area[2] * k.area[2]);
        return Disc{{k.centre[0], k.centre[1], k.centre[2]}, {k.area[0], k.area[1], k.area[2]}, size,
                    std::sqrt(k.limit / from_afar)};
    });
}

/// Points of the grid cells of one block, row by row.
uint32_t list_block(Field& f, const uint32_t block[3], uint32_t at) {
    const uint32_t* size = f.grid_size;
    for (uint32_t z = block[2]; z < std::min(block[2] + cluster_cells, size[2]); ++z)
        for (uint32_t y = block[1]; y < std::min(block[1] + cluster_cells, size[1]); ++y) {
            const uint32_t row = (z * size[1] + y) * size[0];
            const uint32_t last = std::min(block[0] + cluster_cells, size[0]);
            for (uint32_t j = f.cell_start[row + block[0]]; j < f.cell_start[row + last]; ++j) f.cluster_member[at++] = j;
        }
    return at;
}

/// Work(corner) for the blocks of `step` grid cells a side in [from, to).
template <typename Work>
void for_blocks(const uint32_t from[3], const uint32_t to[3], uint32_t step, Work&& work) {
    uint32_t block[3];
    for (block[2] = from[2]; block[2] < to[2]; block[2] += step)
        for (block[1] = from[1]; block[1] < to[1]; block[1] += step)
            for (block[0] = from[0]; block[0] < to[0]; block[0] += step) work(block);
}

void build_clusters(Field& f) {
    uint32_t listed = 0;
    const uint32_t origin[3] = {0, 0, 0};
    for_blocks(origin, f.grid_size, group_cells, [&](const uint32_t group[3]) {
        const uint32_t first = f.cluster_count;
        uint32_t to[3];
        for (int a = 0; a < 3; ++a) to[a] = std::min(group[a] + group_cells, f.grid_size[a]);
        for_blocks(group, to, cluster_cells, [&](const uint32_t block[3]) {
            const uint32_t end = list_block(f, block, listed);
            for (; listed < end; listed = std::min(listed + cluster_size, end))
                f.clusters[f.cluster_count++] = join_points(f, listed, std::min(listed + cluster_size, end));
        });
        if (f.cluster_count > first) f.groups[f.group_count++] = join_clusters(f, first, f.cluster_count);
    });
}

}  // namespace

size_t field_bytes(uint32_t points, uint32_t drops) noexcept {
    return aligned(points * sizeof(Patch)) + 13 * aligned((points + lanes) * sizeof(float)) + 2 * aligned(points * sizeof(uint32_t)) +
           15 * aligned(drops * sizeof(float)) + aligned((grid_capacity(points) + 1) * sizeof(uint32_t)) +
           2 * aligned(cluster_capacity(points) * sizeof(Cluster));
}

void begin_field(Field& field, void* memory, const format::PointSet& points,
                 const format::DropSet& drops) noexcept {
    field = {};
    field.kernels = &best_kernels();
    carve(field, {static_cast<uint8_t*>(memory)}, points.count, drops.count);
    lay_grid(field, points);
    sort_points(field, points);
    place_drops(field, drops);
}

void fit_patches(Field& field, uint32_t first, uint32_t last) noexcept {
    Surroundings surroundings;
    for (uint32_t i = first; i < last; ++i) fit_patch(field, i, surroundings);
}

void finish_field(Field& f) noexcept {
    build_clusters(f);
    for (int a = 0; a < 3; ++a) f.lower[a] = 1e30f, f.upper[a] = -1e30f;
    const auto include = [&](float x, float y, float z, float r) {
        const float p[3] = {x, y, z};
        for (int a = 0; a < 3; ++a) {
            f.lower[a] = std::min(f.lower[a], p[a] - r);
            f.upper[a] = std::max(f.upper[a], p[a] + r);
        }
    };
    for (uint32_t i = 0; i < f.point_count; ++i) {
        f.largest_support = std::max(f.largest_support, f.support[i]);
        include(f.x[i], f.y[i], f.z[i], f.support[i]);
    }
    for (uint32_t i = 0; i < f.drop_count; ++i) {
        f.largest_reach = std::max(f.largest_reach, f.reach[i]);
        include(f.dx[i], f.dy[i], f.dz[i], f.reach[i]);
    }
}

}  // namespace rill::surface
