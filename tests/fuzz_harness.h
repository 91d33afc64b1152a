// SPDX-License-Identifier: MIT
// For the fuzz targets: seeds made by code (so that they follow the formats) and files that readers can open.
#pragma once
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace fuzz {

/// Writes the seeds to the first folder of the command line, where libFuzzer looks for its corpus.
inline void write_seeds(int argc, char** argv, const std::vector<std::string>& seeds) {
    for (int i = 1; i < argc; ++i) {
        if (argv[i][0] == '-' || !std::filesystem::is_directory(argv[i])) continue;
        for (size_t k = 0; k < seeds.size(); ++k)
            std::ofstream(std::string(argv[i]) + "/seed_" + std::to_string(k), std::ios::binary) << seeds[k];
        return;
    }
}

/// A folder of this process, in memory where the system has such a place.
inline const std::filesystem::path& folder() {
    static const std::filesystem::path path = [] {
        const std::filesystem::path memory = "/dev/shm", place = std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
        const std::filesystem::path own = place / ("rill_fuzz_" + std::to_string(::getpid()));
        std::filesystem::create_directories(own);
        return own;
    }();
    static const struct Cleaner {
        ~Cleaner() {
            std::error_code ignored;
            std::filesystem::remove_all(path, ignored);
        }
        std::filesystem::path path;
    } cleaner{path};
    return path;
}

}  // namespace fuzz
