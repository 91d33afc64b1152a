// SPDX-License-Identifier: MIT
// Progressive order: every prefix of layers is an even covering of the surface, in every frame of the window.
//
// Sample elimination over lives (after Yuksel 2015): layer l takes a track when somewhere in its life nothing taken
// before lies within so many local spacings that about 2^(l − last) of all are taken, long lives first. Spacing is relative, so every layer keeps the
// adaptivity of the whole set.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "pipeline.h"

namespace rill::cooker {
namespace {

constexpr int frame_stride = 4;     // of the frames that are looked at; the ends always are
constexpr size_t most_neighbours = 48;
constexpr float same_side = 0.3f;

/// One track at one looked-at frame: its neighbours by distance, relative to its spacing.
struct Standing {
    std::vector<std::pair<uint32_t, float>> neighbours;
};

std::vector<std::vector<Standing>> standings(const Window& window) {
    std::vector<std::vector<Standing>> result(window.paths.size());
    for (int s = 0;; s = std::min(s + frame_stride, window.samples() - 1)) {
        std::vector<glm::vec3> positions, normals;
        std::vector<uint32_t> ids;
        for (uint32_t i = 0; i < window.paths.size(); ++i) {
            const Path& path = window.paths[i];
            // A short life between looked-at frames is looked at once, at its birth.
            const bool brief = path.birth / frame_stride == path.death / frame_stride && path.birth % frame_stride != 0;
            if (!path.alive(s) && !(brief && s == path.birth / frame_stride * frame_stride)) continue;
            const SurfacePoint& p = path.at[size_t(std::clamp(s, path.birth, path.death) - path.birth)];
            positions.push_back(p.position), normals.push_back(p.normal), ids.push_back(i);
        }
        const VertexTree tree(positions);
        std::vector<VertexTree::Found> found;
        for (size_t k = 0; k < ids.size(); ++k) {
            tree.nearest(positions[k], most_neighbours, found);
            Standing standing;
            float spacing = 0;
            for (const auto& f : found) {
                if (f.vertex == k || glm::dot(normals[f.vertex], normals[k]) < same_side) continue;
                standing.neighbours.emplace_back(ids[f.vertex], std::sqrt(f.distance2));
                if (standing.neighbours.size() == 4) spacing = std::sqrt(f.distance2);
            }
            if (spacing <= 0 && !standing.neighbours.empty()) spacing = standing.neighbours.back().second;
            for (auto& [id, distance] : standing.neighbours) distance /= std::max(spacing, 1e-9f);
            result[ids[k]].push_back(std::move(standing));
        }
        if (s == window.samples() - 1) break;
    }
    return result;
}

/// Takes every track that stands anywhere with nothing taken within `room` spacings; returns how many are taken.
size_t cover(const std::vector<std::vector<Standing>>& standing, const std::vector<uint32_t>& order, float room,
             std::vector<bool>& taken) {
    for (uint32_t i : order) {
        if (taken[i]) continue;
        taken[i] = std::any_of(standing[i].begin(), standing[i].end(), [&](const Standing& at) {
            return std::none_of(at.neighbours.begin(), at.neighbours.end(), [&](const auto& neighbour) {
                return taken[neighbour.first] && neighbour.second < room;
            });
        });
    }
    return size_t(std::count(taken.begin(), taken.end(), true));
}

}  // namespace

std::vector<uint32_t> assign_layers(const Window& window, uint32_t layers) {
    const auto standing = standings(window);
    std::vector<uint32_t> layer(window.paths.size(), layers - 1), order(window.paths.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto life = [&](uint32_t i) { return window.paths[i].death - window.paths[i].birth; };
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return life(a) > life(b); });
    std::vector<bool> taken(window.paths.size(), false);
    for (uint32_t l = 0; l + 1 < layers; ++l) {
        // The room that takes about half as many as the layer after will have in all.
        const size_t wanted = window.paths.size() >> (layers - 1 - l);
        float narrow = 0.25f, wide = 8;
        std::vector<bool> best = taken;
        for (int step = 0; step < 7; ++step) {
            const float room = std::sqrt(narrow * wide);
            std::vector<bool> trial = taken;
            const size_t count = cover(standing, order, room, trial);
            (count < wanted ? wide : narrow) = room;
            best = std::move(trial);
        }
        for (uint32_t i = 0; i < taken.size(); ++i)
            if (best[i] && !taken[i]) layer[i] = l;
        taken = std::move(best);
    }
    return layer;
}

std::vector<uint32_t> assign_blocks(const Window& window, uint32_t most_tracks, uint32_t& block_count) {
    std::vector<glm::vec3> mean(window.paths.size(), glm::vec3(0));
    for (size_t i = 0; i < mean.size(); ++i) {
        for (const SurfacePoint& p : window.paths[i].at) mean[i] += p.position;
        mean[i] /= float(window.paths[i].at.size());
    }
    std::vector<uint32_t> block(mean.size(), 0), ids(mean.size());
    std::iota(ids.begin(), ids.end(), 0u);
    block_count = 0;
    const auto split = [&](const auto& self, size_t first, size_t last) -> void {
        if (last - first <= most_tracks || block_count + 2 > format::max_blocks) {
            for (size_t i = first; i < last; ++i) block[ids[i]] = block_count;
            ++block_count;
            return;
        }
        glm::vec3 lower = mean[ids[first]], upper = lower;
        for (size_t i = first; i < last; ++i) lower = glm::min(lower, mean[ids[i]]), upper = glm::max(upper, mean[ids[i]]);
        const glm::vec3 size = upper - lower;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const size_t middle = (first + last) / 2;
        std::nth_element(ids.begin() + long(first), ids.begin() + long(middle), ids.begin() + long(last), [&](uint32_t a, uint32_t b) {
            return mean[a][axis] != mean[b][axis] ? mean[a][axis] < mean[b][axis] : a < b;
        });
        self(self, first, middle);
        self(self, middle, last);
    };
    if (!ids.empty()) split(split, 0, ids.size());
    return block;
}

}  // namespace rill::cooker
