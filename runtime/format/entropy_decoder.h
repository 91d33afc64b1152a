// SPDX-License-Identifier: MIT
// Bits out of bytes: a binary range decoder, and the adaptive probabilities that steer it. All integer, so
// that every machine decodes the same. The encoding half is cooker/asset/entropy_encoder.h.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace rill::format {

/// Byte-wise range decoder. Bytes past the end read as zero; the encoder relies on exactly three of them,
/// so finished() is true only if the stream was consumed to the byte.
class RangeDecoder {
public:
    RangeDecoder(const uint8_t* bytes, const uint8_t* end) : at_(bytes), end_(end) {
        for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
    }
    /// probability: of a 1, in 1/65536, 1 … 65535. The second argument is the encoder's.
    uint32_t bit(uint32_t probability, uint32_t /*value*/) {
        const uint32_t bound = uint32_t((uint64_t(range_) * probability) >> 16);
        const uint32_t bit = code_ < bound;
        if (bit) {
            range_ = bound;
        } else {
            code_ -= bound;
            range_ -= bound;
        }
        while (range_ < (1u << 24)) {
            code_ = code_ << 8 | next();
            range_ <<= 8;
        }
        return bit;
    }
    bool exhausted() const { return beyond_ > 3; }
    bool finished() const { return at_ == end_ && beyond_ == 3; }
    void category(int) {}

private:
    uint32_t next() {
        if (at_ < end_) return *at_++;
        ++beyond_;
        return 0;
    }
    const uint8_t* at_;
    const uint8_t* end_;
    uint32_t range_ = 0xffffffffu, code_ = 0, beyond_ = 0;
};

/// Logistic function: d in 1/256, −2047 … 2047 → probability in 1/65536.
constexpr uint32_t squash(int32_t d) {
    constexpr uint32_t table[33] = {22,    36,    60,    98,    162,   267,   439,   720,   1179,
                                    1921,  3108,  4971,  7812,  11955, 17625, 24743, 32768, 40793,
                                    47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097,
                                    65269, 65374, 65438, 65476, 65500, 65514};
    if (d > 2047) d = 2047;
    if (d < -2047) d = -2047;
    const uint32_t low = uint32_t(d + 2048) & 127, index = uint32_t(d + 2048) >> 7;
    return (table[index] * (128 - low) + table[index + 1] * low + 64) >> 7;
}
/// The same, looked up.
inline constexpr auto squash_table = [] {
    std::array<uint16_t, 4096> table{};
    for (int32_t d = -2048; d < 2048; ++d) table[uint32_t(d + 2048)] = uint16_t(squash(d));
    return table;
}();
/// Its inverse by probability in 1/4096.
inline constexpr auto stretch_table = [] {
    std::array<int16_t, 4096> table{};
    uint32_t done = 0;
    for (int32_t d = -2047; d <= 2047; ++d)
        for (const uint32_t p = squash(d) >> 4; done <= p; ++done) table[done] = int16_t(d);
    for (; done < 4096; ++done) table[done] = 2047;
    return table;
}();

/// One adaptive probability: learns as 1/n at first, then exponentially.
struct Counter {
    uint16_t probability = 32768;  ///< of a 1, in 1/65536
    uint16_t seen = 0;
};
inline constexpr uint32_t counter_limit = 60;
/// By how often a counter was used: how fast it learns, in 1/32768; and how far it is trusted, in 1/256, for a
/// context never met says nothing.
struct Pace {
    uint16_t rate, trust;
};
inline constexpr auto counter_pace = [] {
    std::array<Pace, counter_limit + 1> pace{};
    for (uint32_t n = 0; n <= counter_limit; ++n)
        pace[n] = {uint16_t(2 * 32768 / (2 * n + 3)), uint16_t((256 * (2 * n + 1)) / (2 * n + 4))};
    return pace;
}();

inline void learn(Counter& c, uint32_t bit) {
    const int32_t error = int32_t(bit ? 65535 : 0) - int32_t(c.probability);
    c.probability = uint16_t(int32_t(c.probability) + (error * int32_t(counter_pace[c.seen].rate) >> 15));
    if (c.seen < counter_limit) ++c.seen;
}

/// Weights that blend the opinions of up to four contexts, in 1/65536.
struct Mixer {
    static constexpr uint32_t inputs = 4;
    uint32_t weight[inputs] = {20000, 20000, 20000, 20000};  ///< signed, modulo 2³²: bytes made to overflow it may
};

/// One bit under the blended probability of four contexts; every part learns from it.
template <class Coder>
inline uint32_t mixed_bit(Coder& coder, Mixer& mixer, Counter* const (&context)[Mixer::inputs],
                          uint32_t value) {
    int32_t opinion[Mixer::inputs];
    uint32_t sum = 0;
    for (uint32_t i = 0; i < Mixer::inputs; ++i) {
        const Counter& c = *context[i];
        opinion[i] = stretch_table[c.probability >> 4] * int32_t(counter_pace[c.seen].trust) >> 8;
        sum += uint32_t(opinion[i]) * mixer.weight[i];
    }
    int32_t dot = int32_t(sum) >> 16;
    dot = dot < -2047 ? -2047 : dot > 2047 ? 2047 : dot;
    const uint32_t p = squash_table[uint32_t(dot + 2048)];
    const uint32_t bit = coder.bit(p, value);
    const int32_t error = ((bit ? 65535 : 0) - int32_t(p)) * 14 >> 4;
    for (uint32_t i = 0; i < Mixer::inputs; ++i) {
        mixer.weight[i] += uint32_t((opinion[i] * error + 32768) >> 16);
        learn(*context[i], bit);
    }
    return bit;
}

}  // namespace rill::format
