// SPDX-License-Identifier: MIT
// Readers open files, so each input becomes one, in a folder of the process.
#pragma once
#include <unistd.h>

#include "readers/reader.h"
#include "sequence_files.h"

struct Place {
    TestFolder folder;
    void put(const char* name, const uint8_t* data, size_t size) const {
        put_file(folder.path / name, {reinterpret_cast<const char*>(data), size});
    }
    void read(const char* input) const {
        try {
            const auto reader = rill::cooker::open_sequence(folder / input, {});
            for (size_t i = 0; i < std::min<size_t>(reader->info().numbers.size(), 50); ++i) reader->read(i);
        } catch (const rill::cooker::InputError&) {
        }
    }
};
