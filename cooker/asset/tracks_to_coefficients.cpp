// SPDX-License-Identifier: MIT
// Samples of a track → integers on the quantiser's lattice, and back. Order of work for a point: normals (the
// axis and its frame follow from them), tangential motion, and last the motion along the axis, fitted to where
// the surface is under the tangentially quantised point.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "asset/track_basis.h"
#include "common/mesh.h"

namespace rill::cooker {
namespace {

using dvec3 = glm::dvec3;
constexpr uint32_t max_terms = format::max_terms;

struct Rounding {
    double dead_zone;  ///< coefficients below this fraction of a step are dropped: they cost more than they mend
    double up_from;    ///< others are rounded down up to this fraction: what it takes away is mostly the noise of the source's cells
};
constexpr Rounding of_points{0.62, 0.75}, of_shapes{0.5, 0.5};
/// Of the tolerance over time: a droplet's volume goes with the cube of what its axes are off. README.md, "Drops and bubbles".
constexpr double shape_tolerance = 0.3;
/// What a shape off by a step of the lattice counts, against a volume off by all of it, both squared.
constexpr double still_shape = 0.001;
/// Normals that lean further than this from the axis are kept as vectors, else as points of the plane at 1.
constexpr double least_planar = 0.4;
/// A life with a normal further than this from the axis has no tangential slack.
constexpr double least_slack = 0.6;

using Signal = std::vector<double>;
using Series = std::vector<double>;

/// All coefficients: the basis is orthonormal on the samples, so that least squares are dot products.
Series project_on(const Basis& basis, const Signal& signal) {
    Series c(basis.terms, 0.0);
    for (uint32_t s = 0; s < basis.samples; ++s)
        for (uint32_t k = 0; k < basis.terms; ++k) c[k] += signal[s] * basis.row[s][k];
    return c;
}
double value_at(const Basis& basis, const Series& c, uint32_t s) {
    double sum = 0;
    for (size_t k = 0; k < c.size(); ++k) sum += c[k] * basis.row[s][k];
    return sum;
}
/// Fewest terms (≥ 1) whose truncated series stays within the tolerance at every sample; 0: none does.
uint32_t fewest_terms(const Basis& basis, const Series& c, const Signal& signal, double tolerance) {
    Signal rest = signal;
    for (uint32_t k = 0; k < basis.terms; ++k) {
        double worst = 0;
        for (uint32_t s = 0; s < basis.samples; ++s) {
            rest[s] -= c[k] * basis.row[s][k];
            worst = std::max(worst, std::abs(rest[s]));
        }
        if (worst <= tolerance) return k + 1;
    }
    return 0;
}

/// A shape as a matrix; the order is that of TrackSamples::shape.
template <class Shape>
glm::dmat3 matrix_of(const Shape& v) {
    return {v[0], v[3], v[4], v[3], v[1], v[5], v[4], v[5], v[2]};
}

int32_t checked(double value) {
    if (!(std::abs(value) < format::max_symbol))
        throw InputError("--error is too small for this liquid: a point goes more steps of that size than the format counts");
    return int32_t(std::lround(value));
}
int32_t quantised(double value, double step, const Rounding& rounding) {
    const double v = std::abs(value / step);
    if (v < rounding.dead_zone) return 0;
    return checked(std::copysign(std::max(1.0, std::floor(v + 1 - rounding.up_from)), value));
}

/// What a squared error of one step is worth in bits (the slope of the rate–distortion curve); and what it is worth to keep
/// a tolerance at every sample.
constexpr double bits_per_error = 6.5, bits_per_broken_tolerance = 8;

struct Coded {
    Series series;        ///< what a decoder sees; term 0 is the signal's own
    double cost = 0;      ///< bits + bits_per_error · squared error in steps
    bool within = false;  ///< the tolerance can be met
};
/// Terms 1 … of a signal as integers, into channel `channel` of the rows.
template <class Rows>
Coded quantise_series(const Basis& basis, const Signal& signal, double tolerance, double step, int channel,
                      Rows& rows, const Rounding& rounding = of_points) {
    Coded out;
    Series& c = out.series = project_on(basis, signal);
    uint32_t terms = fewest_terms(basis, c, signal, tolerance);
    out.within = terms > 0;
    if (terms == 0) terms = basis.terms;
    for (uint32_t k = 1; k < basis.terms; ++k) {
        rows[k][channel] = k < terms ? quantised(c[k], step, rounding) : 0;
        out.cost += cost_of(rows[k][channel]);
        c[k] = rows[k][channel] * step;
    }
    for (uint32_t s = 0; s < basis.samples; ++s) {
        const double error = (signal[s] - value_at(basis, c, s)) / step;
        out.cost += bits_per_error * error * error;
    }
    return out;
}

/// How a track is about to be coded on one basis: everything but the choice between bases.
struct Attempt {
    QuantisedTrack track;
    double cost = 0;
    bool within = true;  ///< all tolerances can be met
    void add(const Coded& coded) {
        cost += coded.cost;
        within = within && coded.within;
    }
};

struct Fitter {
    const TrackSamples& samples;
    const Quantiser& quantiser;
    const format::BasisTables& tables;
    const ProjectAlong& project;
    format::LatticeSteps steps;
    dvec3 origin;

