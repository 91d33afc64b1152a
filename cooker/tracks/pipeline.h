// SPDX-License-Identifier: MIT
// The cook of a window, top to bottom, with what passes between its stages; in this folder where no other is named:
//
//   frames/cut_to_closed          what was cut off at the sides of the domain is closed there, as the frames are read
//   frames_to_drops               small pieces that are nearly ellipsoids become tracks of ellipsoids; and in the end those that points lose
//   frames/walls                  what lies flat in a wall goes through it: the runtime cuts it off there
//   frames/split_edges            long edges are halved: all that follows is measured and held at vertices
//   frames_to_samples             where the surface decoded so far is wrong, new points are born
//   frames/surface_motion         how each surface moves onto the next
//   samples_to_tracks             points are carried through the window's frames by that motion, held to the surface
//   tracks_to_surface             what the tracks decode to, measured at every source vertex; corrections
//   points_to_repairs             what coding has torn is mended, by trial; torn_necks.h finds what is thin but holds pieces together
//   asset/tracks_to_coefficients  Fourier extensions on a quantiser's lattice (layers_to_chunks.h)
//   refit_tracks                  coefficients chosen anew, against the surface that all tracks decode to together
//   refit_volume                  heights of the points of small pieces go by a step, until the volume is the source's
//   necks_to_drops                necks that are torn for all that are held by drops, and pieces parted
//   spurs_to_drops                fingers that are lost, or false, likewise
//   coefficients_to_layers        progressive order, blocks
//   asset/layers_to_chunks        entropy coding
//   asset/chunks_to_asset         the file
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "asset/layers_to_chunks.h"
#include "format/layout.h"
#include "frames/surface_frame.h"

