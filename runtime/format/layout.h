// SPDX-License-Identifier: MIT
// The bytes of a .rill file: what is where, and the version table. runtime/FORMAT.md says the same
// in words. Little endian, fixed width. Read through format/check.h, never by casting file memory.
//
//   Header | directory: FrameTime[] WindowRecord[] ChunkRecord[] model settings | chunk bytes …
//
// Chunks stand in playback order: window by window, coarse layers first, blocks within a layer.
#pragma once
#include <cstdint>

namespace rill::format {

inline constexpr uint8_t magic[8] = {'R', 'I', 'L', 'L', '\r', '\n', 0x1a, '\n'};

/// Numbers are never reused. At or above 0xF0: in flux, refused by release builds of later versions.
enum Version : uint32_t {
    version_1 = 1,  ///< 2026-11: first
    version_2 = 2,  ///< 2026-11: slip: points follow the surface, and say how the liquid slides under them
    version_3 = 3,  ///< 2026-11: steps depend on the life of a track
    version_4 = 4,  ///< 2026-11: smaller records, steps by window; lives by their neighbours'
    version_5 = 5,  ///< 2026-11: walls: the liquid is cut off at sides of its bounds
    version_6 = 6,  ///< 2026-11: shapes of drops on a lattice four times as fine
    version_7 = 7,  ///< 2026-11: drops of one sample tell where they go
    version_8 = 8,  ///< 2026-11: slip changes over a life
    current_version = version_8,
};

/// Hard limits a valid file keeps; they bound what a hostile one can ask for.
inline constexpr uint32_t max_layers = 8;
inline constexpr uint32_t max_blocks = 256;        ///< per window
inline constexpr uint32_t max_window_samples = 65; ///< samples (frames) a window touches
inline constexpr uint32_t max_terms = 32;          ///< basis functions of one track channel
inline constexpr uint32_t max_tracks_per_chunk = 1u << 20;
inline constexpr uint32_t max_directory_bytes = 1u << 28;

/// 128 bytes at offset 0.
struct Header {
    uint8_t magic[8];
    uint32_t version;
    uint32_t header_bytes;      ///< 128
    uint64_t file_bytes;        ///< of the whole file
    uint64_t content_hash;      ///< FNV-1a 64 over the chunk checksums in file order
    uint32_t directory_bytes;   ///< directly after the header
    uint32_t directory_crc;     ///< CRC-32 of the directory bytes
    uint32_t frame_count;       ///< ≥ 1
    int32_t first_frame;        ///< the source's number of frame 0
    int32_t frame_step;         ///< source numbers advance by this, ≥ 1
    uint32_t window_count;
    uint32_t chunk_count;
    uint32_t layer_count;       ///< 1 … max_layers
    uint32_t frame_time_count;  ///< 0: evenly spaced at frames_per_second; else = frame_count
    uint32_t model_bytes;       ///< initial contexts of the entropy coder
    uint32_t settings_bytes;    ///< UTF-8 JSON
    float cell_size;            ///< median edge of the source, metres, > 0
    double frames_per_second;   ///< > 0
    double first_seconds;       ///< source's clock at frame 0
    float lower[3];             ///< bounds of the source over all frames; equal to upper if empty
    float upper[3];
    uint32_t walls;             ///< bit 2 axis + (0 lower, 1 upper): the liquid is cut off at that side of its bounds; and as follows. Version 4: 0
    uint32_t header_crc;        ///< CRC-32 of the 124 bytes before it
};
inline constexpr uint32_t header_bytes = 128;
inline constexpr uint32_t every_wall = 63;
/// So many bits above that of a wall: the surface goes on to it as it is, and ends at an edge. Where that is 0, as meshers of cubes
/// have it: cut off within a cell.
inline constexpr uint32_t sharp_rims_shift = 6;
/// Edges between walls that are not sharp are cut off by a plane, so many 128ths of a cell from the edge along either wall: 8 bits.
inline constexpr uint32_t bevel_shift = 12, every_bevel = 255, bevel_parts = 128, walls_bits = 20;
inline float bevel_of(uint32_t walls, float cell_size) { return float(walls >> bevel_shift & every_bevel) / bevel_parts * cell_size; }
static_assert(sizeof(Header) == header_bytes, "the struct is the byte layout");

/// One span of time, decodable alone: frames first_sample … first_sample + sample_count − 1.
/// Neighbouring windows share their border frame (the last sample of one = the first of the next).
struct WindowRecord {           // 40 bytes
    uint64_t offset;            ///< of its first chunk, from the start of the file; the others follow without gaps
    uint32_t first_sample;      ///< index of a frame, 0 … frame_count−1
    uint32_t sample_count;      ///< 1 … max_window_samples
    uint32_t first_chunk;       ///< into the chunk table
    uint32_t chunk_count;       ///< may be 0: no surface at all in this span
    uint16_t block_count;       ///< ≤ max_blocks
    uint16_t ratio;             ///< of its chunks, as what follows: format/lattice.h, LatticeSteps
    float step, normal_step, slip_step;
};

/// One (window, layer, block). Chunks of a window are sorted by layer, then block. As read; in the file it is narrower.
struct ChunkRecord {
    uint64_t offset;            ///< from the start of the file: follows from its window and the chunks before it
    uint32_t bytes;
    uint32_t crc;               ///< CRC-32 of the chunk bytes
    uint16_t layer;
    uint16_t block;
    uint32_t point_count;       ///< surface-point tracks in it
    uint32_t drop_count;        ///< drop tracks in it
    uint32_t coefficient_count; ///< floats after decoding (format/tracks.h), points and drops
    float lower[3], upper[3];   ///< bounds of the surface these tracks carry, over the whole window
    float spacing;              ///< typical distance between neighbouring points, this and coarser layers
    float error_mean;           ///< measured with this layer and all coarser ones, metres, window mean
    float error_p99;            ///< likewise the 99th percentile; missing drops count as far off as they are thick
};
/// Bounds of chunks are whole numbers of these, 16 bits, from the low corner of the file's: they may lie well outside them.
inline double bounds_unit(const Header& h) {
    float extent = 0;
    for (int a = 0; a < 3; ++a) extent = h.upper[a] - h.lower[a] > extent ? h.upper[a] - h.lower[a] : extent;
    return (double(extent) + 64 * double(h.cell_size)) / 16384;
}
inline float bound_at(const Header& h, int axis, int16_t units) { return float(h.lower[axis] + bounds_unit(h) * units); }
/// In cells: a layer whose p99 is no more is fine enough to be drawn with them. dam_break from 4 diagonals, cells of 2 pixels: with 1
/// cell the drawn surface was off by a p99 of 2.6 pixels for no fewer triangles; with .65 of 1.0 at most, with .5 of .8.
inline constexpr float fine_enough = 0.5f;

inline constexpr uint32_t window_record_bytes = 40;
inline constexpr uint32_t chunk_record_bytes = 38;
static_assert(sizeof(WindowRecord) == window_record_bytes, "the struct is the byte layout");

}  // namespace rill::format
