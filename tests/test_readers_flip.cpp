// SPDX-License-Identifier: MIT
// FLIP Fluids caches: a real one, small ones written here, and damaged ones.
#include <doctest/doctest.h>

#include "frames/open_sequence.h"
#include "measure/surface_distance.h"
#include "reader_faults.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;
namespace fs = std::filesystem;

namespace {

std::string bobj(const std::vector<glm::vec3>& vertices, const std::vector<Triangle>& triangles = {}) {
    std::string bytes;
    put(bytes, int32_t(vertices.size()));
    for (const glm::vec3& x : vertices) put(bytes, x);
    put(bytes, int32_t(triangles.size()));
    for (const Triangle& t : triangles) put(bytes, t);
    return bytes;
}
std::string settings(const char* fps, const char* scale = "0.5") {
    return std::string(R"({"domain_data":{"initialize":{"scale":)") + scale +
           R"(},"simulation":{"frames_per_second":{"data":)" + fps + R"(,"is_animated":false}}}})";
}
void put_frame(const fs::path& cache, int frame, const Mesh& mesh) {
    const std::string number = "00000" + std::to_string(frame);
    put_file(cache / "bakefiles" / (number + ".bobj"), bobj(mesh.positions, mesh.triangles));
    put_file(cache / "bakefiles" / ("velocity" + number + ".bobj"), bobj(mesh.velocities));
    put_file(cache / "bakefiles" / ("finished" + number + ".txt"), number);
    put_file(cache / "bakefiles" / ("preview" + number + ".bobj"), "");
}
Mesh ball() {
    Mesh mesh = bumpy_sphere(6, 1);
    mesh.velocities.assign(mesh.positions.size(), {0, 0, -3});
    return mesh;
}
void put_cache(const fs::path& cache, int last = 4) {
    for (int frame = 1; frame <= last; ++frame) put_frame(cache, frame, ball());
    put_file(cache / "export/flipdata.sim", settings("30"));
}
/// Mean distance of moved vertices to a surface.
double miss(const Mesh& from, const SurfaceIndex& to, float seconds) {
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < from.positions.size(); i += 7, ++count)
        sum += to.closest(from.positions[i] + seconds * from.velocities[i], 10).distance;
    return sum / double(count);
}

}  // namespace

TEST_CASE("a cache the add-on wrote: units, direction, winding") {
    const auto reader = open_sequence(RILL_TEST_DATA "/flip_fluids", {});
    const SequenceInfo& info = reader->info();
    CHECK(info.format == "FLIP Fluids cache");
    CHECK(info.numbers == std::vector<int>{2, 3});
    CHECK(info.frames_per_second == 30);
    CHECK(info.velocity == VelocityMeaning::backward);
    const Mesh a = reader->read(0), b = reader->read(1);
    CHECK(a.positions.size() == 18710);
    CHECK(b.triangles.size() == 38024);
    CHECK(signed_volume(b) > 0);
    CHECK(topology(b).open_edges == 0);
    const SurfaceIndex previous(a);
    const float step = float(info.seconds[1] - info.seconds[0]);
    const double still = miss(b, previous, 0), back = miss(b, previous, -step), wrong = miss(b, previous, step);
    CAPTURE(still);
    CAPTURE(wrong);
    CHECK(back < 0.5 * still);
    CHECK(back < 0.5 * wrong);
    CHECK(open_sequence(RILL_TEST_DATA "/flip_fluids/bakefiles/", {})->info().numbers.size() == 2);
}

TEST_CASE("world scale, time scale and rate") {
    const TestFolder folder;
    put_cache(folder.path);
    const Mesh raw = ball();
    auto mesh = open_sequence(folder.path.string(), {})->read(0);
    CHECK(glm::distance(mesh.positions[5], raw.positions[5] * 0.5f) < 1e-6f);
    CHECK(mesh.velocities[0] == glm::vec3(0, 0, -3));  // metres per second whatever the scale
    put_file(folder / "bakefiles/metadata000001.json", R"({"time_scale": 0.25, "world_scale": 2})");
    mesh = open_sequence(folder.path.string(), {})->read(0);
    CHECK(glm::distance(mesh.positions[5], raw.positions[5] * 2.0f) < 1e-6f);
    CHECK(mesh.velocities[0].z == doctest::Approx(-0.75));
    ReadOptions options;
    options.frames_per_second = 60;  // played twice as fast
    CHECK(open_sequence(folder.path.string(), options)->read(1).velocities[0].z == doctest::Approx(-6));
    options.velocity_per_frame = true;
    CHECK_THROWS_AS(open_sequence(folder.path.string(), options), UsageError);
    std::string warning;
    options = {};
    options.warn = [&](const std::string& text) { warning = text; };
    fs::remove(folder / "export/flipdata.sim");
    CHECK(open_sequence(folder.path.string(), options)->info().frames_per_second == 24);
    CHECK_FAULT(warning, "flipdata.sim", "--fps");
}