namespace rill::cooker {

/// Why a track ends before its window does.
enum class Death { none, left_surface, crowded, surplus };
inline constexpr const char* death_names[] = {"span_ends", "left_surface", "crowded", "surplus"};

struct DecodedFrame;

/// One track while it is made: samples birth … death of its window.
struct Path {
    int birth = 0, death = 0;
    bool continues = false;              ///< comes from the previous window
    int age = 0;                         ///< frames it has lived before this window's first
    Death cause = Death::none;           ///< set: is not carried on
    float radius = 0;                    ///< of the local fit that places it, metres
    std::vector<SurfacePoint> at;        ///< on the smoothed source surface, death − birth + 1
    std::vector<float> correction;       ///< along the normal: what makes the decoded surface fit best, metres
    std::vector<glm::vec2> tilt;         ///< likewise of the normal, in its tangent frame
    /// One that has just been born, of a single sample.
    static Path born(const SurfacePoint& at, float radius, int sample);
    bool alive(int sample) const { return sample >= birth && sample <= death; }
    /// Corrected point at a sample of its life: what is coded.
    SurfacePoint target(int sample) const;
};

struct Window {
    int first = 0;                       ///< frame index of sample 0
    bool opens_span = false;             ///< nothing comes from before: the surface stands there from the start
    std::vector<std::shared_ptr<const SurfaceFrame>> frames;
    std::vector<std::vector<glm::vec3>> motion;  ///< of every vertex of frames[s] onto frames[s + 1], metres
    bool calm = false;                   ///< `motion` is the liquid's own
    bool slips = false;                  ///< slip is kept where the points, as coded, go another way along the surface than the liquid
    std::vector<double> seconds;
    std::vector<SurfacePoint> before;    ///< what the window before decodes to in the frame that both have, sample 0; none if it opens a span
    std::vector<Path> paths;
    int samples() const { return int(frames.size()); }
};

/// Takes the closed pieces, of liquid or air, that are ellipsoids within the tolerance (metres) out of a mesh; and air too
/// little to show, which is in no drop.
std::vector<Drop> take_drops(Mesh& mesh, float edge, float tolerance);
/// Other small closed pieces of a frame, which its points, as decoded, do not show: most of it is more than `beyond` metres from what
/// they do. As ellipsoids, however far those are off, no thinner than can be coded within `tolerance` and seen.
std::vector<Drop> lost_drops(const SurfaceFrame& frame, const DecodedFrame& decoded, float beyond, float tolerance);
/// What hangs on a neck of the source, but not as decoded, is held by a drop; pieces that ran together are parted by one of air.
std::vector<Drop> neck_drops(const SurfaceFrame& frame, const DecodedFrame& decoded);
/// Fingers and pits of the source that are lost, and decoded ones that are false, by drops of what is right there. `shown`: by drops already.
std::vector<Drop> spur_drops(const SurfaceFrame& frame, const DecodedFrame& decoded, const std::vector<Drop>& shown);
/// Tracks of the drops of every sample of the window. Those at its first and last go on in the windows beside it, which see the same
/// frame.
std::vector<TrackSamples> track_drops(const Window& window, const std::vector<std::vector<Drop>>& drops);

/// What a set of points means at the vertices of a frame.
struct Residual {
    std::vector<float> distance;         ///< signed, metres, per source vertex: positive where the source lies outside
                                         ///< the decoded surface; ±missing where nothing is decoded there
    std::vector<uint8_t> wrong_side;     ///< per source vertex: a probe on its normal decodes to the wrong side
    std::vector<uint8_t> spur;           ///< per source vertex, by mark_spurs()
    std::vector<float> support;          ///< per input point: radius of its patch
};
inline constexpr float missing = 1e3f;
Residual measure_residual(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points, int jobs = 1);
/// Marks the source vertices nearest to where the decoded mesh stands more than `beyond` metres off the source: fins and
/// scraps between the probes, which only more points than the spacing around asks for will keep away.
void mark_spurs(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points, float beyond, Residual& residual, int jobs);
/// How far each point lies from what its neighbours alone would decode to: metres, and radians of the normal.
struct Surplus {
    std::vector<float> distance, angle;
};
Surplus measure_surplus(const std::vector<SurfacePoint>& points, int jobs);
/// The same of places that need not be among the points: `missing` and π where nothing is decoded.
Surplus measure_places(const std::vector<SurfacePoint>& points, const std::vector<SurfacePoint>& places);

/// New points where |residual| exceeds `threshold`: worst first, no two closer than half the spacing of the points
/// that were measured, nor than the tolerance that is cooked for (all metres) gives reason to.
std::vector<SurfacePoint> choose_births(const SurfaceFrame& frame, const Residual& residual, const std::vector<SurfacePoint>& points,
                                        float threshold, float tolerance);
/// Paths born at a sample where what the points decode to (mesh_points()) and the source are more than `beyond` metres apart, in either
/// direction, or a neck is torn: those that, by trial, leave the decoded surface better there.
std::vector<Path> repair_surface(const SurfaceFrame& frame, int sample, const std::vector<SurfacePoint>& points, const Mesh& decoded,
                                 float beyond, int jobs);

/// Carries the point to the next frame by the motion of the vertices of this one; empty where the surface leaves it.
std::optional<SurfacePoint> carry_point(const SurfaceFrame& from, const std::vector<glm::vec3>& motion, const SurfaceFrame& to,
                                        const SurfacePoint& point, float radius);
/// One step of least-squares progressive iterative approximation: every point moves along its normal, and
/// tilts, by the weighted mean residual around it. Residuals beyond `credible` metres are another sheet's, or for a
/// birth to mend. `points` and `ids`: as measured, and which path each is.
void correct_paths(const SurfaceFrame& frame, const Residual& residual, const std::vector<SurfacePoint>& points,
                   const std::vector<uint32_t>& ids, int sample, float credible, std::vector<Path>& paths, int jobs = 1);

/// Of a layer and all coarser ones, against the source over a window: metres.
struct LayerError {
    float mean = 0, p99 = 0, spacing = 0;
};
struct Layers {
    std::vector<uint32_t> layer;         ///< of every track, 0 coarsest
    std::vector<LayerError> error;       ///< of every layer
};
/// From what the tracks decode to and what each costs (any unit). A prefix of layers is a closed surface in every frame, wrong
/// nowhere by much more than elsewhere. Layer 0 takes at most a ninth of the cost; every further one is as large as it must be
/// to be fine enough for cells twice as large as the next one's, the last but one for cells of two source edges.
Layers assign_layers(const Window& window, const std::vector<TrackSamples>& tracks, const std::vector<float>& cost, uint32_t layers,
                     int jobs);
/// Block of every track: a median split of the mean positions, at most 2^splits blocks.
std::vector<uint32_t> assign_blocks(const std::vector<TrackSamples>& tracks, uint32_t most_tracks, uint32_t& block_count);

}  // namespace rill::cooker
