// SPDX-License-Identifier: MIT
// A coded window → layers, blocks, chunks, and what is known of each: bounds, error, cost.
#pragma once
#include "cook/parts_to_asset.h"
#include "tracks/frames_to_tracks.h"

namespace rill::cooker {

/// Adds the window to the file, and its account to that of the span. `first_sample`: of the window, in the part.
void write_window(AssetWriter& writer, uint32_t first_sample, const Window& window, const CodedWindow& coded, const WindowGoal& goal,
                  uint32_t layers, bool ends_span, SpanResult& account);

}  // namespace rill::cooker
