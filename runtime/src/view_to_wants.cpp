// SPDX-License-Identifier: MIT
// Time, views and budget → moment, cell size, layers, and the ranked list of wanted chunks.
#include <algorithm>
#include <cmath>

#include "pipeline.h"

namespace rill {
namespace {

constexpr float automatic_pixel_error = 2;  ///< Budget::pixel_error 0
constexpr float most_cells_per_spacing = 3; ///< a layer is fine enough for a cell when its points are so near
constexpr float reach_in_spacings = 3;      ///< how far points act beyond their own bounds
constexpr float most_cells_across = 1 << 20;
constexpr int32_t most_levels = 16;
constexpr float hysteresis = 0.25f;         ///< in levels

/// World planes and eyes into asset space. The matrix is rotation · scale | translation, so its inverse
/// is its transpose over scale².
void take_views(const Frame& frame, Plan& plan) {
    const float* m = frame.asset_to_world;
    plan.view_count = frame.view_count;
    if (!frame.view_count) return;
    const float scale = std::sqrt(m[0] * m[0] + m[4] * m[4] + m[8] * m[8]);
    for (uint32_t v = 0; v < frame.view_count; ++v) {
        const View& view = frame.views[v];
        for (int p = 0; p < 6; ++p) {
            const float* world = view.planes[p];
            float* asset = plan.views[v].planes[p];
            for (int a = 0; a < 3; ++a)
                asset[a] = (m[a] * world[0] + m[4 + a] * world[1] + m[8 + a] * world[2]) / scale;
            asset[3] = (m[3] * world[0] + m[7] * world[1] + m[11] * world[2] + world[3]) / scale;
        }
        const float offset[3] = {view.eye[0] - m[3], view.eye[1] - m[7], view.eye[2] - m[11]};
        for (int a = 0; a < 3; ++a)
            plan.eyes[v][a] = (m[a] * offset[0] + m[4 + a] * offset[1] + m[8 + a] * offset[2]) / (scale * scale);
    }
}

bool inside(const FrustumPlanes& view, const float* lower, const float* upper, float wider) {
    for (const float* plane : view.planes) {
        float farthest = plane[3] + wider;
        for (int a = 0; a < 3; ++a) farthest += plane[a] * (plane[a] > 0 ? upper[a] : lower[a]);
        if (farthest < 0) return false;
    }
    return true;
}

bool is_seen(const Plan& plan, const format::ChunkRecord& chunk) {
    if (!plan.view_count) return true;
    for (uint32_t v = 0; v < plan.view_count; ++v)
        if (inside(plan.views[v], chunk.lower, chunk.upper, reach_in_spacings * chunk.spacing)) return true;
    return false;
}

float distance_to(const float* x, const format::ChunkRecord& chunk) {
    float squared = 0;
    for (int a = 0; a < 3; ++a) {
        const float d = std::max({chunk.lower[a] - x[a], x[a] - chunk.upper[a], 0.0f});
        squared += d * d;
    }
    return std::sqrt(squared);
}

/// Most pixels that one metre of asset space covers anywhere in sight; 0: nothing in sight.
float pixels_per_metre(const Directory& directory, const Frame& frame, const Plan& plan) {
    const format::WindowRecord& w = directory.tables.windows[plan.moment.window];
    float most = 0;
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        if (chunk.layer > 0 && most > 0) break;  // all layers fill the same space: the coarsest present will do
        for (uint32_t v = 0; v < plan.view_count; ++v) {
            if (!inside(plan.views[v], chunk.lower, chunk.upper, reach_in_spacings * chunk.spacing)) continue;
            // Nearer than a cell the eye is in the surface: no cell is small enough.
            const float distance = std::max(distance_to(plan.eyes[v], chunk), directory.header.cell_size);
            most = std::max(most, frame.views[v].pixels_per_radian / distance);
        }
    }
    return most;
}

uint32_t layers_for(const Directory& directory, float cell_size) {
    for (uint32_t l = 0; l + 1 < directory.header.layer_count; ++l)
        if (directory.layer_spacing[l] <= most_cells_per_spacing * cell_size) return l + 1;
    return directory.header.layer_count;
}

/// One cell size and one prefix of layers for the whole frame. The level holds on until the view has
/// moved a quarter of a level past the border, lest it flicker.
Detail choose_detail(const Directory& directory, const Frame& frame, uint32_t coarser, Plan& plan) {
    const float source = directory.header.cell_size;
    // In asset space: angles are the same there as in the world.
    const float per_metre = pixels_per_metre(directory, frame, plan);
    Detail detail{};
    if (frame.budget.cell_size > 0) {
        detail.cell_size = frame.budget.cell_size;
    } else {
        int32_t level = 0;
        if (per_metre > 0) {
            const float pixels = frame.budget.pixel_error > 0 ? frame.budget.pixel_error : automatic_pixel_error;
            const float exact = std::log2(std::max(pixels / (per_metre * source), 1e-9f));
            level = int32_t(std::floor(exact));
            if (exact > float(plan.level) - hysteresis && exact < float(plan.level) + 1 + hysteresis)
                level = plan.level;
            level = std::clamp(level, 0, most_levels);
        }
        plan.level = level;
        detail.cell_size = source * float(1u << (uint32_t(level) + coarser));
    }
    // A cell so small that the clip cannot be counted in cells is a mistake that costs nothing to survive.
    float across = 0;
    for (int a = 0; a < 3; ++a)
        across = std::max(across, directory.header.upper[a] - directory.header.lower[a]);
    detail.cell_size = std::max(detail.cell_size, across / most_cells_across);
    detail.pixel_error = detail.cell_size * per_metre;
    detail.layers = detail.cell_size <= source ? directory.header.layer_count
                                               : layers_for(directory, detail.cell_size);
    if (frame.budget.layers) detail.layers = std::min(detail.layers, frame.budget.layers);
    return detail;
}

/// Chunks stand coarse before fine already. Every chunk comes once: the list has room for all.
void want_window(const Directory& directory, uint32_t window, Plan& plan) {
    const format::WindowRecord& w = directory.tables.windows[window];
    const float seconds = seconds_until(directory, plan, window);
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        if (chunk.layer >= plan.detail.layers) break;
        if (is_seen(plan, chunk)) plan.wants[plan.want_count++] = {w.first_chunk + k, seconds};
    }
}

