// SPDX-License-Identifier: MIT
// Heights chosen anew where few points make a piece of liquid, or it is thin. How each is rounded is chance, and where no thousand
// others make up for it the piece's volume is off by as much: a ball of 39 points, pour_sphere 1, by .8 %. So mean heights go up or
// down by a step of the lattice, of those tracks first that the surface is the better for or hardly the worse, until the volume of
// every such piece is about the source's.
// What that gains: README.md, "Drops and bubbles". Pieces meshed by themselves, to save time, have other supports than beside the rest: they
// came out up to a quarter too large.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "asset/track_basis.h"
#include "common/parallel.h"
#include "frames/walls.h"
#include "tracks/frames_to_tracks.h"
#include "tracks/points_to_mesh.h"

namespace rill::cooker {
namespace {

constexpr size_t few_points = 1000;   // of a piece; frames of more are within .2 % by themselves,
constexpr double thin = 2;            // unless they have fewer cubic edges of volume to a square edge of surface
// Off by less is near enough, of the volume of a piece that is most of its frame's, and of small ones; in between by its share, so that two
// jets that have just begun have their frame's volume. A step of one point of a droplet is as much as the second.
constexpr double near_main = 2.5e-3, near_other = 0.03;
constexpr double nearest = 0.5;       // of the largest step
constexpr double most_missing = 0.5;  // else the piece is torn, or one with another
constexpr double spoilt = 0.05;       // more amiss than before: that did not do what it should, and is taken back
constexpr int rounds = 4;             // of steps: what they do is known roughly
constexpr double enough = 0.2;        // of the most that a step would mend now: others are chosen by what they do to the distances
constexpr double least_harm = 0.05;   // of a step's own square: any that does less is as good

/// A point of a piece: what it stands for, and how far the source is above it.
struct Member {
    uint32_t track;
    double area = 0, above = 0;  ///< m², metres
};
struct Piece {
    double volume = 0, missing = 0, near = 0;  ///< of the source, m³; of that, what the decoded piece lacks, and may
    double before = INFINITY;                  ///< beyond() of what was missing a round ago
    std::vector<Member> members;
    /// How much of it counts: of what is missing, or too much.
    double beyond(double now) const { return std::max(std::fabs(now) - near, 0.0); }
};

/// The source's pieces of liquid that few of a frame's points make, and what these decode to.
class FrameOfPieces {
public:
    FrameOfPieces(const SurfaceFrame& frame, const surface::Container& container, const std::vector<SurfacePoint>& points, const std::vector<uint32_t>& ids)
        : frame_(frame), container_(container), points_(points), label_(label_components(frame.mesh)) {
        if (points.empty() || label_.empty()) return;
        begin_pieces(ids);
        if (pieces.empty()) return;
        measure_areas();
        measure_missing();
    }
    std::map<uint32_t, Piece> pieces;  ///< by the first of the source's vertices

private:
    uint32_t label_at(const glm::vec3& x) const {
        thread_local std::vector<VertexTree::Found> found;
        frame_.tree.nearest(x, 1, found);
        return label_[found[0].vertex];
    }
    std::vector<double> volumes_inside(Mesh mesh, const std::vector<uint32_t>& label) const {
        draw_inside(mesh, container_);
        return label_volumes(mesh, label);
    }
    void begin_pieces(const std::vector<uint32_t>& ids) {
        std::vector<uint32_t> count(label_.size(), 0);
        for (const SurfacePoint& p : points_) piece_.push_back(label_at(p.position)), ++count[piece_.back()];
        const std::vector<double> volume = volumes_inside(frame_.mesh, label_);
        const double all = std::accumulate(volume.begin(), volume.end(), 0.0);
        std::vector<double> area(label_.size(), 0);
        for (uint32_t v = 0; v < label_.size(); ++v) area[label_[v]] += frame_.area[v];
        const auto is_exact = [&](uint32_t name) { return count[name] > few_points && volume[name] > thin * frame_.edge * area[name]; };
        for (uint32_t i = 0; i < points_.size(); ++i) {
            const uint32_t name = piece_[i];
            if (is_exact(name) || !(volume[name] > 0)) continue;
            Piece& piece = pieces[name];
            piece.volume = volume[name], piece.near = std::clamp(near_main * all / (2 * volume[name]), near_main, near_other);
            const SurfaceIndex::Hit hit = frame_.index.closest(points_[i].position, INFINITY);
            piece.members.push_back({ids[i], 0, glm::dot(hit.point - points_[i].position, points_[i].normal)});
            few_.push_back(points_[i].position), member_.emplace_back(name, uint32_t(piece.members.size() - 1));
        }
    }
    /// A point stands for the source's vertices that it is nearest to.
    void measure_areas() {
        const VertexTree tree(few_);
        std::vector<VertexTree::Found> found;
        for (uint32_t v = 0; v < label_.size(); ++v) {
            if (!pieces.count(label_[v]) || !is_inside(frame_.mesh.positions[v], container_)) continue;
            tree.nearest(frame_.mesh.positions[v], 1, found);
            const auto [name, member] = member_[found[0].vertex];
            if (name == label_[v]) pieces[name].members[member].area += frame_.area[v];
        }
    }
    void measure_missing() {
        const Mesh decoded = mesh_points(points_, frame_.edge, 1, frame_.mesh.positions.size());
        const std::vector<uint32_t> label = label_components(decoded);
        const std::vector<double> volume = volumes_inside(decoded, label);
        std::map<uint32_t, double> sum;
        for (uint32_t v = 0; v < volume.size(); ++v)
            if (volume[v] != 0) sum[label_at(decoded.positions[v])] += volume[v];
        for (const auto& [name, home] : joined(decoded, label, sum)) sum[home] -= pieces[name].volume;
        for (auto& [name, piece] : pieces) piece.missing = 1 - sum[name] / piece.volume;
    }
    /// Pieces that nothing decoded is counted for, `sum`, and which other they have run into: what is decoded there is both.
    std::map<uint32_t, uint32_t> joined(const Mesh& decoded, const std::vector<uint32_t>& label, const std::map<uint32_t, double>& sum) const {
        std::map<uint32_t, uint32_t> homes;
        const auto is_joined = [&](const auto& piece) { return !sum.count(piece.first); };
        if (decoded.positions.empty() || std::none_of(pieces.begin(), pieces.end(), is_joined)) return homes;
        const VertexTree tree(decoded.positions);
        std::vector<VertexTree::Found> found;
        for (size_t i = 0; i < few_.size(); ++i) {
            const uint32_t name = member_[i].first;
            if (sum.count(name) || homes.count(name)) continue;
            tree.nearest(few_[i], 1, found);
            homes[name] = label_at(decoded.positions[label[found[0].vertex]]);
        }
        return homes;
    }

