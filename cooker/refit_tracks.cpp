// SPDX-License-Identifier: MIT
// Coefficients chosen anew, against the surface that all tracks decode to together: one track after the other gets the
// integers that are worth their bits in squared distance at the source's vertices, given what the others decode to now.
// What rounding leaves of one its neighbours make up for, and noise that they blend away is not coded at all.
//
// Bytes at equal p99 of this and what was tried in its place: README.md, "How coefficients are chosen".
#include <algorithm>
#include <cmath>

#include "frames_to_tracks.h"
#include "parallel.h"
#include "surface_response.h"
#include "track_basis.h"

namespace rill::cooker {
namespace {

using dvec3 = glm::dvec3;
using dmat3 = glm::dmat3;

constexpr float credible = 3;                // tolerances from the source
constexpr double bits_per_square = 2.5;      // what a squared error of one step, in one sample of a track, is worth
constexpr double normals_count = 0.13;       // a normal that is one step off, against a distance of one step
constexpr double rest = 0.05;                // of the mean pull of the surface: keeps a point where few vertices hold it
constexpr int sweeps = 2;                    // over a track's coefficients
// Tracks of different blocks have their turns at once: they rarely touch the same vertices, and where they do, each misses what
// the other does. How many is not for the number of threads to say, or the outcome would be, too.
constexpr size_t together = 32;
constexpr uint32_t fewest_apart = 64;        // tracks of a block
constexpr int32_t most_shift = 3;            // of a mean height, steps: first-order figures hold near where they are from

/// How a sample of a track is held: half the gradient and half the Hessian of the error, by its offset along the normal
/// and its tilts.
struct Hold {
    dvec3 force{0.0};
    dmat3 stiffness{0.0};
};

/// The integers of one track on their way.
class TrackRefit {
public:
    TrackRefit(const QuantisedTrack& track, const TrackSamples& decoded, const Quantiser& quantiser, const glm::vec3& origin,
               const format::BasisTables& tables)
        : track_(track), life_(uint32_t(decoded.position.size())), basis_(tables, life_, track.flags & format::track_cosine),
          steps_(lattice_steps(quantiser, origin)) {
        for (size_t i = 0; i < track.position.size(); ++i) motion_[i / 3][i % 3] = track.position[i];
        for (size_t i = 3; i < track.second.size(); ++i) normals_[i / 3][i % 3] = track.second[i];
        find_units(decoded);
    }
    /// Fewest bits and least error, coefficient by coefficient; nothing where nothing changes.
    std::optional<QuantisedTrack> descend(std::vector<Hold> holds, double worth);

private:
    enum Channel { turn_1, turn_2, height };
    int32_t& value(int channel, uint32_t k) { return channel == height ? motion_[k][2] : normals_[k][size_t(channel)]; }
    /// How far one step of a coefficient goes at a sample.
    double step_at(int channel, uint32_t k, uint32_t s) const {
        if (k == 0) return steps_.step;
        return basis_.row[s][k] * (channel == height ? motion_step(steps_, life_) : turn_step(steps_, life_));
    }
    void find_units(const TrackSamples& decoded);
    bool improve(int channel, uint32_t k, std::vector<Hold>& holds, double worth);

