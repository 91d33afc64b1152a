// SPDX-License-Identifier: MIT
// Any bytes as glTF, text and binary: read, or refused with an InputError. Seeds: tests/data/fuzz_glb.
#include "fuzz_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Place place;
    place.put("f1.glb", data, size);
    place.read("f1.glb");
    return 0;
}
