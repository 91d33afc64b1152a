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
    std::string settings_json;

    int frame_number(uint32_t index) const { return header.first_frame + int(index) * header.frame_step; }
    double diagonal() const;  ///< of the sequence's bounds, metres
};
/// Throws InputError naming the file and what is wrong with it.
AssetDirectory read_directory(const std::string& path);

}  // namespace rill::cooker
