// SPDX-License-Identifier: MIT
// The cook: all stages in order, span by span and window by window, in bounded memory.
//   sequence → survey → spans of windows (frames → samples → tracks → coefficients → layers → chunks) → asset → report
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "cook/spans.h"
#include "cook/verdict.h"
#include "frames/check_velocity.h"
#include "readers/reader.h"

namespace rill::cooker {

struct CookSettings {
    std::string error = "0.25e";   ///< p99 aimed at: "0.25e" median edges, "0.1%" of the diagonal, "2mm", "0.002m"
    double bitrate = 0;            ///< 1000 bits per second, > 0: the best error within this rate, instead of `error`
    int window = 0;                ///< frames a window spans, about (it touches one more); 0: as usual, more where the liquid is calm
    int jobs = 0;                  ///< 0: all cores
    int layers = 4;
    bool slip = true;              ///< keep how the liquid slides along the surface; false: the runtime's velocities are the surface's own
    ReadOptions read;
    // Below: how the work is done; none of it changes a byte of the asset.
    uint32_t segment = 0, segments = 0;  ///< segments > 0: cook only share `segment` (from 0) into a part
    std::string survey;            ///< file the survey is kept in, for other segments of the same cook
    bool force = false;            ///< cook even what is there already
};
/// Told by one thread at a time, though not always the same.
struct CookProgress {
    uint32_t frames_done, frames_total;
    std::string stage;
};
struct CookReport : Verdict {
    nlohmann::json json;           ///< stable, documented in REPORTS.md
    bool up_to_date = false;       ///< the output was there already, of this very input and settings
    bool is_part = false;          ///< the figures are those of this part
};
/// Cooks `input` into `output`. Throws InputError, UsageError. Deterministic: the same input and settings give the same bytes
/// at any number of jobs and segments. Spans that are finished when it fails or is stopped are kept beside `output`, in a
/// folder OUTPUT.cook-KEY, and taken from there by the next cook of the same input and settings.
CookReport cook(const std::string& input, const std::string& output, const CookSettings& settings,
                const std::function<void(const CookProgress&)>& progress);

/// Only makes settings.survey.
void survey(const std::string& input, const CookSettings& settings, const std::function<void(const CookProgress&)>& progress);

/// What cook() would do.
struct CookPlan {
    std::string key;               ///< of input, settings and tool: equal keys give equal assets
    SequenceInfo info;
    VelocityFit fit;
    SpanPlan spans;
    SpanRange share;               ///< the spans to be cooked here …
    uint32_t finished = 0;         ///< … of which an interrupted cook has left so many
    bool up_to_date = false;
};
CookPlan plan_cook(const std::string& input, const std::string& output, const CookSettings& settings);
/// Every file the input consists of, and the folders whose content decides which those are.
std::vector<std::string> dependencies(const std::string& input, const CookSettings& settings);

}  // namespace rill::cooker
