// SPDX-License-Identifier: MIT
// Between the cooker's QuantisedTrack and the format's lattice.
#pragma once
#include "asset/layers_to_chunks.h"
#include "format/lattice.h"

namespace rill::cooker {

/// Steps as a chunk stores them (tangent_ratio in sixteenths). Throws InputError when they are not sensible.
format::LatticeSteps lattice_steps(const Quantiser& quantiser, const glm::vec3& origin);
/// Throws InputError when the track breaks a bound of the format.
format::RawTrack raw_track(const QuantisedTrack& track);

}  // namespace rill::cooker
