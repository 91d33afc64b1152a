// SPDX-License-Identifier: MIT
// A coded window → layers, blocks, chunks, and what is known of each: bounds, error, cost.
#pragma once
#include "frames_to_tracks.h"
#include "parts_to_asset.h"

namespace rill::cooker {

/// Adds the window to the file, and its account to that of the span. `first_sample`: of the window, in the part.
void write_window(AssetWriter& writer, uint32_t first_sample, const Window& window, const CodedWindow& coded, const WindowGoal& goal,
                  uint32_t layers, bool ends_span, SpanResult& account);

}  // namespace rill::cooker
