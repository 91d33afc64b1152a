// SPDX-License-Identifier: MIT
// Any bytes as a PLY file.
#include "frames/open_sequence.h"
#include "fuzz_harness.h"
#include "sequence_files.h"
#include "shapes.h"

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    rill::cooker::Mesh mesh = sphere(4, 1);
    mesh.velocities.assign(mesh.positions.size(), {1, 2, 3});
    const std::string text =
        "ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty double x\nproperty float y\nproperty int z\nproperty list uchar short l\n"
        "element face 1\nproperty list uint uchar vertex_index\nproperty uchar q\nend_header\n0 0 0 0\n1 0 0 1 7\n0 1e0 0 2 7 8\n3 0 1 2 9\n";
    std::string big = text.substr(0, text.find("end_header"));
    big.replace(big.find("ascii"), 5, "binary_big_endian");
    fuzz::write_seeds(*argc, *argv, {plain_ply(mesh), text, big + "end_header\n" + std::string(100, '\0')});
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::filesystem::path file = fuzz::folder() / "frame_1.ply";
    std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data), std::streamsize(size));
    try {
        rill::cooker::open_sequence(file.string(), {})->read(0);
    } catch (const rill::cooker::InputError&) {
    }
    return 0;
}
