// SPDX-License-Identifier: MIT
// What a decoded chunk is: tracks as Fourier-extension coefficients, ready for evaluation.
// Shared by the cooker (which encodes it) and the runtime (which decodes and evaluates it).
//
// A *point track* is a surface point (position + unit normal) over part of a window.
// Where the liquid is violent it follows the surface, and the liquid slides along under it: by its *slip*, a velocity along
// the surface, which goes as a straight line over the track's life. Point and slip together move as the liquid does. Elsewhere slip is 0.
// A *drop track* is a small closed component: an ellipsoid (centre + symmetric shape matrix S),
// surface = { centre + S u : |u| = 1 }. It costs one track where points would need a dozen. S is positive definite for a
// drop of liquid, negative definite for a bubble: air that it takes out of the liquid around.
//
// Time inside a window is measured in samples: s = 0 is its first frame, s = sample_count − 1 its
// last. A track lives on the closed range [birth, death] of samples. Its channels are
//     c(s) = Σ_k coefficient[k] · φ_k(s − birth),  k < terms,
// at its samples, φ_k the orthonormal Fourier-extension basis of length death − birth + 1, and go on a spline through
// these between them (fourier_extension.h). A track that is born (not carried over the window's border) is also active
// before its birth, one that dies after its death: there it moves along the tangent of its end and its activity falls
// linearly from 1 to 0, a point's within half a sample, a drop's within one. A life of one sample has no tangent; a drop may
// have a second term of motion, φ_1(s) = s, by which it drifts, and its activity falls within half a sample where it has none.
// Elsewhere activity is 1; outside, the track is absent.
#pragma once
#include <cstdint>

namespace rill::format {

enum TrackFlags : uint8_t {
    track_born = 1,   ///< begins here; not set = continues from the previous window (or clip start)
    track_dies = 2,   ///< ends here; not set = lives on in the next window (or clip end)
    track_cosine = 4, ///< basis is the plain cosine (DCT-II) one, for rough motion; else Fourier ext.
};

/// Position (3 channels, metres, asset space, relative to TrackBlock::origin) then
/// normal (3 channels, not unit: normalise after evaluation) or, for a drop, shape
/// (6 channels: xx yy zz xy xz yz, metres).
struct Track {
    uint32_t first_coefficient;  ///< into TrackBlock::coefficients
    uint8_t birth, death, flags;
    uint8_t position_terms;      ///< 1 … life length (2 of a drop of one sample); coefficients stored [term][channel]
    uint8_t second_terms;        ///< normal or shape; stored after the position's, [term][channel]
    int8_t slip[3];              ///< of a point, in TrackBlock::slip_unit, asset axes: at the middle of its life
    int8_t slip_change[3];       ///< likewise: by how much it is more at the end than at the middle; less at the beginning
};
static_assert(sizeof(Track) == 16);

/// Where a sample of a life stands between its beginning (−1) and its end (1). A life of one sample stands in the middle.
inline float place_in_life(const Track& track, double s) {
    if (track.birth >= track.death) return 0;
    const double place = (2 * s - track.birth - track.death) / (track.death - track.birth);
    return float(place < -1 ? -1 : place > 1 ? 1 : place);
}

/// Memory belongs to whoever made it; decoding fills it, evaluation reads it.
struct TrackBlock {
    float origin[3];        ///< added to positions
    float slip_unit;        ///< m/s; 0: no slip
    uint32_t point_count;   ///< tracks [0, point_count) are points
    uint32_t drop_count;    ///< tracks [point_count, point_count + drop_count) are drops
    uint32_t coefficient_count;
    Track* tracks;
    float* coefficients;
};

/// Points and drops at one moment, as structure of arrays. Asset space, metres, metres per second.
/// Capacity is the caller's business; see evaluate_tracks().
struct PointSet {
    uint32_t count;
    float *x, *y, *z;
    float *nx, *ny, *nz;    ///< unit
    float *vx, *vy, *vz;    ///< velocity of the liquid there: the point's, and its slip
    float* activity;        ///< (0, 1]: fading in or out
};
struct DropSet {
    uint32_t count;
    float *x, *y, *z;
    float* shape[6];        ///< xx yy zz xy xz yz
    float *vx, *vy, *vz;
    float* activity;
};

}  // namespace rill::format
