// SPDX-License-Identifier: MIT
// Time and room → how much detail a frame gives up. Before the frame: an estimate of the cells in sight, from the
// directory alone, times what cells, points and bytes took lately. During it: the mesher asks whether it is late.
// Without Budget::microseconds nothing is learned and no clock is read: the same frame gives the same bytes.
#include <algorithm>
#include <cmath>

#include "pipeline.h"

namespace rill {
namespace {

constexpr float aim = 0.7f;              ///< of the time there is: estimates err
constexpr float late_after[] = {0.5f, 0.75f, 0.9f};  ///< of the time there is; each asks for less detail once
constexpr float slow_rise = 1 / 16.f;    ///< octaves of detail that a frame wins back, once there are `spare` of them
constexpr float spare = 0.5f;
constexpr float step = 0.25f;            ///< octaves
constexpr int most_places = 512;

/// Places in sight, and the surface that each stands for, in square metres.
struct Places {
    float at[most_places][3], area[most_places];
    int count = 0;

    /// So many cells are there, of the sizes that the octree gives them.
    float cells(const Levels& levels) const {
        float sum = 0;
        for (int i = 0; i < count; ++i) {
            int32_t level = 0, box[3];
            for (; level < levels.coarsest(); ++level) {
                const float inverse = 1 / (tile_cells * levels.cell(level + 1));
                for (int a = 0; a < 3; ++a)
                    box[a] = int32_t(std::clamp(std::floor(at[i][a] * inverse), -1e9f, 1e9f));
                if (levels.divided(level + 1, box)) break;
            }
            sum += area[i] / (levels.cell(level) * levels.cell(level));
        }
        return sum;
    }
};

/// The part of a block in sight, felt out at a few places; its points and their spacing tell how much surface it has.
void add_block(const Plan& plan, const format::ChunkRecord& finest, float points, int samples, Places& places) {
    const float area = points * finest.spacing * finest.spacing / float(samples * samples * samples);
    for (int k = 0; k < samples * samples * samples && places.count < most_places; ++k) {
        const int at[3] = {k % samples, k / samples % samples, k / samples / samples};
        float* p = places.at[places.count];
        for (int a = 0; a < 3; ++a)
            p[a] = finest.lower[a] + (finest.upper[a] - finest.lower[a]) * (float(at[a]) + 0.5f) / float(samples);
        bool seen = plan.view_count == 0;
        for (uint32_t v = 0; v < plan.view_count && !seen; ++v) seen = touches(plan.views[v], p, p, finest.spacing);
        if (seen) places.area[places.count++] = area;
    }
}

void find_places(const Directory& directory, const Plan& plan, Places& places) {
    const format::WindowRecord& w = directory.tables.windows[plan.moment.window];
    float points[format::max_blocks] = {};
    const format::ChunkRecord* finest[format::max_blocks] = {};
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        points[chunk.block] += float(chunk.point_count);
        finest[chunk.block] = &chunk;  // they ascend by layer
    }
    const int samples = std::clamp(int(std::cbrt(float(most_places) / float(std::max(uint32_t(w.block_count), 1u)))), 1, 6);
    for (uint32_t b = 0; b < w.block_count; ++b)
        if (finest[b]) add_block(plan, *finest[b], points[b], samples, places);
}

/// How many cells there are with so much detail given up.
float cells_at(const Plan& plan, const Places& places, float octaves) {
    Levels levels = plan.levels;
    levels.coarsen(octaves);
    return places.cells(levels);
}

/// The least to give up, in steps, so that the cells do not exceed `most`; more cells the less one gives up.
float find_octaves(const Plan& plan, const Places& places, float most_cells, float most) {
    int low = 0, high = int(std::ceil(most / step));
    while (low < high) {
        const int middle = (low + high) / 2;
        if (cells_at(plan, places, step * float(middle)) > most_cells) low = middle + 1;
        else high = middle;
    }
    return std::min(step * float(low), most);
}

uint32_t points_of(const Directory& directory, const Plan& plan) {
    uint32_t points = 0;
    for (uint32_t i = 0; i < plan.now_count; ++i) points += directory.tables.chunks[plan.wants[i].chunk].point_count;
    return points;
}

/// Follows at once what grows, slowly what shrinks: it is for bounds.
void learn(float& known, float measured) {
    if (std::isfinite(measured) && measured >= 0) known += (measured > known ? 0.5f : 0.05f) * (measured - known);
}

}  // namespace

