// SPDX-License-Identifier: MIT
// Building the field: order, bundles, drops. Fits stand in field_kernels_fit.h, evaluation in field_evaluate.cpp.
#include "surface/field.h"

#include <algorithm>
#include <cmath>

#include "surface/field_kernels.h"
#include "surface/field_rules.h"

namespace rill::surface {
namespace {

size_t aligned(size_t bytes) { return (bytes + 63) & ~size_t(63); }

uint32_t bundles_of(uint32_t count) { return (count + lanes - 1) / lanes; }
constexpr uint32_t point_rows = 14, drop_rows = 15, drop_bundle_rows = 6, bundle_rows = 13;
size_t bundle_bytes(uint32_t bundles) { return bundle_rows * aligned((bundles + lanes) * sizeof(float)); }

struct Carver {
    uint8_t* at;
    template <class T> T* take(size_t count) {
        T* block = reinterpret_cast<T*>(at);
        at += aligned(count * sizeof(T));
        return block;
    }
};

void carve_bundles(Bundles& b, Carver& carver, uint32_t capacity) {
    float** rows[bundle_rows] = {&b.x,     &b.y,        &b.z,        &b.ax,       &b.ay,       &b.az,      &b.limit,
                                 &b.lower[0], &b.lower[1], &b.lower[2], &b.upper[0], &b.upper[1], &b.upper[2]};
    for (float** row : rows) *row = carver.take<float>(capacity + lanes);
}

void carve(Field& field, Carver carver, uint32_t points, uint32_t drops) {
    field.patches = carver.take<Patch>(points);
    float** arrays[point_rows] = {&field.x,  &field.y,  &field.z,  &field.nx,      &field.ny,       &field.nz,
                                  &field.vx, &field.vy, &field.vz, &field.support, &field.activity, &field.farther, &field.area, &field.steep};
    for (float** array : arrays) *array = carver.take<float>(points + lanes);  // kernels read whole batches
    field.source = carver.take<uint32_t>(points);
    float** drop_arrays[] = {&field.dx, &field.dy, &field.dz, &field.dvx, &field.dvy, &field.dvz,
                             &field.radius, &field.reach, &field.drop_activity};
    for (float** array : drop_arrays) *array = carver.take<float>(drops);
    for (float*& array : field.inverse) array = carver.take<float>(drops);
    field.drop_source = carver.take<uint32_t>(drops);
    for (int a = 0; a < 3; ++a) {
        field.drops_lower[a] = carver.take<float>(bundles_of(drops));
        field.drops_upper[a] = carver.take<float>(bundles_of(drops));
    }
    carve_bundles(field.bundles, carver, bundles_of(points));
    carve_bundles(field.groups, carver, bundles_of(bundles_of(points)));
}

bool finite(const format::PointSet& p, uint32_t i) {
    return std::isfinite(p.x[i] + p.y[i] + p.z[i] + p.nx[i] + p.ny[i] + p.nz[i]) && p.activity[i] > 0;
}

/// About the distance of points: as if they lay on a smooth surface, more where that has to fold.
float spacing_of(const float lower[3], const float upper[3], uint32_t points) {
    const float longest = std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2], 1e-6f});
    for (float spacing = longest / std::max(1.f, std::sqrt(float(points)));; spacing *= 1.2f) {
        double cells = 1;
        for (int a = 0; a < 3; ++a) cells *= std::floor((upper[a] - lower[a]) / spacing) + 1;
        if (cells <= 8.0 * points + 64) return spacing;
    }
}

struct Extent {
    float lower[3], upper[3];
};
Extent extent_of(const float* const position[3], const uint32_t* points, uint32_t count) {
    Extent e;
    for (int a = 0; a < 3; ++a) e.lower[a] = count ? 1e30f : 0, e.upper[a] = count ? -1e30f : 0;
    for (uint32_t k = 0; k < count; ++k)
        for (int a = 0; a < 3; ++a) {
            const float x = position[a][points[k]];
            e.lower[a] = std::min(e.lower[a], x), e.upper[a] = std::max(e.upper[a], x);
        }
    return e;
}

