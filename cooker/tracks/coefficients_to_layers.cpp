// SPDX-License-Identifier: MIT
// Progressive order: every prefix of layers is a surface of its own in every frame of the window, the best we know
// of its size. The decoder is in the loop: what has been taken so far is decoded, what it leaves wrong at the
// tracks still to come says which of them are worth their bytes, over their whole lives. Layer 0 is a share of the
// cost; the others take tracks until what they leave wrong is too little for their cells to show.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/parallel.h"
#include "format/layout.h"
#include "tracks/frames_to_tracks.h"

namespace rill::cooker {
namespace {

constexpr int frame_stride = 3;        // of the frames that are looked at; the ends always are
constexpr float same_side = 0.3f;
constexpr int measured_stride = 8;     // of the frames on which errors are measured
constexpr float growth = 1.5f;         // of what is taken, from one round to the next, at most
constexpr float least_step = 0.03f, most_step = 0.25f;  // likewise where an error is aimed at, which falls with its square
constexpr float room = 0.6f;           // of the distance to what was taken before: no two of a round are nearer
constexpr size_t least_taken = 24;     // tracks in layer 0, where there are so many
constexpr float least_share = 0.11f;   // of the cost: layer 0
constexpr float most_share = 0.75f;    // all layers but the last
constexpr float least_refined = 1.15f;  // times the cost of the layers before
constexpr uint32_t drops_layer = 1;    // mostly smaller than cells of layer 0; where many are not, its error says so

/// All tracks alive at one looked-at frame.
struct Look {
    std::vector<uint32_t> ids;          ///< of the tracks, ascending
    std::vector<SurfacePoint> points;
    std::vector<float> need;            ///< of those not taken yet: what taking it would mend, m³; of the rest 0
    std::vector<float> distance;        ///< to the nearest taken point on its side, metres
    float scale;                        ///< across all of it, metres
};

std::vector<Look> looks_of(const std::vector<TrackSamples>& tracks, int samples) {
    std::vector<Look> looks;
    for (int s = 0;; s = std::min(s + frame_stride, samples - 1)) {
        Look look;
        glm::vec3 lower(1e30f), upper(-1e30f);
        for (uint32_t i = 0; i < tracks.size(); ++i) {
            const TrackSamples& track = tracks[i];
            if (track.drop || s < track.birth || s > track.death) continue;
            const size_t k = size_t(s - track.birth);
            look.ids.push_back(i), look.points.push_back({track.position[k], track.normal[k], {}});
            lower = glm::min(lower, track.position[k]), upper = glm::max(upper, track.position[k]);
        }
        look.scale = look.ids.empty() ? 0 : 0.5f * glm::distance(lower, upper);
        looks.push_back(std::move(look));
        if (s >= samples - 1) return looks;
    }
}

/// What the taken tracks leave wrong at the others: volume, of about the error over the room a point would fill.
void look_again(Look& look, const std::vector<bool>& taken) {
    std::vector<SurfacePoint> points, others;
    std::vector<glm::vec3> positions;
    for (size_t k = 0; k < look.ids.size(); ++k)
        if (taken[look.ids[k]]) points.push_back(look.points[k]), positions.push_back(look.points[k].position);
        else others.push_back(look.points[k]);
    const Surplus left = measure_places(points, others);
    const VertexTree tree(positions);
    std::vector<VertexTree::Found> found;
    look.need.assign(look.ids.size(), 0), look.distance.assign(look.ids.size(), look.scale);
    for (size_t k = 0, other = 0; k < look.ids.size(); ++k) {
        if (taken[look.ids[k]]) continue;
        if (!positions.empty()) tree.nearest(look.points[k].position, 8, found);
        for (const auto& f : found)
            if (glm::dot(points[f.vertex].normal, look.points[k].normal) > same_side) {
                look.distance[k] = std::min(look.distance[k], std::sqrt(f.distance2));
                break;
            }
        // A point that faces another way than the surface there is as wrong as one beside it.
        const float d = look.distance[k], error = left.distance[other] + 0.1f * d * std::min(left.angle[other], 1.f);
        look.need[k] = std::min(d, error) * d * d;
        ++other;
    }
}

/// Tracks of one round, until their cost comes to `budget`: the most mended per cost first.
void take_round(const std::vector<Look>& looks, const std::vector<float>& cost, float budget, std::vector<bool>& taken) {
    struct Stand {
        uint32_t look, place;
    };
    std::vector<std::vector<Stand>> stands(cost.size());
    std::vector<float> gain(cost.size(), 0.f);
    for (uint32_t l = 0; l < looks.size(); ++l)
        for (uint32_t k = 0; k < looks[l].ids.size(); ++k) {
            const uint32_t id = looks[l].ids[k];
            if (!(looks[l].need[k] > 0)) continue;
            stands[id].push_back({l, k}), gain[id] += looks[l].need[k] / cost[id];
        }
    std::vector<uint32_t> order;
    for (uint32_t i = 0; i < cost.size(); ++i)
        if (gain[i] > 0) order.push_back(i);
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return gain[a] != gain[b] ? gain[a] > gain[b] : a < b; });
    std::vector<std::vector<glm::vec3>> fresh(looks.size());
    for (uint32_t i : order) {
        // What the others of this round leave of its gain.
        float left = 0;
        for (const Stand& at : stands[i]) {
            const Look& look = looks[at.look];
            const float r = room * look.distance[at.place];
            const glm::vec3& p = look.points[at.place].position;
            const bool near = std::any_of(fresh[at.look].begin(), fresh[at.look].end(), [&](const glm::vec3& q) {
                const glm::vec3 d = p - q;
                return glm::dot(d, d) < r * r;
            });
            if (!near) left += look.need[at.place] / cost[i];
        }
        if (left < 0.5f * gain[i]) continue;
        taken[i] = true;
        for (const Stand& at : stands[i]) fresh[at.look].push_back(looks[at.look].points[at.place].position);
        if ((budget -= cost[i]) <= 0) return;
    }
}

