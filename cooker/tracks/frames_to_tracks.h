// SPDX-License-Identifier: MIT
// One window: frames in, coded tracks out; the loop that drives the stages of pipeline.h.
#pragma once
#include <vector>

#include "surface/container.h"
#include "tracks/pipeline.h"

namespace rill::cooker {

/// What the loop aims at; everything scales with the tolerance.
struct WindowGoal {
    float tolerance = 0;          ///< metres: births where the decoded surface misses the source by more
    Quantiser quantiser{};
    glm::vec3 origin{};
    surface::Container container = surface::everywhere;  ///< what the runtime will cut the surface off at
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
/// Where the decoded surface is to be: metres outside the source. Walls stay where they are.
struct SurfaceAim {
    std::vector<float> offset;            ///< by sample
    std::vector<float> seam;              ///< of the vertices of sample 0, in addition: from seam_of(), or none
};
/// Most of the way to where the window before left the surface (Window::before): what is off alike on both sides of a border is not seen to jump.
std::vector<float> seam_of(const Window& window, const WindowGoal& goal);
/// Adds to the distances of a sample's vertices (Residual) what makes that the aim.
void aim_at(const SurfaceAim& aim, int sample, const SurfaceFrame& frame, const surface::Container& container, std::vector<float>& distance);
/// Chooses the coefficients of all tracks anew, so that together they decode to the least error for their bits.
void refit_tracks(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables, const SurfaceAim& aim);
/// Steps of mean heights that bring the volume of pieces of few points nearer to the source's.
void refit_volume(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables);
/// Those that reach the last sample, as one-sample paths: what the next window continues.
std::vector<Path> survivors_of(const Window& window);
/// Decoded points at a sample; `ids`: the tracks they belong to; `only`: of those.
std::vector<SurfacePoint> decoded_points(const std::vector<TrackSamples>& decoded, int sample, std::vector<uint32_t>* ids = nullptr,
                                         const std::vector<bool>* only = nullptr);

}  // namespace rill::cooker
