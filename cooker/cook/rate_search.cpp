// SPDX-License-Identifier: MIT
#include "cook/rate_search.h"

#include <algorithm>
#include <cmath>

namespace rill::cooker {
namespace {
constexpr size_t most_attempts = 6;
constexpr double aim = -0.004;           // log of the ratio: a little below, for beyond costs more
constexpr double near = 0.012;           // this far from the rate is there; spans and the directory need the rest
constexpr double usual_slope = -0.8;     // of log bytes over log tolerance
constexpr double beyond = 100;           // counts as worse than any miss on the allowed side
}  // namespace

RateSearch::RateSearch(double start, double finest, double coarsest)
    : start_(std::log(std::clamp(start, finest, coarsest))), finest_(std::log(finest)), coarsest_(std::log(coarsest)) {}

std::optional<double> RateSearch::next() const {
    if (attempts_.empty()) return std::exp(start_);
    if (best_ <= near || attempts_.size() == most_attempts) return {};
    const Attempt *large = nullptr, *small = nullptr;  // the nearest on either side of the rate
    for (const Attempt& a : attempts_) {
        const Attempt*& side = a.y > aim ? large : small;
        if (!side || std::abs(a.y - aim) < std::abs(side->y - aim)) side = &a;
    }
    const Attempt& last = attempts_.back();
    double x;
    if (large && small) {
        double up = large->y - aim, down = aim - small->y;
        // Twice on one side: the other counts half, or that side would be crept along for ever.
        const bool high = last.y > aim, twice = high == (attempts_[attempts_.size() - 2].y > aim);
        if (twice) (high ? down : up) /= 2;
        x = large->x + (small->x - large->x) * up / (up + down);
    } else {
        double slope = usual_slope;
        if (attempts_.size() > 1) {
            const Attempt& before = attempts_[attempts_.size() - 2];
            if (last.x != before.x) slope = std::clamp((last.y - before.y) / (last.x - before.x), -2.0, -0.2);
        }
        x = last.x + (aim - last.y) / slope;
    }
    x = std::clamp(x, finest_, coarsest_);
    if (std::any_of(attempts_.begin(), attempts_.end(), [&](const Attempt& a) { return std::abs(a.x - x) < 1e-4; })) return {};
    return std::exp(x);
}

bool RateSearch::add(double tolerance, double ratio) {
    const double y = std::log(ratio), miss = y <= std::log(1 + 0.7 * rate_met_within) ? std::abs(y) : beyond + y;
    attempts_.push_back({std::log(tolerance), y});
    if (miss >= best_) return false;
    best_ = miss;
    return true;
}

}  // namespace rill::cooker
