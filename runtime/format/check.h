// SPDX-License-Identifier: MIT
// What a valid header and directory is. Every count and offset is compared with the bytes really
// present before it sizes anything. Reasons are static strings, fit for a log.
#pragma once
#include <cstddef>
#include <cstdint>

#include "format/layout.h"
#include "rill/rill.h"

namespace rill::format {

/// Fewest coded bits that a track, or a float, may have cost: bounds what a few hostile bytes can ask for.
inline constexpr uint32_t most_tracks_per_byte = 256;
inline constexpr uint32_t most_coefficients_per_byte = 4096;
/// Coordinates, spacings and errors stay below this (metres), so that their squares are finite floats.
inline constexpr float largest_length = 1e15f;

/// `size` bytes of the file's beginning are present (≥ header_bytes in a whole file); the file has
/// `file_bytes`. not_an_asset, unknown_format, corrupt, or ok with `out` filled.
Status check_header(const uint8_t* bytes, size_t size, uint64_t file_bytes, Header& out,
                    const char** reason) noexcept;

/// Where check_directory() puts what it read. Arrays have the header's counts; they are the caller's.
/// model and settings point into the bytes given.
struct DirectoryTables {
    double* frame_times;      ///< frame_time_count
    WindowRecord* windows;    ///< window_count
    ChunkRecord* chunks;      ///< chunk_count
    const uint8_t* model;     ///< model_bytes
    const uint8_t* settings;  ///< settings_bytes: printable UTF-8
};
/// `bytes`: header.directory_bytes of them, from a header that passed check_header().
Status check_directory(const Header& header, const uint8_t* bytes, DirectoryTables& out,
                       const char** reason) noexcept;

}  // namespace rill::format
