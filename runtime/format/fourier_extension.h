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

/// Most useful number of functions for a life of `samples`: above half, extensions explode between
/// samples near the ends (measured 1e8); cosines may use all.
uint32_t most_terms(uint32_t samples, bool cosine) noexcept;

/// Orthonormalising matrices for every life length up to `longest`; a few ms to build, then read only.
struct BasisTables {
    const double* matrix;
    uint32_t longest;
};
size_t basis_tables_bytes(uint32_t longest) noexcept;
/// `memory` must outlive the tables; 16-byte aligned.
void build_basis_tables(BasisTables& tables, void* memory, uint32_t longest) noexcept;

/// Values φ_0 … φ_{terms−1} of the basis of length `samples` at time s (in samples, 0 … samples − 1;
/// real), and derivatives dφ/ds (may be null). terms ≤ most_terms(). For s outside [0, samples − 1]
/// the tangent line at the end is continued.
void basis_row(const BasisTables& tables, uint32_t samples, bool cosine, double s, uint32_t terms,
               float* value, float* derivative) noexcept;

}  // namespace rill::format
