// SPDX-License-Identifier: MIT
#include "format/chunk_decoder.h"

#include "format/chunk_walk.h"

namespace rill::format {
namespace {

const char* decode(const uint8_t* bytes, size_t size, const ChunkShape& shape, TrackBlock& block) {
    if (!valid(shape.steps)) return "the window's steps are not sensible";
    RangeDecoder coder(bytes, bytes + size);
    Statistics learned = first_statistics;
    if (const char* why = walk_chunk(coder, shape, block, learned)) return why;
    finish_block(shape.steps, block);
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
