// SPDX-License-Identifier: MIT
// Heights chosen anew where few points make a frame. How each is rounded is chance, and where no thousand others make up for it the
// frame's volume is off by as much: a ball of 39 points, pour_sphere 1, by .8 %. So mean heights go up or down by a step of the lattice,
// of those tracks first that the surface is the better for or hardly the worse, until the volume of every such frame is the source's.
#include <algorithm>
#include <cmath>

#include "frames_to_tracks.h"
#include "parallel.h"
#include "surface_response.h"
#include "track_basis.h"
#include "walls.h"

namespace rill::cooker {
namespace {

constexpr size_t few_points = 1000;    // of a frame; those of more are within .2 % by themselves
constexpr double within = 2.5e-3;      // of its volume
constexpr int rounds = 3;              // of measuring what is missing: what a step does is known to first order
constexpr double enough = 0.7;         // of the most that a step would mend now: others are chosen by what they do to the distances
constexpr double least_harm = 0.05;    // of a step's own square: any that does less is as good
constexpr float credible = 3;          // tolerances, as in refit_tracks.cpp

struct FewPoints {
    int sample;
    std::vector<SurfacePoint> points;
    std::vector<uint32_t> ids;         ///< their tracks
    double volume = 0, missing = 0;    ///< of the source, m³; of that, what the decoded surface lacks
    std::vector<double> grown, pull, square;  ///< by point, per metre up: of `missing`; half the slope and half the curvature of squared error
};
double beyond(double missing) { return std::max(std::fabs(missing) - within, 0.0); }
bool is_off(const FewPoints& few) { return beyond(few.missing) > 0; }

/// What a step up of one track's mean height does.
struct Step {
    std::vector<std::pair<uint32_t, double>> grown;  ///< frame, and how much less is missing there
    double pull = 0, square = 0;
    bool taken = false;
    double harm(int way) const { return std::max(square + 2 * way * pull, least_harm * square); }
};

std::vector<FewPoints> find_few_points(const Window& window, const CodedWindow& coded, const WindowGoal& goal) {
    std::vector<FewPoints> frames(window.frames.size());
    parallel_for(frames.size(), goal.jobs, [&](size_t s) {
        FewPoints& few = frames[s];
        few.sample = int(s), few.points = decoded_points(coded.decoded, few.sample, &few.ids);
        if (few.points.size() > few_points) return;
        const SurfaceFrame& frame = *window.frames[s];
        few.volume = volume_inside(frame.mesh, goal.container);
        const Mesh decoded = mesh_points(few.points, frame.edge, 1, frame.mesh.positions.size());
        if (few.volume > 0) few.missing = 1 - volume_inside(decoded, goal.container) / few.volume;
    });
    std::erase_if(frames, [](const FewPoints& few) { return few.points.empty() || !(few.volume > 0); });
    return frames;
}

/// What its points do to the frame.
void find_responses(const SurfaceFrame& frame, const WindowGoal& goal, FewPoints& few) {
    const SurfaceResponse surface(frame, few.points, credible * goal.tolerance);
    std::vector<Response> does;
    std::vector<uint32_t> slots;
    few.grown.assign(few.points.size(), 0), few.pull = few.square = few.grown;
    for (uint32_t i = 0; i < few.points.size(); ++i) {
        surface.of(i, does, slots);
        for (const Response& r : does) {
            const double up = double(surface.area[r.vertex]) * r.by.x;  // of the residual: a point that goes up takes from it
            few.pull[i] += up * surface.residual[r.vertex], few.square[i] += up * r.by.x;
            if (is_inside(frame.mesh.positions[r.vertex], goal.container)) few.grown[i] -= up / few.volume;
        }
    }
}

std::vector<Step> steps_of(const CodedWindow& coded, const WindowGoal& goal, const std::vector<FewPoints>& frames) {
    const format::LatticeSteps lattice = lattice_steps(coded.quantiser, goal.origin);
    std::vector<Step> steps(coded.tracks.size());
    for (uint32_t f = 0; f < frames.size(); ++f)
        for (size_t k = 0; k < frames[f].ids.size(); ++k) {
            const uint32_t id = frames[f].ids[k];
            const TrackSamples& track = coded.decoded[id];
            const uint32_t life = uint32_t(track.position.size());
            const glm::dvec3 axis = axes_of(coded.tracks[id].axis, format::axis_levels(lattice, life)).n;
            const double up = mean_step(lattice, life) * glm::dot(axis, glm::dvec3(track.normal[size_t(frames[f].sample - track.birth)]));
            steps[id].grown.emplace_back(f, up * frames[f].grown[k]);
            steps[id].pull += up * frames[f].pull[k], steps[id].square += up * up * frames[f].square[k];
        }
    return steps;
}

/// What a step takes away from Σ beyond².
double gain(const std::vector<FewPoints>& frames, const Step& step, int way) {
    double sum = 0;
    for (const auto& [f, grown] : step.grown) {
        const double now = beyond(frames[f].missing), then = beyond(frames[f].missing - way * grown);
        sum += now * now - then * then;
    }
    return sum;
}

/// The best step that is left, and its way: the one that harms least of those that mend much.
std::pair<size_t, int> best_step(const std::vector<FewPoints>& frames, const std::vector<Step>& steps) {
    double most = 0;
    for (const Step& step : steps)
        for (const int way : {-1, 1})
            if (!step.taken) most = std::max(most, gain(frames, step, way));
    std::pair<size_t, int> best{0, 0};
    double least = INFINITY;
    for (size_t i = 0; i < steps.size() && most > 0; ++i)
        for (const int way : {-1, 1}) {
            if (steps[i].taken) continue;
            const double mended = gain(frames, steps[i], way), harm = steps[i].harm(way) / mended;
            if (mended >= enough * most && harm < least) least = harm, best = {i, way};
        }
    return best;
}

}  // namespace

void refit_volume(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables) {
    for (int round = 0; round < rounds; ++round) {
        std::vector<FewPoints> frames = find_few_points(window, coded, goal);
        if (std::none_of(frames.begin(), frames.end(), is_off)) return;
        parallel_for(frames.size(), goal.jobs, [&](size_t f) { find_responses(*window.frames[size_t(frames[f].sample)], goal, frames[f]); });
        std::vector<Step> steps = steps_of(coded, goal, frames);
        while (std::any_of(frames.begin(), frames.end(), is_off)) {
            const auto [id, way] = best_step(frames, steps);
            if (way == 0) break;
            steps[id].taken = true;
            for (const auto& [f, grown] : steps[id].grown) frames[f].missing -= way * grown;
            coded.tracks[id].position[2] += way;
            coded.decoded[id] = dequantise_track(coded.tracks[id], coded.quantiser, goal.origin, tables);
        }
    }
}

}  // namespace rill::cooker
