// SPDX-License-Identifier: MIT
// Which tolerance makes a span as exact as `--error`: the decoded error falls nearly as a power of the tolerance, so the search is along
// lines of log error over log tolerance. But not for ever: crevices and strands narrower than a cell stay as they are, and points without
// end would not tell them.
#pragma once
#include <optional>
#include <vector>

namespace rill::cooker {

class ErrorSearch {
public:
    /// `edges`: the error aimed at, in median edges of the source; `wall_share`: of its surface that lies in walls (survey.h);
    /// `triangles`: of a frame. Where there are few the error goes in leaps, and attempts cost nothing: there are more of them.
    ErrorSearch(double edges, double wall_share, double triangles)
        : edges_(edges), wall_share_(wall_share), leaps_(triangles < 2000) {}
    /// The tolerance to try next, in the error aimed at; empty when there is nothing more to win.
    std::optional<double> next() const;
    /// What came of it: its error, in the one aimed at (nothing to measure: 1), and its bytes. True: the best so far.
    bool add(double tolerance, double ratio, double bytes);
    int attempts() const { return int(attempts_.size()); }

private:
    struct Attempt {
        double x, y;  ///< logarithms of tolerance and ratio
        double bytes;  ///< logarithm
    };
    bool better(const Attempt& a, const Attempt& b) const;
    /// How the error went with the tolerance, from the last attempt but one to the last.
    double slope() const;

    double edges_, wall_share_;
    bool leaps_;
    std::vector<Attempt> attempts_;
    size_t best_ = 0;
};

}  // namespace rill::cooker