    uint32_t life() const { return uint32_t(samples.position.size()); }
    double tangent_step() const { return double(steps.step) * steps.ratio / 16; }
    double motion_step() const { return cooker::motion_step(steps, life()); }
    double shape_step() const { return cooker::shape_step(steps, life()); }
    double drift_step() const { return motion_step() * steps.ratio / 16; }
    double turn_step() const { return cooker::turn_step(steps, life()); }
    dvec3 position(uint32_t s) const { return dvec3(samples.position[s]) - origin; }

    /// The direction the life's normals are planar about, and whether they are.
    bool choose_axis(int32_t (&axis)[2]) const;
    double quantise_normals(const Basis& basis, const FrameAxes& axes, bool planar, Rows<3>& rows,
                            bool& within) const;
    Attempt attempt_point(const Basis& basis) const;
    Attempt attempt_drop(const Basis& basis) const;
    void keep_volume(const Basis& basis, Rows<6>& shape) const;
};

bool Fitter::choose_axis(int32_t (&axis)[2]) const {
    const int32_t levels = format::axis_levels(steps, life());
    dvec3 mean(0);
    for (const glm::vec3& n : samples.normal) mean += dvec3(n);
    if (!(glm::length(mean) > 1e-3 * life())) mean = dvec3(samples.normal[0]);
    mean = glm::length(mean) > 0 ? glm::normalize(mean) : dvec3(0, 0, 1);
    for (int pass = 0; pass < 2; ++pass) {  // the mean in the plane is not quite the mean on the sphere
        dvec3 planar(0);
        for (const glm::vec3& n : samples.normal) {
            const double along = glm::dot(dvec3(n), mean);
            if (along < least_planar) {
                format::nearest_axis(&mean[0], levels, axis);
                return false;
            }
            planar += dvec3(n) / along;
        }
        mean = glm::normalize(planar);
    }
    format::nearest_axis(&mean[0], levels, axis);
    const dvec3 n = axes_of(axis, levels).n;
    return std::all_of(samples.normal.begin(), samples.normal.end(),
                       [&](const glm::vec3& m) { return glm::dot(dvec3(m), n) > 0.5 * least_planar; });
}

double Fitter::quantise_normals(const Basis& basis, const FrameAxes& axes, bool planar, Rows<3>& rows,
                                bool& within) const {
    const uint32_t n = life();
    dvec3 mean(0);
    for (const glm::vec3& m : samples.normal) mean += dvec3(m) / double(n);
    const double size = std::max(glm::length(mean), 0.2);
    const dvec3 directions[3] = {axes.t1, axes.t2, axes.n};
    double cost = 0;
    for (int c = 0; c < (planar ? 2 : 3); ++c) {
        Signal signal(n);
        for (uint32_t s = 0; s < n; ++s) {
            const dvec3 m(samples.normal[s]);
            signal[s] = glm::dot(m, directions[c]) / (planar ? glm::dot(m, axes.n) : size);
        }
        const Coded coded = quantise_series(basis, signal, quantiser.normal_tolerance, turn_step(), c, rows);
        within = within && coded.within;
        cost += coded.cost;
    }
    return cost;
}

Attempt Fitter::attempt_point(const Basis& basis) const {
    const uint32_t n = life();
    Attempt out;
    QuantisedTrack& track = out.track;
    const bool planar = choose_axis(track.axis);
    const FrameAxes axes = axes_of(track.axis, format::axis_levels(steps, life()));
    Rows<3> normals{}, motion{};
    out.cost = quantise_normals(basis, axes, planar, normals, out.within);

    double least = 1;
    for (const glm::vec3& m : samples.normal) least = std::min(least, glm::dot(dvec3(m), axes.n));
    const bool fine = least < least_slack;
    const double slack = fine ? 1.0 : steps.ratio / 16.0;

    dvec3 mean(0);
    for (uint32_t s = 0; s < n; ++s) mean += position(s) / double(n);
    dvec3 corner;
    for (int c = 0; c < 3; ++c) {
        track.lattice[c] = checked(mean[c] / tangent_step());
        corner[c] = track.lattice[c] * tangent_step();
    }
    const dvec3 tangents[2] = {axes.t1, axes.t2};
    std::vector<dvec3> placed(n, corner);
    for (int c = 0; c < 2; ++c) {
        Signal signal(n);
        for (uint32_t s = 0; s < n; ++s) signal[s] = glm::dot(position(s) - mean, tangents[c]);
        if (fine) motion[0][c] = checked(glm::dot(mean - corner, tangents[c]) / mean_step(steps, n));
        const double tolerance = quantiser.time_tolerance * slack;
        Coded coded = quantise_series(basis, signal, tolerance, motion_step() * slack, c, motion);
        coded.series[0] = 0;
        out.add(coded);
        for (uint32_t s = 0; s < n; ++s)
            placed[s] += tangents[c] * (value_at(basis, coded.series, s) + motion[0][c] * mean_step(steps, n));
    }
    // Along the axis: to the surface under the placed point; without a surface, to the sample's tangent plane.
    Signal along(n);
    for (uint32_t s = 0; s < n; ++s) {
        const dvec3 offset = position(s) - placed[s], m(samples.normal[s]);
        const double lean = glm::dot(m, axes.n);
        along[s] = lean > 0.3 ? glm::dot(offset, m) / lean : glm::dot(offset, axes.n);
        if (!project) continue;
        const float more = project(s, glm::vec3(placed[s] + along[s] * axes.n + origin), glm::vec3(axes.n));
        if (std::isfinite(more)) along[s] += more;
    }
    double height = 0;
    for (const double h : along) height += h / n;
    motion[0][2] = checked(height / mean_step(steps, n));
    out.add(quantise_series(basis, along, quantiser.time_tolerance, motion_step(), 2, motion));

    track.flags =
        uint8_t(samples.flags | (fine ? format::track_fine : 0) | (basis.cosine ? format::track_cosine : 0));
    track.drop = false;
    track.position = flattened(motion);
    track.second = flattened(normals);
    return out;
}

/// A step of one axis is a tenth of a droplet's volume: of all ways to round the means of the three axes, takes the one with which
/// the volume is nearest to its own over the life.
void Fitter::keep_volume(const Basis& basis, Rows<6>& shape) const {
    const uint32_t n = life();
    std::vector<glm::dmat3> coded(n);
    std::array<double, 3> off{};  // steps, as rounded
    for (uint32_t s = 0; s < n; ++s) {
        double v[6] = {};
        for (uint32_t k = 0; k < basis.terms; ++k)
            for (size_t c = 0; c < 6; ++c) v[c] += shape[k][c] * basis.row[s][k] * shape_step();
        coded[s] = matrix_of(v);
        for (size_t c = 0; c < 3; ++c) off[c] -= double(samples.shape[s][c]) / (std::sqrt(double(n)) * shape_step());
    }
    for (size_t c = 0; c < 3; ++c) off[c] += shape[0][c];
    std::array<int32_t, 3> best{};
    double least = INFINITY;
    for (int way = 0; way < 27; ++way) {
        const std::array<int32_t, 3> by{way % 3 - 1, way / 3 % 3 - 1, way / 9 - 1};
        double cost = 0;
        for (size_t c = 0; c < 3; ++c) cost += still_shape * n * (off[c] + by[c]) * (off[c] + by[c]);
        for (uint32_t s = 0; s < n; ++s) {
            glm::dmat3 m = coded[s];
            for (int c = 0; c < 3; ++c) m[c][c] += by[size_t(c)] * basis.row[s][0] * shape_step();
            const double larger = glm::determinant(m) / glm::determinant(matrix_of(samples.shape[s])) - 1;
            cost += larger * larger;
        }
        if (cost < least) least = cost, best = by;
    }
    for (size_t c = 0; c < 3; ++c) shape[0][c] += best[c];
}

Attempt Fitter::attempt_drop(const Basis& basis) const {
    const uint32_t n = life();
    Attempt out;
    QuantisedTrack& track = out.track;
    track.axis[0] = track.axis[1] = 0;
    Rows<3> motion{};
    Rows<6> shape{};
    Signal signal(n);
    for (int c = 0; c < 3; ++c) {
        double mean = 0;
        for (uint32_t s = 0; s < n; ++s) mean += (signal[s] = position(s)[c]) / n;
        track.lattice[c] = checked(mean / tangent_step());
        motion[0][c] = checked((mean - track.lattice[c] * tangent_step()) / mean_step(steps, n));
        out.add(quantise_series(basis, signal, quantiser.time_tolerance, motion_step(), c, motion));
    }
    for (int c = 0; c < 6; ++c) {
        double mean = 0;
        for (uint32_t s = 0; s < n; ++s) mean += (signal[s] = samples.shape[s][size_t(c)]) / n;
        shape[0][size_t(c)] = checked(mean * std::sqrt(double(n)) / shape_step());
        out.add(quantise_series(basis, signal, shape_tolerance * quantiser.time_tolerance, shape_step(), c, shape, of_shapes));
    }
    if (n == 1)
        for (int c = 0; c < 3; ++c) motion[1][size_t(c)] = checked(samples.drift[c] / drift_step());
    keep_volume(basis, shape);
    track.flags = uint8_t(samples.flags | (basis.cosine ? format::track_cosine : 0));
    track.drop = true;
    track.position = flattened(motion);
    track.second = flattened(shape);
    return out;
}

}  // namespace

format::LatticeSteps lattice_steps(const Quantiser& quantiser, const glm::vec3& origin) {
    format::LatticeSteps steps{quantiser.step, quantiser.normal_step, {origin.x, origin.y, origin.z}, 0};
    if (quantiser.tangent_ratio >= 1 && quantiser.tangent_ratio <= 64)
        steps.ratio = uint16_t(std::lround(quantiser.tangent_ratio * 16));
    steps.slip_step = quantiser.slip_step;
    if (!format::valid(steps)) throw InputError("quantiser: a step is not positive, finite and sensible");
    return steps;
}

format::RawTrack raw_track(const QuantisedTrack& track) {
    format::RawTrack raw{};
    const size_t channels = track.drop ? 6 : 3;
    const uint32_t most = track.birth > track.death ? 0
                                                    : format::most_terms(track.death - track.birth + 1u,
                                                                         track.flags & format::track_cosine);
    const bool drifts = track.drop && track.birth == track.death;
    if (track.position.size() < 3 || track.position.size() % 3 || track.position.size() / 3 > most + drifts ||
        track.second.size() < channels || track.second.size() % channels ||
        track.second.size() / channels > most)
        throw InputError("chunk: a track has an impossible number of coefficients");
    raw.birth = track.birth, raw.death = track.death, raw.flags = track.flags;
    raw.position_terms = uint8_t(track.position.size() / 3);
    raw.second_terms = uint8_t(track.second.size() / channels);
    std::copy(track.lattice, track.lattice + 3, raw.lattice);
    std::copy(track.axis, track.axis + 2, raw.axis);
    std::copy(track.slip, track.slip + 2, raw.slip), std::copy(track.slip_change, track.slip_change + 2, raw.slip_change);
    for (size_t i = 0; i < track.position.size(); ++i) raw.position[i / 3][i % 3] = track.position[i];
    for (size_t i = 0; i < track.second.size(); ++i) raw.second[i / channels][i % channels] = track.second[i];
    return raw;
}

QuantisedTrack quantise_track(const TrackSamples& track, const Quantiser& quantiser, const glm::vec3& origin,
                              const format::BasisTables& tables, const ProjectAlong& project) {
    const size_t life = track.position.size();
    if (life == 0 || life > tables.longest || track.death != track.birth + life - 1 ||
        (track.drop ? track.shape.size() : track.normal.size()) != life)
        throw InputError("track: the number of its samples does not fit its life");
    const Fitter fitter{track, quantiser, tables, project, lattice_steps(quantiser, origin), dvec3(origin)};
    const auto attempt = [&](bool cosine) {
        const Basis basis(tables, uint32_t(life), cosine);
        return track.drop ? fitter.attempt_drop(basis) : fitter.attempt_point(basis);
    };
    // The cheaper basis, all told; one that cannot meet the tolerances even unquantised has to be cheaper by far.
    Attempt best = attempt(false);
    if (life > 2) {
        Attempt plain = attempt(true);
        const double handicap = (int(plain.within) - int(best.within)) * bits_per_broken_tolerance;
        if (plain.cost < best.cost + handicap) best = std::move(plain);
    }
    best.track.birth = track.birth, best.track.death = track.death;
    set_slip(best.track, track, quantiser, origin);
    return std::move(best.track);
}

float rough_bits(const QuantisedTrack& track) {
    constexpr double birth = 40;  // place, axis, life
    double bits = birth;
    for (size_t i = 3; i < track.position.size(); ++i) bits += cost_of(track.position[i]);
    for (size_t i = track.drop ? 6 : 3; i < track.second.size(); ++i) bits += cost_of(track.second[i]);
    return float(bits);
}

void set_slip(QuantisedTrack& track, const TrackSamples& samples, const Quantiser& quantiser, const glm::vec3& origin) {
    const format::LatticeSteps steps = lattice_steps(quantiser, origin);
    if (track.drop || !(steps.slip_step > 0)) return;
    const uint32_t life = track.death - track.birth + 1u;
    const FrameAxes axes = axes_of(track.axis, format::axis_levels(steps, life));
    const auto set = [&](const glm::vec3& slip, int32_t (&out)[2]) {
        const dvec3 tangents[2] = {axes.t1, axes.t2};
        for (int c = 0; c < 2; ++c) {
            const double along = glm::dot(dvec3(slip), tangents[c]) / steps.slip_step;
            if (!std::isfinite(along)) throw InputError("track: a slip is not finite");
            out[c] = int32_t(std::lround(std::clamp(along, -double(format::max_slip), double(format::max_slip))));
        }
    };
    set(samples.slip, track.slip);
    if (life >= format::least_changing_life) set(samples.slip_change, track.slip_change);
}

TrackSamples dequantise_track(const QuantisedTrack& track, const Quantiser& quantiser,
                              const glm::vec3& origin, const format::BasisTables& tables) {
    const format::LatticeSteps steps = lattice_steps(quantiser, origin);
    const format::RawTrack raw = raw_track(track);
    std::vector<float> coefficients(format::coefficients_of(raw, track.drop));
    format::Track record;
    format::TrackBlock block{{}, 0,   !track.drop,        track.drop, uint32_t(coefficients.size()),
                             &record, coefficients.data()};
    if (!format::place_track(raw, steps, track.drop, block, 0, 0))
        throw InputError("track: a value is out of range");
    format::finish_block(steps, block);

    TrackSamples out;
    out.birth = track.birth, out.death = track.death, out.drop = track.drop;
    out.flags = record.flags & (format::track_born | format::track_dies);
    for (int c = 0; c < 3 && !track.drop; ++c)
        out.slip[c] = block.slip_unit * float(record.slip[c]), out.slip_change[c] = block.slip_unit * float(record.slip_change[c]);
    const uint32_t life = track.death - track.birth + 1u, channels = track.drop ? 6 : 3;
    const uint32_t terms = std::max(record.position_terms, record.second_terms);
    const float* second = coefficients.data() + 3 * record.position_terms;
    if (track.drop && life == 1 && record.position_terms > 1) out.drift = {coefficients[3], coefficients[4], coefficients[5]};
    for (uint32_t s = 0; s < life; ++s) {
        float phi[max_terms], x[3] = {}, y[6] = {};
        format::basis_row(tables, life, record.flags & format::track_cosine, s, terms, phi);
        for (uint32_t k = 0; k < record.position_terms; ++k)
            for (uint32_t c = 0; c < 3; ++c) x[c] += phi[k] * coefficients[3 * k + c];
        for (uint32_t k = 0; k < record.second_terms; ++k)
            for (uint32_t c = 0; c < channels; ++c) y[c] += phi[k] * second[channels * k + c];
        out.position.push_back(glm::vec3(x[0], x[1], x[2]) + origin);
        const glm::vec3 n(y[0], y[1], y[2]);
        if (track.drop)
            out.shape.push_back({y[0], y[1], y[2], y[3], y[4], y[5]});
        else
            out.normal.push_back(glm::length(n) > 0 ? glm::normalize(n) : n);
    }
    return out;
}

}  // namespace rill::cooker
