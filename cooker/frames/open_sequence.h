// SPDX-License-Identifier: MIT
// A path → frames the cooker can trust, with velocity: where every command begins.
#pragma once
#include "readers/reader.h"

namespace rill::cooker {

/// The reader for what lies there, its frames checked (sequence_to_frames.h), velocity estimated where asked for. Throws InputError
/// naming file and cause, UsageError for options that make no sense.
std::unique_ptr<SequenceReader> open_sequence(const std::string& input, const ReadOptions& options);

}  // namespace rill::cooker
