// SPDX-License-Identifier: MIT
// One window: frames in, coded tracks out; the loop that drives the stages of pipeline.h.
#pragma once
#include <vector>

#include "pipeline.h"

namespace rill::cooker {

/// What the loop aims at; everything scales with the tolerance.
struct WindowGoal {
    float tolerance = 0;          ///< metres: births where the decoded surface misses the source by more
    Quantiser quantiser{};
    glm::vec3 origin{};
    int jobs = 0;
};
struct CodedWindow {
    std::vector<QuantisedTrack> tracks;   ///< of Window::paths, in their order; then the drops
    std::vector<TrackSamples> decoded;    ///< what each decodes to
    Quantiser quantiser{};                ///< the goal's, with the step of slip
};

/// Fills window.paths: survivors of the window before (points on its last frame) are carried on, then births and
/// corrections alternate until nothing is missed.
void grow_tracks(Window& window, const std::vector<Path>& survivors, const WindowGoal& goal);
/// Quantises the tracks and corrects them against what they decode to.
CodedWindow code_tracks(Window& window, const WindowGoal& goal, const format::BasisTables& tables);
/// Chooses the coefficients of all tracks anew, so that together they decode to the least error for their bits.
void refit_tracks(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables);
/// Those that reach the last sample, as one-sample paths: what the next window continues.
std::vector<Path> survivors_of(const Window& window);
/// Decoded points at a sample; `ids`: the tracks they belong to; `only`: of those.
std::vector<SurfacePoint> decoded_points(const std::vector<TrackSamples>& decoded, int sample, std::vector<uint32_t>* ids = nullptr,
                                         const std::vector<bool>* only = nullptr);

}  // namespace rill::cooker
