// SPDX-License-Identifier: MIT
// The inner loops of field evaluation: sixteen positions against a list of patches. One source, compiled for
// several instruction sets; the best that the machine has is chosen when a field is begun.
#pragma once
#include <cstdint>

namespace rill::surface {

struct Field;
inline constexpr uint32_t lanes = 16;
inline constexpr uint32_t most_listed = 1024;     // patches that a batch may blend
inline constexpr uint32_t listing_block = 32;     // of candidates: a list has room for one more than fits
inline constexpr uint32_t most_neighbours = 14;   // rows of a fit
inline constexpr uint32_t support_neighbour = 6;  // whose distance gives the support
inline constexpr float nowhere = 1e12f;           // place of what fills whole sixteens up

/// Sixteen positions and what was found there.
struct alignas(64) Batch {
    float x[lanes], y[lanes], z[lanes];
    float value[lanes];                 ///< `unsupported`: nothing reaches here
    float sign[lanes];                  ///< 1: the value is that of cluster A, −1: of B, 0: of none
    float u2[lanes];  ///< least of any patch; `unsupported` for none: in a thin sheet the nearest may be of the other face
    float nx[lanes], ny[lanes], nz[lanes];  ///< normal of the nearest point
};
/// Means over the patches of the chosen cluster.
struct alignas(64) Slopes {
    float gx[lanes], gy[lanes], gz[lanes], vx[lanes], vy[lanes], vz[lanes];
};

/// The nearest neighbours of sixteen points that face the same way, nearest first, and the distances of those of either
/// side: squared, `beyond` and more for none.
struct alignas(64) Nearest {
    float d2[most_neighbours][lanes], any[support_neighbour][lanes];
    uint32_t id[most_neighbours][lanes];
    float beyond;
};

struct Kernels {
    const char* name;
    bool fused;  ///< multiplies and adds with one rounding
    /// Points of the field whose weight can be non-zero somewhere in the box, as surface::gather().
    uint32_t (*gather)(const Field&, const float lower[3], const float upper[3], uint32_t* out, uint32_t capacity);
    /// Fills all but the places in, and lists who of the candidates has weight. Beyond `most_listed`, which are all that count,
    /// `listed` says that there are more, no longer how many. `list` has room for `most_listed + listing_block`. Returns bits of the lanes to ask the winding number for: none up to |value| `trusted`.
    uint32_t (*blend)(const Field&, const uint32_t* candidates, uint32_t count, uint32_t* list, uint32_t& listed, float trusted, Batch&);
    void (*slope)(const Field&, const uint32_t* list, uint32_t count, const Batch&, bool velocity, Slopes&);
    /// Winding number of all points at a position, and about the squared distance to the nearest.
    float (*winding)(const Field&, float x, float y, float z, float& distance2);
    /// Neighbours of the points of a bundle.
    void (*nearest)(const Field&, uint32_t bundle, Nearest&);
    /// Supports and quadratics of points [first, last) of that bundle.
    void (*fit)(Field&, uint32_t first, uint32_t last, const Nearest&);
    /// Adds to rows (y + 8 z; bit x) of 8³ cells those that a disc crosses, all in cells from the block's lowest corner. A
    /// guess, of no consequence but for how much there is left to find.
    void (*draw)(const float centre[3], const float normal[3], float radius, uint8_t rows[8 * 8]);
};

/// Slowest first; with GCC the first two are compiled without vectors, for reference. All that are `fused` give the same
/// bits, and all that are not: only machines without fused instructions (x86-64 of before 2013) take one of these.
constexpr uint32_t most_kernel_levels = 5;
uint32_t kernel_levels(const Kernels* out[most_kernel_levels]) noexcept;
const Kernels& best_kernels() noexcept;

}  // namespace rill::surface
