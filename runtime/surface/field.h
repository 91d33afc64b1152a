// SPDX-License-Identifier: MIT
// The surface that a set of points and drops means: neighbours, local quadratics, blended
// implicit function. This definition binds cooker and runtime alike: the cooker places points so
// that THIS function fits the source.
//
// Method: Keeler & Bridson, "Compact Iso-Surface Representation and Compression for Fluid
// Phenomena", section 2: Γ_i(x) = d + n·r + a τ1² + b τ1 τ2 + c τ2² (eq. 1), a, b, c by minimal-norm
// least squares over neighbours (eq. 2), blended with compact weights. Measured departures from
// the paper stand in field_rules.h, field_kernels_fit.h and field_kernels_blend.h.
//
// Sign: negative in the liquid, positive in the air; about a distance (metres) near the surface.
// Everything is a pure function of (points, drops, x): no order, thread or tile changes a bit.
#pragma once
#include <cstddef>
#include <cstdint>

#include "format/tracks.h"
#include "surface/container.h"

namespace rill::surface {

/// Axis-aligned box, asset space.
struct Box {
    float lower[3], upper[3];
};
/// Each sixteen neighbours in the sorted order as one, row by row and padded to whole sixteens: bundle k holds points
/// or smaller bundles [16 k, 16 k + 16).
struct Bundles {
    uint32_t count;
    float *x, *y, *z, *ax, *ay, *az;  ///< an oriented disc, for the winding number: centre, Σ area · normal / 4π
    float* limit;                     ///< squared distance from which it counts as one disc
    float *lower[3], *upper[3];       ///< box of the points; from finish_field() on of all places where they have weight
};

struct Kernels;

/// What evaluation reads of a point: one cache line.
struct alignas(64) Patch {
    float x, y, z, nx, ny, nz;
    float xx, yy, zz, xy, xz, yz;  ///< of Q; the mixed ones doubled
    float inverse;                 ///< 1 / R²
    float activity, recede;        ///< and 1 / activity: a point that fades recedes
    float area;                    ///< as Field::area
};

/// All memory is the caller's: one block of field_bytes(), 64-byte aligned.
struct Field {
    // Points, sorted so that each sixteen lie together, and their local quadratics.
    uint32_t point_count, drop_count;
    Patch* patches;
    float *x, *y, *z;                      ///< position
    float *nx, *ny, *nz;                   ///< normal of the patch (unit)
    float *support, *steep;                ///< radius R_i beyond which the patch has no weight, and 1 / R_i²
    float* activity;
    float* farther;                        ///< 1 / √activity: so many times its squared distance counts, as a neighbour
    float* area;                           ///< that the point stands for, over 4π, for the winding number
    float *vx, *vy, *vz;
    uint32_t* source;                      ///< index in the PointSet each came from
    // Drops, sorted likewise, with inverse shape and mean radius, negative for bubbles.
    float *dx, *dy, *dz, *inverse[6], *radius, *reach, *drop_activity, *dvx, *dvy, *dvz;
    uint32_t* drop_source;                 ///< index in the DropSet each came from
    float *drops_lower[3], *drops_upper[3];  ///< box of each sixteen drops with all they reach: bound_drops()
    Bundles bundles, groups;               ///< of points; of bundles
    float spacing;                         ///< about the distance of points
    Container container = everywhere;           ///< as given to begin_field()
    const Kernels* kernels;                ///< what evaluation runs on
    float largest_support;
};

/// Bytes that a field of at most so many points and drops needs.
size_t field_bytes(uint32_t points, uint32_t drops) noexcept;

/// Step 1, one thread: sorts the points inside `memory`. Non-finite points are dropped. O(n log n).
/// `container`: where the liquid ends, exactly, wherever it would go on by its points and drops.
void begin_field(Field& field, void* memory, const format::PointSet& points, const format::DropSet& drops,
                 const Container& container = everywhere) noexcept;
/// Step 2, any threads, disjoint ranges [first, last) of sorted points: supports and quadratics.
void fit_patches(Field& field, uint32_t first, uint32_t last) noexcept;
/// Step 3, one thread: bundles, largest support.
void finish_field(Field& field) noexcept;
/// Before step 2, one thread: makes the field's points `count` again or more; `more` are what comes beyond those it has, at the end of
/// its order, so that all there are keep their numbers. The field must have room: that of points of begin_field() that had no activity.
void resize_field(Field& field, uint32_t count, const format::PointSet& more) noexcept;

/// After drops have been moved or their reach changed, one thread: gather() finds them by this. begin_field() does it too.
void bound_drops(const Field& field) noexcept;

/// Patches and drops whose weight can be non-zero somewhere in the box, ascending; drops are numbered
/// from field.point_count on. Returns how many there are; writes at most `capacity` of them (when the
/// return is larger, the list is the first `capacity` and evaluation stays deterministic).
uint32_t gather(const Field& field, const Box& box, uint32_t* out, uint32_t capacity) noexcept;

/// Field values at n positions, from candidates that gather() gave for a box holding them all.
/// Where no patch has weight there is no gradient, the winding number of all points gives the sign, and the nearest
/// point about the distance: in the liquid at most Field::spacing, in the air at most the largest support, beyond it
/// +unsupported. Positions next to each other in the list should be next to each other in space: batches of 16 share
/// what they are evaluated from.
void evaluate(const Field& field, const uint32_t* candidates, uint32_t candidate_count,
              const float* x, const float* y, const float* z, uint32_t n, float* value) noexcept;
/// The same with gradient (not normalised, and smoother than the value's own: `ripple` of field_rules.h) and, if
/// velocity is not null, the blended velocity of the surface (3n floats, SoA in three rows of n).
void evaluate_gradient(const Field& field, const uint32_t* candidates, uint32_t candidate_count,
                       const float* x, const float* y, const float* z, uint32_t n, float* value,
                       float* gx, float* gy, float* gz, float* velocity) noexcept;
/// The same for positions that are known to lie within `distance` of the surface: the winding number is only asked where
/// the blend says otherwise.
void evaluate_at_surface(const Field& field, const uint32_t* candidates, uint32_t candidate_count,
                         const float* x, const float* y, const float* z, uint32_t n, float* value,
                         float* gx, float* gy, float* gz, float* velocity, float distance) noexcept;

}  // namespace rill::surface
