// SPDX-License-Identifier: MIT
// A folder of its own below the system's temporary one; gone with everything in it when the work is done.
#pragma once
#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "common/mesh.h"

namespace rill::cooker {

struct ScratchFolder {
    std::filesystem::path path;
    ScratchFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "rill-XXXXXX").string();
        if (!mkdtemp(name.data())) throw InputError(name + ": cannot be made: " + std::strerror(errno));
        path = name;
    }
    ~ScratchFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
};

}  // namespace rill::cooker