/// Brings the `half` points that come first along an axis to the front; of equals the first in number. Counted into bins
/// first, without a branch, so that only those of one bin are left to compare: a third of the time. `spare`: for 2 count + 2.
void halve(const float* along, float lower, float upper, uint32_t* points, uint32_t count, uint32_t half, uint32_t* spare) {
    constexpr uint32_t bins = 64;
    const auto first = [along](uint32_t i, uint32_t j) { return along[i] != along[j] ? along[i] < along[j] : i < j; };
    if (!(upper - lower > 1e-30f && upper - lower < 1e30f)) return std::nth_element(points, points + half, points + count, first);
    const float scale = (bins - 1) / (upper - lower);
    const auto bin_of = [&](uint32_t i) { return uint32_t((along[i] - lower) * scale); };
    uint32_t held[bins + 1] = {}, middle = 0, before = 0;
    for (uint32_t k = 0; k < count; ++k) ++held[bin_of(points[k])];
    while (before + held[middle] <= half) before += held[middle++];
    uint32_t low = 0, same = 0, high = 0, *const at_middle = spare, *const above = spare + count + 1;
    for (uint32_t k = 0; k < count; ++k) {
        const uint32_t i = points[k], bin = bin_of(i);
        points[low] = at_middle[same] = above[high] = i;
        low += bin < middle, same += bin == middle, high += bin > middle;
    }
    std::copy(above, above + high, std::copy(at_middle, at_middle + same, points + low));
    std::nth_element(points + low, points + half, points + low + same, first);
}

/// Halves the points along the longest side of their box until sixteen are left, so that each sixteen lie together, and
/// each sixteen of those. (Along a Morton curve bundles are so much wider that neighbours take four times as long.)
void divide(const float* const position[3], uint32_t* points, uint32_t count, uint32_t* spare) {
    constexpr uint32_t group = lanes * lanes;
    while (count > lanes) {
        const Extent e = extent_of(position, points, count);
        int axis = e.upper[1] - e.lower[1] > e.upper[0] - e.lower[0] ? 1 : 0;
        if (e.upper[2] - e.lower[2] > e.upper[axis] - e.lower[axis]) axis = 2;
        const uint32_t whole = count > group ? group : lanes, half = ((count + 1) / 2 + whole - 1) / whole * whole;
        halve(position[axis], e.lower[axis], e.upper[axis], points, count, half, spare);
        divide(position, points, half, spare);
        points += half, count -= half;
    }
    std::sort(points, points + count);
}

/// Point `at`, from its source.
void place_point(Field& f, uint32_t at, const format::PointSet& p) {
    const uint32_t i = f.source[at];
    const float length = std::sqrt(p.nx[i] * p.nx[i] + p.ny[i] * p.ny[i] + p.nz[i] * p.nz[i]);
    const float scale = length > 0 ? 1 / length : 0;
    f.x[at] = p.x[i], f.y[at] = p.y[i], f.z[at] = p.z[i];
    f.nx[at] = p.nx[i] * scale, f.ny[at] = p.ny[i] * scale, f.nz[at] = p.nz[i] * scale;
    f.vx[at] = p.vx[i], f.vy[at] = p.vy[i], f.vz[at] = p.vz[i];
    f.activity[at] = std::min(p.activity[i], 1.f);
    f.farther[at] = 1 / std::sqrt(std::max(f.activity[at], 1e-12f));
}
void pad_points(Field& f) {
    for (uint32_t at = f.point_count; at < f.point_count + lanes; ++at) {
        f.x[at] = f.y[at] = f.z[at] = nowhere;
        f.nx[at] = f.ny[at] = f.nz[at] = f.activity[at] = f.area[at] = 0, f.farther[at] = f.steep[at] = 1;
    }
}

void sort_points(Field& f, const format::PointSet& p) {
    for (uint32_t i = 0; i < p.count; ++i)
        if (finite(p, i)) f.source[f.point_count++] = i;
    const float* const position[3] = {p.x, p.y, p.z};
    const Extent e = extent_of(position, f.source, f.point_count);
    f.spacing = spacing_of(e.lower, e.upper, f.point_count);
    static_assert(sizeof(Patch) >= 4 * sizeof(uint32_t));
    divide(position, f.source, f.point_count, reinterpret_cast<uint32_t*>(f.patches));  // not placed yet
    for (uint32_t at = 0; at < f.point_count; ++at) place_point(f, at, p);
    pad_points(f);
}

/// Of bundle k, from those of what it holds; `part(i, a, low, high)` tells their extent along axis a.
template <typename Part>
void bound_bundle(Bundles& b, uint32_t k, uint32_t parts, Part&& part) {
    for (int a = 0; a < 3; ++a) {
        float lower = 1e30f, upper = -1e30f;
        for (uint32_t i = lanes * k; i < std::min(lanes * (k + 1), parts); ++i) {
            float low, high;
            part(i, a, low, high);
            lower = std::min(lower, low), upper = std::max(upper, high);
        }
        b.lower[a][k] = lower, b.upper[a][k] = upper;
    }
}

template <typename Part>
void bound_bundles(Field& f, Part&& part) {
    for (uint32_t k = 0; k < f.bundles.count; ++k) bound_bundle(f.bundles, k, f.point_count, part);
    for (uint32_t k = 0; k < f.groups.count; ++k)
        bound_bundle(f.groups, k, f.bundles.count, [&](uint32_t i, int a, float& low, float& high) {
            low = f.bundles.lower[a][i], high = f.bundles.upper[a][i];
        });
}