TEST_CASE("frames are where their first substep ended") {
    const TestFolder folder;
    put_cache(folder.path);
    auto seconds = [&] { return open_sequence(folder.path.string(), {})->info().seconds; };
    CHECK(seconds()[3] == doctest::Approx(4 / 30.0));
    put_file(folder / "flipstats.data", R"({"1": {"substeps": 1}, "2": {"substeps": 2}, "3": {"substeps": 2}})");
    CHECK(seconds()[1] - seconds()[0] == doctest::Approx(0.5 / 30));
    CHECK(seconds()[2] - seconds()[1] == doctest::Approx(1 / 30.0));
    CHECK(seconds()[3] - seconds()[2] == doctest::Approx(1.5 / 30));
    std::string log;
    for (const char* run : {"40", "25"})  // a resumed bake logs the frame again
        log += std::string("----\n\nSimulation Frame: 3 / 90\n  Timeline Frame: 3 / 90\n         Substep: 1\n    Substep Time: 0.01s (") + run +
               "% of frame)\n\n  Timeline Frame: 3 / 90\n         Substep: 2\n    Substep Time: 0.02s (100% of frame)\n";
    put_file(folder / "logs/dam.txt", log);
    CHECK(seconds()[2] == doctest::Approx(2.25 / 30));
    CHECK(seconds()[1] == doctest::Approx(1.5 / 30));
}

TEST_CASE("frames without liquid, unfinished frames, caches without velocity") {
    const TestFolder folder;
    put_cache(folder.path);
    put_file(folder / "bakefiles/000001.bobj", "");
    put_file(folder / "bakefiles/000002.bobj", std::string(8, '\0'));
    for (int frame : {1, 2}) fs::remove(folder / ("bakefiles/velocity00000" + std::to_string(frame) + ".bobj"));
    const auto reader = open_sequence(folder.path.string(), {});
    CHECK(reader->info().velocity == VelocityMeaning::backward);
    CHECK(reader->read(0).triangles.empty());
    CHECK(reader->read(1).triangles.empty());
    CHECK(reader->read(2).triangles.size() == ball().triangles.size());

    std::string warning;
    ReadOptions options;
    options.warn = [&](const std::string& text) { warning = text; };
    fs::remove(folder / "bakefiles/finished000004.txt");
    CHECK(open_sequence(folder.path.string(), options)->info().numbers == std::vector<int>{1, 2, 3});
    CHECK_FAULT(warning, "000004.bobj", "not finished");
    put_file(folder / "bakefiles/finished000004.txt", "4");
    fs::remove(folder / "bakefiles/velocity000003.bobj");
    CHECK_FAULT(fault(folder.path.string()), "velocity000003.bobj", "missing");
    fs::remove(folder / "bakefiles/velocity000004.bobj");
    fs::remove(folder / "bakefiles/000004.bobj");
    CHECK(open_sequence(folder.path.string(), {})->info().velocity == VelocityMeaning::none);
}

TEST_CASE("damage") {
    const TestFolder folder;
    put_cache(folder.path, 2);
    const std::string input = folder.path.string();
    const fs::path mesh = folder.path / "bakefiles/000002.bobj", velocity = folder.path / "bakefiles/velocity000002.bobj";
    CHECK(damage_everywhere(input, mesh, "000002.bobj", 3) > 100);
    CHECK(damage_everywhere(input, velocity, "000002.bobj", 5) > 40);
    CHECK(damage_everywhere(input, folder.path / "export/flipdata.sim", "flipdata.sim") > 100);
    put_file(folder / "flipstats.data", R"({"1": {"substeps": 2}})");
    CHECK(damage_everywhere(input, folder.path / "flipstats.data", "flipstats.data") > 10);
    Mesh bad = ball();
    bad.triangles[3][1] = uint32_t(bad.positions.size());
    put_frame(folder.path, 2, bad);
    CHECK_FAULT(fault(input), "000002.bobj", "triangle 3 refers to vertex");
    bad = ball();
    bad.velocities[7].y = std::numeric_limits<float>::quiet_NaN();
    put_frame(folder.path, 2, bad);
    CHECK_FAULT(fault(input), "000002", "velocity of vertex 7 is not finite");
    bad.velocities.pop_back();
    put_frame(folder.path, 2, bad);
    CHECK_FAULT(fault(input), "velocity000002.bobj", "the mesh has");
    for (const int32_t count : {-1, 0x7fffffff, int32_t(0x80000000)}) {
        std::string bytes = bobj(ball().positions, ball().triangles);
        std::memcpy(bytes.data(), &count, 4);
        put_file(mesh, bytes);
        CHECK_FAULT(fault(input), "000002.bobj", "vertices");
    }
    put_frame(folder.path, 2, ball());
    put_file(folder / "export/flipdata.sim", settings("0"));
    CHECK_FAULT(fault(input), "flipdata.sim", "frames_per_second");
    put_file(folder / "export/flipdata.sim", settings("\"30\""));
    CHECK_FAULT(fault(input), "flipdata.sim", "frames_per_second");
    fs::remove_all(folder / "bakefiles");
    fs::create_directory(folder / "bakefiles");
    CHECK_FAULT(fault(input), "bakefiles", "nothing is baked");
}
