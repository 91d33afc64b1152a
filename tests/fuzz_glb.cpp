// SPDX-License-Identifier: MIT
// Any bytes as glTF, text or binary: read, or refused with an InputError.
#include "fuzz_reader.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    fuzz::seed_from("fuzz_glb", *argc, *argv);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::read_as({"f1.glb"}, "f1.glb", data, size);
    return 0;
}