/// How far off the surface is, metres, over how much of it.
struct Off {
    float distance, area;
};

/// Drops that are left out are as far off as they are thick.
void miss_drops(const std::vector<TrackSamples>& tracks, int sample, std::vector<Off>& off) {
    for (const TrackSamples& track : tracks) {
        if (!track.drop || sample < track.birth || sample > track.death) continue;
        const std::array<float, 6>& s = track.shape[size_t(sample - track.birth)];
        const glm::mat3 shape(s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]);
        const float radius = std::cbrt(std::fabs(glm::determinant(shape)));
        off.push_back({radius, 4 * std::numbers::pi_v<float> * radius * radius});
    }
}

LayerError error_of(std::vector<Off>& off) {
    double area = 0, sum = 0, below = 0;
    for (const Off& at : off) area += at.area, sum += double(at.area) * at.distance;
    if (!(area > 0)) return {};
    std::sort(off.begin(), off.end(), [](const Off& one, const Off& other) { return one.distance < other.distance; });
    const auto p99 = std::find_if(off.begin(), off.end() - 1, [&](const Off& at) { return (below += at.area) >= 0.99 * area; });
    return {float(sum / area), p99->distance, 0};
}

/// Error of the taken tracks, with all drops or none, on a few frames of the window.
LayerError measure_taken(const Window& window, const std::vector<TrackSamples>& tracks, const std::vector<bool>& taken, bool with_drops, int jobs) {
    const size_t looks = (window.frames.size() + measured_stride - 1) / measured_stride;
    std::vector<LayerError> at(looks);
    parallel_for(looks, jobs, [&](size_t look) {
        const int sample = int(look * measured_stride);
        const SurfaceFrame& frame = *window.frames[size_t(sample)];
        const auto points = decoded_points(tracks, sample, nullptr, &taken);
        const Residual residual = measure_residual(frame, points);
        std::vector<Off> off;
        double area = 0;
        for (size_t v = 0; v < residual.distance.size(); ++v)
            off.push_back({std::min(std::fabs(residual.distance[v]), 10 * frame.edge), frame.area[v]}), area += frame.area[v];
        if (!with_drops) miss_drops(tracks, sample, off);
        at[look] = error_of(off);
        at[look].spacing = points.empty() ? 0 : float(std::sqrt(area / double(points.size())));
    });
    LayerError error;
    for (const LayerError& look : at) {
        error.mean += look.mean / float(looks), error.p99 += look.p99 / float(looks);
        error.spacing = std::max(error.spacing, look.spacing);
    }
    return error;
}

