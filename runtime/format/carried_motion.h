// SPDX-License-Identifier: MIT
// The polynomials that carry motion from the life of one track to that of another.
#pragma once
#include <cstdint>

#include "format/lattice.h"
#include "format/layout.h"
#include "format/tracks.h"

namespace rill::format {

/// The orthonormal polynomials of degree 1 … 4 on a life's samples, times √samples, in 1/4096: near enough to the first terms of both bases
/// to carry motion from one life to another (of the Fourier extension .99 and more, of cosines .8 and more), and integers on every machine.
/// By the recurrence of Gram's polynomials. Of degree 3 at most: +.2 % bytes (dam_break), +.5 % (drop_splash); 5: −.0, −.1 %.
inline constexpr uint32_t carried_terms = 4;
struct Polynomials {
    static constexpr uint32_t most = max_window_samples;
    int16_t value[most * (most + 1) / 2][carried_terms] = {};
    constexpr const int16_t (*of(uint32_t samples) const)[carried_terms] { return value + samples * (samples - 1) / 2; }
};
constexpr double root(double x) {
    double y = x > 1 ? x : 1;
    for (double next = 0.5 * (y + x / y); next < y; next = 0.5 * (y + x / y)) y = next;
    return y;
}
inline constexpr Polynomials polynomials = [] {
    Polynomials out;
    for (uint32_t n = 2; n <= Polynomials::most; ++n) {
        double unit[carried_terms + 1] = {}, square = 1;  // in 1/4096, of the polynomial of that degree
        for (uint32_t k = 1; k <= carried_terms && k < n; ++k) square *= double(n * n - k * k), unit[k] = 4096 * root((2 * k + 1) / square);
        for (uint32_t s = 0; s < n; ++s) {
            const double u = 2. * s - n + 1;
            double before = 0, now = 1;
            for (uint32_t k = 1; k <= carried_terms; ++k) {
                const double next = ((2. * k - 1) * u * now - (k - 1.) * (double(n) * n - (k - 1.) * (k - 1.)) * before) / k;
                before = now, now = next;
                const double value = now * unit[k];
                out.value[n * (n - 1) / 2 + s][k - 1] = int16_t(value < 0 ? value - 0.5 : value + 0.5);
            }
        }
    }
    return out;
}();
/// Of term k of a basis against the polynomial of that degree.
constexpr int32_t polynomial_sign(uint32_t k, uint32_t flags) { return (flags & track_cosine ? k % 2 == 0 : k == 1 || k == 4) ? 1 : -1; }

}  // namespace rill::format