void list_wants(const Directory& directory, Plan& plan) {
    const uint32_t now = plan.moment.window, end = directory.header.window_count;
    const bool back = plan.rate < 0;
    plan.want_count = 0;
    want_window(directory, now, plan);
    plan.now_count = plan.want_count;
    for (uint32_t step = 1; step < end; ++step) {
        const bool any = back ? step <= now : step < end - now;
        if (!any) break;
        const uint32_t window = back ? now - step : now + step;
        if (step > 1 && seconds_until(directory, plan, window) > prefetch_seconds) break;
        want_window(directory, window, plan);
    }
    // Standing still the next move may go either way; going back it often ends in play forward again.
    if (plan.rate == 0 && now > 0) want_window(directory, now - 1, plan);
    if (back && now + 1 < end) want_window(directory, now + 1, plan);
}

uint32_t count_blocks_in_view(const Directory& directory, const Plan& plan) {
    const format::WindowRecord& w = directory.tables.windows[plan.moment.window];
    uint64_t seen[format::max_blocks / 64] = {};
    uint32_t count = 0;
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        uint64_t& word = seen[chunk.block / 64];
        const uint64_t bit = uint64_t(1) << (chunk.block % 64);
        if ((word & bit) || !is_seen(plan, chunk)) continue;
        word |= bit;
        ++count;
    }
    return count;
}

}  // namespace

/// The last frame at or before the time decides, so a time on a window's border is the later window's.
Moment moment_at(const Directory& directory, double seconds) noexcept {
    const uint32_t last = directory.header.frame_count - 1;
    Moment moment{};
    moment.seconds = std::clamp(seconds, 0.0, frame_time(directory, last));
    uint32_t low = 0, high = last;  // frame_time(low) ≤ seconds
    while (low < high) {
        const uint32_t middle = low + (high - low + 1) / 2;
        if (frame_time(directory, middle) <= moment.seconds) low = middle;
        else high = middle - 1;
    }
    uint32_t w = 0, end = directory.header.window_count;  // windows[w] begins at or before `low`
    while (end - w > 1) {
        const uint32_t middle = w + (end - w) / 2;
        if (directory.tables.windows[middle].first_sample <= low) w = middle;
        else end = middle;
    }
    const format::WindowRecord& window = directory.tables.windows[w];
    const uint32_t before = low < last ? low : last ? last - 1 : 0;
    const double step = last ? frame_time(directory, before + 1) - frame_time(directory, before)
                             : 1 / directory.header.frames_per_second;
    moment.window = w;
    moment.sample = low - window.first_sample + (moment.seconds - frame_time(directory, low)) / step;
    moment.sample = std::min(moment.sample, double(window.sample_count - 1));
    moment.samples_per_second = 1 / step;
    return moment;
}

float seconds_until(const Directory& directory, const Plan& plan, uint32_t window) noexcept {
    constexpr double behind = 1e6;  // after everything ahead
    if (window == plan.moment.window) return 0;
    const format::WindowRecord& w = directory.tables.windows[window];
    const bool later = window > plan.moment.window;
    const double border = frame_time(directory, later ? w.first_sample : w.first_sample + w.sample_count - 1);
    const double distance = std::abs(border - plan.moment.seconds);
    if (plan.rate == 0) return float(distance);
    const double real = distance / std::max(1e-6f, std::abs(plan.rate));
    return float(later == (plan.rate > 0) ? real : behind + real);
}

void plan_frame(const Directory& directory, const Frame& frame, uint32_t coarser, Plan& plan) noexcept {
    plan.moment = moment_at(directory, frame.seconds);
    plan.rate = frame.rate;
    take_views(frame, plan);
    plan.detail = choose_detail(directory, frame, coarser, plan);
    plan.blocks_in_view = count_blocks_in_view(directory, plan);
    list_wants(directory, plan);
}

}  // namespace rill
