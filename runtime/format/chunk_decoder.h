// SPDX-License-Identifier: MIT
// Chunk bytes → tracks. The encoder half is cooker/asset/layers_to_chunks.cpp; FORMAT.md describes the bits.
#pragma once
#include <cstddef>
#include <cstdint>

#include "format/lattice.h"
#include "format/tracks.h"
#include "rill/rill.h"

namespace rill::format {

struct ChunkShape {          ///< from the directory, already checked
    uint32_t sample_count;   ///< of the window
    uint32_t point_count, drop_count, coefficient_count;
    LatticeSteps steps;      ///< of the window
};
/// Fills block.tracks (point_count + drop_count) and block.coefficients (coefficient_count), which
/// the caller sized from the shape. Any bytes are safe: anything that does not decode to exactly this
/// shape is Status::corrupt, and `reason` (static string, may be null) says why.
/// Deterministic on every machine: prediction and dequantisation of stored symbols are integer work.
/// Allocates nothing; takes about 80 kB of stack. About 5 µs a track: 3 MB of chunk per second and core.
Status decode_chunk(const uint8_t* bytes, size_t size, const ChunkShape& shape,
                    const uint8_t* model, size_t model_bytes, TrackBlock& block,
                    const char** reason) noexcept;

}  // namespace rill::format
