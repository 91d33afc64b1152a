// SPDX-License-Identifier: MIT
#include "verify/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>

#include "asset/asset_directory.h"
#include "asset/asset_player.h"
#include "common/parallel.h"

namespace rill::cooker {
namespace {

constexpr float lone_cells = 0.25f;     // that a piece must lie away from all else to be remembered
constexpr double beside_border = 1e-4;  // of a frame step: nothing moves in it

struct Moment {
    Mesh mesh;
    SurfaceIndex index;
    explicit Moment(Mesh shown) : mesh(std::move(shown)), index(mesh) {}
};

/// The pieces of `mesh` that lie away from the surface `distances` were taken to.
void find_lone(const Mesh& mesh, const std::vector<float>& distances, float least, std::vector<LonePiece>& lone) {
    if (distances.empty()) return;
    const std::vector<uint32_t> piece = label_components(mesh);
    std::vector<float> away(piece.size(), std::numeric_limits<float>::infinity());
    for (size_t v = 0; v < piece.size(); ++v) away[piece[v]] = std::min(away[piece[v]], distances[v]);
    std::vector<double> volume(piece.size(), 0.0);
    for (const Triangle& t : mesh.triangles) {
        const uint32_t p = piece[t[0]];
        if (!(away[p] > least)) continue;
        const glm::dvec3 o = mesh.positions[p];
        const glm::dvec3 a = glm::dvec3(mesh.positions[t[0]]) - o, b = glm::dvec3(mesh.positions[t[1]]) - o;
        volume[p] += glm::dot(a, glm::cross(b, glm::dvec3(mesh.positions[t[2]]) - o)) / 6;
    }
    for (size_t p = 0; p < piece.size(); ++p)
        if (volume[p] != 0) lone.push_back({away[p], float(std::abs(volume[p]))});
}

/// One interval, or one border, with what it adds to the whole.
struct Part {
    IntervalMotion interval;
    std::optional<BorderJump> border;  ///< at `interval.from`
    Spread frame, substep, jump;
};

Part measure_part(AssetPlayer& player, const AssetDirectory& directory, uint32_t index, bool at_border, uint32_t substeps) {
    Part part;
    const float cell = directory.header.cell_size;
    const double begin = player.frame_seconds(index), step = player.frame_seconds(index + 1) - begin;
    part.interval.from = directory.frame_number(index), part.interval.to = directory.frame_number(index + 1);
    const auto moment = [&](double seconds) { return std::make_shared<const Moment>(player.mesh(seconds)); };
    if (at_border) {
        const double before = begin - player.frame_seconds(index - 1);
        const auto left = moment(begin - beside_border * before), right = moment(begin + beside_border * step);
        part.border = BorderJump{part.interval.from, displacement(left->mesh, left->index, right->mesh, right->index, cell, part.jump, nullptr)};
    }
    const std::shared_ptr<const Moment> first = moment(begin);
    std::shared_ptr<const Moment> now = first;
    for (uint32_t k = 1; k <= substeps; ++k) {
        const std::shared_ptr<const Moment> next = moment(begin + step * k / substeps);
        part.interval.substeps.push_back(
            displacement(now->mesh, now->index, next->mesh, next->index, cell, part.substep, &part.interval.lone));
        now = next;
    }
    part.interval.frame = displacement(first->mesh, first->index, now->mesh, now->index, cell, part.frame, nullptr);
    return part;
}

}  // namespace

Displacement displacement(const Mesh& a, const SurfaceIndex& a_index, const Mesh& b, const SurfaceIndex& b_index, float cell,
                          Spread& spread, std::vector<LonePiece>* lone) {
    const SurfaceDistance d = surface_distance(a, a_index, b, b_index, lone != nullptr);
    if (std::isfinite(d.max)) spread.add(d);
    if (lone) {
        find_lone(a, d.per_source_vertex, lone_cells * cell, *lone);
        find_lone(b, d.per_decoded_vertex, lone_cells * cell, *lone);
    }
    return {d.mean, d.p99, d.max};
}

uint32_t Motion::jumps() const {
    uint32_t count = 0;
    for (const IntervalMotion& interval : intervals)
        for (const Displacement& d : interval.substeps) count += d.max > most_smooth();
    return count;
}

double Motion::jump_share() const { return substep.weight > 0 ? 1 - substep.histogram.share_below(most_smooth()) : 0; }

std::vector<LonePiece> Motion::lone() const {
    std::vector<LonePiece> all;
    for (const IntervalMotion& interval : intervals)
        for (const LonePiece& piece : interval.lone)
            if (piece.away > most_smooth()) all.push_back(piece);
    std::sort(all.begin(), all.end(), [](const LonePiece& a, const LonePiece& b) { return a.volume > b.volume; });
    return all;
}

Motion measure_motion(const std::string& asset, int first, int last, uint32_t substeps, int jobs,
                      const std::function<void(uint32_t, uint32_t)>& progress) {
    const AssetDirectory directory = read_directory(asset);
    const uint32_t begin = directory.index_of(first), end = directory.index_of(last);
    Motion motion;
    motion.substeps = substeps;
    // A run of frames per task, one player each: its windows are decoded about once.
    const uint32_t count = end > begin ? end - begin : 0, run = uint32_t(run_length(count, jobs)), runs = (count + run - 1) / run;
    std::mutex mutex;
    uint32_t done = 0;
    InOrder<Part> parts([&](Part&& part) {
        motion.frame.add(part.frame), motion.substep.add(part.substep), motion.border.add(part.jump);
        if (part.border) motion.borders.push_back(*part.border);
        motion.intervals.push_back(std::move(part.interval));
    });
    parallel_for(runs, jobs, [&](size_t r) {
        AssetPlayer player(asset);
        for (uint32_t i = uint32_t(r) * run; i < std::min(count, uint32_t(r + 1) * run); ++i) {
            const uint32_t index = begin + i;
            const bool at_border = i > 0 && std::any_of(directory.windows.begin(), directory.windows.end(),
                                                        [&](const auto& w) { return w.first_sample == index; });
            Part part = measure_part(player, directory, index, at_border, substeps);
            const std::lock_guard lock(mutex);
            parts.put(i, std::move(part));
            if (progress) progress(++done, count);
        }
    });
    return motion;
}

}  // namespace rill::cooker