float cost_of(const std::vector<bool>& taken, const std::vector<float>& cost) {
    float spent = 0;
    for (size_t i = 0; i < taken.size(); ++i)
        if (taken[i]) spent += cost[i];
    return spent;
}

}  // namespace

Layers assign_layers(const Window& window, const std::vector<TrackSamples>& tracks, const std::vector<float>& cost, uint32_t layers,
                     int jobs) {
    Layers result{std::vector<uint32_t>(tracks.size(), layers - 1), std::vector<LayerError>(layers)};
    std::vector<bool> taken(tracks.size(), false);
    std::vector<Look> looks = looks_of(tracks, window.samples());
    const float all = std::accumulate(cost.begin(), cost.end(), 0.f);
    /// False when nothing is wrong any more.
    const auto take_more = [&](float budget) {
        const auto count = std::count(taken.begin(), taken.end(), true);
        parallel_for(looks.size(), jobs, [&](size_t s) { look_again(looks[s], taken); });
        take_round(looks, cost, budget, taken);
        return std::count(taken.begin(), taken.end(), true) > count;
    };
    for (uint32_t l = 0; l + 1 < layers; ++l) {
        const float least = l == 0 ? all * std::min(least_share, std::ldexp(1.f, 1 - int(layers))) : least_refined * cost_of(taken, cost);
        const size_t least_count = l == 0 ? least_taken : 0;
        for (float spent = cost_of(taken, cost); spent < least || size_t(std::count(taken.begin(), taken.end(), true)) < least_count;
             spent = cost_of(taken, cost))
            if (!take_more(spent == 0 ? 0.15f * least : std::min(least - spent, (growth - 1) * spent))) break;
        result.error[l] = measure_taken(window, tracks, taken, l >= drops_layer, jobs);
        // A cell of this layer's: twice as wide as the next one's. A track more may open a gap beside it, for supports shrink: the best is kept.
        const float allowed = format::fine_enough * std::ldexp(window.frames[0]->edge, int(layers - 1 - l));
        std::vector<bool> best = taken;
        LayerError error = result.error[l];
        for (float left; l > 0 && error.p99 > allowed && (left = most_share * all - cost_of(taken, cost)) > 0;) {
            const float spent = most_share * all - left;
            if (!take_more(std::min(std::clamp(std::sqrt(error.p99 / allowed) - 1, least_step, most_step) * spent, left))) break;
            error = measure_taken(window, tracks, taken, l >= drops_layer, jobs);
            if (error.p99 < result.error[l].p99) result.error[l] = error, best = taken;
        }
        taken = best;
        for (size_t i = 0; i < taken.size(); ++i)
            if (taken[i] && result.layer[i] == layers - 1) result.layer[i] = l;
    }
    result.error[layers - 1] = measure_taken(window, tracks, std::vector<bool>(tracks.size(), true), true, jobs);
    for (size_t i = 0; i < tracks.size(); ++i)
        if (tracks[i].drop) result.layer[i] = std::min(drops_layer, layers - 1);
    return result;
}

std::vector<uint32_t> assign_blocks(const std::vector<TrackSamples>& tracks, uint32_t most_tracks, uint32_t& block_count) {
    std::vector<glm::vec3> mean(tracks.size(), glm::vec3(0));
    for (size_t i = 0; i < mean.size(); ++i)
        for (const glm::vec3& p : tracks[i].position) mean[i] += p / float(tracks[i].position.size());
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