    QuantisedTrack track_;
    uint32_t life_;
    Basis basis_;
    format::LatticeSteps steps_;
    Rows<3> motion_{}, normals_{};
    std::array<std::vector<dvec3>, 3> unit_;  ///< by channel and sample: what one unit does to offset and tilts
};

void TrackRefit::find_units(const TrackSamples& decoded) {
    const FrameAxes axes = axes_of(track_.axis, format::axis_levels(steps_));
    const dvec3 directions[3] = {axes.t1, axes.t2, axes.n};
    for (uint32_t s = 0; s < life_; ++s) {
        const TangentFrame tangents = tangent_frame(decoded.normal[s]);
        dvec3 normal = axes.n;
        for (uint32_t k = 1; k < basis_.terms; ++k)
            for (size_t c = 0; c < 3; ++c) normal += directions[c] * (normals_[k][c] * step_at(turn_1, k, s));
        const double length = std::max(glm::length(normal), 0.2);
        for (int c : {turn_1, turn_2})
            unit_[size_t(c)].push_back(dvec3(0, glm::dot(directions[c], dvec3(tangents.t1)), glm::dot(directions[c], dvec3(tangents.t2))) / length);
        unit_[height].push_back(dvec3(glm::dot(axes.n, dvec3(decoded.normal[s])), 0, 0));
    }
}

bool TrackRefit::improve(int channel, uint32_t k, std::vector<Hold>& holds, double worth) {
    double linear = 0, square = 0;
    for (uint32_t s = 0; s < life_; ++s) {
        const dvec3 by = unit_[size_t(channel)][s] * step_at(channel, k, s);
        linear += glm::dot(by, holds[s].force), square += glm::dot(by, holds[s].stiffness * by);
    }
    int32_t& now = value(channel, k);
    if (!(square > 0)) return false;
    const double best = now - linear / square, most = k == 0 ? std::abs(double(now)) + most_shift : 1e5;
    if (!(std::abs(best) < most)) return false;
    const auto cost = [&](int32_t v) {
        const double d = v - now;
        return worth * (2 * linear + square * d) * d + (k == 0 ? 0 : cost_of(v));
    };
    int32_t chosen = now;
    for (const int32_t v : {int32_t(std::floor(best)), int32_t(std::ceil(best)), 0})
        if (cost(v) < cost(chosen)) chosen = v;
    if (chosen == now || (k == 0 && std::abs(chosen - now) > most_shift)) return false;
    for (uint32_t s = 0; s < life_; ++s)
        holds[s].force += holds[s].stiffness * unit_[size_t(channel)][s] * (step_at(channel, k, s) * (chosen - now));
    now = chosen;
    return true;
}

std::optional<QuantisedTrack> TrackRefit::descend(std::vector<Hold> holds, double worth) {
    bool changed = false;
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (uint32_t k = 0; k < basis_.terms; ++k)
            for (int channel : {height, turn_2, turn_1})
                if (k > 0 || channel == height) changed |= improve(channel, k, holds, worth);
    if (!changed) return {};
    track_.position = flattened(motion_), track_.second = flattened(normals_);
    return track_;
}

/// The surfaces of a window, and what its tracks do to them.
class WindowRefit {
public:
    WindowRefit(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables);
    void refit_all();

private:
    /// A track whose turn it is.
    struct Turn {
        uint32_t track;
        std::vector<std::vector<Response>> does;  ///< by sample of its life
        std::optional<QuantisedTrack> better;
        TrackSamples now;  ///< what that decodes to
    };
    SurfaceResponse& surface(int sample) { return *surfaces_[size_t(sample)]; }
    const SurfaceResponse& surface(int sample) const { return *surfaces_[size_t(sample)]; }
    Hold hold_of(const SurfaceResponse& surface, uint32_t point, const std::vector<Response>& does, const glm::vec3& off) const;
    void choose(Turn& turn) const;
    void follow(const Turn& turn);

