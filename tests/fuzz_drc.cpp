// SPDX-License-Identifier: MIT
// Any bytes as a Draco file: read, or refused with an InputError.
#include "fuzz_reader.h"
#include "readers/draco_mesh.h"
#include "shapes.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    rill::cooker::Mesh ball = bumpy_sphere(8, 1), moving = ball;
    moving.velocities.assign(moving.positions.size(), {1, 2, 3});
    fuzz::write_seeds(*argc, *argv, {rill::cooker::draco_encode(ball, 10, 10), rill::cooker::draco_encode(moving, 14, 12)});
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::read_as({"f1.drc"}, "f1.drc", data, size);
    return 0;
}
