// SPDX-License-Identifier: MIT
// The bits of a word.
#pragma once
#include <cstdint>

namespace rill {

/// Number of the lowest bit set.
inline uint32_t lowest_bit(uint32_t bits) {
#if defined(__GNUC__)
    return uint32_t(__builtin_ctz(bits));
#else
    uint32_t n = 0;
    for (; !(bits & 1); bits >>= 1) ++n;
    return n;
#endif
}
/// How many bits it takes to write the number; 0 for 0.
inline uint32_t bit_width(uint32_t number) {
#if defined(__GNUC__)
    return number ? 32 - uint32_t(__builtin_clz(number)) : 0;
#else
    uint32_t n = 0;
    for (; number; number >>= 1) ++n;
    return n;
#endif
}
/// Work(number) for each bit set, lowest first.
template <typename Work>
void for_bits(uint32_t bits, Work&& work) {
    for (; bits; bits &= bits - 1) work(lowest_bit(bits));
}

}  // namespace rill
