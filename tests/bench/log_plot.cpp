// SPDX-License-Identifier: MIT
#include "log_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace rill::bench {
namespace {

constexpr double width = 640, height = 460, left = 80, right = 20, top = 40, bottom = 60;

/// Ends of an axis, and where they lie in the picture.
struct Axis {
    double low, high, from, to;
    double at(double value) const { return from + (to - from) * std::log(value / low) / std::log(high / low); }
};

__attribute__((format(printf, 2, 3))) void add(std::string& out, const char* format, ...) {
    char line[512];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    out += line;
}

void add_grid(std::string& out, const Axis& x, const Axis& y) {
    for (int decade = -9; decade <= 2; ++decade)
        for (const int digit : {1, 2, 5}) {
            const double value = digit * std::pow(10.0, decade);
            if (value >= x.low * 0.999 && value <= x.high * 1.001) {
                add(out, "<path d='M%.1f %.1fV%.1f' stroke='#ddd'/>\n", x.at(value), y.from, y.to);
                add(out, "<text x='%.1f' y='%.1f' text-anchor='middle'>%g</text>\n", x.at(value), y.from + 20, value);
            }
            if (digit == 1 && value >= y.low * 0.999 && value <= y.high * 1.001) {
                add(out, "<path d='M%.1f %.1fH%.1f' stroke='#ddd'/>\n", x.from, y.at(value), x.to);
                add(out, "<text x='%.1f' y='%.1f' text-anchor='end'>%g</text>\n", x.from - 8, y.at(value) + 5, value);
            }
        }
    add(out, "<path d='M%.1f %.1fV%.1fH%.1f' fill='none' stroke='#444'/>\n", x.from, y.to, y.from, x.to);
}

void add_series(std::string& out, const Series& s, const Axis& x, const Axis& y, double name_y) {
    const double first = std::min_element(s.points.begin(), s.points.end())->first;
    const auto line = [&](double u) { return y.at(s.factor * std::pow(u, s.order)); };
    add(out, "<path d='M%.1f %.1fL%.1f %.1f' stroke='%s' stroke-width='1.5'/>\n", x.at(first), line(first),
        x.at(s.fitted_up_to), line(s.fitted_up_to), s.colour.c_str());
    for (const auto& [u, v] : s.points)
        add(out, "<circle cx='%.1f' cy='%.1f' r='4' fill='%s' stroke='%s' stroke-width='1.5'/>\n", x.at(u), y.at(v),
            u <= s.fitted_up_to ? s.colour.c_str() : "white", s.colour.c_str());
    add(out, "<circle cx='%.1f' cy='%.1f' r='4' fill='%s'/>\n", x.from + 22, name_y - 5, s.colour.c_str());
    add(out, "<text x='%.1f' y='%.1f'>%s, order %.2f</text>\n", x.from + 34, name_y, s.name.c_str(), s.order);
}

}  // namespace

std::string log_plot(const std::string& title, const std::string& x_name, const std::vector<Series>& series) {
    double ends[4] = {1e30, 0, 1e30, 0};
    for (const Series& s : series)
        for (const auto& [u, v] : s.points) {
            ends[0] = std::min(ends[0], u), ends[1] = std::max(ends[1], u);
            ends[2] = std::min(ends[2], v), ends[3] = std::max(ends[3], v);
        }
    const Axis x{ends[0] / 1.15, ends[1] * 1.15, left, width - right};
    const Axis y{std::pow(10, std::floor(std::log10(ends[2]))), std::pow(10, std::ceil(std::log10(ends[3]))),
                 height - bottom, top};
    std::string out;
    add(out, "<svg xmlns='http://www.w3.org/2000/svg' width='%g' height='%g' viewBox='0 0 %g %g' "
             "font-family='sans-serif' font-size='14' stroke='none'>\n", width, height, width, height);
    add(out, "<rect width='%g' height='%g' fill='white'/>\n", width, height);
    add(out, "<text x='%g' y='24' text-anchor='middle' font-size='16'>%s</text>\n", width / 2, title.c_str());
    add_grid(out, x, y);
    add(out, "<text x='%g' y='%g' text-anchor='middle'>%s</text>\n", (x.from + x.to) / 2, height - 16, x_name.c_str());
    double name_y = top + 28;
    for (const Series& s : series) add_series(out, s, x, y, name_y), name_y += 22;
    return out + "</svg>\n";
}

}  // namespace rill::bench