    const SurfaceFrame& frame_;
    const surface::Container& container_;
    const std::vector<SurfacePoint>& points_;
    std::vector<uint32_t> label_, piece_;  ///< by the first vertex of a piece: of the source's vertices, and of the points
    std::vector<glm::vec3> few_;           ///< points of the pieces
    std::vector<std::pair<uint32_t, uint32_t>> member_;  ///< piece, and which of it, of those
};

/// The steps that there are: what each does to which pieces, all in a row, for all of them are looked through for every one taken.
class Steps {
public:
    /// What one track's mean height does to one piece when it goes up.
    struct Growth {
        uint32_t track, piece;
        double grown;  ///< how much less is missing there
        double pull, square;  ///< half the slope and half the curvature of squared distance
    };
    /// `growths`: sorted by track. `near`, `missing`: by piece. `stays`: by track, those that take no step.
    Steps(const std::vector<Growth>& growths, std::vector<double> near, std::vector<double> missing, const std::vector<bool>& stays)
        : tracks_(stays.size()), near_(std::move(near)), left_(std::move(missing)), off2_(left_.size()) {
        for (size_t i = 0; i < tracks_.size(); ++i) tracks_[i].taken = stays[i];
        for (const Growth& g : growths) {
            Track& track = tracks_[g.track];
            if (track.first == track.last) track.first = track.last = entries_.size();
            entries_.push_back({g.piece, g.grown}), ++track.last;
            track.pull += g.pull, track.square += g.square;
            near_[g.piece] = std::max(near_[g.piece], nearest * std::fabs(g.grown));
        }
        for (uint32_t piece = 0; piece < left_.size(); ++piece) set_left(piece, left_[piece]);
    }
    bool any_off() const { return off_ > 0; }
    /// The best that is left, and its way: the one that harms least of those that mend much. No way: none mends anything.
    std::pair<size_t, int> best(int jobs) {
        parallel_for((tracks_.size() + run - 1) / run, jobs, [&](size_t k) {
            for (size_t i = k * run; i < std::min((k + 1) * run, tracks_.size()); ++i)
                if (!tracks_[i].taken) find_gains(tracks_[i]);
        });
        double most = 0;
        for (const Track& track : tracks_)
            if (!track.taken) most = std::max({most, track.gain[0], track.gain[1]});
        std::pair<size_t, int> best{0, 0};
        double least = INFINITY;
        for (size_t i = 0; i < tracks_.size() && most > 0; ++i)
            for (const int way : {-1, 1}) {
                const Track& track = tracks_[i];
                const double mended = track.gain[way > 0], harm = track.harm(way) / mended;
                if (!track.taken && mended >= enough * most && harm < least) least = harm, best = {i, way};
            }
        return best;
    }
    void take(size_t track, int way) {
        tracks_[track].taken = true;
        for (size_t k = tracks_[track].first; k < tracks_[track].last; ++k) set_left(entries_[k].piece, left_[entries_[k].piece] - way * entries_[k].grown);
    }

private:
    static constexpr size_t run = 256;  ///< tracks that are a task
    struct Entry {
        uint32_t piece;
        double grown;
    };
    struct Track {
        size_t first = 0, last = 0;  ///< its entries
        double pull = 0, square = 0, gain[2] = {};
        bool taken = false;
        double harm(int way) const { return std::max(square + 2 * way * pull, least_harm * square); }
    };
    double beyond2(uint32_t piece, double left) const {
        const double beyond = std::max(std::fabs(left) - near_[piece], 0.0);
        return beyond * beyond;
    }
    /// What a step takes away from Σ beyond², either way.
    void find_gains(Track& track) const {
        double down = 0, up = 0;
        for (size_t k = track.first; k < track.last; ++k) {
            const auto [piece, grown] = entries_[k];
            down += off2_[piece] - beyond2(piece, left_[piece] + grown), up += off2_[piece] - beyond2(piece, left_[piece] - grown);
        }
        track.gain[0] = down, track.gain[1] = up;
    }
    void set_left(uint32_t piece, double left) {
        off_ -= off2_[piece] > 0;
        left_[piece] = left, off2_[piece] = beyond2(piece, left);
        off_ += off2_[piece] > 0;
    }

