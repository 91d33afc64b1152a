// SPDX-License-Identifier: MIT
// The report of `rill verify`, as cooker/REPORTS.md describes it.
#include <nlohmann/json.hpp>

#include <cmath>

#include "verify/verify.h"

namespace rill::cooker {
namespace {

using nlohmann::json;

json topology_json(const Topology& t) {
    return {{"components", t.components}, {"large_components", t.large_components}, {"non_manifold_edges", t.non_manifold_edges},
            {"open_edges", t.open_edges}, {"volume_m3", t.volume}};
}

json direction_json(const DirectedDistance& d) {
    return {{"max_m", d.max}, {"mean_m", d.mean}, {"normal_degrees", d.normal_degrees}, {"p99_m", d.p99}};
}

json velocity_json(const VelocityError& error) {
    if (error.degrees.weight == 0) return nullptr;
    return {{"degrees_mean", error.degrees.mean()}, {"degrees_p99", error.degrees.p99()},
            {"length_mean", error.length.mean()}, {"length_p99", error.length.p99()}};
}

json thin_json(const ThinError& error) {
    json classes = json::array();
    for (size_t i = 0; i < ThinError::classes; ++i)
        classes.push_back({{"below_spacings", i + 1}, {"area_share", error.area_share(i)}, {"mean_m", error.below[i].mean()},
                           {"p99_m", error.below[i].p99()}, {"max_m", error.below[i].max}});
    return classes;
}

json coarse_json(const std::array<CoarseMeasure, 2>& measures) {
    json cells = json::array();
    for (const CoarseMeasure& m : measures)
        cells.push_back({{"times", m.times}, {"components", m.components}, {"non_manifold_edges", m.non_manifold_edges}, {"open_edges", m.open_edges}});
    return cells;
}

json frame_json(const FrameMeasure& f, bool details) {
    json frame = {{"frame", f.number},
                  {"seconds", f.seconds},
                  {"between", f.between},
                  {"mean_m", f.distance.mean},
                  {"p99_m", f.distance.p99},
                  {"max_m", f.distance.max},
                  {"normal_degrees", f.distance.normal_degrees},
                  {"source_to_decoded", direction_json(f.distance.forward)},
                  {"decoded_to_source", direction_json(f.distance.backward)},
                  {"median_edge_m", f.edge},
                  {"volume_ratio", f.volume_ratio()},
                  {"source_triangles", f.source_triangles},
                  {"decoded_triangles", f.decoded_triangles},
                  {"source", topology_json(f.source)},
                  {"decoded", topology_json(f.decoded)}};
    if (details)
        frame.update({{"points", f.points}, {"spacing_m", f.spacing}, {"velocity", velocity_json(f.velocity)}, {"thin", thin_json(f.thin)},
                      {"coarser", coarse_json(f.coarse)}});
    return frame;
}

/// Infinite where one of two moments has no surface; JSON knows only null.
json displacement_json(const Displacement& d) { return {{"mean_m", d.mean}, {"p99_m", d.p99}, {"max_m", d.max}}; }

json motion_json(const Motion& motion, double p99, double cell) {
    if (motion.substeps == 0) return nullptr;
    json intervals = json::array(), borders = json::array();
    for (const IntervalMotion& interval : motion.intervals) {
        json steps = json::array();
        for (const Displacement& d : interval.substeps) steps.push_back(displacement_json(d));
        intervals.push_back({{"from", interval.from}, {"to", interval.to}, {"frame", displacement_json(interval.frame)}, {"substeps", steps}});
    }
    for (const BorderJump& border : motion.borders) {
        json entry = displacement_json(border.jump);
        entry["frame"] = border.frame;
        borders.push_back(entry);
    }
    const std::vector<LonePiece> lone = motion.lone();
    return {{"substeps", motion.substeps},
            {"frame_step_mean_m", motion.frame.mean()},
            {"jump_limit_m", motion.most_smooth()},
            {"mean_m", motion.substep.mean()},
            {"p99_m", motion.substep.p99()},
            {"max_m", motion.substep.max},
            {"jumps", motion.jumps()},
            {"jump_area_share", motion.jump_share()},
            {"lone_pieces", lone.size()},
            {"largest_lone_piece_cells", lone.empty() || cell == 0 ? 0 : lone.front().volume / (cell * cell * cell)},
            {"border_mean_m", motion.border.mean()},
            {"border_p99_m", motion.border.p99()},
            {"border_p99_over_p99", p99 > 0 ? motion.border.p99() / p99 : 0},
            {"intervals", intervals},
            {"borders", borders}};
}

}  // namespace

nlohmann::json to_json(const Verification& v) {
    json frames = json::array();
    for (const FrameMeasure& f : v.frames) frames.push_back(frame_json(f, v.details));
    json target = nullptr;
    if (v.target_p99 > 0) target = {{"error", v.target}, {"p99_m", v.target_p99}, {"met", v.target_met()}};
    json report = {{"report", "rill verify"},
            {"version", 1},
            {"asset", v.asset},
            {"input", v.input},
            {"diagonal_m", v.diagonal},
            {"median_edge_m", v.edge},
            {"bytes_per_frame", v.bytes_per_frame},
            {"target", target},
            {"summary", summary_json(v.totals, v.diagonal)},
            {"frames", frames}};
    if (v.details)
        report.update({{"velocity", velocity_json(v.velocity)}, {"thin", thin_json(v.thin)}, {"coarser", coarse_json(v.coarse)},
                       {"motion", motion_json(v.motion, v.p99, v.edge)}});
    return report;
}

}  // namespace rill::cooker
