// SPDX-License-Identifier: MIT
// The time basis: Fourier extensions, orthonormal on a track's samples.
//
// A Fourier series of period 2T fitted on [−1, 1] ⊂ [−T, T] has no wrap-around to mend (Adcock,
// Huybrechs & Martín-Vaquero, "On the numerical stability of Fourier extensions", FoCM 14(4), 2014).
// Its raw coefficients reach 1e5 × the signal; here the functions 1, cos, sin, cos 2, … are
// orthonormalised on the samples in that order (nested: the first n span the same space for every n),
// so a coefficient's quantisation error is the signal's, and truncation is least squares.
#pragma once
#include <cstddef>
#include <cstdint>

namespace rill::format {

/// Most functions for a life of `samples`: extensions are for smooth motion, half the samples and one (all of them in lives of
/// up to twelve: −.6 and +.3 % bytes of frames 25:50 of dam_break and pour_sphere); cosines may use all.
uint32_t most_terms(uint32_t samples, bool cosine) noexcept;

/// Orthonormalising matrices for every life length up to `longest`; a few ms to build, then read only.
struct BasisTables {
    const double* matrix;
    uint32_t longest;
};
size_t basis_tables_bytes(uint32_t longest) noexcept;
/// `memory` must outlive the tables; 16-byte aligned.
void build_basis_tables(BasisTables& tables, void* memory, uint32_t longest) noexcept;

/// Values φ_0 … φ_{terms−1} of the basis of length `samples` at one of its samples. terms ≤ most_terms(); of one sample up to 2: 1 and s, by
/// which drops drift.
void basis_row(const BasisTables& tables, uint32_t samples, bool cosine, uint32_t sample, uint32_t terms, float* value) noexcept;

/// How long the steps from sample to sample before and after the one that begins at ⌊s⌋ take, in units of that one.
struct StepRatios {
    double before = 1, after = 1;  ///< 1: frames are evenly spaced in time
};
/// What a track does at any real time s, in samples: rows of the spline through what it is at its samples (Catmull & Rom 1974, slopes as
/// of parabolas through three samples where these are uneven in time: what moves evenly does so whatever the times of frames), and derivatives by s.
/// At a sample the values are basis_row(), to the bit. For s outside [0, samples − 1] the tangent line at the end is continued.
///
/// Not the functions themselves: most series of violent liquid hold as many terms as samples, and such functions swing between
/// them as far as any noise lets them. Figures, and what else was tried: cooker/README.md, "Between frames".
void spline_row(const BasisTables& tables, uint32_t samples, bool cosine, double s, const StepRatios& steps, uint32_t terms, float* value,
                float* derivative) noexcept;

}  // namespace rill::format
