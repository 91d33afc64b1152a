// SPDX-License-Identifier: MIT
// Coefficients chosen anew, against the surface that all tracks decode to together: one track after the other gets the
// integers that are worth their bits in squared distance at the source's vertices, given what the others decode to now.
// What rounding leaves of one its neighbours make up for, and noise that they blend away is not coded at all.
//
// Bytes at equal p99 of this and what was tried in its place: README.md, "How coefficients are chosen".
#include <algorithm>
#include <cmath>

#include "asset/track_basis.h"
#include "common/parallel.h"
#include "tracks/frames_to_tracks.h"
#include "tracks/surface_response.h"

namespace rill::cooker {
namespace {

using dvec3 = glm::dvec3;
using dmat3 = glm::dmat3;

constexpr float credible = 3;                // tolerances from the source
constexpr double bits_per_square = 2.5;      // what a squared error of one step, in one sample of a track, is worth
constexpr double normals_count = 0.13;       // a normal that is one step off, against a distance of one step
constexpr double rest = 0.05;                // of the mean pull of the surface: keeps a point where few vertices hold it, and from sliding
constexpr int sweeps = 2;                    // over a track's coefficients
// Tracks of different blocks have their turns at once: they rarely touch the same vertices, and where they do, each misses what
// the other does. How many is not for the number of threads to say, or the outcome would be, too.
constexpr size_t together = 32;
constexpr uint32_t fewest_apart = 64;        // tracks of a block
// First-order figures hold near where they are from. Steps:
constexpr int32_t most_shift = 3;            // of a mean height
constexpr int32_t most_slide = 1;            // of a coefficient across the axis
constexpr double turning = 0.5;              // bits that another axis has to be worth: next to a good guess it takes more

/// How a sample of a track is held: half the gradient and half the Hessian of the error, by its offset along the normal
/// and its tilts; and the curvature of its patch.
struct Hold {
    dvec3 force{0.0};
    dmat3 stiffness{0.0};
    glm::vec3 curvature{0};
};

/// Offset and tilts of a point whose normal turns.
dvec3 tilts_of(const dvec3& turn, const dvec3& normal) {
    const TangentFrame tangents = tangent_frame(glm::vec3(normal));
    return {0, glm::dot(turn, dvec3(tangents.t1)), glm::dot(turn, dvec3(tangents.t2))};
}
/// Of one that moves: where it slides, its patch comes along, which is a tilt to those that lie under it.
dvec3 shift_of(const dvec3& move, const dvec3& normal, const glm::vec3& curvature) {
    const dvec3 across = tilts_of(move, normal);
    return {glm::dot(move, normal), curvature.x * across.y + curvature.y * across.z, curvature.y * across.y + curvature.z * across.z};
}

/// The integers of one track on their way.
class TrackRefit {
public:
    TrackRefit(const QuantisedTrack& track, const TrackSamples& decoded, const Quantiser& quantiser, const glm::vec3& origin,
               const format::BasisTables& tables, std::vector<Hold> holds)
        : track_(track), life_(uint32_t(decoded.position.size())), basis_(tables, life_, track.flags & format::track_cosine),
          steps_(lattice_steps(quantiser, origin)), holds_(std::move(holds)) {
        for (size_t i = 0; i < track.position.size(); ++i) motion_[i / 3][i % 3] = track.position[i];
        for (size_t i = 3; i < track.second.size(); ++i) normals_[i / 3][i % 3] = track.second[i];
        began_ = motion_;
        const dvec3 corner = dvec3(track.lattice[0], track.lattice[1], track.lattice[2]) * (slack() * steps_.step) + dvec3(origin);
        for (uint32_t s = 0; s < life_; ++s) arm_.push_back(dvec3(decoded.position[s]) - corner), normal_.push_back(dvec3(decoded.normal[s]));
        find_units();
    }
    /// Fewest bits and least error, integer by integer; nothing where nothing changes. Bits that a squared error is worth, and
    /// what holds a point across the axis, both per m².
    std::optional<QuantisedTrack> descend(double worth, double still);

private:
    enum Channel { slide_1, slide_2, height, turn_1, turn_2, channels };
    int32_t& value(int channel, uint32_t k) { return channel <= height ? motion_[k][size_t(channel)] : normals_[k][size_t(channel - turn_1)]; }
    double slack() const { return steps_.ratio / 16.0; }
    double slide_step() const { return motion_step(steps_, life_) * (track_.flags & format::track_fine ? 1 : slack()); }
    /// How far one step of a coefficient goes at a sample.
    double step_at(int channel, uint32_t k, uint32_t s) const {
        if (k == 0) return mean_step(steps_, life_);
        return basis_.row[s][k] * (channel < height ? slide_step() : channel == height ? motion_step(steps_, life_) : turn_step(steps_, life_));
    }
    void find_units();
    bool turn_axis(double worth);
    bool improve(int channel, uint32_t k, double worth, double still);

