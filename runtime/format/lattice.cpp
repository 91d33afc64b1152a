// SPDX-License-Identifier: MIT
#include "format/lattice.h"

#include <cmath>

namespace rill::format {
namespace {

constexpr int64_t one = 16384;

int64_t rounded(int64_t a, int64_t b) { return a >= 0 ? (a + b / 2) / b : -((-a + b / 2) / b); }
int64_t sign_of(int64_t a) { return a < 0 ? -1 : 1; }
int64_t magnitude(int64_t a) { return a < 0 ? -a : a; }

/// Octahedral integers → direction of any length.
void unfold(const int32_t axis[2], int32_t levels, int64_t out[3]) {
    int64_t u = axis[0], v = axis[1];
    const int64_t z = levels - magnitude(u) - magnitude(v);
    if (z < 0) {
        const int64_t fold = (levels - magnitude(v)) * sign_of(u);
        v = (levels - magnitude(u)) * sign_of(v);
        u = fold;
    }
    out[0] = u, out[1] = v, out[2] = z;
}

/// Along t1, t2 → asset axes, in half steps. False: too large.
bool place_slip(const int32_t (&along)[2], const Frame& frame, int8_t (&out)[3]) {
    for (int c = 0; c < 3; ++c) {
        const int64_t slip = rounded(2 * (int64_t(along[0]) * frame.row[0][c] + int64_t(along[1]) * frame.row[1][c]), one);
        if (magnitude(slip) > 127) return false;
        out[c] = int8_t(slip);
    }
    return true;
}

}  // namespace

int64_t square_root(int64_t x) noexcept {
    if (x <= 0) return 0;
    int64_t root = int64_t(std::sqrt(double(x)));  // nearly; made exact whatever the machine's root is
    while (root * root > x) --root;
    while ((root + 1) * (root + 1) <= x) ++root;
    return root;
}

bool valid(const LatticeSteps& steps) noexcept {
    bool good = std::isfinite(steps.step) && steps.step > 1e-30f && steps.step < 1e15f &&
                std::isfinite(steps.normal_step) && steps.normal_step > 1e-5f && steps.normal_step < 4.f &&
                steps.ratio >= 16 && steps.ratio <= 1024 && steps.slip_step >= 0 && steps.slip_step < 1e15f;
    for (const float x : steps.origin) good = good && std::isfinite(x) && std::fabs(x) < 1e30f;
    return good;
}

int32_t axis_levels(const LatticeSteps& steps, uint32_t life) noexcept {
    const double levels = 1.8 / (steps.normal_step * life_factor(life));
    return levels < 4 ? 4 : levels > 4096 ? 4096 : int32_t(levels + 0.5);
}

Frame frame_of(const int32_t axis[2], int32_t levels) noexcept {
    int64_t n[3];
    unfold(axis, levels, n);
    for (int64_t& x : n) x *= 4096;  // so that the root has bits to spare
    const int64_t length = square_root(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int64_t& x : n) x = length ? rounded(x * one, length) : 0;
    if (!length) n[2] = one;
    // Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    const int64_t s = sign_of(n[2]), d = one + magnitude(n[2]);  // 1 + |z|: never small
    Frame f;
    f.row[0][0] = int32_t(one - rounded(n[0] * n[0], d));
    f.row[0][1] = int32_t(-rounded(n[0] * n[1], d));
    f.row[0][2] = int32_t(-s * n[0]);
    f.row[1][0] = int32_t(-s * rounded(n[0] * n[1], d));
    f.row[1][1] = int32_t(s * (one - rounded(n[1] * n[1], d)));
    f.row[1][2] = int32_t(-n[1]);
    for (int c = 0; c < 3; ++c) f.row[2][c] = int32_t(n[c]);
    return f;
}

void nearest_axis(const int64_t direction[3], int32_t levels, int32_t axis[2]) noexcept {
    const int64_t sum = magnitude(direction[0]) + magnitude(direction[1]) + magnitude(direction[2]);
    if (sum == 0) {
        axis[0] = axis[1] = 0;
        return;
    }
    int64_t u = rounded(direction[0] * levels, sum), v = rounded(direction[1] * levels, sum);
    if (direction[2] < 0) {
        const int64_t fold = (levels - magnitude(v)) * sign_of(u);
        v = (levels - magnitude(u)) * sign_of(v);
        u = fold;
    }
    axis[0] = int32_t(u), axis[1] = int32_t(v);
}

void nearest_axis(const double direction[3], int32_t levels, int32_t axis[2]) noexcept {
    const double length =
        std::sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    int64_t scaled[3] = {0, 0, 0};
    if (length > 0)
        for (int c = 0; c < 3; ++c) scaled[c] = std::llround(direction[c] / length * 1e9);
    nearest_axis(scaled, levels, axis);
}

namespace {

/// Integer components in a frame, of `across` sixteenths of a step along the surface and `along` the normal → asset axes, in 1/256 of a step.
bool to_asset(const int32_t value[3], const Frame& frame, int64_t across, int64_t along, float* out) {
    for (int c = 0; c < 3; ++c) {
        const int64_t sum =
            (int64_t(value[0]) * frame.row[0][c] + int64_t(value[1]) * frame.row[1][c]) * across +
            int64_t(value[2]) * frame.row[2][c] * along;
        const int64_t scaled = rounded(sum, 1024);  // 1/16 · 1/16384 → 1/256
        if (magnitude(scaled) > (int64_t(1) << 30)) return false;
        store(out + c, int32_t(scaled));
    }
    return true;
}

}  // namespace

bool place_track(const RawTrack& raw, const LatticeSteps& steps, bool drop, TrackBlock& block, uint32_t index,
                 uint32_t first_coefficient) noexcept {
    Track& track = block.tracks[index];
    track = {};
    track.first_coefficient = first_coefficient;
    track.birth = raw.birth, track.death = raw.death;
    track.flags = uint8_t(raw.flags & (track_born | track_dies | track_cosine));
    track.position_terms = raw.position_terms, track.second_terms = raw.second_terms;

    const uint32_t life = raw.death - raw.birth + 1u;
    const Frame frame = drop ? identity_frame : frame_of(raw.axis, axis_levels(steps, life));
    const int64_t ratio = drop || (raw.flags & track_fine) ? 16 : steps.ratio;
    float* out = block.coefficients + first_coefficient;
    for (int c = 0; c < 3; ++c) {
        const int64_t offset =
            (int64_t(raw.position[0][0]) * frame.row[0][c] + int64_t(raw.position[0][1]) * frame.row[1][c]) *
                ratio +
            int64_t(raw.position[0][2]) * frame.row[2][c] * 16;
        const int64_t mean = int64_t(raw.lattice[c]) * steps.ratio + rounded(offset * life_scale(life), int64_t(16384) << 12);
        if (magnitude(mean) > max_mean) return false;
        store(out + c, int32_t(mean));
    }
    const bool drifts = drop && life == 1;  // how far a drop goes within a step need not be known as well as where it is
    for (uint32_t k = 1; k < raw.position_terms; ++k)
        if (!to_asset(raw.position[k], frame, drifts ? steps.ratio : ratio, drifts ? steps.ratio : 16, out + 3 * k)) return false;
    if (!drop && !(place_slip(raw.slip, frame, track.slip) && place_slip(raw.slip_change, frame, track.slip_change))) return false;
    out += 3 * raw.position_terms;
    if (drop) {
        for (uint32_t k = 0; k < raw.second_terms; ++k)
            for (int c = 0; c < 6; ++c) store(out + 6 * k + c, raw.second[k][c] * steps.shape_unit);
        return true;
    }
    store(out, raw.axis[0]), store(out + 1, raw.axis[1]), store(out + 2, 0);
    for (uint32_t k = 1; k < raw.second_terms; ++k)
        if (!to_asset(raw.second[k], frame, 16, 16, out + 3 * k)) return false;
    return true;
}

void finish_block(const LatticeSteps& steps, TrackBlock& block) noexcept {
    for (int c = 0; c < 3; ++c) block.origin[c] = steps.origin[c];
    block.slip_unit = steps.slip_step / 2;
    const uint32_t count = block.point_count + block.drop_count;
    for (uint32_t i = 0; i < count; ++i) {
        const Track& track = block.tracks[i];
        const bool drop = i >= block.point_count;
        const uint32_t life = track.death - track.birth + 1u;
        const double root = std::sqrt(double(life));
        const int32_t levels = axis_levels(steps, life);
        const double scaled_root = root * life_factor(life);
        const double position_step = steps.step * scaled_root * position_gain / 256;
        const double second_step =
            (drop ? double(steps.step) * position_gain : steps.normal_step * normal_gain) * scaled_root / 256;
        float* at = block.coefficients + track.first_coefficient;
        for (int c = 0; c < 3; ++c, ++at) *at = float(load(at) * (steps.step * root / 16));
        for (uint32_t k = 3; k < track.position_terms * 3u; ++k, ++at) *at = float(load(at) * position_step);
        const uint32_t channels = drop ? 6 : 3, skip = drop ? 0 : 3;
        if (!drop) {
            const int32_t axis[2] = {load(at), load(at + 1)};
            const Frame frame = frame_of(axis, levels);
            for (int c = 0; c < 3; ++c, ++at) *at = float(frame.row[2][c] * (root / 16384));
        }
        for (uint32_t k = skip; k < track.second_terms * channels; ++k, ++at)
            *at = float(load(at) * second_step);
    }
}

}  // namespace rill::format
