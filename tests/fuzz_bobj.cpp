// SPDX-License-Identifier: MIT
// Any bytes as the frames of a FLIP Fluids cache: read, or refused with an InputError.
#include "fuzz_reader.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    fuzz::seed_from("fuzz_bobj", *argc, *argv);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::read_as({"cache/bakefiles/000001.bobj", "cache/bakefiles/velocity000001.bobj"}, "cache", data, size);
    return 0;
}