void begin_bundles(Field& f) {
    f.bundles.count = bundles_of(f.point_count), f.groups.count = bundles_of(f.bundles.count);
    for (Bundles* b : {&f.bundles, &f.groups})
        for (uint32_t k = b->count; k < b->count + lanes; ++k) {  // padding is far from everything
            b->x[k] = b->y[k] = b->z[k] = nowhere, b->ax[k] = b->ay[k] = b->az[k] = 0, b->limit[k] = -1;
            for (int a = 0; a < 3; ++a) b->lower[a][k] = 1e30f, b->upper[a][k] = -1e30f;
        }
    const float* const position[3] = {f.x, f.y, f.z};
    bound_bundles(f, [&](uint32_t i, int a, float& low, float& high) { low = high = position[a][i]; });
}

struct Disc {
    float centre[3], area[3], size, radius;  ///< size: of all areas, whatever their direction
};

/// One disc in place of those in bundle k. Their areas give the centre; the ball holds them all.
template <typename Of>
void join(Bundles& b, uint32_t k, uint32_t parts, Of&& disc) {
    const uint32_t first = lanes * k, last = std::min(first + lanes, parts);
    float centre[3] = {}, area[3] = {}, total = 0, furthest = 0;
    for (uint32_t m = first; m < last; ++m) {
        const Disc d = disc(m);
        for (int a = 0; a < 3; ++a) centre[a] += d.size * d.centre[a], area[a] += d.area[a];
        total += d.size;
    }
    for (float& x : centre) x /= std::max(total, 1e-30f);
    for (uint32_t m = first; m < last; ++m) {
        const Disc d = disc(m);
        const float r[3] = {d.centre[0] - centre[0], d.centre[1] - centre[1], d.centre[2] - centre[2]};
        furthest = std::max(furthest, std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) + d.radius);
    }
    b.x[k] = centre[0], b.y[k] = centre[1], b.z[k] = centre[2];
    b.ax[k] = area[0], b.ay[k] = area[1], b.az[k] = area[2];
    b.limit[k] = from_afar * furthest * furthest;
}

void join_discs(Field& f) {
    for (uint32_t k = 0; k < f.bundles.count; ++k)
        join(f.bundles, k, f.point_count, [&](uint32_t j) {
            const float area = f.area[j];
            return Disc{{f.x[j], f.y[j], f.z[j]}, {area * f.nx[j], area * f.ny[j], area * f.nz[j]}, area, 0};
        });
    const Bundles& b = f.bundles;
    for (uint32_t k = 0; k < f.groups.count; ++k)
        join(f.groups, k, b.count, [&](uint32_t j) {
            const float size = std::sqrt(b.ax[j] * b.ax[j] + b.ay[j] * b.ay[j] + b.az[j] * b.az[j]);
            return Disc{{b.x[j], b.y[j], b.z[j]}, {b.ax[j], b.ay[j], b.az[j]}, size, std::sqrt(b.limit[j] / from_afar)};
        });
}

/// From positions to all places where points have weight; a little more than that, so that rounding loses none.
void widen_bundles(Field& f) {
    constexpr float more = 1.0001f, rounding = 1e-6f;
    const float* const position[3] = {f.x, f.y, f.z};
    const float* const normal[3] = {f.nx, f.ny, f.nz};
    bound_bundles(f, [&](uint32_t i, int a, float& low, float& high) {
        const float p = position[a][i], n = normal[a][i];
        const float thin = flatten / (1 + flatten) * n * n;  // half axes of the ellipsoid u² = 1: see field_rules.h
        const float reach = more * f.support[i] * std::sqrt(std::max(1 - thin, 0.f)) + rounding * std::fabs(p);
        low = p - reach, high = p + reach;
    });
}

/// The symmetric matrix S of an ellipsoid {c + S u}, as xx yy zz xy xz yz, and what its inverse is made of.
struct Shape {
    float s[6], cofactor[6], determinant, size;
    Shape(const format::DropSet& drops, uint32_t i) {
        for (int k = 0; k < 6; ++k) s[k] = drops.shape[k][i];
        const float xx = s[0], yy = s[1], zz = s[2], xy = s[3], xz = s[4], yz = s[5];
        const float of[6] = {yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy, xz * yz - xy * zz, xy * yz - yy * xz, xy * xz - xx * yz};
        std::copy(of, of + 6, cofactor);
        determinant = xx * cofactor[0] + xy * cofactor[3] + xz * cofactor[4];
        size = std::sqrt(xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz));
    }
    /// Neither flat, indefinite nor broken.
    bool is_sound() const {
        return cofactor[2] > 0 && s[0] * determinant > 0 && std::fabs(determinant) > 1e-4f * size * size * size && std::isfinite(determinant);
    }
};

