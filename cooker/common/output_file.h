// SPDX-License-Identifier: MIT
// Output appears only when it is complete: written beside its place, then renamed.
#pragma once
#include <filesystem>
#include <functional>
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

/// Throws InputError where `path` is a file whose beginning, of at most so many bytes, is not ours; `what` it should be, in the message. An empty
/// file is nobody's.
void spare_others(const std::filesystem::path& path, size_t most, const std::function<bool(std::string_view)>& is_ours, const char* what);

}  // namespace rill::cooker
