// SPDX-License-Identifier: MIT
// Any bytes as Alembic archives: read, or refused with an InputError. Seeds: tests/data/fuzz_abc.
#include "fuzz_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static const Place place;
    place.put("f1.abc", data, size);
    place.read("f1.abc");
    return 0;
}
