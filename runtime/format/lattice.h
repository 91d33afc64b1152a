// SPDX-License-Identifier: MIT
// The lattice that tracks are quantised on: integer frames from integer axes, and the integers of a track
// turned to asset axes. All integer, so that prediction is the same on every machine; floats come last.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>

#include "format/layout.h"
#include "format/tracks.h"

namespace rill::format {

/// Step of drops' shapes, in 1/256 of that of motion; before version 6.
inline constexpr int32_t fine_shape_unit = 64, coarse_shape_unit = 256;

/// Quantiser steps of a window.
struct LatticeSteps {
    float step;         ///< normal direction, metres; of a life of eight samples, see life_scales
    float normal_step;  ///< normals, radians; likewise
    float origin[3];    ///< the low corner of the file's bounds
    uint16_t ratio;  ///< tangential step / step, in 1/16: 16 … 1024
    float slip_step = 0;  ///< of slip, m/s; 0: points have none
    int32_t shape_unit = fine_shape_unit;
    bool slip_changes = true;  ///< over the life of a point; not before version 8
    bool lone_drops_drift = true;  ///< drops of one sample have a second term of motion: how far they go in a step; not before version 7
};
/// Finite, positive, ratio in range; says nothing else of the values.
bool valid(const LatticeSteps& steps) noexcept;
inline LatticeSteps steps_of(const Header& h, const WindowRecord& w) noexcept {
    return {w.step, w.normal_step, {h.lower[0], h.lower[1], h.lower[2]}, w.ratio, w.slip_step, h.version < version_6 ? coarse_shape_unit : fine_shape_unit,
            h.version >= version_8, h.version >= version_7};
}

/// Largest integer whose square is no more than x.
constexpr int64_t whole_root(int64_t x) {
    int64_t root = 0;
    for (int64_t bit = int64_t(1) << 31; bit > 0; bit >>= 1)
        if ((root + bit) * (root + bit) <= x) root += bit;
    return root;
}
/// How a life of so many samples scales all steps: (8 / samples)^¼, in 1/4096. An error of a long life is seen in many frames.
/// Equal errors in every sample would ask for 1, equal coefficients for (8 / samples)^½; bytes at equal p99 against 1, one clip
/// each of dam_break, drop_splash, pour_sphere: ^¼ −2.5, −.4, −1.3 %, of motion and normals' motion only −2.0, +.6, −1.2 %; ^½ of
/// means and axes −1.3, +.4 %; ^.35 of motion and means −2.4, +1.9 %.
inline constexpr std::array<int32_t, max_window_samples + 1> life_scales = [] {
    std::array<int32_t, max_window_samples + 1> scales{};
    for (uint32_t n = 1; n <= max_window_samples; ++n) scales[n] = int32_t(whole_root(whole_root((int64_t(8) << 48) / n)));
    return scales;
}();
constexpr int32_t life_scale(uint32_t samples) { return life_scales[samples < max_window_samples ? samples : max_window_samples]; }
/// The same as a factor.
constexpr double life_factor(uint32_t samples) { return life_scale(samples) / 4096.0; }

/// Coefficients of the orthonormal basis grow with √samples; these fractions of step · √samples (and
/// normal_step · √samples), scaled by the life, are their quantiser steps. Means (k = 0) use the whole step, scaled likewise.
inline constexpr double position_gain = 0.75, normal_gain = 0.75;

/// Only between coder and lattice: tangential steps equal the step (the normal turns far over the life).
inline constexpr uint8_t track_fine = 8;
/// Only of tracks to be encoded: their slip, but not its change, becomes what the neighbours foretell where that is no more than so many steps off
/// along either axis, for it is the cheapest.
inline constexpr uint8_t track_slips_along = 16;
inline constexpr uint32_t slips_along_within = 2;
inline constexpr int32_t max_symbol = 1 << 20;  ///< no stored integer is larger
inline constexpr int32_t max_mean = 1 << 30;    ///< likewise mean positions, in step/16
inline constexpr int32_t max_slip = 44;         ///< likewise slip: both at once fit Track::slip
inline constexpr uint32_t least_changing_life = 6;  ///< samples; the slip of shorter lives stays as it is

/// The integers of one track. Points: position [term][t1, t2, n] in frame_of(axis), term 0 relative to the
/// lattice point; second [term][t1, t2, n], term 0 unused (the mean normal is the axis). Drops: position
/// [term][xyz] likewise, second [term][6].
struct RawTrack {
    uint8_t birth, death, flags;  ///< flags: TrackFlags | track_fine | track_slips_along
    uint8_t position_terms, second_terms;
    int32_t lattice[3];  ///< tangential steps from the origin
    int32_t axis[2];     ///< octahedral, |u|, |v| ≤ axis_levels
    int32_t position[max_terms][3];
    int32_t second[max_terms][6];
    int32_t slip[2];     ///< of points, along t1, t2, in slip_step, at the middle of the life
    int32_t slip_change[2];  ///< likewise: from there to its end; 0 of lives shorter than least_changing_life
};

/// Levels of one octahedral half axis: neighbouring axes are about normal_step apart, scaled by the life.
int32_t axis_levels(const LatticeSteps& steps, uint32_t life) noexcept;

/// Rows t1, t2, n; unit vectors in 1/16384.
struct Frame {
    int32_t row[3][3];
};
Frame frame_of(const int32_t axis[2], int32_t levels) noexcept;
inline constexpr Frame identity_frame = {{{16384, 0, 0}, {0, 16384, 0}, {0, 0, 16384}}};
/// Integer part; 0 for negatives; exact below 2^62.
int64_t square_root(int64_t x) noexcept;
/// Nearest octahedral integers to a direction (any length, not zero).
void nearest_axis(const double direction[3], int32_t levels, int32_t axis[2]) noexcept;
/// The same in integers only (prediction).
void nearest_axis(const int64_t direction[3], int32_t levels, int32_t axis[2]) noexcept;

/// While a block is being coded its coefficients hold integers: asset axes, in 1/256 of the step of normal
/// coefficients; position term 0 in step/16; second term 0 of points = axis.
inline int32_t load(const float* at) {
    int32_t value;
    std::memcpy(&value, at, sizeof value);
    return value;
}
inline void store(float* at, int32_t value) { std::memcpy(at, &value, sizeof value); }

/// Writes track `index` of the block as such integers from track.first_coefficient on (room: see
/// coefficients_of()). False: a value is too large.
bool place_track(const RawTrack& raw, const LatticeSteps& steps, bool drop, TrackBlock& block, uint32_t index,
                 uint32_t first_coefficient) noexcept;
inline uint32_t coefficients_of(const RawTrack& raw, bool drop) {
    return raw.position_terms * 3u + raw.second_terms * (drop ? 6u : 3u);
}
/// Integers → floats, for all tracks of the block.
void finish_block(const LatticeSteps& steps, TrackBlock& block) noexcept;

}  // namespace rill::format
