// SPDX-License-Identifier: MIT
// Fuzz targets of readers: each input becomes the files that a reader opens; seeds are small files of tests/data.
#pragma once
#include <algorithm>

#include "frames/open_sequence.h"
#include "fuzz_harness.h"
#include "sequence_files.h"

namespace fuzz {

inline void seed_from(const char* folder, int argc, char** argv) {
    std::vector<std::string> seeds;
    for (const auto& entry : std::filesystem::directory_iterator(std::string(RILL_TEST_DATA "/") + folder))
        seeds.push_back(get_file(entry.path()));
    write_seeds(argc, argv, seeds);
}
/// Puts the bytes into files under folder() and reads what lies at `input` there.
inline void read_as(const std::vector<const char*>& names, const char* input, const uint8_t* data, size_t size) {
    for (const char* name : names) put_file(folder() / name, {reinterpret_cast<const char*>(data), size});
    try {
        const auto reader = rill::cooker::open_sequence((folder() / input).string(), {});
        for (size_t i = 0; i < std::min<size_t>(reader->info().numbers.size(), 50); ++i) reader->read(i);
    } catch (const rill::cooker::InputError&) {
    }
}

}  // namespace fuzz
