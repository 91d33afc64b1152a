// SPDX-License-Identifier: MIT
// Where the bytes of an asset are: every one of them, read out of the file itself.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "asset/asset_directory.h"

namespace rill::cooker {

/// What the bytes of a layer are for. The coder spends fractions of bits: kinds are rounded so that they add up.
struct LayerBytes {
    uint64_t directory = 0;           ///< records of its chunks
    uint64_t structure = 0;           ///< boxes; birth, death and kind of tracks
    uint64_t births = 0;              ///< where on the lattice tracks stand
    uint64_t first_coefficients = 0;  ///< mean normal, and the mean position's rest along it
    uint64_t motion = 0, normals = 0; ///< all further terms
    uint64_t slip = 0;                ///< of the liquid along the surface
    uint64_t drops = 0;
    uint64_t padding = 0;             ///< up to whole bytes, at the end of every chunk
    uint64_t sum() const;
};
struct ByteAccount {
    uint64_t header = 0, frame_times = 0, windows = 0, model = 0, settings = 0;
    uint64_t unused = 0;              ///< between windows: the format allows it, the cooker leaves none
    std::vector<LayerBytes> layers;
    uint64_t sum() const;             ///< the size of the file, exactly
};
/// Decodes all chunks. Throws InputError naming the first that is damaged.
ByteAccount account_for_bytes(const AssetDirectory& directory);
/// Documented in REPORTS.md.
nlohmann::json to_json(const ByteAccount& account);

}  // namespace rill::cooker
