// SPDX-License-Identifier: MIT
// Any bytes as one of the files of a Mantaflow cache. The first byte says which; whether the rest is packed first, or
// taken for the gzip stream itself.
#include "frames/open_sequence.h"
#include "fuzz_harness.h"
#include "sequence_files.h"
#include "shapes.h"

namespace {

constexpr float upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
constexpr const char* names[3] = {"mesh/fluid_mesh_0001.bobj.gz", "mesh/lVelMesh_0001.uni", "config/config_0001.uni"};

const std::string (&whole())[3] {
    static const std::string files[3] = {mantaflow_mesh(sphere(4, 0.2f)),
                                         mantaflow_velocity(std::vector<glm::vec3>(sphere(4, 0.2f).positions.size(), {1, 2, 3})),
                                         mantaflow_config(1, 24, {1, 2, 3}, upright)};
    return files;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    std::vector<std::string> seeds;
    for (int k = 0; k < 3; ++k) {
        seeds.push_back(char(k) + whole()[k]);
        seeds.push_back(char(k + 3) + gzip(whole()[k]));
    }
    fuzz::write_seeds(*argc, *argv, seeds);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    if (size == 0) return 0;
    static const bool prepared = [] {
        for (int k = 0; k < 3; ++k) put_file(fuzz::folder() / names[k], gzip(whole()[k]));
        return true;
    }();
    const int which = data[0] % 6;
    const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
    const std::filesystem::path file = fuzz::folder() / names[which % 3];
    put_file(file, which < 3 ? gzip(bytes) : bytes);
    try {
        rill::cooker::open_sequence(fuzz::folder().string(), {})->read(0);
    } catch (const rill::cooker::InputError&) {
    }
    put_file(file, gzip(whole()[which % 3]));
    return prepared ? 0 : 1;
}
