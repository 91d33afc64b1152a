// SPDX-License-Identifier: MIT
#include "cook/error_search.h"

#include <algorithm>
#include <cmath>

#include "cook/parts_to_asset.h"

namespace rill::cooker {
namespace {

constexpr size_t most_attempts = 3, most_of_leaps = 6;
constexpr double finer_by = 0.1;    // an error below its target by more is bytes nobody asked for, and worth another attempt
constexpr double most_finer = 0.3;  // of a tolerance, the next one
constexpr double most_coarser = 2;
/// Edges. Points that lie closer to the source than that follow its facets and the noise of its cells, and one another less and less: without this
/// end `dam_break` 44:47 came as near with .05e, .03e and .02e (p99 .082 of an edge), in 14, 21 and 27 kB a frame, and a ball of 320 triangles was
/// farther off with .02e than with .07e.
constexpr double least_tolerance = 0.02;
constexpr double tells = 0.75;      // of a tolerance: of a smaller step the error is chance as much
/// Of a target that is missed anyway: per cent of bytes that a per cent of error is worth. Where points tell, it is had for 1.2.
constexpr double worth_bytes = 4;

bool is_met(double y) { return y <= std::log(1 + met_within); }
bool is_near(double y) { return is_met(y) && y >= std::log(1 - finer_by); }

/// Walls are exact: the more of the surface lies in them, the farther off may the rest be for the same p99; but .4 at most, or liquid ends
/// before its walls. The finer, the more of the error is not the points'.
double first_tolerance(double edges, double wall_share) {
    const double finer = std::max(0.25 / edges, 1.0);
    return 1.2 * std::pow(edges / 0.25, edges < 0.25 ? 0.6 : 0.2) + 0.8 * std::pow(finer, 0.3) * std::min(wall_share, 0.4);
}

}  // namespace

double ErrorSearch::slope() const {
    const Attempt &last = attempts_.back(), &before = attempts_[attempts_.size() - 2];
    return (last.y - before.y) / (last.x - before.x);
}

std::optional<double> ErrorSearch::next() const {
    const double least = least_tolerance / edges_;
    if (attempts_.empty()) return std::max(first_tolerance(edges_, wall_share_), least);
    const Attempt& last = attempts_.back();
    if (is_near(last.y) || attempts_.size() == (leaps_ ? most_of_leaps : most_attempts)) return {};
    double power = edges_ < 0.2 ? 1.3 : 0.9;  // of the tolerance, by the error's
    if (attempts_.size() > 1) {
        const bool is_told = last.x - attempts_[attempts_.size() - 2].x < std::log(tells);
        if (is_told && !leaps_ && !is_met(last.y + std::max(slope(), 0.0) * std::log(most_finer))) return {};
        if (slope() > 0) power = std::clamp(1 / slope(), 0.7, 2.0);
        else if (leaps_) power = 2;
    }
    const double finer = std::exp(last.x + std::clamp(-power * last.y, std::log(most_finer), std::log(most_coarser)));
    if (finer < least && !(last.x > std::log(least) + 1e-9)) return {};  // there already
    return std::max(finer, least);
}

bool ErrorSearch::better(const Attempt& a, const Attempt& b) const {
    // One that misses the target is no better than one that is too fine, however near it comes.
    if (is_met(a.y) != is_met(b.y)) return is_met(a.y);
    if (is_met(a.y)) return std::abs(a.y) < std::abs(b.y);
    return worth_bytes * a.y + a.bytes < worth_bytes * b.y + b.bytes;
}

bool ErrorSearch::add(double tolerance, double ratio, double bytes) {
    attempts_.push_back({std::log(tolerance), std::log(std::max(ratio, 1e-9)), std::log(std::max(bytes, 1.0))});
    const size_t index = attempts_.size() - 1;
    if (index > 0 && !better(attempts_[index], attempts_[best_])) return false;
    best_ = index;
    return true;
}

}  // namespace rill::cooker