/// As points are: those that are sound, each sixteen near each other.
void sort_drops(Field& f, const format::DropSet& drops) {
    f.drop_count = 0;
    for (uint32_t i = 0; i < drops.count; ++i)
        if (std::isfinite(drops.x[i] + drops.y[i] + drops.z[i]) && drops.activity[i] > 0 && Shape(drops, i).is_sound())
            f.drop_source[f.drop_count++] = i;
    const float* const position[3] = {drops.x, drops.y, drops.z};
    divide(position, f.drop_source, f.drop_count, reinterpret_cast<uint32_t*>(f.dx));  // three rows in one, not placed yet
}

/// Stores S⁻¹, so that |S⁻¹ r| = 1 on the surface. The S of a bubble is negative: so is its radius then, which turns the field
/// over.
void place_drops(Field& f, const format::DropSet& drops) {
    for (uint32_t at = 0; at < f.drop_count; ++at) {
        const uint32_t i = f.drop_source[at];
        const Shape shape(drops, i);
        const float k = 1 / shape.determinant;
        // A drop that is born or dies grows and shrinks with its activity, from and to a size that is not drawn.
        const float grow = 1 / std::cbrt(std::max(std::min(drops.activity[i], 1.f), 1e-6f));
        for (int a = 0; a < 6; ++a) f.inverse[a][at] = shape.cofactor[a] * k * grow;
        f.dx[at] = drops.x[i], f.dy[at] = drops.y[i], f.dz[at] = drops.z[i];
        f.dvx[at] = drops.vx[i], f.dvy[at] = drops.vy[i], f.dvz[at] = drops.vz[i];
        f.radius[at] = std::cbrt(shape.determinant) / grow;
        f.reach[at] = 1.5f * shape.size;
        f.drop_activity[at] = drops.activity[i];
    }
}

}  // namespace

size_t field_bytes(uint32_t points, uint32_t drops) noexcept {
    return aligned(points * sizeof(Patch)) + point_rows * aligned((points + lanes) * sizeof(float)) +
           aligned(points * sizeof(uint32_t)) + drop_rows * aligned(drops * sizeof(float)) + aligned(drops * sizeof(uint32_t)) +
           drop_bundle_rows * aligned(bundles_of(drops) * sizeof(float)) +
           bundle_bytes(bundles_of(points)) + bundle_bytes(bundles_of(bundles_of(points)));
}

void begin_field(Field& field, void* memory, const format::PointSet& points, const format::DropSet& drops,
                 const Container& container) noexcept {
    field = {};
    field.kernels = &best_kernels();
    field.container = container;
    carve(field, {static_cast<uint8_t*>(memory)}, points.count, drops.count);
    sort_points(field, points);
    begin_bundles(field);
    sort_drops(field, drops);
    place_drops(field, drops);
    bound_drops(field);
}

void resize_field(Field& f, uint32_t count, const format::PointSet& more) noexcept {
    for (uint32_t at = f.point_count; at < count; ++at) f.source[at] = at - f.point_count, place_point(f, at, more);
    f.point_count = count;
    pad_points(f);
    begin_bundles(f);
}

void fit_patches(Field& field, uint32_t first, uint32_t last) noexcept {
    Nearest nearest;
    for (uint32_t bundle = first / lanes; bundle * lanes < last; ++bundle) {
        field.kernels->nearest(field, bundle, nearest);
        field.kernels->fit(field, std::max(first, bundle * lanes), std::min(last, (bundle + 1) * lanes), nearest);
    }
}

void finish_field(Field& f) noexcept {
    join_discs(f);
    widen_bundles(f);
    f.largest_support = 0;
    for (uint32_t i = 0; i < f.point_count; ++i) f.largest_support = std::max(f.largest_support, f.support[i]);
}

void bound_drops(const Field& f) noexcept {
    constexpr float more = 1.0001f, rounding = 1e-6f;  // so that rounding loses none
    const float* const position[3] = {f.dx, f.dy, f.dz};
    for (uint32_t k = 0; k < bundles_of(f.drop_count); ++k)
        for (int a = 0; a < 3; ++a) {
            float lower = 1e30f, upper = -1e30f;
            for (uint32_t i = lanes * k; i < std::min(lanes * (k + 1), f.drop_count); ++i) {
                const float p = position[a][i], reach = more * f.reach[i] + rounding * std::fabs(p);
                lower = std::min(lower, p - reach), upper = std::max(upper, p + reach);
            }
            f.drops_lower[a][k] = lower, f.drops_upper[a][k] = upper;
        }
}

}  // namespace rill::surface
