// SPDX-License-Identifier: MIT
// What `--error` says, in metres.
#pragma once
#include <string>

namespace rill::cooker {

/// "0.25e" (of the median source edge), "0.1%" (of the diagonal of the sequence's bounds), "2mm", "0.002m".
/// Throws UsageError for anything else and for values that are not positive.
double error_target(const std::string& text, double median_edge, double diagonal);

}  // namespace rill::cooker
