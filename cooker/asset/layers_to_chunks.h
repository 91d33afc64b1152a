// SPDX-License-Identifier: MIT
// Tracks → quantised tracks → chunk bytes. Quantisation is on a fixed lattice, so what a track decodes to
// does not depend on its neighbours or its place in the chunk; prediction and entropy coding of the
// integers are lossless.
#pragma once
#include <cstdint>
#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "format/chunk_decoder.h"
#include "format/fourier_extension.h"

namespace rill::cooker {

/// One track as the tracker made it: one value per sample of its life, birth … death.
struct TrackSamples {
    uint8_t birth = 0, death = 0, flags = 0;   ///< format::TrackFlags without track_cosine
    bool drop = false;
    std::vector<glm::vec3> position;           ///< asset space, metres
    std::vector<glm::vec3> normal;             ///< points: unit
    std::vector<std::array<float, 6>> shape;   ///< drops: xx yy zz xy xz yz, metres
    glm::vec3 drift{};                         ///< drops of one sample: how far they go from that to the next, metres
    glm::vec3 slip{};                          ///< points: mean velocity of the liquid past the track, m/s; along the surface counts
    glm::vec3 slip_change{};                   ///< likewise: how much faster at the end of its life than at the middle
};
struct Quantiser {
    float step;             ///< along the normal, metres: the lattice of what shows; decoded rms error ≈ .4 of it
    float tangent_ratio;    ///< tangential step / step (≥ 1): slack that does not show
    float normal_step;      ///< of normals, radians
    /// RTE: most error along the normal a truncated series may leave, metres. Cheapest at .6 … 1 × step: at 4 ×
    /// step and equal rms error a track costs a quarter more.
    float time_tolerance;
    float normal_tolerance; ///< likewise for normals, radians; cheapest at about 1 × normal_step
    float slip_step = 0;    ///< of slip, m/s; 0: none is kept
};
/// Integers on the lattice of a Quantiser.
struct QuantisedTrack {
    uint8_t birth, death, flags;      ///< flags: TrackFlags | format::track_fine | format::track_slips_along
    bool drop;
    int32_t lattice[3];               ///< mean position / tangential step, from the origin
    int32_t axis[2];                  ///< mean normal, octahedral (points)
    std::vector<int32_t> position;    ///< [term][t1, t2, n] in the frame of axis; drops: [term][xyz]
    std::vector<int32_t> second;      ///< normals [term][3] in that frame, or shape [term][6]
    int32_t slip[2] = {0, 0}, slip_change[2] = {0, 0};  ///< in that frame, in slip_step
};
/// Offset along `axis` (unit) that brings x at the given sample of life onto the source surface; NaN: cannot say.
using ProjectAlong = std::function<float(uint32_t sample, const glm::vec3& x, const glm::vec3& axis)>;

/// Fits Fourier extensions (fewest terms that meet the tolerances; cosines where they are cheaper or the only way
/// to meet them), quantises. Throws InputError for NaN, and for motion too large for the step. When `project` is given the
/// tangential part is quantised first and the part along the axis is then fitted anew to where the
/// surface is under the moved point: tangential slack costs no error.
QuantisedTrack quantise_track(const TrackSamples& track, const Quantiser& quantiser,
                              const glm::vec3& origin, const format::BasisTables& tables,
                              const ProjectAlong& project = {});
/// Quantises slip and slip_change of a track of points anew; the rest stays.
void set_slip(QuantisedTrack& track, const TrackSamples& samples, const Quantiser& quantiser, const glm::vec3& origin);
/// What a decoder makes of the quantised track at its samples (normals unit).
TrackSamples dequantise_track(const QuantisedTrack& track, const Quantiser& quantiser,
                              const glm::vec3& origin, const format::BasisTables& tables);

/// What the track will cost, in bits, roughly.
float rough_bits(const QuantisedTrack& track);

/// Where the bytes went, in bits (fractional: from the coder's probabilities).
struct ChunkBits {
    double structure = 0, births = 0, motion = 0, normals = 0, slip = 0, drops = 0;
};
struct EncodedChunk {
    std::vector<uint8_t> bytes;
    format::ChunkShape shape{};
    ChunkBits bits;
};
/// Deterministic; the tracks may come in any order (they are sorted along a space-filling curve).
EncodedChunk encode_chunk(const std::vector<QuantisedTrack>& tracks, const Quantiser& quantiser,
                          const glm::vec3& origin, uint32_t window_samples,
                          const std::vector<uint8_t>& model);

}  // namespace rill::cooker
