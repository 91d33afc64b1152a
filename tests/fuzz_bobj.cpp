// SPDX-License-Identifier: MIT
// Any bytes as the frames of a FLIP Fluids cache: read, or refused with an InputError. Seeds: tests/data/fuzz_bobj.
#include "fuzz_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Place place;
    for (const char* name : {"bakefiles/000001.bobj", "bakefiles/velocity000001.bobj"}) place.put(name, data, size);
    place.read("");
    return 0;
}
