// SPDX-License-Identifier: MIT
// CRC-32 (IEEE 802.3, reflected, as in zlib and PNG) and FNV-1a 64. Chunks are small, so one table does.
#pragma once
#include <cstddef>
#include <cstdint>

namespace rill::format {

struct Crc32Table {
    uint32_t entry[256];
    constexpr Crc32Table() : entry{} {
        for (uint32_t i = 0; i < 256; ++i) {
            uint32_t c = i;
            for (int bit = 0; bit < 8; ++bit) c = (c & 1) ? 0xEDB88320u ^ (c >> 1) : c >> 1;
            entry[i] = c;
        }
    }
};
inline constexpr Crc32Table crc32_table{};

/// `before`: the result for the bytes that precede these, or 0.
inline uint32_t crc32(const void* data, size_t size, uint32_t before = 0) noexcept {
    const auto* bytes = static_cast<const uint8_t*>(data);
    uint32_t c = ~before;
    for (size_t i = 0; i < size; ++i) c = crc32_table.entry[(c ^ bytes[i]) & 0xFF] ^ (c >> 8);
    return ~c;
}

inline constexpr uint64_t fnv1a_start = 0xcbf29ce484222325u;
/// Adds the four bytes of `value`, lowest first.
inline uint64_t fnv1a(uint64_t hash, uint32_t value) noexcept {
    for (int i = 0; i < 4; ++i) hash = (hash ^ ((value >> (8 * i)) & 0xFF)) * 0x100000001b3u;
    return hash;
}

}  // namespace rill::format
