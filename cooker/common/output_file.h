// SPDX-License-Identifier: MIT
// Output appears only when it is complete: written beside its place, then renamed.
#pragma once
#include <filesystem>
#include <string_view>

namespace rill::cooker {

/// Throws InputError naming the file when it cannot be written; nothing is left behind then.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace rill::cooker
