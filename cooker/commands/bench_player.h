// SPDX-License-Identifier: MIT
// A player as an engine would embed it, with everything counted and timed.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/mesh.h"
#include "rill/host.h"
#include "rill/rill.h"

namespace rill::cooker {

enum Stage { stage_plan, stage_decode, stage_field, stage_mesh, stage_wait, stage_total, stage_processor, stage_count };
inline constexpr const char* stage_names[stage_count] = {"plan", "decode", "field", "mesh", "wait", "total", "processor"};

struct BenchFrame {
    std::array<uint32_t, stage_count> microseconds{};  ///< total: from begin_frame() to the return of end_frame(); processor: time that all threads together computed meanwhile
    uint32_t triangles = 0, points = 0, cut = 0;
    uint64_t hash = 0;                                 ///< FNV-1a of every buffer written
};

/// Processor time of all threads so far, microseconds: on a busy machine, a better measure than the clock.
uint64_t processor_microseconds();

/// Heap memory that counts.
struct CountedMemory {
    Memory heap{};
    uint64_t allocations = 0, bytes = 0, peak_bytes = 0;
    Memory memory();
};

class BenchPlayer {
public:
    /// The file is held in memory: what is timed is the runtime, not the disk. Throws InputError.
    BenchPlayer(const std::string& path, int jobs);
    ~BenchPlayer();
    BenchPlayer(const BenchPlayer&) = delete;

    const AssetInfo& info() const { return info_; }
    double seconds_of(uint32_t frame) const { return frame_seconds(asset_, frame); }
    /// One frame, waited for; `mesh`, if given, gets a copy of the output.
    BenchFrame play(double seconds, float rate, Mesh* mesh = nullptr);
    /// What the frames after this ask for: a cell size (0: the source's), and whether an eighth of the bounds is in sight.
    void look(float cell_size, bool eighth);
    /// Likewise: all is in sight, from there, in cells of `pixel_error` pixels.
    void look_from(const glm::vec3& eye, float pixels_per_radian, float pixel_error);
    uint64_t allocations() const { return memory_.allocations; }
    uint64_t peak_bytes() const { return memory_.peak_bytes; }
    uint64_t bytes_read() const { return bytes_read_; }

private:
    [[noreturn]] void fail(Status status);
    std::string path_, bytes_, reason_;
    CountedMemory memory_;
    MemoryReader reader_{};
    ThreadPool* pool_ = nullptr;
    Asset* asset_ = nullptr;
    Player* player_ = nullptr;
    AssetInfo info_{};
    uint64_t bytes_read_ = 0;
    Budget budget_{};
    View view_{};
    bool from_view_ = false;
    std::vector<glm::vec3> positions_, normals_, velocities_;
    std::vector<uint32_t> indices_;
    std::vector<Range> ranges_;
};

}  // namespace rill::cooker
