// SPDX-License-Identifier: MIT
#include "error_target.h"

#include <charconv>
#include <cmath>

#include "mesh.h"

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

}  // namespace rill::cooker
