// SPDX-License-Identifier: MIT
// Any bytes as an Alembic archive: read, or refused with an InputError.
#include "fuzz_reader.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    fuzz::seed_from("fuzz_abc", *argc, *argv);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::read_as({"f1.abc"}, "f1.abc", data, size);
    return 0;
}
