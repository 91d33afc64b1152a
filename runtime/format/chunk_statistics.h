// SPDX-License-Identifier: MIT
// All that adapts while a chunk is coded, and what it starts from: what chunks of other liquids had learned at their
// ends. A chunk is so small that it would otherwise be over before much is learned.
#pragma once
#include <cstddef>
#include <cstdint>

#include "format/carried_motion.h"
#include "format/chunk_priors.h"
#include "format/entropy_decoder.h"

namespace rill::format {

/// What is being coded by a signed value.
enum Kind : uint32_t { tangent, normal, turn, turn_axis, drop_path, drop_shape, along, axis_delta, sliding, slide_change, kinds };

/// All that adapts while a chunk is coded.
struct Statistics {
    static constexpr uint32_t bins = 8;  ///< of a value: zero, unary magnitude class up to 8
    static constexpr uint32_t contexts[Mixer::inputs] = {48, 49, 40, 48};  ///< per kind
    static constexpr uint32_t all_contexts = 48 + 49 + 40 + 48;
    static constexpr uint32_t more_contexts = 72, leaf_contexts = 78, life_contexts = 256;

    Counter values[kinds * all_contexts * bins];
    Counter mantissa[kinds][24], escape[24];
    Counter split_small[9][9], split_empty[2][16], split_tree[8][16];
    Counter leaf[Mixer::inputs][leaf_contexts];
    Counter flag[2][12], cosine[2][16], fine, at_border[2];
    Counter life[2][Mixer::inputs][life_contexts];
    Counter more[4][Mixer::inputs][more_contexts];
    Mixer value_mixer[kinds][bins], leaf_mixer[3], more_mixer[4], life_mixer[2];
    /// How far predictions were right: Σ value · prediction / Σ prediction², in 1/256; drawn up anew now and then.
    struct Trust {
        int64_t product = 1 << 17, square = 1 << 18;
        int32_t factor = 128;
        uint32_t seen = 0;
        void learn(int64_t was, int64_t said) {
            was = was < -32768 ? -32768 : was > 32768 ? 32768 : was;
            said = said < -(1 << 23) ? -(1 << 23) : said > 1 << 23 ? 1 << 23 : said;
            product += (was * said * 256 - product) / 32;
            square += (said * said - square) / 32;
            if (seen++ % 8) return;
            const int64_t ratio = product * 256 / (square + 1);
            factor = int32_t(ratio < 0 ? 0 : ratio > 256 ? 256 : ratio);
        }
    } trust[kinds][carried_terms + 1];
};

/// Calls f with every counter, then every mixer, then every trust, in the order of chunk_priors.
template <class T, class F>
constexpr void each_part(T& part, F& f) {
    f(part);
}
template <class T, size_t n, class F>
constexpr void each_part(T (&parts)[n], F& f) {
    for (T& part : parts) each_part(part, f);
}
template <class S, class F>
constexpr void each_part_of(S& s, F f) {
    each_part(s.values, f), each_part(s.mantissa, f), each_part(s.escape, f);
    each_part(s.split_small, f), each_part(s.split_empty, f), each_part(s.split_tree, f), each_part(s.leaf, f);
    each_part(s.flag, f), each_part(s.cosine, f), each_part(s.fine, f), each_part(s.at_border, f);
    each_part(s.life, f), each_part(s.more, f);
    each_part(s.value_mixer, f), each_part(s.leaf_mixer, f), each_part(s.more_mixer, f), each_part(s.life_mixer, f);
    each_part(s.trust, f);
}

/// Reads chunk_priors: a letter is one of 52 levels, a dot is nothing known, a number after a dot says how many dots.
class PriorReader {
public:
    static constexpr int32_t unknown = -1;
    static constexpr uint16_t seen = 10;  ///< as if so many bits had been met
    constexpr int32_t next() {
        if (dots_ > 0) return --dots_, unknown;
        const char c = next_char();
        if (c >= 'A' && c <= 'Z') return c - 'A';
        if (c >= 'a' && c <= 'z') return c - 'a' + 26;
        uint32_t count = 0;
        while (*at_ >= '0' && *at_ <= '9') count = 10 * count + uint32_t(*at_++ - '0');
        dots_ = count ? count - 1 : 0;
        return unknown;
    }
    // What is unknown is said as well: GCC 12 makes zeros of what only the members' own initialisers say, deep in a constant's arrays.
    constexpr void operator()(Counter& counter) {
        const int32_t level = next();
        counter.probability = uint16_t(level == unknown ? 32768 : squash(level * 80 - 2040)), counter.seen = level == unknown ? 0 : seen;
    }
    constexpr void operator()(Mixer& mixer) {
        for (uint32_t& weight : mixer.weight) {
            const int32_t level = next();
            weight = level == unknown ? 20000 : uint32_t(level * 1280 - 20480);
        }
    }
    constexpr void operator()(Statistics::Trust& trust) {
        const int32_t level = next();
        trust.factor = level == unknown ? 128 : level * 5, trust.product = int64_t(trust.factor) << 10, trust.square = 1 << 18;
    }

private:
    constexpr char next_char() {
        while (*at_ == '\n') ++at_;
        return *at_ ? *at_++ : '.';
    }
    const char* at_ = chunk_priors;
    uint32_t dots_ = 0;
};
inline constexpr Statistics first_statistics = [] {
    Statistics s;
    each_part_of(s, PriorReader{});
    return s;
}();

}  // namespace rill::format
