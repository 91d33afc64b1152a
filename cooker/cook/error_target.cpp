// SPDX-License-Identifier: MIT
#include "cook/error_target.h"

#include <charconv>
#include <cmath>

#include "common/mesh.h"

namespace rill::cooker {

double error_target(const std::string& text, double median_edge, double diagonal) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const std::string unit(end, text.data() + text.size());
    const double scale = unit == "e" ? median_edge : unit == "%" ? diagonal / 100 : unit == "mm" ? 0.001 : unit == "m" ? 1 : 0;
    const bool known = unit == "e" || unit == "%" || unit == "mm" || unit == "m";
    if (error != std::errc() || !known || !(value > 0) || !std::isfinite(value))
        throw UsageError("--error '" + text + "' is none of 0.25e (median source edges), 0.1% (of the diagonal), 2mm, 0.002m");
    return value * scale;
}

Aim aim_of(const std::string& error, double kilobits, double median_edge, double diagonal, double seconds) {
    if (kilobits == 0) return {error_target(error, median_edge, diagonal), 0};
    if (!(kilobits > 0) || !std::isfinite(kilobits)) throw UsageError("--bitrate must be a number of kilobits per second above 0");
    return {0, kilobits * 1000 / 8 * seconds};
}

}  // namespace rill::cooker