    const Window& window_;
    CodedWindow& coded_;
    const WindowGoal& goal_;
    const format::BasisTables& tables_;
    double lever_;       ///< metres that count like a radian
    double square_ = 0;  ///< area × share² that holds a point, on average: m²
    std::vector<std::unique_ptr<SurfaceResponse>> surfaces_;
    std::vector<std::vector<uint32_t>> point_;  ///< by sample and track
};

WindowRefit::WindowRefit(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables)
    : window_(window), coded_(coded), goal_(goal), tables_(tables), lever_(goal.quantiser.step / goal.quantiser.normal_step),
      surfaces_(window.frames.size()), point_(window.frames.size()) {
    parallel_for(surfaces_.size(), goal.jobs, [&](size_t s) {
        std::vector<uint32_t> ids;
        const std::vector<SurfacePoint> points = decoded_points(coded.decoded, int(s), nullptr, 0, &ids);
        surfaces_[s] = std::make_unique<SurfaceResponse>(*window.frames[s], points, credible * goal.tolerance);
        point_[s].resize(coded.decoded.size());
        for (uint32_t i = 0; i < ids.size(); ++i) point_[s][ids[i]] = i;
    });
    double points = 0;
    for (const auto& surface : surfaces_)
        for (uint32_t i = 0; i < surface->tangents.size(); ++i) square_ += surface->grip_of(i).square, ++points;
    square_ /= std::max(points, 1.0);
}

/// `off`: the normal from what it should be.
Hold WindowRefit::hold_of(const SurfaceResponse& surface, uint32_t point, const std::vector<Response>& does, const glm::vec3& off) const {
    Hold hold;
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    for (const Response& r : does) {
        const dvec3 by(r.by), weighted = double(surface.area[r.vertex]) * by;
        hold.force += double(surface.residual[r.vertex]) * weighted;
        xx += weighted.x * by.x, xy += weighted.x * by.y, xz += weighted.x * by.z;
        yy += weighted.y * by.y, yz += weighted.y * by.z, zz += weighted.z * by.z;
    }
    hold.stiffness = dmat3(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    const double normal = normals_count * surface.grip_of(point).area * lever_ * lever_;
    const TangentFrame& tangents = surface.tangents[point];
    hold.force += normal * dvec3(0, glm::dot(off, tangents.t1), glm::dot(off, tangents.t2));
    const double still = rest * square_, upright = normal + still * lever_ * lever_;
    for (int a = 0; a < 3; ++a) hold.stiffness[a][a] += a == 0 ? still : upright;
    return hold;
}

void WindowRefit::choose(Turn& turn) const {
    thread_local std::vector<uint32_t> slots;
    const TrackSamples& decoded = coded_.decoded[turn.track];
    const Path& path = window_.paths[turn.track];
    turn.does.resize(decoded.position.size());
    std::vector<Hold> holds;
    for (size_t k = 0; k < turn.does.size(); ++k) {
        const int s = path.birth + int(k);
        const uint32_t point = point_[size_t(s)][turn.track];
        surface(s).of(point, turn.does[k], slots);
        holds.push_back(hold_of(surface(s), point, turn.does[k], decoded.normal[k] - path.target(s).normal));
    }
    const double step = goal_.quantiser.step, worth = bits_per_square / (square_ * step * step);
    TrackRefit integers(coded_.tracks[turn.track], decoded, coded_.quantiser, goal_.origin, tables_);
    turn.better = integers.descend(std::move(holds), worth);
    if (turn.better) turn.now = dequantise_track(*turn.better, coded_.quantiser, goal_.origin, tables_);
}

/// The surfaces go where the track takes them.
void WindowRefit::follow(const Turn& turn) {
    const TrackSamples& before = coded_.decoded[turn.track];
    for (size_t k = 0; k < turn.does.size(); ++k) {
        const glm::vec3 &n = before.normal[k], by = turn.now.normal[k] - n;
        const TangentFrame tangents = tangent_frame(n);
        const glm::vec3 move(glm::dot(turn.now.position[k] - before.position[k], n), glm::dot(by, tangents.t1), glm::dot(by, tangents.t2));
        std::vector<float>& residual = surface(before.birth + int(k)).residual;
        for (const Response& r : turn.does[k]) residual[r.vertex] += glm::dot(r.by, move);
    }
}

void WindowRefit::refit_all() {
    const size_t count = window_.paths.size();
    uint32_t blocks = 0;
    const std::vector<uint32_t> block = assign_blocks(coded_.decoded, std::max(fewest_apart, uint32_t(count / together)), blocks);
    std::vector<std::vector<uint32_t>> tracks(blocks);
    for (uint32_t i = 0; i < count; ++i) tracks[block[i]].push_back(i);
    std::vector<Turn> turns;
    for (size_t round = 0;; ++round) {
        turns.clear();
        for (const std::vector<uint32_t>& of_block : tracks)
            if (round < of_block.size()) turns.push_back({of_block[round], {}, {}, {}});
        if (turns.empty()) return;
        parallel_for(turns.size(), goal_.jobs, [&](size_t i) { choose(turns[i]); });
        for (Turn& turn : turns) {
            if (!turn.better) continue;
            follow(turn);
            coded_.tracks[turn.track] = std::move(*turn.better), coded_.decoded[turn.track] = std::move(turn.now);
        }
    }
}

}  // namespace

void refit_tracks(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables) {
    WindowRefit(window, coded, goal, tables).refit_all();
}

}  // namespace rill::cooker
