// SPDX-License-Identifier: MIT
#include "format/chunk_decoder.h"

#include <cstring>

#include "format/chunk_model.h"

namespace rill::format {
namespace {

uint32_t little_endian(const uint8_t* at, uint32_t bytes) {
    uint32_t value = 0;
    for (uint32_t b = 0; b < bytes; ++b) value |= uint32_t(at[b]) << (8 * b);
    return value;
}
float float_at(const uint8_t* at) {
    const uint32_t bits = little_endian(at, 4);
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

/// The bounding box of the lattice points; false when its positions cannot be held.
bool read_box(ChunkModel<RangeDecoder>& model, const LatticeSteps& steps, int32_t (&low)[3],
              uint8_t (&bits)[3]) {
    const int64_t reach = max_mean / steps.ratio;
    for (int c = 0; c < 3; ++c) {
        low[c] = int32_t(model.raw(32, 0));
        bits[c] = uint8_t(model.raw(5, 0));
        if (low[c] < -reach || low[c] + (int64_t(1) << bits[c]) > reach) return false;
    }
    return true;
}

const char* decode(const uint8_t* bytes, size_t size, const ChunkShape& shape, TrackBlock& block) {
    if (size < lattice_steps_bytes) return "the chunk is shorter than its head";
    if (shape.sample_count < 1 || shape.sample_count > max_window_samples) return "the window is too long";
    LatticeSteps steps;
    steps.step = float_at(bytes), steps.normal_step = float_at(bytes + 4);
    for (int c = 0; c < 3; ++c) steps.origin[c] = float_at(bytes + 8 + 4 * c);
    steps.ratio = uint16_t(little_endian(bytes + 20, 2));
    if (!valid(steps)) return "the chunk's steps are not sensible";

    RangeDecoder coder(bytes + lattice_steps_bytes, bytes + size);
    Statistics learned;
    ChunkModel<RangeDecoder> model(coder, steps, shape.sample_count, learned, block);
    const auto none = [](uint32_t) -> const RawTrack* { return nullptr; };
    const uint32_t counts[2] = {shape.point_count, shape.drop_count};
    for (int set = 0; set < 2; ++set) {
        if (counts[set] == 0) continue;
        int32_t low[3];
        uint8_t bits[3];
        if (!read_box(model, steps, low, bits)) return "the chunk's box is out of range";
        if (!model.code_set(set == 1, set ? counts[0] : 0, counts[set], low, bits, none)) return model.reason;
    }
    if (model.coefficients_used() != shape.coefficient_count)
        return "fewer coefficients than the directory says";
    if (!coder.finished()) return "the chunk's length does not fit its content";
    finish_block(steps, block);
    return nullptr;
}

}  // namespace

Status decode_chunk(const uint8_t* bytes, size_t size, const ChunkShape& shape, const uint8_t* model,
                    size_t model_bytes, TrackBlock& block, const char** reason) noexcept {
    (void)model;
    block.point_count = shape.point_count;
    block.drop_count = shape.drop_count;
    block.coefficient_count = shape.coefficient_count;
    const char* why =
        model_bytes ? "the entropy model is not one this version knows" : decode(bytes, size, shape, block);
    if (why) block.point_count = block.drop_count = block.coefficient_count = 0;
    if (reason) *reason = why;
    return why ? Status::corrupt : Status::ok;
}

}  // namespace rill::format
