// SPDX-License-Identifier: MIT
// Small closed pieces of liquid, or of air in it, that are nearly ellipsoids, taken out of the meshes before points are
// scattered: one track of an ellipsoid instead of a dozen of points, and rounder than so few points would make it.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tracks/decoded_frame.h"
#include "tracks/pipeline.h"

namespace rill::cooker {
namespace {

constexpr double most_volume = 100;     // cubic edges
constexpr double least_air = 0.1;       // likewise: less is decoded as a ball of this, for no cell shows it, and points around it
                                        // open a void
// Edges. Meshers that smooth level sets leave dozens of scraps a frame, a hundredth of an edge across, some of them inside out. One
// that is no wider than `speck_extent`, has less volume than that and is no ellipsoid is a ball; those of a radius below `least_speck` are
// balls of that, which are seen. (17 frames of 844 pieces, most of them scraps: the largest
// error of the middle frame falls from 18 to 3 edges, of the worst from 31 to 16, for as many bytes.)
constexpr float speck_extent = 1.5f, least_speck = 0.15f;
constexpr double most_open = 0.01;      // of the area: |∫ n| of a piece that counts as closed
// In tolerances, of a piece's vertices from its ellipsoid; tolerances have grown by a sixth since .7 and 2.2. (At 1, without the second, long droplets with heads at their ends
// become spindles; frames 14:41 of dam_break take .7 % more bytes at equal p99, 40:50 of pour_sphere 1.5 % less.) Now less what all vertices
// are off alike, for then they were .6 and 1.9:
constexpr float most_rms = 0.42f, most_off = 1.45f;
// Edges. Flat triangles cut volume off a ball, so that all vertices of its mesh lie outside of the ball that has its volume: .12 to .16 for
// those of 2 to 15 cubic edges; and unevenly, by an rms of .04 to .06 and .15 at most. What tolerates less would make balls of dozens
// of points, whose volume is off by a tenth.
constexpr float most_facets = 0.2f, facets_rms = 0.065f, facets_off = 0.17f;
constexpr double ball = 4 * std::numbers::pi / 3;
constexpr float flattest = 0.12f;       // shortest over longest axis
constexpr float reach = 2;              // edges that a drop may land off where its velocity takes it
constexpr float most_growth = 2;        // of volume from frame to frame, either way
constexpr float most_drift = 100;       // edges from frame to frame: a velocity beyond is none

/// Volume integrals of a closed piece, about `base`: 1, x, x xᵀ.
struct Moments {
    double volume = 0, area = 0;
    Eigen::Vector3d facing = Eigen::Vector3d::Zero();  ///< ∫ n: nothing, of a closed piece
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
        const double six = a.dot(b.cross(c));
        const Eigen::Vector3d sum = a + b + c;
        const Eigen::Vector3d twice = (b - a).cross(c - a);
        area += twice.norm() / 2, facing += twice / 2;
        volume += six / 6, first += six / 24 * sum;
        second += six / 120 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
    }
};

Eigen::Vector3d eigen(const glm::vec3& v) { return {v.x, v.y, v.z}; }

glm::vec3 base_of(const Mesh& mesh, const std::vector<uint32_t>& triangles) {
    return mesh.positions[mesh.triangles[triangles.front()][0]];
}
std::vector<uint32_t> vertices_of(const Mesh& mesh, const std::vector<uint32_t>& triangles) {
    std::vector<uint32_t> vertices;
    for (uint32_t t : triangles) vertices.insert(vertices.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    return vertices;
}
Moments moments_of(const Mesh& mesh, const std::vector<uint32_t>& triangles) {
    const glm::vec3 base = base_of(mesh, triangles);
    Moments m;
    for (uint32_t t : triangles) {
        const Triangle& v = mesh.triangles[t];
        m.add(eigen(mesh.positions[v[0]] - base), eigen(mesh.positions[v[1]] - base), eigen(mesh.positions[v[2]] - base));
    }
    return m;
}

/// How far a piece's vertices may lie from its ellipsoid, metres.
struct Fit {
    float rms, most;
    float facets = 0; ///< all of them so far outside does not count
    float least = 0;  ///< no half axis is shorter, metres; nor any too short in the longest: 0: then there is no ellipsoid
};

/// The ellipsoid of the piece's centre, second moments and volume; the runtime sees to it that what it draws has that volume. None where the
/// vertices are farther off.
std::optional<Drop> fit_drop(const Mesh& mesh, const std::vector<uint32_t>& triangles, const Moments& m, const Fit& fit) {
    if (!(std::abs(m.volume) > 0)) return {};
    const glm::vec3 base = base_of(mesh, triangles);
    const Eigen::Vector3d centre = m.first / m.volume;
    const Eigen::Matrix3d covariance = m.second / m.volume - centre * centre.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(5 * covariance);  // of a solid ellipsoid: S² / 5
    if (axes.info() != Eigen::Success) return {};
    const double shortest = flattest * flattest * axes.eigenvalues()[2];
    if (!(axes.eigenvalues()[0] > shortest) && fit.least == 0) return {};
    const double least = std::max(shortest, double(fit.least) * fit.least);
    const bool is_thickened = axes.eigenvalues()[0] < least;  // then no vertex is on it
    const Eigen::Vector3d half = axes.eigenvalues().cwiseMax(least).cwiseSqrt();
    const Eigen::Matrix3d turn = axes.eigenvectors(), inverse = turn * half.cwiseInverse().asDiagonal() * turn.transpose();
    const std::vector<uint32_t> vertices = vertices_of(mesh, triangles);
    const double share = 1 / double(vertices.size());
    const auto on_ball = [&](uint32_t v) -> Eigen::Vector3d { return inverse * (eigen(mesh.positions[v] - base) - centre); };
    const double scale = is_thickened ? 1 : std::cbrt(std::abs(m.volume) / (ball * half.prod()));
    Drop drop;
    std::vector<double> off;
    for (uint32_t v : vertices) {
        const Eigen::Vector3d q = on_ball(v);
        const double length = q.norm();
        off.push_back((length - scale) * length / std::max((inverse * q).norm(), 1e-12));
        if (!mesh.velocities.empty()) drop.velocity += float(share) * mesh.velocities[v];
    }
    const double alike = std::clamp(share * std::accumulate(off.begin(), off.end(), 0.0), 0.0, double(fit.facets));
    double square = 0;
    for (const double o : off) {
        if (!(std::abs(o - alike) <= fit.most)) return {};
        square += share * (o - alike) * (o - alike);
    }
    if (!(std::sqrt(square) <= fit.rms)) return {};
    const Eigen::Matrix3d shape = (m.volume < 0 ? -scale : scale) * turn * half.asDiagonal() * turn.transpose();
    drop.centre = base + glm::vec3(centre.x(), centre.y(), centre.z());
    drop.volume = float(m.volume);
    drop.shape = {float(shape(0, 0)), float(shape(1, 1)), float(shape(2, 2)), float(shape(0, 1)), float(shape(0, 2)), float(shape(1, 2))};
    return drop;
}

/// Where what is too small to be fitted is, and how large; add_specks() gives it a shape.
Drop speck_of(const Mesh& mesh, const std::vector<uint32_t>& triangles, double volume) {
    const std::vector<uint32_t> vertices = vertices_of(mesh, triangles);
    const float share = 1 / float(vertices.size());
    Drop drop;
    for (uint32_t v : vertices) {
        drop.centre += share * mesh.positions[v];
        if (!mesh.velocities.empty()) drop.velocity += share * mesh.velocities[v];
    }
    drop.volume = float(std::abs(volume));
    return drop;
}

float extent_of(const Mesh& mesh, const std::vector<uint32_t>& triangles) {
    glm::vec3 lower(1e30f), upper(-1e30f);
    for (uint32_t t : triangles)
        for (uint32_t v : mesh.triangles[t]) lower = glm::min(lower, mesh.positions[v]), upper = glm::max(upper, mesh.positions[v]);
    return std::max({upper.x - lower.x, upper.y - lower.y, upper.z - lower.z});
}

/// Half axes shorter than that are neither seen nor known to the lattice of shapes.
float least_radius(float edge, float tolerance) { return std::max(least_speck * edge, 0.3f * tolerance); }

/// Balls of liquid in the air and of air in the liquid, of a size that is seen. `around`: the mesh without them. On which side of
/// it they lie tells what they are, not how they are wound.
void add_specks(const Mesh& around, std::vector<Drop>& specks, float edge, float tolerance, std::vector<Drop>& drops) {
    if (specks.empty()) return;
    const SurfaceIndex index(around);
    const std::vector<glm::vec3> normals = vertex_normals(around);
    const auto is_in_air = [&](const glm::vec3& x) {
        if (around.triangles.empty()) return true;
        const SurfaceIndex::Hit hit = index.closest(x, INFINITY);
        return glm::dot(value_at(hit, around.triangles[hit.triangle], normals), x - hit.point) >= 0;
    };
    const float least_volume = float(ball) * std::pow(least_radius(edge, tolerance), 3.f), air = float(least_air) * edge * edge * edge;
    for (Drop& speck : specks) {
        speck.volume = is_in_air(speck.centre) ? std::max(speck.volume, least_volume) : -air;
        const float radius = std::cbrt(speck.volume / float(ball));
        speck.shape = {radius, radius, radius, 0, 0, 0};
        drops.push_back(speck);
    }
}

/// Triangles of one connected piece of a mesh.
struct Piece {
    uint32_t name;                   ///< label_components()
    std::vector<uint32_t> triangles;
    Moments moments;
};

/// Closed pieces of up to `most_volume`; a piece of a sheet has none that means anything.
std::vector<Piece> small_pieces(const Mesh& mesh, const std::vector<uint32_t>& label, float edge) {
    std::vector<uint32_t> size(mesh.positions.size(), 0);
    for (const Triangle& t : mesh.triangles) ++size[label[t[0]]];
    constexpr uint32_t most_triangles = 600;  // of so small a volume: beyond, it is no drop
    std::vector<uint32_t> slot(mesh.positions.size(), ~0u);
    std::vector<Piece> pieces;
    for (uint32_t v = 0; v < size.size(); ++v)
        if (size[v] > 0 && size[v] <= most_triangles) slot[v] = uint32_t(pieces.size()), pieces.push_back({v, {}, {}});
    for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
        if (const uint32_t s = slot[label[mesh.triangles[t][0]]]; s != ~0u) pieces[s].triangles.push_back(t);
    for (Piece& piece : pieces) piece.moments = moments_of(mesh, piece.triangles);
    std::erase_if(pieces, [edge](const Piece& p) {
        return p.moments.facing.norm() > most_open * p.moments.area || std::abs(p.moments.volume) > most_volume * std::pow(double(edge), 3);
    });
    return pieces;
}

struct Match {
    float distance;
    uint32_t track, drop;
};

}  // namespace

std::vector<Drop> take_drops(Mesh& mesh, float edge, float tolerance) {
    const std::vector<uint32_t> label = label_components(mesh);
    std::vector<Drop> drops, specks;
    std::vector<bool> marked(mesh.positions.size(), false);
    const double least_volume = least_air * std::pow(double(edge), 3);
    const Fit near{std::max(most_rms * tolerance, facets_rms * edge), std::max(most_off * tolerance, facets_off * edge), most_facets * edge};
    bool any = false;
    for (const Piece& piece : small_pieces(mesh, label, edge)) {
        const double volume = piece.moments.volume;
        const float extent = extent_of(mesh, piece.triangles);
        const bool is_small = std::abs(volume) < least_volume, is_speck = (is_small && volume < 0) || extent < 2 * least_speck * edge;
        const auto drop = is_speck ? std::nullopt : fit_drop(mesh, piece.triangles, piece.moments, near);
        if (drop) drops.push_back(*drop);
        else if (is_speck || (is_small && extent < speck_extent * edge)) specks.push_back(speck_of(mesh, piece.triangles, volume));
        else continue;
        marked[piece.name] = any = true;
    }
    if (!any) return drops;
    std::vector<Triangle> others;
    for (const Triangle& t : mesh.triangles)
        if (!marked[label[t[0]]]) others.push_back(t);
    mesh = part_of(mesh, others);
    add_specks(mesh, specks, edge, tolerance, drops);
    return drops;
}

std::vector<Drop> lost_drops(const SurfaceFrame& frame, const DecodedFrame& decoded, float beyond, float tolerance) {
    std::vector<Drop> drops;
    const std::vector<Piece> pieces = small_pieces(frame.mesh, label_components(frame.mesh), frame.edge);
    if (pieces.empty()) return drops;
    for (const Piece& piece : pieces) {
        std::vector<glm::vec3> positions;
        for (uint32_t v : vertices_of(frame.mesh, piece.triangles)) positions.push_back(frame.mesh.positions[v]);
        if (!decoded.mesh.triangles.empty() && 2 * find_beyond(decoded.pieces.index, positions, beyond, 1).size() < positions.size()) continue;
        const Fit any{INFINITY, INFINITY, 0, least_radius(frame.edge, tolerance)};
        if (const auto drop = fit_drop(frame.mesh, piece.triangles, piece.moments, any)) drops.push_back(*drop);
    }
    return drops;
}

std::vector<TrackSamples> track_drops(const Window& window, const std::vector<std::vector<Drop>>& drops_of) {
    std::vector<TrackSamples> tracks;
    std::vector<uint32_t> alive;               // tracks at the sample before
    std::vector<const Drop*> at;               // what they were there
    for (int s = 0; s < window.samples(); ++s) {
        const float farthest = reach * window.frames[size_t(s)]->edge;
        const std::vector<Drop>& drops = drops_of[size_t(s)];
        const float seconds = s ? float(window.seconds[size_t(s)] - window.seconds[size_t(s - 1)]) : 0;
        const float to_next = s + 1 < window.samples() ? float(window.seconds[size_t(s + 1)] - window.seconds[size_t(s)]) : seconds;
        std::vector<Match> matches;
        for (uint32_t a = 0; a < alive.size(); ++a)
            for (uint32_t d = 0; d < drops.size(); ++d) {
                const Drop &from = *at[a], &to = drops[d];
                const float growth = to.volume / from.volume;
                const float off = glm::distance(from.centre + 0.5f * seconds * (from.velocity + to.velocity), to.centre);
                const float still = glm::distance(from.centre, to.centre);
                if (growth < most_growth && growth > 1 / most_growth && std::min(off, still) < farthest)
                    matches.push_back({std::min(off, still), a, d});
            }
        std::sort(matches.begin(), matches.end(), [](const Match& a, const Match& b) {
            return a.distance != b.distance ? a.distance < b.distance : a.track != b.track ? a.track < b.track : a.drop < b.drop;
        });
        std::vector<uint32_t> track_of(drops.size(), ~0u);
        std::vector<bool> carried(alive.size(), false);
        for (const Match& match : matches)
            if (!carried[match.track] && track_of[match.drop] == ~0u) carried[match.track] = true, track_of[match.drop] = alive[match.track];
        alive.clear(), at.clear();
        for (uint32_t d = 0; d < drops.size(); ++d) {
            if (track_of[d] == ~0u) {
                track_of[d] = uint32_t(tracks.size());
                TrackSamples& track = tracks.emplace_back();
                track.birth = uint8_t(s), track.drop = true;
                track.flags = s > 0 ? format::track_born : 0;
            }
            TrackSamples& track = tracks[track_of[d]];
            track.death = uint8_t(s);
            track.position.push_back(drops[d].centre), track.shape.push_back(drops[d].shape);
            track.drift = to_next * drops[d].velocity;
            if (!(glm::length(track.drift) < most_drift * window.frames[size_t(s)]->edge)) track.drift = glm::vec3(0);
            alive.push_back(track_of[d]), at.push_back(&drops[d]);
        }
    }
    for (TrackSamples& track : tracks)
        if (track.death + 1 < window.samples()) track.flags |= format::track_dies;
    return tracks;
}

}  // namespace rill::cooker
