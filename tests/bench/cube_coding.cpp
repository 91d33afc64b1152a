// SPDX-License-Identifier: MIT
#include "cube_coding.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "../basis_tables.h"
#include "asset/layers_to_chunks.h"
#include "common/parallel.h"
#include "format/layout.h"

namespace rill::bench {
namespace {

constexpr double pi = 3.14159265358979323846;
/// Of the quantiser, metres and radians: a coarser one would save bytes but no words, and spend the error on rounding.
constexpr double coarsest_step = 0.01;
using Frames = std::vector<std::vector<Point>>;  ///< [frame][point], world

Point posed(const Point& p, const Pose& pose) { return {pose.turn * p.position + pose.shift, pose.turn * p.normal}; }

/// The points as the exact motion carries them.
Frames carried(const std::vector<Point>& points) {
    Frames frames(cube_frames);
    for (int k = 0; k < cube_frames; ++k)
        for (const Point& p : points) frames[size_t(k)].push_back(posed(p, cube_pose(k)));
    return frames;
}

CubeError error_of(const CubeMesh& mesh, const Frames& frames) {
    std::vector<CubeError> errors(frames.size());
    cooker::parallel_for(frames.size(), 0, [&](size_t k) {
        const Pose pose = cube_pose(double(k));
        std::vector<glm::dvec3> positions, normals;
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const Point p = posed({mesh.positions[v], mesh.normals[v]}, pose);
            positions.push_back(p.position);
            normals.push_back(p.normal);
        }
        errors[k] = {0, 0};
        for (const double d : DecodedField(frames[k]).distances_along(positions, normals)) {
            errors[k].average += d / double(positions.size());
            errors[k].max = std::max(errors[k].max, d);
        }
    });
    CubeError all{0, 0};
    for (const CubeError& e : errors) {
        all.average += e.average / double(errors.size());
        all.max = std::max(all.max, e.max);
    }
    return all;
}

/// birth, death, flags, two numbers of terms, mean position, mean normal; then the coefficients.
uint64_t words_of(const cooker::QuantisedTrack& t) { return 5 + 3 + 2 + t.position.size() + t.second.size(); }

/// Columns: the first `terms` functions 1, x, cos θ, sin θ, cos 2θ … of period 4 on [-1, 1], orthonormal on the samples.
Eigen::MatrixXd extension_basis(int samples, int terms) {
    Eigen::MatrixXd plain(samples, terms);
    for (int s = 0; s < samples; ++s) {
        const double x = 2.0 * s / (samples - 1) - 1;
        for (int k = 0; k < terms; ++k) {
            const double angle = k / 2 * x * pi / 2;
            plain(s, k) = k == 1 ? x : k % 2 == 0 ? std::cos(angle) : std::sin(angle);
        }
    }
    return plain.householderQr().householderQ() * Eigen::MatrixXd::Identity(samples, terms);
}

/// Fewest functions whose series stays within the tolerance at every sample; `signal` becomes that series.
int truncate(const Eigen::MatrixXd& basis, double tolerance, Eigen::MatrixXd& signal) {
    const Eigen::MatrixXd coefficients = basis.transpose() * signal;
    for (int n = 1;; ++n) {
        const Eigen::MatrixXd series = basis.leftCols(n) * coefficients.topRows(n);
        if (n < basis.cols() && (series - signal).rowwise().norm().maxCoeff() > tolerance) continue;
        signal = series;
        return n;
    }
}

}  // namespace

CubeError uncoded_error(const CubeMesh& mesh, const std::vector<Point>& points) {
    return error_of(mesh, carried(points));
}

CubeCost code_in_windows(const CubeMesh& mesh, const std::vector<Point>& points, double rte) {
    constexpr int stride = 60;
    cooker::Quantiser quantiser{};
    quantiser.step = quantiser.normal_step = float(std::min(rte, coarsest_step));
    quantiser.tangent_ratio = 1;
    quantiser.time_tolerance = quantiser.normal_tolerance = float(rte / std::sqrt(3.0));  // of each channel

    Frames decoded = carried(points);
    CubeCost cost{};
    for (int first = 0; first < cube_frames - 1; first += stride) {
        const int last = std::min(first + stride, cube_frames - 1);
        std::vector<cooker::QuantisedTrack> tracks;
        for (const Point& p : points) {
            cooker::TrackSamples samples;
            samples.death = uint8_t(last - first);
            for (int k = first; k <= last; ++k) {
                const Point q = posed(p, cube_pose(k));
                samples.position.emplace_back(q.position);
                samples.normal.emplace_back(q.normal);
            }
            tracks.push_back(cooker::quantise_track(samples, quantiser, glm::vec3(0), tables()));
            cost.words += words_of(tracks.back());
            samples = cooker::dequantise_track(tracks.back(), quantiser, glm::vec3(0), tables());
            const size_t i = tracks.size() - 1;
            for (int k = first; k <= last; ++k)
                decoded[size_t(k)][i] = {samples.position[size_t(k - first)], samples.normal[size_t(k - first)]};
        }
        const uint32_t samples = uint32_t(last - first + 1);
        cost.bytes += cooker::encode_chunk(tracks, quantiser, glm::vec3(0), samples, {}).bytes.size();
    }
    cost.error = error_of(mesh, decoded);
    return cost;
}

CubeCost code_in_one_segment(const CubeMesh& mesh, const std::vector<Point>& points, double rte) {
    static const Eigen::MatrixXd basis = extension_basis(cube_frames, 40);
    Frames frames = carried(points);
    CubeCost cost{};
    for (size_t i = 0; i < points.size(); ++i)
        for (glm::dvec3 Point::*part : {&Point::position, &Point::normal}) {
            Eigen::MatrixXd signal(cube_frames, 3);
            for (int k = 0; k < cube_frames; ++k)
                for (int a = 0; a < 3; ++a) signal(k, a) = (frames[size_t(k)][i].*part)[a];
            cost.words += 1 + 3 * uint64_t(truncate(basis, rte, signal));
            for (int k = 0; k < cube_frames; ++k)
                for (int a = 0; a < 3; ++a) (frames[size_t(k)][i].*part)[a] = signal(k, a);
        }
    cost.error = error_of(mesh, frames);
    return cost;
}

}  // namespace rill::bench
