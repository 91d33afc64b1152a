// SPDX-License-Identifier: MIT
// What a cook aimed at, and what came of it.
#pragma once

namespace rill::cooker {

struct Verdict {
    bool target_met = false;
    double target_p99 = 0, measured_p99 = 0;    ///< metres; target 0: a rate is what was aimed at
    double target_kbps = 0, measured_kbps = 0;  ///< 1000 bits per second; 0: an error is what was aimed at
};

}  // namespace rill::cooker
