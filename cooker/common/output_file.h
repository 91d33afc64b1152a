// SPDX-License-Identifier: MIT
// Output appears only when it is complete: written beside its place, then renamed.
#pragma once
#include <filesystem>
#include <string_view>
#include <vector>

namespace rill::cooker {

/// Throws InputError naming the file when it cannot be written; nothing is left behind then. What symbolic links lead to is replaced,
/// not they; devices and pipes are written into.
void write_file(const std::filesystem::path& path, std::string_view bytes);
/// What a symbolic link leads to; any other path as it is.
std::filesystem::path followed(const std::filesystem::path& path);
/// Throws InputError where a file that is about to be written is one of those.
void spare_inputs(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs);

}  // namespace rill::cooker
