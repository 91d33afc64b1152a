// SPDX-License-Identifier: MIT
// A chunk from its first bit to its last, whatever the decoder does on the way: the runtime only decodes, `rill info`
// counts bits as well.
#pragma once
#include <cstring>

#include "format/chunk_decoder.h"
#include "format/chunk_model.h"

namespace rill::format {

inline uint32_t little_endian(const uint8_t* at, uint32_t bytes) {
    uint32_t value = 0;
    for (uint32_t b = 0; b < bytes; ++b) value |= uint32_t(at[b]) << (8 * b);
    return value;
}
inline float float_at(const uint8_t* at) {
    const uint32_t bits = little_endian(at, 4);
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}
/// A chunk's head, lattice_steps_bytes of it; check with valid().
inline LatticeSteps read_steps(const uint8_t* bytes) {
    LatticeSteps steps;
    steps.step = float_at(bytes), steps.normal_step = float_at(bytes + 4);
    for (int c = 0; c < 3; ++c) steps.origin[c] = float_at(bytes + 8 + 4 * c);
    steps.ratio = uint16_t(little_endian(bytes + 20, 2));
    steps.slip_step = float_at(bytes + 22);
    return steps;
}

/// The bounding box of the lattice points; false when its positions cannot be held.
template <class Coder>
bool read_box(ChunkModel<Coder>& model, const LatticeSteps& steps, int32_t (&low)[3], uint8_t (&bits)[3]) {
    const int64_t reach = max_mean / steps.ratio;
    for (int c = 0; c < 3; ++c) {
        low[c] = int32_t(model.raw(32, 0));
        bits[c] = uint8_t(model.raw(5, 0));
        if (low[c] < -reach || low[c] + (int64_t(1) << bits[c]) > reach) return false;
    }
    return true;
}

/// All after the head. `coder`: a RangeDecoder, or what behaves as one. Null, or why the bytes are no chunk of this
/// shape. What is in the block is still on the lattice: finish_block() follows. `learned`: a copy of
/// first_statistics.
template <class Coder>
const char* walk_chunk(Coder& coder, const LatticeSteps& steps, const ChunkShape& shape, TrackBlock& block, Statistics& learned) {
    if (shape.sample_count < 1 || shape.sample_count > max_window_samples) return "the window is too long";
    ChunkModel<Coder> model(coder, steps, shape.sample_count, learned, block);
    const auto none = [](uint32_t) -> const RawTrack* { return nullptr; };
    const uint32_t counts[2] = {shape.point_count, shape.drop_count};
    for (int set = 0; set < 2; ++set) {
        if (counts[set] == 0) continue;
        int32_t low[3];
        uint8_t bits[3];
        if (!read_box(model, steps, low, bits)) return "the chunk's box is out of range";
        if (!model.code_set(set == 1, set ? counts[0] : 0, counts[set], low, bits, none)) return model.reason;
    }
    if (model.coefficients_used() != shape.coefficient_count) return "fewer coefficients than the directory says";
    return coder.finished() ? nullptr : "the chunk's length does not fit its content";
}

}  // namespace rill::format
