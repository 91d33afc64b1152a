// SPDX-License-Identifier: MIT
// What the directory of an asset says beyond AssetInfo: for reports, not for playing.
#pragma once
#include <string>
#include <vector>

#include "format/layout.h"

namespace rill::cooker {

struct AssetDirectory {
    format::Header header{};
    std::vector<format::WindowRecord> windows;
    std::vector<format::ChunkRecord> chunks;
    std::string path, settings_json;

    std::vector<int> numbers;  ///< the source's, where some are missing; else empty: first_frame by frame_step

    int frame_number(uint32_t index) const {
        return numbers.empty() ? header.first_frame + int(index) * header.frame_step : numbers.at(index);
    }
    uint32_t index_of(int number) const;  ///< throws InputError when the asset has no such frame
    /// Index of a frame, or where it lies between two by its number. Throws InputError when it is none of those between first and last.
    double place_of(int number) const;
    double diagonal() const;  ///< of the sequence's bounds, metres
};
/// Throws InputError naming the file and what is wrong with it.
AssetDirectory read_directory(const std::string& path);
/// All bytes of the chunks against their checksums. Throws InputError naming the first that is damaged.
void check_chunks(const AssetDirectory& directory);
/// One chunk's bytes, checked. Throws InputError.
std::vector<uint8_t> read_chunk(const AssetDirectory& directory, uint32_t chunk);

}  // namespace rill::cooker
