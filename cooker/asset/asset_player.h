// SPDX-License-Identifier: MIT
// The cooker judges its own files as an engine would see them: an asset opened and meshed through the
// public runtime API (rill.h, host.h).
#pragma once
#include <memory>
#include <string>

#include "common/mesh.h"
#include "rill/rill.h"

namespace rill::cooker {

class AssetPlayer {
public:
    /// Throws InputError naming the file and rill::text(status).
    explicit AssetPlayer(const std::string& path, int jobs = 1);
    ~AssetPlayer();
    const AssetInfo& info() const;
    /// Whole surface at `seconds` after the first frame. cell 0: the source's own resolution; layers 0: all.
    Mesh mesh(double seconds, float cell = 0, uint32_t layers = 0, Stats* stats = nullptr);
    double frame_seconds(uint32_t index) const;
    Asset* asset() const;
private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rill::cooker
