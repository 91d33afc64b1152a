// SPDX-License-Identifier: MIT
// The only way to move through file bytes: little endian, bounded. Reading past the end gives zeros and
// sets `overrun`, so that a parser may check once at its end.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rill::format {

struct Cursor {
    const uint8_t* at;
    const uint8_t* end;
    bool overrun = false;

    Cursor(const uint8_t* bytes, size_t size) noexcept : at(bytes), end(bytes + size) {}

    size_t left() const noexcept { return static_cast<size_t>(end - at); }
    /// The next `size` bytes, or null when there are not so many.
    const uint8_t* take(size_t size) noexcept {
        if (size > left()) {
            overrun = true;
            at = end;
            return nullptr;
        }
        const uint8_t* taken = at;
        at += size;
        return taken;
    }
    uint8_t u8() noexcept { return static_cast<uint8_t>(little_endian(1)); }
    uint16_t u16() noexcept { return static_cast<uint16_t>(little_endian(2)); }
    int16_t i16() noexcept { return static_cast<int16_t>(u16()); }
    uint32_t u24() noexcept { return static_cast<uint32_t>(little_endian(3)); }
    uint32_t u32() noexcept { return static_cast<uint32_t>(little_endian(4)); }
    int32_t i32() noexcept { return static_cast<int32_t>(u32()); }
    uint64_t u64() noexcept { return little_endian(8); }
    float f32() noexcept { return reinterpret<float>(u32()); }
    /// The upper half of an f32.
    float f16() noexcept { return reinterpret<float>(uint32_t(u16()) << 16); }
    double f64() noexcept { return reinterpret<double>(u64()); }

private:
    uint64_t little_endian(size_t size) noexcept {
        const uint8_t* bytes = take(size);
        uint64_t value = 0;
        for (size_t i = 0; bytes && i < size; ++i) value |= uint64_t(bytes[i]) << (8 * i);
        return value;
    }
    template <class To, class From>
    static To reinterpret(From from) noexcept {
        static_assert(sizeof(To) == sizeof(From));
        To to;
        std::memcpy(&to, &from, sizeof to);
        return to;
    }
};

}  // namespace rill::format
