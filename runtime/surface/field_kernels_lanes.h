// SPDX-License-Identifier: MIT
// What the kernels are written with: loops over the lanes of plain arrays, of fixed length and without a branch, so that
// compilers make one or two vector operations of every line. Sums stay in arrays of the function's own: nothing the
// compiler must fear to be aliased. Everything is inlined into the entry points of each instruction set.
#pragma once
#include <cstdint>
#include <cstring>

#include "surface/field_kernels.h"

#if defined(__GNUC__)
#define RILL_INLINED __attribute__((always_inline))  // of lambdas, too: they would not know the instruction set
#else
#define RILL_INLINED
#endif
#define RILL_INLINE inline RILL_INLINED

namespace rill::surface::inner {

RILL_INLINE float lesser(float a, float b) { return a < b ? a : b; }
RILL_INLINE float greater(float a, float b) { return a > b ? a : b; }

/// a b + c, rounded once where the instruction set can (`fused`), else twice; never left to what a compiler makes of it.
template <bool fused>
RILL_INLINE float madd(float a, float b, float c) {
#if defined(__GNUC__)
    if constexpr (fused) return __builtin_fmaf(a, b, c);
#endif
    return a * b + c;
}
template <bool fused>
RILL_INLINE float dot(float ax, float ay, float az, float bx, float by, float bz) {
    return madd<fused>(ax, bx, madd<fused>(ay, by, az * bz));
}

RILL_INLINE uint32_t bits_of(float x) {
    uint32_t bits;
    std::memcpy(&bits, &x, sizeof(bits));
    return bits;
}

RILL_INLINE float float_of(int32_t bits) {
    float x;
    std::memcpy(&x, &bits, sizeof(x));
    return x;
}

/// x, or the nearer of 0 and 1. By its bits: of two conditions in a row GCC makes three cases and works each of them out.
RILL_INLINE float within_one(float x) {
    constexpr int32_t one = 0x3f800000;
    const int32_t bits = int32_t(bits_of(x)), positive = bits & ~(bits >> 31);
    return float_of(positive < one ? positive : one);
}

constexpr int32_t no_word = 0x7fffffff;  // more than the bits of any number

/// About 1 / x of a positive x, to 7e-6: a guess from the exponent and two Newton steps. A division takes as long as all
/// the rest of a weight.
template <bool fused>
RILL_INLINE float inverse_of(float x) {
    float y = float_of(0x7ef311c7 - int32_t(bits_of(x)));
    y *= madd<fused>(-x, y, 2);
    return y * madd<fused>(-x, y, 2);
}

alignas(64) constexpr uint32_t bit_of_lane[lanes] = {1,      1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                                                    1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};

/// Bits to a word.
RILL_INLINE uint32_t word_of(const uint32_t (&bit)[lanes]) {
    uint64_t pair[lanes / 2];
    std::memcpy(pair, bit, sizeof(pair));
    const uint64_t all = ((pair[0] | pair[1]) | (pair[2] | pair[3])) | ((pair[4] | pair[5]) | (pair[6] | pair[7]));
    return uint32_t(all | all >> 32);
}

RILL_INLINE float least_of(const float* of) {
    alignas(64) float value[lanes / 2];
    for (uint32_t l = 0; l < 8; ++l) value[l] = lesser(of[l], of[l + 8]);
    for (uint32_t l = 0; l < 4; ++l) value[l] = lesser(value[l], value[l + 4]);
    return lesser(lesser(value[0], value[1]), lesser(value[2], value[3]));
}
RILL_INLINE float greatest_of(const float* of) {
    alignas(64) float value[lanes / 2];
    for (uint32_t l = 0; l < 8; ++l) value[l] = greater(of[l], of[l + 8]);
    for (uint32_t l = 0; l < 4; ++l) value[l] = greater(value[l], value[l + 4]);
    return greater(greater(value[0], value[1]), greater(value[2], value[3]));
}

}  // namespace rill::surface::inner
