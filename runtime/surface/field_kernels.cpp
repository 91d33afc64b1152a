// SPDX-License-Identifier: MIT
// One set of entry points per instruction set; everything in field_kernels_*.h is inlined into each.
#include "surface/field_kernels.h"

#include "surface/field_kernels_blend.h"
#include "surface/field_kernels_draw.h"
#include "surface/field_kernels_fit.h"
#include "surface/field_kernels_search.h"

namespace rill::surface {
namespace {

#define RILL_LEVEL(id, fused, target)                                                                             \
    target uint32_t gather_##id(const Field& f, const float lower[3], const float upper[3], uint32_t* out,        \
                                uint32_t capacity) {                                                              \
        return inner::gather<fused>(f, lower, upper, out, capacity);                                              \
    }                                                                                                             \
    target uint32_t blend_##id(const Field& f, const uint32_t* candidates, uint32_t n, uint32_t* list,            \
                               uint32_t& listed, float trusted, Batch& b) {                                       \
        return inner::blend<fused>(f, candidates, n, list, listed, trusted, b);                                   \
    }                                                                                                             \
    target void slope_##id(const Field& f, const uint32_t* list, uint32_t count, const Batch& b, bool velocity,   \
                           Slopes& out) {                                                                         \
        inner::slope<fused>(f, list, count, b, velocity, out);                                                    \
    }                                                                                                             \
    target float winding_##id(const Field& f, float x, float y, float z, float& distance2) {                      \
        return inner::winding<fused>(f, x, y, z, distance2);                                                      \
    }                                                                                                             \
    target void nearest_##id(const Field& f, uint32_t bundle, Nearest& found) {                                   \
        inner::find_neighbours(f, bundle, found);                                                                 \
    }                                                                                                             \
    target void fit_##id(Field& f, uint32_t first, uint32_t last, const Nearest& near) {                          \
        inner::fit(f, first, last, near);                                                                         \
    }                                                                                                             \
    target void draw_##id(const float centre[3], const float normal[3], float radius, uint8_t rows[8 * 8]) {      \
        inner::draw_disc(centre, normal, radius, rows);                                                           \
    }                                                                                                             \
    constexpr Kernels kernels_##id{#id,          fused,        gather_##id, blend_##id, slope_##id,               \
                                   winding_##id, nearest_##id, fit_##id,    draw_##id};

#if defined(__GNUC__) && (defined(__FMA__) || defined(__ARM_FEATURE_FMA))
constexpr bool baseline_fused = true;
#else
constexpr bool baseline_fused = false;
#endif
#if defined(__GNUC__) && !defined(__clang__)
#define RILL_SCALAR __attribute__((optimize("no-tree-vectorize", "no-tree-slp-vectorize")))
RILL_LEVEL(scalar, false, RILL_SCALAR)
RILL_LEVEL(scalar_fused, true, RILL_SCALAR)
#endif
RILL_LEVEL(baseline, baseline_fused, )
#if defined(__GNUC__) && defined(__x86_64__)
#define RILL_X86_LEVELS 1
RILL_LEVEL(avx2, true, __attribute__((target("avx2,fma"))))
RILL_LEVEL(avx512, true, __attribute__((target("avx512f,avx512vl,avx512bw,avx512dq,fma"))))
#endif

}  // namespace

uint32_t kernel_levels(const Kernels* out[most_kernel_levels]) noexcept {
    uint32_t count = 0;
#if defined(__GNUC__) && !defined(__clang__)
    out[count++] = &kernels_scalar;
    out[count++] = &kernels_scalar_fused;
#endif
    out[count++] = &kernels_baseline;
#if RILL_X86_LEVELS
    const bool fma = __builtin_cpu_supports("fma");
    if (__builtin_cpu_supports("avx2") && fma) out[count++] = &kernels_avx2;
    if (fma && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
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
