// SPDX-License-Identifier: MIT
// Any bytes as an OpenVDB file: read, or refused with an InputError.
#include "fuzz_reader.h"

#ifdef RILL_OPENVDB
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <tbb/global_control.h>

// The reader runs in a child of this process, where threads that OpenVDB may have started here would be missing.
static const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
    openvdb::initialize();
    const auto ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.2f, {0, 0, 0}, 0.05f);
    ball->setName("surface");
    const auto velocity = openvdb::Vec3SGrid::create();
    velocity->setTransform(ball->transformPtr());
    velocity->setName("v");
    velocity->fill({{-6, -6, -6}, {6, 6, 6}}, {1, 2, 3});
    const std::string file = fuzz::folder() / "seed.vdb";
    std::vector<std::string> seeds;
    for (const uint32_t compression : {openvdb::io::COMPRESS_ZIP, openvdb::io::COMPRESS_BLOSC}) {
        openvdb::io::File out(file);
        out.setCompression(compression);
        out.write(openvdb::GridPtrVec{ball, velocity});
        out.close();
        seeds.push_back(get_file(file));
    }
    fuzz::write_seeds(*argc, *argv, seeds);
    return 0;
}
#endif

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::read_as({"f1.vdb"}, "f1.vdb", data, size);
    return 0;
}
