// SPDX-License-Identifier: MIT
// What choosing the integers of a track shares, however they are chosen.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "asset/lattice_tracks.h"

namespace rill::cooker {

/// One basis on one life, as rows of values per sample.
struct Basis {
    uint32_t samples, terms;
    bool cosine;
    std::vector<std::array<float, format::max_terms>> row;

    Basis(const format::BasisTables& tables, uint32_t life, bool plain)
        : samples(life), terms(format::most_terms(life, plain)), cosine(plain), row(life) {
        for (uint32_t s = 0; s < samples; ++s)
            format::basis_row(tables, samples, cosine, s, terms, row[s].data());
    }
};

/// Integers by term and channel.
template <size_t channels>
using Rows = std::array<std::array<int32_t, channels>, format::max_terms>;

template <size_t channels>
uint32_t terms_used(const Rows<channels>& rows) {
    uint32_t terms = format::max_terms;
    while (terms > 1 &&
           std::all_of(rows[terms - 1].begin(), rows[terms - 1].end(), [](int32_t v) { return v == 0; }))
        --terms;
    return terms;
}
template <size_t channels>
std::vector<int32_t> flattened(const Rows<channels>& rows) {
    std::vector<int32_t> out;
    for (uint32_t k = 0; k < terms_used(rows); ++k) out.insert(out.end(), rows[k].begin(), rows[k].end());
    return out;
}

/// The frame that a track's coefficients are along.
struct FrameAxes {
    glm::dvec3 t1, t2, n;
};
inline FrameAxes axes_of(const int32_t axis[2], int32_t levels) {
    const format::Frame f = format::frame_of(axis, levels);
    const auto row = [&](int r) { return glm::dvec3(f.row[r][0], f.row[r][1], f.row[r][2]) / 16384.0; };
    return {row(0), row(1), row(2)};
}

/// Steps of a life of so many samples: of its mean place along the normal and of its motion (k > 0) there, metres, and of its normals' motion.
inline double mean_step(const format::LatticeSteps& steps, uint32_t life) {
    return steps.step * format::life_factor(life);
}
inline double motion_step(const format::LatticeSteps& steps, uint32_t life) {
    return mean_step(steps, life) * std::sqrt(double(life)) * format::position_gain;
}
/// Of a drop's shape.
inline double shape_step(const format::LatticeSteps& steps, uint32_t life) {
    return motion_step(steps, life) * steps.shape_unit / 256;
}
inline double turn_step(const format::LatticeSteps& steps, uint32_t life) {
    return steps.normal_step * format::life_factor(life) * std::sqrt(double(life)) * format::normal_gain;
}

/// Bits of a coefficient, roughly.
inline double cost_of(int32_t v) { return v == 0 ? 0.3 : 2 + 1.6 * std::log2(std::abs(double(v))); }

}  // namespace rill::cooker
