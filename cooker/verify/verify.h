// SPDX-License-Identifier: MIT
// An asset against the sequence it was cooked from, frame by frame, as the runtime shows it.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "measure/surface_distance.h"
#include "measure/thin_liquid.h"
#include "measure/velocity_error.h"
#include "readers/reader.h"
#include "verify/motion.h"

namespace rill::cooker {

/// How the surface fares with cells so many times the source's.
struct CoarseMeasure {
    uint32_t times = 1, open_edges = 0, non_manifold_edges = 0, components = 0;
};
inline constexpr uint32_t coarser[] = {2, 4};

struct FrameMeasure {
    int number = 0;              ///< the source's
    double seconds = 0;          ///< after the asset's first frame
    bool between = false;        ///< two frames of the asset, which has not this one
    uint32_t source_triangles = 0, source_vertices = 0, decoded_triangles = 0;
    double edge = 0;             ///< median edge of the source frame, metres
    SurfaceDistance distance;
    Topology source, decoded;
    double volume_ratio() const; ///< decoded / source; 1 when both are empty
    // Only when details are asked for:
    uint32_t points = 0;         ///< and drops, decoded
    double spacing = 0;          ///< of the decoded points: √(decoded area / points), metres
    VelocityError velocity;      ///< nothing where the source has no velocity
    ThinError thin;
    std::array<CoarseMeasure, 2> coarse{};
    /// What a sequence needs of every frame when its distances are added up: not the histograms.
    void forget_histograms();
};
/// Errors of many frames added up; totals of parts add up to those of the whole.
struct ErrorTotals {
    uint32_t frames = 0;
    double area = 0, distance_area = 0, degrees_area = 0, max = 0;
    DistanceHistogram histogram;
    uint64_t open_edges = 0, non_manifold_edges = 0;     ///< decoded
    double volume_ratio_min = 1e300, volume_ratio_max = 0;
    int worst_frame = 0;         ///< number of the frame with the largest p99
    double worst_p99 = -1;
    void add(const FrameMeasure& frame);
    void add(const ErrorTotals& other);
    double mean() const { return area > 0 ? distance_area / area : 0; }
    double normal_degrees() const { return area > 0 ? degrees_area / area : 0; }
    double p99() const { return histogram.quantile(0.99); }
};
/// Exact to the bit, there and back.
nlohmann::json to_json(const ErrorTotals& totals);
ErrorTotals totals_from_json(const nlohmann::json& json);
/// As `summary` of a report of `rill verify`.
nlohmann::json summary_json(const ErrorTotals& totals, double diagonal);

struct Verification {
    std::string asset, input;
    std::vector<FrameMeasure> frames;  ///< without histograms
    ErrorTotals totals;
    bool details = false;        ///< were asked for
    VelocityError velocity;
    ThinError thin;
    std::array<CoarseMeasure, 2> coarse{};  ///< edges of all frames added up
    Motion motion;               ///< where it was measured; by the caller
    double diagonal = 0;         ///< of the asset's bounds, metres
    double edge = 0;             ///< the source's median edge as the asset states it, metres
    std::string target;          ///< the asset's own --error; empty when it states none
    double target_p99 = 0;       ///< metres; 0 when it states none, or when frames lie between the asset's: it is stated of these
    double mean = 0, p99 = 0, max = 0;  ///< metres, over the surface of all frames together
    double normal_degrees = 0;
    double bytes_per_frame = 0;
    size_t worst = 0;            ///< index of the frame with the largest p99
    bool target_met() const { return target_p99 == 0 || p99 <= target_p99 * target_slack; }
    static constexpr double target_slack = 1.1;
};
enum class Scrutiny {
    glance,  ///< a third of the samples, in half the time: mean and p99 within a percent, the maximum not
    plain,
    close,   ///< velocity, thin liquid and coarser cells too
};
/// The frames of `asset` (or of `read`'s range, if it has one) out of `input`, read as they were when it was cooked
/// unless `read` says otherwise. Throws InputError when either
/// cannot be read or the input lacks one.
std::unique_ptr<SequenceReader> open_source_of(const std::string& asset, const std::string& input, ReadOptions read);
/// The frames of an input, closed where the cook of `asset` closed them. Throws InputError when the asset cannot be read.
std::unique_ptr<SequenceReader> closed_as_in(const std::string& asset, std::unique_ptr<SequenceReader> source);
/// Every frame of the source against the asset, at the moment between two of its frames where it has not that one. Throws InputError when
/// a frame lies outside of it. jobs 0: all cores.
Verification verify(const std::string& asset, const SequenceReader& source, int jobs,
                    const std::function<void(uint32_t done, uint32_t total)>& progress = {}, Scrutiny scrutiny = Scrutiny::plain);

/// Documented in cooker/REPORTS.md.
nlohmann::json to_json(const Verification& verification);
/// One self-contained page: figures, graphs, and the worst frames beside those of the source.
std::string to_html(const Verification& verification, const SequenceReader& source);

}  // namespace rill::cooker
