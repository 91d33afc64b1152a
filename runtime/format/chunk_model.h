// SPDX-License-Identifier: MIT
// What the bits of a chunk mean, written once for both directions: Coder::bit(probability, value) encodes
// `value` and returns it, or ignores it and returns the decoded bit. The decoder and the encoder therefore
// see the same contexts by construction.
//
// A chunk is: range-coded points, then drops. Each set is a count-coded k-d
// tree over lattice points (Devillers & Gandoin 2000), whose leaves, in Morton order, carry their track at
// once, so that everything decoded before helps with what comes next. See FORMAT.md, "Chunk".
#pragma once
#include <array>
#include <cstdint>

#include "format/bits.h"
#include "format/carried_motion.h"
#include "format/chunk_statistics.h"
#include "format/entropy_decoder.h"
#include "format/fourier_extension.h"
#include "format/lattice.h"

namespace rill::format {

/// What Coder::category() is told: where the next bits are spent.
enum BitCategory : int { bits_structure, bits_births, bits_motion, bits_normals, bits_drops, bits_first, bits_slip, bit_categories };

/// Magnitude class: 0, 1, 2, 3–4, 5–8, 9–16 …
inline uint32_t magnitude_class(uint32_t m) { return m <= 2 ? m : 2 + bit_width((m - 1) >> 1); }
inline uint32_t at_most(uint32_t value, uint32_t limit) { return value < limit ? value : limit; }
inline uint32_t magnitude(int32_t v) { return v < 0 ? 0u - uint32_t(v) : uint32_t(v); }
inline int64_t rounded_division(int64_t a, int64_t b) {
    if (b < 0) a = -a, b = -b;
    return (a >= 0 ? a + b / 2 : a - b / 2) / b;
}

template <class Coder>
class ChunkModel {
public:
    ChunkModel(Coder& coder, const LatticeSteps& steps, uint32_t sample_count, Statistics& learned,
               TrackBlock& block)
        : learned_(learned),
          coder_(coder),
          steps_(steps),
          samples_(sample_count),
          coarse_scale_((1 << 20) / steps.ratio),
          block_(block) {}

    /// Codes one of the two sets, tracks [first, first + count) of the block. `source(i)` gives the encoder's
    /// i-th track in Morton order; the decoder's returns null. False: the bytes are not a chunk (`reason`).
    template <class Source>
    bool code_set(bool drops, uint32_t first, uint32_t count, const int32_t (&low)[3],
                  const uint8_t (&bits)[3], const Source& source);
    const char* reason = nullptr;
    uint32_t coefficients_used() const { return used_; }
    /// Raw bits at even odds.
    uint32_t raw(uint32_t bits, uint32_t value) {
        uint32_t out = 0;
        for (uint32_t b = bits; b-- > 0;) out = out << 1 | coder_.bit(32768, value >> b & 1);
        return out;
    }

    /// Any number, at even odds: how many bits it takes first, the lowest for its sign.
    int32_t number(int32_t value) {
        const uint32_t coded = uint32_t(value) << 1 ^ (value < 0 ? ~0u : 0u);
        uint32_t bits = 0;
        while (bits < 32 && coded >> bits) ++bits;
        bits = raw(6, bits);
        const uint32_t read = raw(bits > 32 ? 32 : bits, coded);
        return int32_t(read >> 1 ^ (read & 1 ? ~0u : 0u));
    }

private:
    // ---- symbols -----------------------------------------------------------------------------------
    using Contexts = std::array<uint32_t, Mixer::inputs>;

    uint32_t bit(Mixer& mixer, Counter* a, Counter* b, Counter* c, Counter* d, uint32_t value) {
        return mixed_bit(coder_, mixer, {a, b, c, d}, value);
    }
    uint32_t bit(Counter& counter, uint32_t value) {
        const uint32_t p = counter.probability;
        const uint32_t out = coder_.bit(p < 64 ? 64 : p > 65472 ? 65472 : p, value);
        learn(counter, out);
        return out;
    }
    uint32_t tree(Counter* counters, uint32_t bits, uint32_t value) {
        uint32_t node = 1;
        for (uint32_t b = bits; b-- > 0;) node = node << 1 | bit(counters[node], value >> b & 1);
        return node - (1u << bits);
    }
    /// Signed integer under four contexts (each below contexts_per_input).
    int32_t signed_value(Kind kind, const Contexts& context, int32_t value) {
        uint32_t base = kind, slot[Mixer::inputs], offset = 0;
        for (uint32_t i = 0; i < Mixer::inputs; ++i) {
            slot[i] = (offset + base * Statistics::contexts[i] + context[i]) * Statistics::bins;
            offset += uint32_t(kinds) * Statistics::contexts[i];
        }
        const auto coded = [&](uint32_t bin, uint32_t v) {
            return bit(learned_.value_mixer[kind][bin], &learned_.values[slot[0] + bin],
                       &learned_.values[slot[1] + bin], &learned_.values[slot[2] + bin],
                       &learned_.values[slot[3] + bin], v);
        };
        const uint32_t wanted = magnitude(value);
        if (!coded(0, wanted != 0)) return 0;
        const uint32_t negative = raw(1, value < 0);
        const uint32_t wanted_class = magnitude_class(wanted);
        uint32_t c = 1;
        while (c < 21) {  // 2^20 and below
            const uint32_t more = wanted_class > c;
            if (!(c < Statistics::bins ? coded(c, more) : bit(learned_.escape[c], more))) break;
            ++c;
        }
        uint32_t m = c;
        if (c > 2) {
            const uint32_t bits = c - 2, floor = (1u << bits) + 1, rest = wanted - floor;
            const uint32_t top = bit(learned_.mantissa[kind][c], rest >> (bits - 1) & 1);
            m = floor + (top << (bits - 1) | raw(bits - 1, rest & ((1u << (bits - 1)) - 1)));
        }
        return negative ? -int32_t(m) : int32_t(m);
    }

