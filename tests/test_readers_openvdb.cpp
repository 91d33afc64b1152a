// SPDX-License-Identifier: MIT
// OpenVDB level sets as an input. Without the library: that the tool says so.
#include <doctest/doctest.h>

#include "frames/open_sequence.h"
#include "measure/surface_distance.h"
#include "reader_faults.h"
#include "sequence_files.h"

using namespace rill::cooker;

#ifdef RILL_OPENVDB
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <tbb/global_control.h>

#include <cmath>

namespace {

// The reader runs in a child of this process, where threads that OpenVDB may have started here would be missing.
const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);

constexpr float radius = 0.5f, voxel = 0.05f;

struct Vdb {
    openvdb::GridPtrVec grids;
    explicit Vdb(const openvdb::Vec3f& centre, const std::string& name = "surface") {
        openvdb::initialize();
        auto surface = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(radius, centre, voxel);
        surface->setName(name);
        grids.push_back(surface);
    }
    /// v = (z, 1, −x), known within and around the ball; staggered: each component on its own cell face.
    Vdb& velocity(const std::string& name, bool staggered = false) {
        auto grid = openvdb::Vec3SGrid::create();
        grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
        grid->setName(name);
        if (staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
        auto access = grid->getAccessor();
        for (int x = -14; x <= 14; ++x)
            for (int y = -14; y <= 14; ++y)
                for (int z = -14; z <= 14; ++z) access.setValue({x, y, z}, {float(z) * voxel, 1, -float(x) * voxel});
        grids.push_back(grid);
        return *this;
    }
    std::string put(const std::string& path) const {
        std::filesystem::create_directories(std::filesystem::path(path).parent_path());
        openvdb::io::File file(path);
        file.write(grids);
        file.close();
        return path;
    }
};

}  // namespace

TEST_CASE("a level set is its zero surface, closed and wound outward, with the velocity beside it") {
    const TestFolder folder;
    for (const char* name : {"v", "vel", "Velocity"})
        for (bool staggered : {false, true}) {
            CAPTURE(name);
            CAPTURE(staggered);
            Vdb({0, 0, 0}).velocity(name, staggered).put(folder / "f7.vdb");
            std::string said;
            ReadOptions options;
            options.warn = [&](const std::string& message) { said += message; };
            const auto reader = open_sequence(folder / "f7.vdb", options);
            CHECK(reader->info().numbers == std::vector<int>{7});
            CHECK(reader->info().velocity == VelocityMeaning::unknown);
            const Mesh mesh = reader->read(0);
            CHECK(said == "");  // not turned round: it came outward
            CHECK(signed_volume(mesh) == doctest::Approx(4.0 / 3 * 3.14159265 * std::pow(radius, 3)).epsilon(0.02));
            const Topology shape = topology(mesh);
            CHECK(shape.open_edges == 0);
            CHECK(shape.components == 1);
            REQUIRE(mesh.velocities.size() == mesh.positions.size());
            for (size_t i = 0; i < mesh.positions.size(); i += 7) {
                const glm::vec3 x = mesh.positions[i] * (1 - voxel / radius);  // a voxel inside
                REQUIRE(glm::distance(mesh.velocities[i], {x.z, 1, -x.x}) < 0.02f);
            }
        }
}

TEST_CASE("grids by name, frames without liquid, sequences") {
    const TestFolder folder;
    for (int i = 1; i <= 3; ++i) Vdb({0.1f * float(i), 0, 0}).velocity("other").velocity("v").put(folder / ("in/f" + std::to_string(i) + ".vdb"));
    auto empty = openvdb::FloatGrid::create(voxel);
    empty->setGridClass(openvdb::GRID_LEVEL_SET);
    Vdb none({0, 0, 0});
    none.grids = {empty};
    none.put(folder / "in/f4.vdb");
    const auto reader = open_sequence(folder / "in", {});
    CHECK(reader->info().format == "OpenVDB sequence");
    REQUIRE(reader->info().numbers.size() == 4);
    CHECK(reader->read(1).positions.size() > 500);
    CHECK(reader->read(3).triangles.empty());
    ReadOptions options;
    options.velocity_name = "other";
    CHECK(open_sequence(folder / "in/f1.vdb", options)->read(0).velocities.size() > 500);
    options.velocity_name = "gone";
    CHECK_FAULT(fault(folder / "in/f1.vdb", options), "no vector grid 'gone'", "other (vec3s)");
    Vdb fog({0, 0, 0}, "density");
    fog.grids[0]->setGridClass(openvdb::GRID_FOG_VOLUME);
    fog.put(folder / "f1.vdb");
    CHECK_FAULT(fault(folder / "f1.vdb"), "no level set; it holds density (float)");
}

TEST_CASE("damaged files are refused by name") {
    const TestFolder folder;
    const std::string good = get_file(Vdb({0, 0, 0}).velocity("v").put(folder / "good1.vdb"));
    put_file(folder / "f1.vdb", "");
    CHECK_FAULT(fault(folder / "f1.vdb"), "f1.vdb");
    put_file(folder / "f1.vdb", std::string(2000, 'x'));
    CHECK_FAULT(fault(folder / "f1.vdb"), "not usable");
    for (size_t length : {10u, 100u, 1000u}) {
        CAPTURE(length);
        put_file(folder / "f1.vdb", good.substr(0, length));
        CHECK_FAULT(fault(folder / "f1.vdb"), "f1.vdb");
    }
    for (size_t part = 1; part < 8; ++part) {
        CAPTURE(part);
        put_file(folder / "f1.vdb", good.substr(0, good.size() * part / 8));
        CHECK_FAULT(fault(folder / "f1.vdb"), "f1.vdb");
    }
}
#else
TEST_CASE("built without OpenVDB: .vdb is an unknown format") {
    const TestFolder folder;
    put_file(folder / "f1.vdb", "x");
    CHECK_FAULT(fault(folder / "f1.vdb"), "unknown format '.vdb'");
}
#endif
