// SPDX-License-Identifier: MIT
// Chunks → file. Chunk bytes are spooled beside the target as they come, so memory does not grow with the
// sequence; the finished file appears by rename, or not at all.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "asset/asset_directory.h"
#include "asset/layers_to_chunks.h"
#include "format/layout.h"

namespace rill::cooker {

struct ChunkToWrite {
    EncodedChunk encoded;
    uint32_t layer = 0, block = 0;
    glm::vec3 lower{}, upper{};
    float spacing = 0, error_mean = 0, error_p99 = 0;
};
/// Everything of the header that is not derived from the chunks.
struct AssetFacts {
    uint32_t frame_count = 0;
    int32_t first_frame = 0, frame_step = 1;
    uint32_t layer_count = 1;
    double frames_per_second = 24, first_seconds = 0;
    std::vector<double> frame_seconds;   ///< empty: evenly spaced; else seconds after the first frame
    float cell_size = 0;
    glm::vec3 lower{}, upper{};
    uint32_t walls = 0;                  ///< as format::Header
    std::vector<uint8_t> model;
    std::string settings_json;
};

class AssetWriter {
public:
    /// Opens the spool file beside `path`. Throws InputError when it cannot.
    explicit AssetWriter(std::string path);
    ~AssetWriter();  ///< removes what is unfinished
    /// Windows in playback order; chunks in any order (sorted here).
    void add_window(uint32_t first_sample, uint32_t sample_count, uint32_t block_count,
                    std::vector<ChunkToWrite> chunks);
    /// All windows of a finished asset, as they are; its first sample becomes `first_sample`. Throws InputError when damaged.
    void append(const AssetDirectory& part, uint32_t first_sample);
    /// Writes header, directory, chunks to `path`.partial, syncs, renames. Throws InputError (disk full …).
    void finish(const AssetFacts& facts);
private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rill::cooker
