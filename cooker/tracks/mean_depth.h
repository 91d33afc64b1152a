// SPDX-License-Identifier: MIT
// Whether decoded liquid is too thin all over, by less than the distance of single places tells.
#pragma once
#include "frames/surface_frame.h"
#include "surface/container.h"

namespace rill::cooker {

/// How far the decoded surface lies inside the source's on average: metres, negative outside. By what volume is missing in the
/// container; but liquid that is lost, or that nobody has, says nothing of where the rest lies, so that no more than a 50th of an edge of it, nor
/// than .25 % of the volume, goes beyond the distance where the two are near each other. (In a splash of particles a void in one frame, mended later, had taken 1 %
/// of its volume.)
float mean_depth(const SurfaceFrame& frame, const Mesh& decoded, const surface::Container& container, int jobs);

}  // namespace rill::cooker
