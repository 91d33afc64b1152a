// SPDX-License-Identifier: MIT
// A log-log plot as SVG, for reports.
#pragma once
#include <string>
#include <utility>
#include <vector>

namespace rill::bench {

struct Series {
    std::string name, colour;
    std::vector<std::pair<double, double>> points;  ///< all positive
    double order, factor;                           ///< of the line y = factor · x^order; drawn up to fitted_up_to
    double fitted_up_to;
};
/// Points beyond `fitted_up_to` are drawn hollow.
std::string log_plot(const std::string& title, const std::string& x_name, const std::vector<Series>& series);

}  // namespace rill::bench
