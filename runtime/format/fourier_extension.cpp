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

/// Half the samples and one. Beyond 24 (lives of 48 samples) the functions lose orthogonality in double, and
/// the Lebesgue constant, 3.3 at 25 samples, passes 16.
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

/// The functions before orthonormalisation and their derivatives by s, at s in [0, samples − 1].
void plain_row(uint32_t samples, double s, uint32_t terms, double* g, double* dg) {
    const double dx = samples > 1 ? 2.0 / (samples - 1) : 0.0;
    const double x = samples > 1 ? s * dx - 1.0 : 0.0;
    const double sine = std::sin(x * (pi / 2)), y = std::cos(x * (pi / 2));
    const double dsine = y * (pi / 2) * dx, dz = -2 * sine * (pi / 2) * dx, z = 2 * y - 1;
    g[0] = 1, dg[0] = 0;
    if (terms > 1) g[1] = x, dg[1] = dx;
    double t0 = 1, d0 = 0, t1 = z, d1 = dz;  // T_{k−1}, T_k and their derivatives
    for (uint32_t i = 2; i < terms; ++i) {
        if (i % 2 == 0) {
            g[i] = t1, dg[i] = d1;
        } else {
            g[i] = sine * t0, dg[i] = dsine * t0 + sine * d0;
            const double t2 = 2 * z * t1 - t0, d2 = 2 * (dz * t1 + z * d1) - d0;
            t0 = t1, d0 = d1, t1 = t2, d1 = d2;
        }
    }
}

void cosine_row(uint32_t samples, double s, uint32_t terms, double* value, double* derivative) {
    const double step = pi / samples;
    for (uint32_t k = 0; k < terms; ++k) {
        const double scale = std::sqrt((k ? 2.0 : 1.0) / samples);
        value[k] = scale * std::cos(step * k * (s + 0.5));
        derivative[k] = -scale * step * k * std::sin(step * k * (s + 0.5));
    }
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
    double g[max_window_samples][max_terms], unused[max_terms];
    for (uint32_t s = 0; s < samples; ++s) plain_row(samples, s, terms, g[s], unused);
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

void basis_row(const BasisTables& tables, uint32_t samples, bool cosine, double s, uint32_t terms,
               float* value, float* derivative) noexcept {
    const double end = samples - 1.0, inside = s < 0 ? 0 : s > end ? end : s, beyond = s - inside;
    double v[max_terms], d[max_terms];
    if (cosine) {
        cosine_row(samples, inside, terms, v, d);
    } else {
        plain_row(samples, inside, terms, v, d);
        const double* rows = tables.matrix + table_offsets[samples];
        orthonormal_row(rows, terms, v);
        orthonormal_row(rows, terms, d);  // linear: derivatives combine as the functions do
    }
    for (uint32_t k = 0; k < terms; ++k) {
        value[k] = float(v[k] + beyond * d[k]);
        if (derivative) derivative[k] = float(d[k]);
    }
}

}  // namespace rill::format
