// SPDX-License-Identifier: MIT
// Every field of rill::Stats by name, and the --stats file.
#pragma once
#include <string>
#include <vector>

#include "engine.h"

namespace player {

/// Calls visit(name, value) for each field in the order of rill.h.
template <class Visit>
void for_each_stat(const rill::Stats& s, Visit&& visit) {
    visit("cut", s.cut);
    visit("blocks_in_view", s.blocks_in_view);
    visit("blocks_drawn", s.blocks_drawn);
    visit("layers_wanted", s.layers_wanted);
    visit("layers_drawn", s.layers_drawn);
    visit("points_wanted", s.points_wanted);
    visit("points_used", s.points_used);
    visit("vertices_wanted", s.vertices_wanted);
    visit("indices_wanted", s.indices_wanted);
    visit("ranges_wanted", s.ranges_wanted);
    visit("chunks_resident", s.chunks_resident);
    visit("chunks_late", s.chunks_late);
    visit("reads_in_flight", s.reads_in_flight);
    visit("chunks_rejected", s.chunks_rejected);
    visit("reads_refused", s.reads_refused);
    visit("reads_failed", s.reads_failed);
    visit("bytes_resident", s.bytes_resident);
    visit("bytes_asked", s.bytes_asked);
    visit("bytes_arrived", s.bytes_arrived);
    visit("windows_decoded", s.windows_decoded);
    visit("plan_us", s.plan_us);
    visit("decode_us", s.decode_us);
    visit("field_us", s.field_us);
    visit("mesh_us", s.mesh_us);
    visit("wait_us", s.wait_us);
    visit("cell_size", s.cell_size);
    visit("pixel_error", s.pixel_error);
}

/// "vertices, late" for Cut bits; "nothing" for 0.
std::string cut_names(uint32_t cut);

struct FrameRecord {
    int frame;           ///< the source's number
    double seconds;      ///< in the clip
    double frame_ms;     ///< begin_frame to the return of end_frame
    uint32_t vertices, triangles;
    rill::Status status;
    rill::Stats stats;
};

/// Appears only when complete. False: it could not be written (errno says why).
bool write_statistics(const std::string& path, const std::string& asset, const Clip& clip,
                      uint64_t allocations_after_create, const std::vector<FrameRecord>& frames);

}  // namespace player
