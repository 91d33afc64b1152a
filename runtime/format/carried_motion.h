// SPDX-License-Identifier: MIT
// The polynomials that carry motion from the life of one track to that of another.
#pragma once
#include <cstdint>

#include "format/lattice.h"
#include "format/layout.h"
#include "format/tracks.h"

namespace rill::format {

/// The orthonormal polynomials of degree 1 … 3 on a life's samples, times √samples, in 1/4096: near enough to the
/// first terms of both bases to carry motion from one life to another, and integers on every machine.
inline constexpr uint32_t carried_terms = 3;
struct Polynomials {
    static constexpr uint32_t most = max_window_samples;
    int16_t value[most * (most + 1) / 2][carried_terms] = {};
    constexpr const int16_t (*of(uint32_t samples) const)[carried_terms] { return value + samples * (samples - 1) / 2; }
};
inline constexpr Polynomials polynomials = [] {
    Polynomials out;
    for (int64_t n = 2; n <= Polynomials::most; ++n) {
        const int64_t one = n * n - 1, two = one * (n * n - 4), three = two * (n * n - 9), unit = int64_t(1) << 60;
        const int64_t norm[3] = {whole_root(3 * unit / one), n > 2 ? whole_root(5 * unit / (4 * two)) : 0,
                                 n > 3 ? whole_root(7 * unit / (4 * three)) : 0};
        for (int64_t s = 0; s < n; ++s) {
            const int64_t u = 2 * s - n + 1;
            const int64_t p[3] = {u, 3 * u * u - one, 5 * u * u * u - u * (3 * n * n - 7)};
            for (int k = 0; k < 3; ++k) out.value[n * (n - 1) / 2 + s][k] = int16_t((p[k] * norm[k] + (1 << 17)) >> 18);
        }
    }
    return out;
}();
/// Of term k of a basis against the polynomial of that degree.
constexpr int32_t polynomial_sign(uint32_t k, uint32_t flags) { return (flags & track_cosine ? k == 2 : k == 1) ? 1 : -1; }

}  // namespace rill::format