    // ---- neighbours --------------------------------------------------------------------------------
    static constexpr uint32_t window = 128, nearest = 3, rest_terms = 12;
    static constexpr int32_t share[nearest + 1] = {0, 65536, 32768, 21845};  ///< of so many, in 1/65536
    struct Near {
        uint32_t count = 0;
        uint32_t slot[nearest];
        uint32_t distance[nearest];  ///< squared, in units of the search
    };
    /// The last tracks of the set, laid out for searching: slot = number modulo window.
    struct Recent {
        uint32_t count = 0;              ///< slots in use
        int16_t place[3][window];        ///< mean positions, coarse
        uint8_t birth[window] = {}, death[window] = {};
        int32_t mean[window][3];         ///< step/16
        int16_t normal[window][3];       ///< of points, 1/16384
        uint32_t track[window];
        uint8_t slip_rest[2][window];    ///< Σ |residuals| of slip and of its change, at most 255
        uint8_t rest[window][2][rest_terms][3];  ///< |residuals|, at most 255, [positions, normals][term][channel]
    };

    /// Of a neighbour, against the nearest.
    static int64_t weight_of(const Near& near, uint32_t j) {
        return 1 + 1024 * (int64_t(near.distance[0]) + 1) / (int64_t(near.distance[j]) + 1);
    }
    void begin_search(const int32_t (&low)[3], const uint8_t (&bits)[3]);
    void coarse_place(const int64_t (&x)[3], int16_t (&out)[3]) const;
    void remember(uint32_t index, const RawTrack& t, const Frame& frame);
    void measure(const int64_t (&x)[3]);
    template <class Score>
    Near find_near(const uint32_t (&distance)[window], const Score& score) const;
    Near find_moving(uint8_t birth, uint8_t death) const;

    // ---- parts of a track --------------------------------------------------------------------------
    struct Box {
        int32_t low[3];
        uint8_t bits[3];
        uint32_t count;
    };
    uint32_t split_count(uint32_t n, uint32_t value);
    void leaf(Box& box, const RawTrack* source);
    /// The planes of the nearest points, summed up for leaf_bit().
    struct Planes {
        uint32_t count = 0, distance = 0;
        int64_t height = 0, normal[3] = {}, first[3] = {};
    };
    uint32_t leaf_bit(const Box& box, uint32_t dimension, const Planes& planes, uint32_t value);
    bool track(uint32_t index, const Box& box, const RawTrack* source);
    uint32_t moment(uint32_t which, uint32_t from, uint32_t last, const Near& near, uint32_t wanted);
    void life(RawTrack& t, const Near& near, const RawTrack* source);
    bool axis(RawTrack& t, const Near& near, const RawTrack* source);
    void along_axis(RawTrack& t, const Frame& frame, const Near& near, const RawTrack* source);
    /// Predictions of one coefficient by the neighbours, in 1/256 of it.
    struct Said {
        int64_t mean = 0;
        uint32_t size = 0, spread = 0;  ///< classes
    };
    /// A channel group while it is coded; residuals of the last two terms.
    struct Terms {
        const Near& moving;  ///< from find_moving()
        bool second;
        uint32_t channels;
        int32_t previous[6], before[6];
    };
    void carry(const RawTrack& t, const Frame& frame, uint32_t terms, const Near& moving);
    Said said(const Near& moving, uint32_t k, uint32_t channel) const;
    Contexts series_contexts(const RawTrack& t, const Terms& terms, Said about, uint32_t k, uint32_t c, uint32_t others) const;
    bool term(const RawTrack& t, Terms& terms, uint32_t k, const int32_t* wanted, int32_t* out);
    struct Sliding;
    Sliding sliding_of(const RawTrack& t, const Near& near, bool change) const;
    bool slip(RawTrack& t, const Frame& frame, const RawTrack* source);
    bool slip_values(const RawTrack& t, const Frame& frame, const Near& near, bool change, const RawTrack* source, int32_t (&out)[2]);
    bool series(RawTrack& t, const Frame& frame, bool second, const Near& moving, const RawTrack* source);

    Statistics& learned_;
    Coder& coder_;
    const LatticeSteps& steps_;
    uint32_t samples_;
    int32_t levels_ = 0;  ///< of the track at hand
    int32_t coarse_scale_;  ///< 16 / ratio, in 1/65536
    TrackBlock& block_;
    uint32_t first_ = 0, done_ = 0, used_ = 0;
    bool drops_ = false;
    uint8_t rest_[2][rest_terms][3];  ///< of the track at hand
    uint8_t slip_rest_[2] = {0, 0};
    int64_t carried_[nearest][carried_terms][3];  ///< its motion as its neighbours' says, terms 1 …, in 1/256
    int64_t carried_share_[nearest];  ///< in 1/65536
    Recent recent_;
    int64_t search_low_[3];
    uint32_t search_shift_ = 0;
    uint32_t distance_[window] = {};  ///< of every slot, from measure()
};

#include "format/chunk_model_parts.h"
#include "format/chunk_model_series.h"
#include "format/chunk_model_slip.h"

}  // namespace rill::format
