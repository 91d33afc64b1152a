// SPDX-License-Identifier: MIT
// Carves one memory block. The same code measures (no base) and places, so that a footprint told in
// advance is exact. Sizes saturate instead of wrapping: an absurd request stays absurd and is refused.
#pragma once
#include <cstddef>
#include <cstdint>

namespace rill {

inline constexpr uint64_t block_alignment = 64;  ///< a cache line; what the largest users want

constexpr uint64_t align_up(uint64_t bytes) noexcept {
    return bytes > UINT64_MAX - block_alignment ? UINT64_MAX
                                                : (bytes + block_alignment - 1) / block_alignment * block_alignment;
}

struct Arena {
    uint8_t* base = nullptr;  ///< null: measure only
    uint64_t used = 0;

    /// 64-byte aligned. Null while measuring.
    void* take(uint64_t bytes) noexcept {
        uint8_t* at = base ? base + used : nullptr;
        const uint64_t rounded = align_up(bytes);
        used = rounded > UINT64_MAX - used ? UINT64_MAX : used + rounded;
        return at;
    }
    template <class T>
    T* take_array(uint64_t count) noexcept {
        return static_cast<T*>(take(count > UINT64_MAX / sizeof(T) ? UINT64_MAX : count * sizeof(T)));
    }
};

}  // namespace rill
