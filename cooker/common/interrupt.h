// SPDX-License-Identifier: MIT
// Ctrl-C during long work: the work ends with an exception, so that files under way are removed as after any error.
#pragma once
#include <atomic>

namespace rill::cooker {

/// The signal that asked to stop; 0: none. Set by the tool's handler, looked at by parallel_for and Progress.
inline std::atomic<int> interrupting_signal{0};

struct Interrupted {};
inline void stop_if_interrupted() {
    if (interrupting_signal) throw Interrupted();
}

}  // namespace rill::cooker
