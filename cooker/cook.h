// SPDX-License-Identifier: MIT
// The cook: all stages in order, window by window, in bounded memory.
//   sequence → frames → samples → tracks → coefficients → layers → chunks → asset → report
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "readers/reader.h"

namespace rill::cooker {

struct CookSettings {
    std::string error = "0.25e";   ///< p99 aimed at: "0.25e" median edges, "0.1%" of the diagonal, "2mm", "0.002m"
    int window = 24;               ///< frames a window spans (it touches one more)
    int jobs = 0;                  ///< 0: all cores
    int layers = 4;
    ReadOptions read;
};
struct CookProgress {
    uint32_t frames_done, frames_total;
    std::string stage;
};
struct CookReport {
    nlohmann::json json;           ///< stable, documented in cooker/README.md
    bool target_met = false;
    double target_p99 = 0, measured_p99 = 0;  ///< metres
};
/// Cooks `input` into `output`. Throws InputError, UsageError. Deterministic: the same input and settings give
/// the same bytes at any number of jobs.
CookReport cook(const std::string& input, const std::string& output, const CookSettings& settings,
                const std::function<void(const CookProgress&)>& progress);

}  // namespace rill::cooker
