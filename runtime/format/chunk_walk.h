// SPDX-License-Identifier: MIT
// A chunk from its first bit to its last, whatever the decoder does on the way: the runtime only decodes, `rill info`
// counts bits as well.
#pragma once
#include "format/chunk_decoder.h"
#include "format/chunk_model.h"

namespace rill::format {

/// The bounding box of the lattice points; false when its positions cannot be held.
template <class Coder>
bool read_box(ChunkModel<Coder>& model, const LatticeSteps& steps, int32_t (&low)[3], uint8_t (&bits)[3]) {
    const int64_t reach = max_mean / steps.ratio;
    for (int c = 0; c < 3; ++c) {
        low[c] = model.number(0);
        bits[c] = uint8_t(model.raw(5, 0));
        if (low[c] < -reach || low[c] + (int64_t(1) << bits[c]) > reach) return false;
    }
    return true;
}

/// `coder`: a RangeDecoder, or what behaves as one. Null, or why the bytes are no chunk of this
/// shape. What is in the block is still on the lattice: finish_block() follows. `learned`: a copy of
/// first_statistics.
template <class Coder>
const char* walk_chunk(Coder& coder, const ChunkShape& shape, TrackBlock& block, Statistics& learned) {
    if (shape.sample_count < 1 || shape.sample_count > max_window_samples) return "the window is too long";
    ChunkModel<Coder> model(coder, shape.steps, shape.sample_count, learned, block);
    const auto none = [](uint32_t) -> const RawTrack* { return nullptr; };
    const uint32_t counts[2] = {shape.point_count, shape.drop_count};
    for (int set = 0; set < 2; ++set) {
        if (counts[set] == 0) continue;
        int32_t low[3];
        uint8_t bits[3];
        if (!read_box(model, shape.steps, low, bits)) return "the chunk's box is out of range";
        if (!model.code_set(set == 1, set ? counts[0] : 0, counts[set], low, bits, none)) return model.reason;
    }
    if (model.coefficients_used() != shape.coefficient_count) return "fewer coefficients than the directory says";
    return coder.finished() ? nullptr : "the chunk's length does not fit its content";
}

}  // namespace rill::format