float most_octaves(const Directory& directory) noexcept {
    constexpr float fewest_cells = 8, most = 6;
    float across = 0;
    for (int a = 0; a < 3; ++a) across = std::max(across, directory.header.upper[a] - directory.header.lower[a]);
    return std::clamp(std::log2(std::max(across, 1e-9f) / (fewest_cells * directory.header.cell_size)), 0.f, most);
}

uint64_t microseconds_now(const Player& player) noexcept {
    return player.frame.budget.microseconds ? read_clock(player.asset->host) : 0;
}

void give_up_detail(Player& player) noexcept {
    Pace& pace = player.pace;
    const Budget& budget = player.frame.budget;
    pace.lates = 0;
    pace.cells = 0;
    if (!budget.microseconds || budget.cell_size > 0) {
        pace.octaves = 0;
        return;
    }
    Places places;
    find_places(*player.directory, player.plan, places);
    pace.points = float(points_of(*player.directory, player.plan));
    const float left = aim * float(budget.microseconds) - pace.us_per_point * pace.points - float(player.plan_us);
    const float affordable = std::max(left, 0.1f * float(budget.microseconds)) / pace.us_per_vertex;
    const float most = most_octaves(*player.directory);
    const float octaves = find_octaves(player.plan, places, affordable / pace.vertices_per_cell, most);
    if (octaves > pace.octaves) pace.octaves = octaves;
    else if (octaves == 0 || octaves < pace.octaves - spare) pace.octaves = std::max(octaves, pace.octaves - slow_rise);
    pace.octaves = std::min(pace.octaves, most);
    pace.cells = cells_at(player.plan, places, pace.octaves);
    player.plan.levels_drawn = player.plan.levels;
    player.plan.levels_drawn.coarsen(pace.octaves);
}

bool is_late(void* player) noexcept {
    Player& p = *static_cast<Player*>(player);
    Pace& pace = p.pace;
    constexpr uint32_t most = sizeof(late_after) / sizeof(late_after[0]);
    if (pace.lates == most) return false;
    const float spent = float(p.plan_us) + float(microseconds_now(p) - p.decode_begun.us);
    if (spent < late_after[pace.lates] * float(p.frame.budget.microseconds)) return false;
    ++pace.lates;
    return true;
}

uint64_t decode_bytes_affordable(const Player& player) noexcept {
    constexpr float share = 0.3f;
    if (!player.frame.budget.microseconds || player.residency.waiting) return UINT64_MAX;
    return uint64_t(share * float(player.frame.budget.microseconds) / player.pace.us_per_byte);
}

void learn_pace(Player& player, const MeshCounts& mesh, uint64_t bytes_decoded) noexcept {
    Pace& pace = player.pace;
    if (!player.frame.budget.microseconds) return;
    if (bytes_decoded)
        learn(pace.us_per_byte, float(player.decode_done.us - player.decode_begun.us) / float(bytes_decoded));
    if (!player.frame.target || pace.cells <= 0) return;
    if (pace.points > 0)
        learn(pace.us_per_point, float(player.mesh_begun.us - player.decode_done.us) / pace.points);
    if (mesh.octaves > 0) {  // what it took was not for one mesh
        pace.octaves = std::min(pace.octaves + mesh.octaves, most_octaves(*player.directory));
        learn(pace.vertices_per_cell, 1.5f * pace.vertices_per_cell);
        return;
    }
    if (mesh.vertices < 100) return;
    learn(pace.us_per_vertex, float(player.mesh_done.us - player.mesh_begun.us) / float(mesh.vertices));
    learn(pace.vertices_per_cell, float(mesh.vertices) / pace.cells);
}

}  // namespace rill
