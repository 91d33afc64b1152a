// SPDX-License-Identifier: MIT
// What a cook depends on, as hashes: file contents, settings, the tool. Equal hashes: equal assets.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "readers/reader.h"

namespace rill::cooker {

/// Every file that the frames of `reader` are read from, each once, in order of first use.
std::vector<std::filesystem::path> input_files(const SequenceReader& reader);
/// Of the contents, in order; names and places do not count. 32 hexadecimal digits. Throws InputError.
std::string hash_contents(const std::vector<std::filesystem::path>& files, int jobs);
/// Of names, sizes and times of change: cheap, and good enough to tell that nothing was touched.
std::string hash_states(const std::vector<std::filesystem::path>& files);
std::string hash_text(const std::string& text);

}  // namespace rill::cooker
