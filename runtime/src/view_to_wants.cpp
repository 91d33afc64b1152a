// SPDX-License-Identifier: MIT
// Time, views and budget → moment, cell size, layers, and the ranked list of wanted chunks.
#include <algorithm>
#include <cmath>

#include "pipeline.h"

namespace rill {
namespace {

constexpr float automatic_pixel_error = 2;  ///< Budget::pixel_error 0
constexpr float most_cells_across = 1 << 20;
/// Wants stay as they are while an eye moves by no more than this share of its distance, and the sizes asked for change by
/// no more than this many octaves: a camera that trembles asks for nothing new. (What is drawn follows it exactly, without
/// jumps: cells_to_parents.cpp.)
constexpr float most_drift = 1 / 8.f;
/// By so much cells may then be drawn smaller than those that wants are for: both drifts together. A layer is wanted until it has
/// faded from what is drawn, too.
constexpr float most_lag = 1.25f;

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

bool is_seen(const Plan& plan, const format::ChunkRecord& chunk) {
    if (!plan.view_count) return true;
    for (uint32_t v = 0; v < plan.view_count; ++v)
        if (touches(plan.views[v], chunk.lower, chunk.upper, reach_in_spacings * chunk.spacing)) return true;
    return false;
}

/// Distance of each eye from what it sees, infinite where it sees nothing.
struct Sight {
    float nearest[most_views];
};
Sight look(const Directory& directory, const Plan& plan) {
    const format::WindowRecord& w = directory.tables.windows[plan.moment.window];
    Sight sight;
    std::fill(sight.nearest, sight.nearest + most_views, 1e15f);
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        for (uint32_t v = 0; v < plan.view_count; ++v) {
            if (!touches(plan.views[v], chunk.lower, chunk.upper, reach_in_spacings * chunk.spacing)) continue;
            // Nearer than a cell the eye is in the surface: no cell is small enough.
            const float distance = std::max(distance_to_box(plan.eyes[v], chunk.lower, chunk.upper), directory.header.cell_size);
            sight.nearest[v] = std::min(sight.nearest[v], distance);
        }
    }
    return sight;
}

Levels levels_asked(const Directory& directory, const Frame& frame, const Plan& plan) {
    Levels levels{};
    levels.cell_size = frame.budget.cell_size > 0 ? frame.budget.cell_size : directory.header.cell_size;
    // A cell so small that the clip cannot be counted in cells is a mistake that costs nothing to survive.
    float across = 0;
    for (int a = 0; a < 3; ++a)
        across = std::max(across, directory.header.upper[a] - directory.header.lower[a]);
    levels.cell_size = std::max(levels.cell_size, across / most_cells_across);
    if (frame.budget.cell_size > 0) return levels;
    const float pixels = frame.budget.pixel_error > 0 ? frame.budget.pixel_error : automatic_pixel_error;
    levels.eye_count = plan.view_count;
    for (uint32_t v = 0; v < plan.view_count; ++v) {
        std::copy(plan.eyes[v], plan.eyes[v] + 3, levels.eyes[v]);
        levels.reach[v] = std::clamp(frame.views[v].pixels_per_radian / pixels, least_reach, 1e9f);
    }
    return levels;
}

/// So near to each other that one may stand for the other.
bool alike(const Levels& a, const Levels& b, const Sight& sight) {
    if (a.cell_size != b.cell_size || a.eye_count != b.eye_count) return false;
    for (uint32_t e = 0; e < a.eye_count; ++e) {
        if (std::abs(std::log2(a.reach[e] / b.reach[e])) > most_drift) return false;
        float moved = 0;
        for (int k = 0; k < 3; ++k) moved += (a.eyes[e][k] - b.eyes[e][k]) * (a.eyes[e][k] - b.eyes[e][k]);
        // All cells nearer than the reach are of one size anyway.
        if (std::sqrt(moved) > most_drift * std::max(sight.nearest[e], b.reach[e] * b.cell_size)) return false;
    }
    return true;
}

uint32_t layers_for(const Directory& directory, const Frame& frame, float cell_size) {
    const uint32_t count = directory.header.layer_count;
    uint32_t layers = 1;
    while (layers < count && cell_size < layer_limit(directory, layers)) ++layers;
    return frame.budget.layers ? std::min(layers, frame.budget.layers) : layers;
}

void choose_detail(const Directory& directory, const Frame& frame, Plan& plan) {
    const Sight sight = look(directory, plan);
    plan.levels = plan.levels_drawn = levels_asked(directory, frame, plan);
    if (!alike(plan.levels_held, plan.levels, sight)) plan.levels_held = plan.levels;
    plan.detail = {};
    for (uint32_t v = 0; v < plan.view_count; ++v)
        if (sight.nearest[v] < 1e15f)
            plan.detail.pixels_per_metre =
                std::max(plan.detail.pixels_per_metre, frame.views[v].pixels_per_radian / sight.nearest[v]);
}

/// What is wanted of a window's blocks: the nearer, the more layers. A prefix, for all of a block.
struct BlockLayers {
    uint8_t count[format::max_blocks];
};
BlockLayers layers_of_blocks(const Directory& directory, const Frame& frame, uint32_t window, const Plan& plan) {
    const format::WindowRecord& w = directory.tables.windows[window];
    BlockLayers layers{};
    const float lag = plan.levels_held.eye_count ? most_lag : 1;
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        if (!is_seen(plan, chunk)) continue;
        const uint32_t wanted = layers_for(directory, frame, plan.levels_held.cell_at(chunk.lower, chunk.upper) / lag);
        layers.count[chunk.block] = uint8_t(std::max<uint32_t>(layers.count[chunk.block], wanted));
    }
    return layers;
}

