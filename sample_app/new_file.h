// SPDX-License-Identifier: MIT
// Files appear when they are complete: written beside their place, then renamed. Devices and pipes are written into.
#pragma once
#include <cstdio>
#include <filesystem>
#include <string>

namespace player {

struct NewFile {
    std::string target;  ///< what links lead to
    std::string place;   ///< to be written
    explicit NewFile(const std::string& path) : target(path) {
        std::error_code error;
        if (std::filesystem::is_symlink(path, error)) target = std::filesystem::weakly_canonical(path, error).string();
        const auto status = std::filesystem::status(path, error);
        const bool in_place = std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
        place = in_place ? target : target + ".part";
    }
    /// `good`: all of it was written. False: there is no new file, and errno says why.
    bool finish(bool good) const {
        if (place == target) return good;
        if (good && std::rename(place.c_str(), target.c_str()) == 0) return true;
        std::remove(place.c_str());
        return false;
    }
};

}  // namespace player
