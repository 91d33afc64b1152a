// SPDX-License-Identifier: MIT
// What `--error` says, in metres, and `--bitrate` instead of it, in bytes.
#pragma once
#include <string>

namespace rill::cooker {

/// "0.25e" (of the median source edge), "0.1%" (of the diagonal of the sequence's bounds), "2mm", "0.002m".
/// Throws UsageError for anything else and for values that are not positive.
double error_target(const std::string& text, double median_edge, double diagonal);

/// One of them; the other is 0.
struct Aim {
    double p99, bytes;  ///< metres; of the whole asset
};
/// `kilobits` (1000 bits) per second, or 0: then it is `error`. Throws UsageError.
Aim aim_of(const std::string& error, double kilobits, double median_edge, double diagonal, double seconds);

}  // namespace rill::cooker