    std::vector<Track> tracks_;
    std::vector<Entry> entries_;
    std::vector<double> near_, left_, off2_;  ///< by piece: may be missing, is, and beyond² of that
    size_t off_ = 0;                          ///< pieces
};

/// Takes steps in rounds, and back those that did not do what they should: a strand has torn, or run into another.
class VolumeRefit {
public:
    VolumeRefit(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables)
        : window_(window), coded_(coded), goal_(goal), tables_(tables), lattice_(lattice_steps(coded.quantiser, goal.origin)),
          of_sample_(window.frames.size()), moved_(coded.tracks.size(), 0), stays_(coded.tracks.size(), false) {}
    void run() {
        std::vector<size_t> samples(of_sample_.size());
        std::iota(samples.begin(), samples.end(), size_t(0));
        for (int round = 0; !samples.empty(); ++round) {
            measure(samples);
            take_back();
            std::fill(moved_.begin(), moved_.end(), 0);
            if (round == rounds) return;
            take_steps();
            samples = samples_moved();
        }
    }

private:
    void measure(const std::vector<size_t>& samples) {
        parallel_for(samples.size(), goal_.jobs, [&](size_t k) {
            const size_t s = samples[k];
            std::vector<uint32_t> ids;
            const std::vector<SurfacePoint> points = decoded_points(coded_.decoded, int(s), &ids);
            std::map<uint32_t, Piece> now = FrameOfPieces(*window_.frames[s], goal_.container, points, ids).pieces;
            for (auto& [name, piece] : now)
                if (const auto was = of_sample_[s].find(name); was != of_sample_[s].end()) piece.before = was->second.beyond(was->second.missing);
            of_sample_[s] = std::move(now);
        });
    }
    void step(size_t track, int way) {
        coded_.tracks[track].position[2] += way;
        coded_.decoded[track] = dequantise_track(coded_.tracks[track], coded_.quantiser, goal_.origin, tables_);
    }
    void take_back() {
        for (const auto& pieces : of_sample_)
            for (const auto& [name, piece] : pieces) {
                if (!(piece.beyond(piece.missing) > piece.before + spoilt)) continue;
                for (const Member& member : piece.members) {
                    if (moved_[member.track] == 0) continue;
                    step(member.track, -moved_[member.track]);
                    moved_[member.track] = 0, stays_[member.track] = true;
                }
            }
    }
    void take_steps() {
        Steps steps = find_steps();
        while (steps.any_off()) {
            const auto [id, way] = steps.best(goal_.jobs);
            if (way == 0) return;
            steps.take(id, way), moved_[id] = way;
            step(id, way);
        }
    }
    Steps find_steps() const {
        std::vector<Steps::Growth> growths;
        std::vector<double> near, missing;
        for (size_t s = 0; s < of_sample_.size(); ++s)
            for (const auto& [name, piece] : of_sample_[s]) {
                if (!(std::fabs(piece.missing) < most_missing)) continue;
                for (const Member& member : piece.members) growths.push_back(growth_of(piece, uint32_t(near.size()), member, s));
                near.push_back(piece.near), missing.push_back(piece.missing);
            }
        std::stable_sort(growths.begin(), growths.end(), [](const Steps::Growth& a, const Steps::Growth& b) { return a.track < b.track; });
        return {growths, std::move(near), std::move(missing), stays_};
    }
    Steps::Growth growth_of(const Piece& piece, uint32_t number, const Member& member, size_t sample) const {
        const TrackSamples& track = coded_.decoded[member.track];
        const uint32_t life = uint32_t(track.position.size());
        const glm::dvec3 axis = axes_of(coded_.tracks[member.track].axis, format::axis_levels(lattice_, life)).n;
        const double up = mean_step(lattice_, life) * glm::dot(axis, glm::dvec3(track.normal[sample - track.birth]));
        return {member.track, number, up * member.area / piece.volume, -up * member.area * member.above, up * up * member.area};
    }
    /// Those that have pieces, in the lives of what has moved.
    std::vector<size_t> samples_moved() const {
        std::vector<size_t> samples;
        for (size_t s = 0; s < of_sample_.size(); ++s) {
            const auto lives = [&](size_t i) { return moved_[i] != 0 && coded_.decoded[i].birth <= s && s <= coded_.decoded[i].death; };
            bool any = false;
            for (size_t i = 0; i < moved_.size() && !of_sample_[s].empty() && !any; ++i) any = lives(i);
            if (any) samples.push_back(s);
        }
        return samples;
    }

    const Window& window_;
    CodedWindow& coded_;
    const WindowGoal& goal_;
    const format::BasisTables& tables_;
    format::LatticeSteps lattice_;
    std::vector<std::map<uint32_t, Piece>> of_sample_;
    std::vector<int> moved_;     ///< by track: the last round's step
    std::vector<bool> stays_;    ///< it was taken back once
};

}  // namespace

void refit_volume(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables) {
    VolumeRefit(window, coded, goal, tables).run();
}

}  // namespace rill::cooker
