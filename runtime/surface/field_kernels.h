// SPDX-License-Identifier: MIT
// The inner loops of field evaluation: sixteen positions against a list of patches. One source, compiled for
// several instruction sets; the best that the machine has is chosen when a field is begun.
#pragma once
#include <cstdint>

namespace rill::surface {

struct Field;
inline constexpr uint32_t lanes = 16, most_reached = 128;

/// Sixteen positions and what was found there.
struct alignas(64) Batch {
    float x[lanes], y[lanes], z[lanes];
    float value[lanes], weight[lanes];  ///< weight 0: nothing reaches here, value is `unsupported`
    float sign[lanes];                  ///< 1: the value is that of cluster A, −1: of B, 0: of none
    float u2[lanes];  ///< least of any patch; `unsupported` for none: in a thin sheet the nearest may be of the other face
    float nx[lanes], ny[lanes], nz[lanes];  ///< normal of the nearest point
    int32_t doubt[lanes];  ///< 1: the winding number should be asked, 0
};
/// Sums over the patches of the chosen cluster, still to be divided by the weight.
struct alignas(64) Slopes {
    float gx[lanes], gy[lanes], gz[lanes], vx[lanes], vy[lanes], vz[lanes];
};

struct Kernels {
    const char* name;
    /// Which of n ≤ most_reached points may have weight in the box, 16 to a word: rows x y z, nx ny nz, 1/R², read up to
    /// the next multiple of `lanes`; bits beyond n mean nothing.
    void (*reach)(const float* const point[7], uint32_t n, const float lower[3], const float upper[3],
                  uint32_t* within);
    void (*blend)(const Field&, const uint32_t* list, uint32_t count, Batch&);
    void (*slope)(const Field&, const uint32_t* list, uint32_t count, const Batch&, bool velocity, Slopes&);
    /// Winding number of all points, and about the squared distance to the nearest.
    void (*winding)(const Field&, const float* x, const float* y, const float* z, float* number, float* distance2);
};

/// Slowest first; with GCC the first is compiled without vectors, for reference. All give the same bits.
constexpr uint32_t most_kernel_levels = 4;
uint32_t kernel_levels(const Kernels* out[most_kernel_levels]) noexcept;
const Kernels& best_kernels() noexcept;

}  // namespace rill::surface
