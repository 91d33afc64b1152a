// SPDX-License-Identifier: MIT
// Which tolerance makes a span as large as its share of `--bitrate`: bytes fall nearly as a power of the tolerance, so
// the search is along lines of log bytes over log tolerance.
#pragma once
#include <optional>
#include <vector>

namespace rill::cooker {

inline constexpr double rate_met_within = 0.03;  ///< of what `--bitrate` allows
/// Median edges: finer errors gain little (clip of res 32: a p99 of .19 at .05, .18 at .02). A rate that this does not fill is met.
inline constexpr double finest_tolerance = 0.02;

class RateSearch {
public:
    /// Tolerances in metres: where to start, and the limits of what is tried.
    RateSearch(double start, double finest, double coarsest);
    /// The tolerance to try next; empty when there is nothing more to win.
    std::optional<double> next() const;
    /// What came of it: bytes over those allowed. True: the best so far, nearest to the rate but not beyond it.
    bool add(double tolerance, double ratio);

private:
    struct Attempt {
        double x, y;  ///< logarithms of tolerance and ratio
    };
    double start_, finest_, coarsest_, best_ = 1e300;
    std::vector<Attempt> attempts_;
};

}  // namespace rill::cooker