/// Chunks stand coarse before fine already. Every chunk comes once: the list has room for all.
void want_window(const Directory& directory, const Frame& frame, uint32_t window, Plan& plan) {
    const format::WindowRecord& w = directory.tables.windows[window];
    const float seconds = seconds_until(directory, plan, window);
    const BlockLayers layers = layers_of_blocks(directory, frame, window, plan);
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        if (chunk.layer >= layers.count[chunk.block] || !is_seen(plan, chunk)) continue;
        plan.wants[plan.want_count++] = {w.first_chunk + k, seconds};
        if (window == plan.moment.window)
            plan.detail.layers = std::max<uint32_t>(plan.detail.layers, layers.count[chunk.block]);
    }
}

void list_wants(const Directory& directory, const Frame& frame, Plan& plan) {
    const uint32_t now = plan.moment.window, end = directory.header.window_count;
    const bool back = plan.rate < 0;
    plan.want_count = 0;
    want_window(directory, frame, now, plan);
    plan.now_count = plan.want_count;
    for (uint32_t step = 1; step < end; ++step) {
        const uint32_t window = (back ? now + end - step : now + step) % end;
        if (!plan.loops && back != (window < now)) break;
        if (step > 1 && seconds_until(directory, plan, window) > prefetch_seconds) break;
        want_window(directory, frame, window, plan);
    }
    if (plan.loops) return;
    // Standing still the next move may go either way; going back it often ends in play forward again.
    if (plan.rate == 0 && now > 0) want_window(directory, frame, now - 1, plan);
    if (back && now + 1 < end) want_window(directory, frame, now + 1, plan);
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

bool touches(const FrustumPlanes& view, const float* lower, const float* upper, float wider) noexcept {
    for (const float* plane : view.planes) {
        float farthest = plane[3] + wider;
        for (int a = 0; a < 3; ++a) farthest += plane[a] * (plane[a] > 0 ? upper[a] : lower[a]);
        if (farthest < 0) return false;
    }
    return true;
}

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
    // The step that begins there, or the clip's last; a single frame has none.
    const uint32_t begin = low < last ? low : last ? last - 1 : 0;
    const auto length = [&](uint32_t frame) { return frame_time(directory, frame + 1) - frame_time(directory, frame); };
    const double step = last ? length(begin) : 1 / directory.header.frames_per_second;
    if (begin == low && begin > 0) moment.steps.before = length(begin - 1) / step;
    if (begin + 2 <= last) moment.steps.after = length(begin + 1) / step;
    moment.window = w;
    moment.sample = low - window.first_sample + (moment.seconds - frame_time(directory, low)) / step;
    moment.sample = std::min(moment.sample, double(window.sample_count - 1));
    moment.samples_per_second = 1 / step;
    return moment;
}

float smallest_cell(const Directory& directory, const Plan& plan, const Levels& levels) noexcept {
    const format::WindowRecord& w = directory.tables.windows[plan.moment.window];
    float smallest = levels.cell(levels.coarsest()), cell = levels.cell_size;
    for (uint32_t k = 0; k < w.chunk_count; ++k) {
        const format::ChunkRecord& chunk = directory.tables.chunks[w.first_chunk + k];
        if (is_seen(plan, chunk)) smallest = std::min(smallest, levels.cell_at(chunk.lower, chunk.upper));
    }
    while (2 * cell <= smallest) cell *= 2;  // the largest power of two that fits: what Levels::divided() comes to
    return cell;
}

float seconds_until(const Directory& directory, const Plan& plan, uint32_t window) noexcept {
    constexpr double behind = 1e6;  // after everything ahead
    if (window == plan.moment.window) return 0;
    const format::WindowRecord& w = directory.tables.windows[window];
    const bool later = window > plan.moment.window;
    const double border = frame_time(directory, later ? w.first_sample : w.first_sample + w.sample_count - 1);
    double distance = std::abs(border - plan.moment.seconds);
    if (plan.rate == 0) return float(distance);
    if (plan.loops && later != (plan.rate > 0)) {
        const double clip = frame_time(directory, directory.header.frame_count - 1);
        const double far = frame_time(directory, later ? w.first_sample + w.sample_count - 1 : w.first_sample);
        return float((clip - std::abs(far - plan.moment.seconds)) / std::max(1e-6f, std::abs(plan.rate)));
    }
    const double real = distance / std::max(1e-6f, std::abs(plan.rate));
    return float(later == (plan.rate > 0) ? real : behind + real);
}

void plan_frame(const Directory& directory, const Frame& frame, Plan& plan) noexcept {
    plan.moment = moment_at(directory, frame.seconds);
    plan.rate = frame.rate;
    plan.loops = frame.loops;
    take_views(frame, plan);
    choose_detail(directory, frame, plan);
    plan.blocks_in_view = count_blocks_in_view(directory, plan);
    list_wants(directory, frame, plan);
}

}  // namespace rill