    QuantisedTrack track_;
    uint32_t life_;
    Basis basis_;
    format::LatticeSteps steps_;
    std::vector<Hold> holds_;                        ///< by sample
    Rows<3> motion_{}, normals_{}, began_{};         ///< the last: motion as it was
    std::vector<dvec3> arm_, normal_;                ///< by sample, as decoded at first: from the lattice point, metres; unit
    std::array<std::vector<dvec3>, channels> unit_;  ///< by channel and sample: what one unit does to offset and tilts
};

void TrackRefit::find_units() {
    for (auto& of_samples : unit_) of_samples.clear();
    const FrameAxes axes = axes_of(track_.axis, format::axis_levels(steps_, life_));
    const dvec3 directions[3] = {axes.t1, axes.t2, axes.n};
    for (uint32_t s = 0; s < life_; ++s) {
        dvec3 normal = axes.n;
        for (uint32_t k = 1; k < basis_.terms; ++k)
            for (size_t c = 0; c < 3; ++c) normal += directions[c] * (normals_[k][c] * step_at(turn_1, k, s));
        const double length = std::max(glm::length(normal), 0.2);
        for (int c : {slide_1, slide_2, height}) unit_[size_t(c)].push_back(shift_of(directions[c], normal_[s], holds_[s].curvature));
        for (int c : {0, 1}) unit_[size_t(turn_1 + c)].push_back(tilts_of(directions[c] / length, normal_[s]));
    }
}

/// The axis takes the whole track with it, about the lattice point.
bool TrackRefit::turn_axis(double worth) {
    constexpr std::array<int32_t, 2> ways[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    const int32_t levels = format::axis_levels(steps_, life_);
    const FrameAxes now = axes_of(track_.axis, levels);
    std::array<int32_t, 2> chosen{};
    std::vector<dvec3> does(life_), best;
    double least = -turning;
    for (const auto& way : ways) {
        const int32_t axis[2] = {track_.axis[0] + way[0], track_.axis[1] + way[1]};
        if (std::abs(axis[0]) > levels || std::abs(axis[1]) > levels) continue;
        const FrameAxes then = axes_of(axis, levels);
        if (glm::dot(then.t1, now.t1) < 0.9) continue;  // on the other side of the frames' seam
        const dmat3 turn = glm::outerProduct(then.t1, now.t1) + glm::outerProduct(then.t2, now.t2) + glm::outerProduct(then.n, now.n);
        double cost = 0;
        for (uint32_t s = 0; s < life_; ++s) {
            const Hold& hold = holds_[s];
            does[s] = tilts_of(turn * normal_[s] - normal_[s], normal_[s]) + shift_of(turn * arm_[s] - arm_[s], normal_[s], hold.curvature);
            cost += worth * (2 * glm::dot(does[s], hold.force) + glm::dot(does[s], hold.stiffness * does[s]));
        }
        if (cost < least) least = cost, chosen = way, best = does;
    }
    if (best.empty()) return false;
    for (size_t c = 0; c < 2; ++c) track_.axis[c] += chosen[c];
    for (uint32_t s = 0; s < life_; ++s) holds_[s].force += holds_[s].stiffness * best[s];
    find_units();
    return true;
}

bool TrackRefit::improve(int channel, uint32_t k, double worth, double still) {
    double linear = 0, square = 0;
    for (uint32_t s = 0; s < life_; ++s) {
        const dvec3 by = unit_[size_t(channel)][s] * step_at(channel, k, s);
        linear += glm::dot(by, holds_[s].force), square += glm::dot(by, holds_[s].stiffness * by);
    }
    int32_t& now = value(channel, k);
    const bool slides = channel < height;
    const int32_t began = slides ? began_[k][size_t(channel)] : now;
    if (slides) {
        const double pull = still * slide_step() * slide_step();
        linear += pull * (now - began), square += pull;
    }
    if (!(square > 0)) return false;
    const double best = now - linear / square, most = k == 0 ? std::abs(double(now)) + most_shift : 1e5;
    if (!(std::abs(best) < most)) return false;
    const auto cost = [&](int32_t v) {
        const double d = v - now;
        return worth * (2 * linear + square * d) * d + (k == 0 ? 0 : cost_of(v));
    };
    int32_t chosen = now;
    for (const int32_t v : {int32_t(std::floor(best)), int32_t(std::ceil(best)), 0})
        if (cost(v) < cost(chosen) && !(slides && std::abs(v - began) > most_slide)) chosen = v;
    if (chosen == now || (k == 0 && std::abs(chosen - now) > most_shift)) return false;
    for (uint32_t s = 0; s < life_; ++s)
        holds_[s].force += holds_[s].stiffness * unit_[size_t(channel)][s] * (step_at(channel, k, s) * (chosen - now));
    now = chosen;
    return true;
}

std::optional<QuantisedTrack> TrackRefit::descend(double worth, double still) {
    bool changed = false;
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        changed |= turn_axis(worth);
        for (uint32_t k = 0; k < basis_.terms; ++k)
            for (int channel : {slide_1, slide_2, height, turn_2, turn_1})
                if (k > 0 || channel == height) changed |= improve(channel, k, worth, still);
    }
    if (!changed) return {};
    track_.position = flattened(motion_), track_.second = flattened(normals_);
    return track_;
}

/// The surfaces of a window, and what its tracks do to them.
class WindowRefit {
public:
    WindowRefit(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables, const SurfaceAim& aim);
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

WindowRefit::WindowRefit(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables, const SurfaceAim& aim)
    : window_(window), coded_(coded), goal_(goal), tables_(tables), lever_(goal.quantiser.step / goal.quantiser.normal_step),
      surfaces_(window.frames.size()), point_(window.frames.size()) {
    parallel_for(surfaces_.size(), goal.jobs, [&](size_t s) {
        std::vector<uint32_t> ids;
        const std::vector<SurfacePoint> points = decoded_points(coded.decoded, int(s), &ids);
        surfaces_[s] = std::make_unique<SurfaceResponse>(*window.frames[s], points, credible * goal.tolerance);
        aim_at(aim, int(s), *window.frames[s], goal.container, surfaces_[s]->residual);
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
    hold.curvature = surface.curvature[point];
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
    TrackRefit integers(coded_.tracks[turn.track], decoded, coded_.quantiser, goal_.origin, tables_, std::move(holds));
    turn.better = integers.descend(worth, rest * square_);
    if (turn.better) turn.now = dequantise_track(*turn.better, coded_.quantiser, goal_.origin, tables_);
}

/// The surfaces go where the track takes them.
void WindowRefit::follow(const Turn& turn) {
    const TrackSamples& before = coded_.decoded[turn.track];
    for (size_t k = 0; k < turn.does.size(); ++k) {
        const int s = before.birth + int(k);
        const dvec3 n(before.normal[k]);
        const glm::vec3& curvature = surface(s).curvature[point_[size_t(s)][turn.track]];
        const glm::vec3 move(shift_of(dvec3(turn.now.position[k] - before.position[k]), n, curvature) +
                             tilts_of(dvec3(turn.now.normal[k] - before.normal[k]), n));
        std::vector<float>& residual = surface(s).residual;
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

void refit_tracks(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables, const SurfaceAim& aim) {
    WindowRefit(window, coded, goal, tables, aim).refit_all();
}

}  // namespace rill::cooker
