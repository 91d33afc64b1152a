// SPDX-License-Identifier: MIT
// The span is that of 1, x, cos θ, sin θ, cos 2θ, … with θ = πx/2 (T = 2), taken in that order, but the
// functions that are orthonormalised are 1, x, T_k(2y − 1), sin θ · T_{k−1}(2y − 1) with y = cos θ: cos kθ
// is a polynomial of degree k in y and sin kθ is sin θ times one of degree k − 1, and on y ∈ [0, 1]
// shifted Chebyshev polynomials are well conditioned where the plain cosines are not. The linear function
// stands second because most liquid moves at a nearly constant velocity over most of a life: a straight
// line takes two terms instead of six (test_fourier.cpp has the figures).
#include "format/fourier_extension.h"

#include <array>
#include <cmath>

#include "format/layout.h"

namespace rill::format {
namespace {

constexpr double pi = 3.14159265358979323846;

/// Half the samples and one. Beyond 24 (lives of 48 samples) the functions lose orthogonality in double.
constexpr uint32_t extension_terms(uint32_t samples) {
    const uint32_t half = samples < 2 ? samples : samples / 2 + 1;
    return half < 24 ? half : 24;
}
constexpr uint32_t triangle(uint32_t n) { return n * (n + 1) / 2; }

constexpr auto table_offsets = [] {
    std::array<uint32_t, max_window_samples + 2> offset{};
    for (uint32_t n = 1; n <= max_window_samples; ++n)
        offset[n + 1] = offset[n] + triangle(extension_terms(n));
    return offset;
}();

/// The functions before orthonormalisation, at a sample.
void plain_row(uint32_t samples, uint32_t sample, uint32_t terms, double* g) {
    const double x = samples > 1 ? sample * (2.0 / (samples - 1)) - 1.0 : 0.0;
    const double sine = std::sin(x * (pi / 2)), y = std::cos(x * (pi / 2)), z = 2 * y - 1;
    g[0] = 1;
    if (terms > 1) g[1] = x;
    double t0 = 1, t1 = z;  // T_{k−1}, T_k
    for (uint32_t i = 2; i < terms; ++i) {
        if (i % 2 == 0) {
            g[i] = t1;
        } else {
            g[i] = sine * t0;
            const double t2 = 2 * z * t1 - t0;
            t0 = t1, t1 = t2;
        }
    }
}

/// cos kθ by Chebyshev's recurrence: one cosine a sample, not one a term.
void cosine_row(uint32_t samples, uint32_t sample, uint32_t terms, double* value) {
    const double first = std::cos(pi * (sample + 0.5) / samples), scale = std::sqrt(2.0 / samples);
    double t0 = scale, t1 = scale * first;
    value[0] = std::sqrt(1.0 / samples);
    for (uint32_t k = 1; k < terms; ++k) {
        value[k] = t1;
        const double t2 = 2 * first * t1 - t0;
        t0 = t1, t1 = t2;
    }
}

/// Four samples that a spline goes by at a moment: what each has of its value and of its slope.
struct Knots {
    uint32_t first;  ///< of the four; those beyond the ends have no share
    double value[4] = {}, slope[4] = {};
};
Knots knots_at(uint32_t samples, double s, const StepRatios& steps) {
    const uint32_t last = samples - 1;
    if (s < 0) return {0, {1 - s / steps.after, s / steps.after}, {-1 / steps.after, 1 / steps.after}};
    if (s >= last) {
        const double beyond = (s - last) / steps.before;
        return {last - 1, {-beyond, 1 + beyond}, {-1 / steps.before, 1 / steps.before}};
    }
    const uint32_t low = uint32_t(s);
    const bool starts = low == 0, ends = low + 1 == last;
    Knots knots{starts ? 0 : low - 1};
    const auto share = [&](uint32_t sample, double of_value, double of_slope) {
        knots.value[sample - knots.first] += of_value, knots.slope[sample - knots.first] += of_slope;
    };
    const auto difference = [&](uint32_t to, double per_step, double of_value, double of_slope) {  // of two samples, in units of this step
        share(to, of_value * per_step, of_slope * per_step), share(to - 1, -of_value * per_step, -of_slope * per_step);
    };
    // Hermite's cubic, of the samples at both ends and the slopes there, and its derivative.
    const double f = s - low, rest = 1 - f;
    share(low, (1 + 2 * f) * rest * rest, -6 * f * rest), share(low + 1, f * f * (3 - 2 * f), 6 * f * rest);
    const double value[2] = {f * rest * rest, -f * f * rest}, slope[2] = {rest * (1 - 3 * f), f * (3 * f - 2)};
    // A slope is the mean of those of the steps on both sides, the shorter step's counting more; at an end that of the only one.
    const double before = starts ? 0 : 1 / (1 + steps.before), after = ends ? 0 : 1 / (1 + steps.after);
    difference(low + 1, 1 - before, value[0], slope[0]), difference(low + 1, 1 - after, value[1], slope[1]);
    if (!starts) difference(low, before / steps.before, value[0], slope[0]);
    if (!ends) difference(low + 2, after / steps.after, value[1], slope[1]);
    return knots;
}

/// Applies the first `terms` rows of the orthonormalisation to the plain functions, in place. Each function
/// is made from those before it, never from the plain ones directly: that would cancel.
void orthonormal_row(const double* rows, uint32_t terms, double* g) {
    for (uint32_t j = 0; j < terms; rows += ++j) {
        double sum = g[j];
        for (uint32_t i = 0; i < j; ++i) sum -= rows[i] * g[i];
        g[j] = sum * rows[j];
    }
}

/// Rows of the length: row j holds the j projections, then 1 / norm.
void orthonormalise(uint32_t samples, double* rows) {
    const uint32_t terms = extension_terms(samples);
    double g[max_window_samples][max_terms];
    for (uint32_t s = 0; s < samples; ++s) plain_row(samples, s, terms, g[s]);
    for (uint32_t j = 0; j < terms; ++j) {
        double* row = rows + triangle(j);
        for (uint32_t i = 0; i < j; ++i) row[i] = 0;
        for (int pass = 0; pass < 3; ++pass)  // twice is enough (Kahan); the third costs nothing
            for (uint32_t i = 0; i < j; ++i) {
                double dot = 0;
                for (uint32_t s = 0; s < samples; ++s) dot += g[s][i] * g[s][j];
                for (uint32_t s = 0; s < samples; ++s) g[s][j] -= dot * g[s][i];
                row[i] += dot;
            }
        double norm = 0;
        for (uint32_t s = 0; s < samples; ++s) norm += g[s][j] * g[s][j];
        row[j] = 1 / std::sqrt(norm);
        for (uint32_t s = 0; s < samples; ++s) g[s][j] *= row[j];
    }
}

}  // namespace

uint32_t most_terms(uint32_t samples, bool cosine) noexcept {
    if (!cosine) return extension_terms(samples);
    return samples < max_terms ? samples : max_terms;
}

size_t basis_tables_bytes(uint32_t longest) noexcept {
    return table_offsets[(longest < max_window_samples ? longest : max_window_samples) + 1] * sizeof(double);
}

void build_basis_tables(BasisTables& tables, void* memory, uint32_t longest) noexcept {
    double* const matrix = static_cast<double*>(memory);
    tables = {matrix, longest < max_window_samples ? longest : max_window_samples};
    for (uint32_t n = 1; n <= tables.longest; ++n) orthonormalise(n, matrix + table_offsets[n]);
}

void basis_row(const BasisTables& tables, uint32_t samples, bool cosine, uint32_t sample, uint32_t terms, float* value) noexcept {
    double v[max_terms];
    if (samples == 1) {
        v[0] = 1, v[1] = 0;
    } else if (cosine) {
        cosine_row(samples, sample, terms, v);
    } else {
        plain_row(samples, sample, terms, v);
        orthonormal_row(tables.matrix + table_offsets[samples], terms, v);
    }
    for (uint32_t k = 0; k < terms; ++k) value[k] = float(v[k]);
}

void spline_row(const BasisTables& tables, uint32_t samples, bool cosine, double s, const StepRatios& steps, uint32_t terms, float* value,
                float* derivative) noexcept {
    if (samples == 1) {
        value[0] = 1, derivative[0] = 0;
        if (terms > 1) value[1] = float(s), derivative[1] = 1;
        return;
    }
    const Knots knots = knots_at(samples, s, steps);
    double v[max_terms] = {}, d[max_terms] = {}, at[max_terms];
    for (uint32_t i = 0; i < 4; ++i) {
        if (knots.value[i] == 0 && knots.slope[i] == 0) continue;
        (cosine ? cosine_row : plain_row)(samples, knots.first + i, terms, at);
        for (uint32_t k = 0; k < terms; ++k) v[k] += knots.value[i] * at[k], d[k] += knots.slope[i] * at[k];
    }
    if (!cosine) {
        const double* rows = tables.matrix + table_offsets[samples];
        orthonormal_row(rows, terms, v);
        orthonormal_row(rows, terms, d);  // linear: sums of rows become the sums of what they become
    }
    for (uint32_t k = 0; k < terms; ++k) value[k] = float(v[k]), derivative[k] = float(d[k]);
}

}  // namespace rill::format
