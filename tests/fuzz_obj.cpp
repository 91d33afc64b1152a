// SPDX-License-Identifier: MIT
// Any bytes as an OBJ file: read, or refused with an InputError.
#include "fuzz_reader.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    fuzz::write_seeds(*argc, *argv,
                      {"# metres\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\nf -1 -2 -3\nf 2/1/1 4 3 1\n",
                       "mtllib a.mtl\no one\ng part\nusemtl m\nv 1e3 -2.5 .5 1\nv 0 0 0\nv 3 4 5\ns off\nf 1 2 3\nl 1 2\n"});
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::read_as({"f1.obj"}, "f1.obj", data, size);
    return 0;
}
