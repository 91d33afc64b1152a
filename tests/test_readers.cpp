// SPDX-License-Identifier: MIT
// Every input format, and every kind of bad input: one line that names file and cause, never a crash.
#include <doctest/doctest.h>

#include <limits>

#include "frames/open_sequence.h"
#include "reader_faults.h"
#include "readers/draco_mesh.h"
#include "sequence_files.h"
#include "shapes.h"
#include "writers/frame_writer.h"

using namespace rill::cooker;
namespace fs = std::filesystem;

namespace {

Mesh moving_ball(int frame) {
    Mesh mesh = bumpy_sphere(12, 0.5f, {0.1f * float(frame), 0, 0});
    mesh.velocities.assign(mesh.positions.size(), {2.4f, 0, 0});
    return mesh;
}

constexpr float upright[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

void put_cache(const fs::path& folder, int first, int last, const float (&rows)[9] = upright, const glm::vec3& origin = {1, 2, 3}) {
    for (int frame = first; frame <= last; ++frame) {
        char digits[8];
        std::snprintf(digits, sizeof digits, "%04d", frame);
        Mesh mesh = bumpy_sphere(8, 0.2f);
        mesh.velocities.assign(mesh.positions.size(), {1, 0, -2});
        put_file(folder / "mesh" / ("fluid_mesh_" + std::string(digits) + ".bobj.gz"), gzip(mantaflow_mesh(mesh)));
        put_file(folder / "mesh" / ("lVelMesh_" + std::string(digits) + ".uni"), gzip(mantaflow_velocity(mesh.velocities)));
        put_file(folder / "config" / ("config_" + std::string(digits) + ".uni"), gzip(mantaflow_config(frame, 24, origin, rows)));
    }
}

void put_balls(const TestFolder& folder, int first, int last, int step = 1) {
    for (int frame = first; frame <= last; frame += step) {
        char name[32];
        std::snprintf(name, sizeof name, "frame_%04d.ply", frame);
        put_file(folder / name, plain_ply(moving_ball(frame)));
    }
}

}  // namespace

TEST_CASE("Mantaflow cache: world space, metres per second") {
    const TestFolder folder;
    put_cache(folder.path, 1, 3);
    const auto reader = open_sequence(folder.path.string(), {});
    const SequenceInfo& info = reader->info();
    CHECK(info.format == "Mantaflow cache");
    CHECK(info.numbers == std::vector<int>{1, 2, 3});
    CHECK(info.frames_per_second == 24);
    CHECK(info.seconds[2] == doctest::Approx(3 / 24.0));
    CHECK(info.velocity == VelocityMeaning::forward);
    CHECK(info.raw_bytes > 0);
    const Mesh mesh = reader->read(1), raw = bumpy_sphere(8, 0.2f);
    REQUIRE(mesh.positions.size() == raw.positions.size());
    CHECK(glm::distance(mesh.positions[9], raw.positions[9] * 4.0f + glm::vec3(1, 2, 3)) < 1e-5f);
    // One raw unit: 4 m / 32 cells · 2.5 solver time units a second.
    CHECK(mesh.velocities[0].x == doctest::Approx(0.3125));
    CHECK(mesh.velocities[0].z == doctest::Approx(-0.625));
    CHECK(fault(folder / "mesh") == "");
}

TEST_CASE("Mantaflow cache of a scaled and turned domain") {
    const TestFolder folder;
    const float rows[9] = {0, 3, 0, -1, 0, 0, 0, 0, 1};  // x → 3y, y → −x: longest side 4·3 = 12 m
    put_cache(folder.path, 1, 2, rows, {0, 0, 0});
    const Mesh mesh = open_sequence(folder.path.string(), {})->read(0), raw = bumpy_sphere(8, 0.2f);
    const glm::vec3 x = raw.positions[9] * 12.0f;
    CHECK(glm::distance(mesh.positions[9], {-x.y, x.x, x.z}) < 1e-5f);
    CHECK(glm::distance(mesh.velocities[0], glm::vec3(0, 1, -2) * (12.0f / 32 * 2.5f)) < 1e-5f);
}

TEST_CASE("Mantaflow cache: the rate from bake.json, --fps, or a guess that is told") {
    const TestFolder folder;
    put_cache(folder.path, 1, 2);
    ReadOptions options;
    std::string warning;
    options.warn = [&](const std::string& text) { warning = text; };
    put_file(folder / "bake.json", R"({"fps": 30})");
    CHECK(open_sequence(folder.path.string(), options)->info().frames_per_second == 30);
    options.frames_per_second = 48;
    CHECK(open_sequence(folder.path.string(), options)->info().frames_per_second == 48);
    put_file(folder / "bake.json", "{");
    CHECK_FAULT(fault(folder.path.string()), "bake.json", "not a JSON object");
    put_file(folder / "bake.json", R"({"fps": -2})");
    CHECK_FAULT(fault(folder.path.string()), "bake.json", "fps");
    fs::remove(folder / "bake.json");
    for (int frame : {1, 2}) put_file(folder.path / "config" / ("config_000" + std::to_string(frame) + ".uni"),
                                      gzip(mantaflow_config(frame, 60, {}, upright)));
    options.frames_per_second = 0;
    CHECK(open_sequence(folder.path.string(), options)->info().frames_per_second == 24);
    CHECK_FAULT(warning, "60", "--fps");
}

TEST_CASE("Mantaflow cache: damage") {
    const TestFolder folder;
    put_cache(folder.path, 1, 4);
    const fs::path mesh = folder.path / "mesh/fluid_mesh_0002.bobj.gz", velocity = folder.path / "mesh/lVelMesh_0002.uni",
                   config = folder.path / "config/config_0002.uni";
    const std::string input = folder.path.string(), whole = get_file(mesh), raw = mantaflow_mesh(bumpy_sphere(8, 0.2f));
    CHECK(fault(input) == "");

    put_file(mesh, whole.substr(0, whole.size() / 2));
    CHECK_FAULT(fault(input), "fluid_mesh_0002", "middle of its gzip stream");
    put_file(mesh, whole.substr(0, whole.size() - 4));
    CHECK_FAULT(fault(input), "fluid_mesh_0002", "gzip");
    put_file(mesh, "");
    CHECK_FAULT(fault(input), "fluid_mesh_0002", "empty file");
    put_file(mesh, raw);
    CHECK_FAULT(fault(input), "fluid_mesh_0002", "not a gzip stream");
    std::string damaged = whole;
    for (size_t i = 20; i < 60; ++i) damaged[i] = char(damaged[i] ^ 0x5a);
    put_file(mesh, damaged);
    CHECK_FAULT(fault(input), "fluid_mesh_0002");
    for (const size_t length : {size_t(0), size_t(3), size_t(100), raw.size() - 1}) {
        put_file(mesh, gzip(raw.substr(0, length)));
        CHECK_FAULT(fault(input), "fluid_mesh_0002");
    }
    put_file(mesh, gzip(raw + "x"));
    CHECK_FAULT(fault(input), "fluid_mesh_0002", "too many");
    for (const int32_t count : {-1, 0x7fffffff, int32_t(0x80000000)}) {
        std::string bad = raw;
        std::memcpy(bad.data(), &count, 4);
        put_file(mesh, gzip(bad));
        CHECK_FAULT(fault(input), "fluid_mesh_0002", "vertices");
    }
    put_file(mesh, whole);

    put_file(velocity, gzip(mantaflow_velocity(std::vector<glm::vec3>(3))));
    CHECK_FAULT(fault(input), "lVelMesh_0002", "for 3 vertices");
    put_file(velocity, gzip("MD99" + mantaflow_velocity({}).substr(4)));
    CHECK_FAULT(fault(input), "lVelMesh_0002", "MD01");
    fs::remove(velocity);
    CHECK_FAULT(fault(input), "lVelMesh_0002", "missing");
    put_cache(folder.path, 2, 2);

    put_file(config, gzip(std::string(204, '\0')));
    CHECK_FAULT(fault(input), "config_0002", "C01");
    put_file(config, gzip("short"));
    CHECK_FAULT(fault(input), "config_0002", "ends");
    fs::remove(config);
    CHECK_FAULT(fault(input), "config_0002", "No such file");
    put_cache(folder.path, 2, 2);

    fs::remove(mesh);
    CHECK_FAULT(warning(input), "frame 2 is missing");
}

TEST_CASE("a Mantaflow cache without any velocity is read; where velocity is needed, it is estimated and told") {
    const TestFolder folder;
    put_cache(folder.path, 1, 2);
    for (int frame : {1, 2}) fs::remove(folder.path / "mesh" / ("lVelMesh_000" + std::to_string(frame) + ".uni"));
    CHECK(open_sequence(folder.path.string(), {})->info().velocity == VelocityMeaning::none);
    ReadOptions options;
    std::string warning;
    options.warn = [&](const std::string& text) { warning = text; };
    options.require_velocity = true;
    const auto reader = open_sequence(folder.path.string(), options);
    CHECK(reader->info().velocity == VelocityMeaning::forward);
    CHECK(reader->read(0).velocities.size() == reader->read(0).positions.size());
    CHECK_FAULT(warning, "fluid_mesh_0001", "no velocity", "estimate");
    warning.clear();
    options.velocity_name = "estimate";
    CHECK(open_sequence(folder.path.string(), options)->info().velocity == VelocityMeaning::forward);
    CHECK(warning.empty());
}

TEST_CASE("PLY sequence by directory, pattern, glob and single file") {
    const TestFolder folder;
    put_balls(folder, 7, 10);
    put_file(folder / "sequence.json", R"({"fps": 30, "anything": [1]})");
    const Mesh expected = moving_ball(8);
    for (const char* name : {"", "frame_%04d.ply", "frame_*.ply", "frame_####.ply", "*.ply", "frame_00??.PLY"}) {
        CAPTURE(name);
        const auto reader = open_sequence(folder / name, {});
        CHECK(reader->info().numbers == std::vector<int>{7, 8, 9, 10});
        CHECK(reader->info().frames_per_second == 30);
        CHECK(reader->info().velocity == VelocityMeaning::unknown);
        const Mesh mesh = reader->read(1);
        CHECK(mesh.positions == expected.positions);
        CHECK(mesh.velocities == expected.velocities);
        CHECK(mesh.triangles == expected.triangles);
    }
    const auto one = open_sequence(folder / "frame_0009.ply", {});
    CHECK(one->info().numbers == std::vector<int>{9});
    CHECK(one->read(0).positions.size() == expected.positions.size());
    ReadOptions options;
    options.velocity_per_frame = true;
    CHECK(open_sequence(folder.path.string(), options)->read(0).velocities[0].x == doctest::Approx(72));
}

TEST_CASE("frames asked for") {
    const TestFolder folder;
    put_balls(folder, 1, 10);
    auto numbers = [&](int first, int last, int step) {
        ReadOptions options;
        options.first = first, options.last = last, options.step = step;
        return open_sequence(folder.path.string(), options)->info().numbers;
    };
    CHECK(numbers(3, 5, 1) == std::vector<int>{3, 4, 5});
    CHECK(numbers(1, 10, 4) == std::vector<int>{1, 5, 9});
    CHECK(numbers(4, 4, 1) == std::vector<int>{4});
    CHECK_THROWS_AS(numbers(0, 5, 1), InputError);
    CHECK_THROWS_AS(numbers(5, 11, 1), InputError);
    CHECK_THROWS_AS(numbers(5, 4, 1), UsageError);
    fs::remove(folder / "frame_0006.ply");
    CHECK_FAULT(warning(folder.path.string()), "frame 6 is missing");
    CHECK(numbers(1, 10, 1) == std::vector<int>{1, 2, 3, 4, 5, 7, 8, 9, 10});
    CHECK(open_sequence(folder.path.string(), {})->info().seconds[5] == doctest::Approx(7 / 24.0));
    CHECK(numbers(1, 5, 1).size() == 5);
    CHECK(numbers(1, 9, 2).size() == 5);
    ReadOptions options;
    options.first = 2, options.last = 10, options.step = 2;
    CHECK_FAULT(warning(folder.path.string(), options), "frame 6 is missing");
    fs::rename(folder / "frame_0009.ply", folder / "frame_0012.ply");
    options.last = 12, options.step = 0;
    for (int gone : {3, 5, 7}) fs::remove(folder / ("frame_000" + std::to_string(gone) + ".ply"));
    fs::remove(folder / "frame_0001.ply");
    CHECK(open_sequence(folder.path.string(), {})->info().numbers == std::vector<int>{2, 4, 8, 10, 12});
    put_balls(folder, 5, 5);
    fs::remove(folder / "frame_0004.ply"), fs::remove(folder / "frame_0010.ply");  // 2, 5, 8, 12
    CHECK_FAULT(fault(folder.path.string()), "frame 12 does not fit");
    put_balls(folder, 1, 10);
    fs::remove(folder / "frame_0006.ply"), fs::remove(folder / "frame_0012.ply");
    for (int odd : {1, 3, 5, 7, 9}) fs::remove(folder / ("frame_000" + std::to_string(odd) + ".ply"));
    put_balls(folder, 6, 6);
    CHECK(open_sequence(folder.path.string(), {})->info().numbers == std::vector<int>{2, 4, 6, 8, 10});
    CHECK(numbers(4, 8, 1) == std::vector<int>{4, 6, 8});  // a range alone keeps the source's step
}

TEST_CASE("PLY in every encoding, type and order") {
    const TestFolder folder;
    put_file(folder / "a_1.ply",
             "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nelement vertex 4\r\nproperty float velocity_z\r\nproperty double z\r\n"
             "property uchar red\r\nproperty float32 x\r\nproperty int16 y\r\nproperty float velocity_x\r\nproperty float velocity_y\r\n"
             "property list uchar float weights\r\nelement material 1\r\nproperty int kind\r\nelement face 1\r\nproperty uchar flags\r\n"
             "property list uint8 uint32 vertex_index\r\nelement edge 1\r\nproperty int a\r\nend_header\r\n"
             "3 0 255 0 0 1 2 0\r\n3 0.0e0 255 +1 0 1 2 2 .5 .5\n3 0 0 1 1 1 2 0\n3\t1e-50 0 0 1 1 2 1 9\n77\n5 4 0 1 2 3\n1");
    const Mesh ascii = open_sequence(folder / "a_1.ply", {})->read(0);
    CHECK(ascii.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    CHECK(ascii.velocities[3] == glm::vec3(1, 2, 3));
    CHECK(ascii.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});

    std::string big = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty double x\nproperty float y\nproperty short z\n"
                      "element face 1\nproperty list uint ushort vertex_indices\nend_header\n";
    auto put_big = [&](auto value) {
        char raw[sizeof value];
        std::memcpy(raw, &value, sizeof value);
        for (size_t i = sizeof value; i-- > 0;) big += raw[i];
    };
    for (const glm::vec3& x : {glm::vec3(0, 0, 5), glm::vec3(1.5f, 0, 5), glm::vec3(0, 2.5f, 5)})
        put_big(double(x.x)), put_big(x.y), put_big(int16_t(x.z));
    put_big(uint32_t(3));
    for (uint16_t index : {0, 1, 2}) put_big(index);
    put_file(folder / "b_1.ply", big);
    const Mesh mesh = open_sequence(folder / "b_1.ply", {})->read(0);
    CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 5}, {1.5f, 0, 5}, {0, 2.5f, 5}});
    CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}});
    CHECK(mesh.velocities.empty());
}

TEST_CASE("PLY velocity by name") {
    const TestFolder folder;
    const Mesh ball = moving_ball(1);
    std::string bytes = plain_ply(ball);
    for (const char* axis : {"x", "y", "z"}) bytes.replace(bytes.find(std::string("v") + axis), 2, std::string("flow.") + axis);
    put_file(folder / "f1.ply", bytes);
    CHECK(open_sequence(folder / "f1.ply", {})->info().velocity == VelocityMeaning::none);
    ReadOptions options;
    options.velocity_name = "flow";
    CHECK(open_sequence(folder / "f1.ply", options)->read(0).velocities == ball.velocities);
    options.velocity_name = "swirl";
    CHECK_FAULT(fault(folder / "f1.ply", options), "f1.ply", "swirl");
    const auto renamed = [&](const std::string& name, const char (&ends)[4]) {
        std::string other = plain_ply(ball);
        for (int a = 0; a < 3; ++a) other.replace(other.find(std::string("v") + "xyz"[a]), 2, name + ends[a]);
        put_file(folder / "f1.ply", other);
        return open_sequence(folder / "f1.ply", {})->read(0).velocities;
    };
    for (const char* name : {"velocity_", "vel", "Velocity.", "flip_velocity_", "v_", ".velocities_", "_VELOCITY_", "_velocity.", "VEL_"}) {
        CAPTURE(name);
        CHECK(renamed(name, "xyz") == ball.velocities);
    }
    CHECK(renamed("VEL_", "XYZ") == ball.velocities);
    CHECK(renamed("Velocity", "XYZ") == ball.velocities);
    CHECK(renamed("velocities_", "012") == ball.velocities);
    for (const char* name : {"level", "vx", "nv_"}) CHECK(renamed(name, "xyz").empty());
}

TEST_CASE("PLY damage") {
    const TestFolder folder;
    const std::string file = folder / "f1.ply", good = plain_ply(moving_ball(1));
    for (size_t length = 0; length < good.size(); length += length < 400 ? 1 : 97) {
        put_file(file, good.substr(0, length));
        CHECK_FAULT(fault(file), "f1.ply");
    }
    auto with = [&](const std::string& from, const std::string& to) {
        std::string bytes = good;
        bytes.replace(bytes.find(from), from.size(), to);
        put_file(file, bytes);
        return fault(file);
    };
    CHECK_FAULT(with("ply\n", "plx\n"), "not a PLY");
    CHECK_FAULT(with("binary_little_endian", "binary_middle_endian"), "line 2", "middle");
    CHECK_FAULT(with("format binary_little_endian 1.0\n", ""), "no format");
    CHECK_FAULT(with("element vertex 62", "element vertex 4000000000000000"), "4000000000000000", "bytes");
    CHECK_FAULT(with("element vertex 62", "element vertex -3"), "count");
    CHECK_FAULT(with("element vertex 62", "element vertex 99999999999999999999999"), "count");
    CHECK_FAULT(with("property float y", "property quad y"), "quad");
    CHECK_FAULT(with("property float y", "property float w"), "no x y z");
    CHECK_FAULT(with("uchar int vertex_indices", "float int vertex_indices"), "float");
    CHECK_FAULT(with("vertex_indices", "corners"), "vertex_indices");
    CHECK_FAULT(with("end_header", "endheader"), "header");
    CHECK_FAULT(with("element face", "element shape"), "no face element");
    std::string bytes = good;
    bytes[bytes.size() - 13] = char(200);  // the last face claims 200 corners
    put_file(file, bytes);
    CHECK_FAULT(fault(file), "list of 200");
    put_file(file, "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 0\n"
                   "property list uchar int vertex_indices\nend_header\n1 two 3\n");
    CHECK_FAULT(fault(file), "f1.ply", "'two' is not a number");
}

TEST_CASE("values that no surface has") {
    const TestFolder folder;
    const std::string file = folder / "f1.ply";
    auto check = [&](auto change, const char* cause) {
        Mesh mesh = moving_ball(1);
        change(mesh);
        put_file(file, plain_ply(mesh));
        CHECK_FAULT(fault(file), "f1.ply", cause);
    };
    check([](Mesh& m) { m.positions[5].y = std::numeric_limits<float>::quiet_NaN(); }, "position of vertex 5");
    check([](Mesh& m) { m.positions[6].z = -std::numeric_limits<float>::infinity(); }, "position of vertex 6");
    check([](Mesh& m) { m.positions[7].x = 1e30f; }, "position of vertex 7");
    check([](Mesh& m) { m.velocities[8].x = std::numeric_limits<float>::quiet_NaN(); }, "velocity of vertex 8");
    check([](Mesh& m) { m.triangles[9][1] = 62; }, "triangle 9 refers to vertex 62 of 62");
    check([](Mesh& m) { m.triangles[9][1] = 0xffffffffu; }, "face 9");
}

TEST_CASE("frames are put right: degenerate triangles go, the winding turns outward") {
    const TestFolder folder;
    Mesh mesh = moving_ball(1);
    const Mesh good = mesh;
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    mesh.triangles.push_back({3, 3, 4});
    put_file(folder / "f1.ply", plain_ply(mesh));
    put_file(folder / "f2.ply", plain_ply(mesh));
    ReadOptions options;
    std::vector<std::string> warnings;
    options.warn = [&](const std::string& text) { warnings.push_back(text); };
    const auto reader = open_sequence(folder.path.string(), options);
    const Mesh read = reader->read(0);
    reader->read(1);
    CHECK(read.triangles == good.triangles);
    REQUIRE(warnings.size() == 1);  // not once per frame
    CHECK_FAULT(warnings[0], "f1.ply", "inward");
}

TEST_CASE("frames without liquid are legal") {
    const TestFolder folder;
    put_balls(folder, 1, 3);
    Mesh empty;
    put_file(folder / "frame_0001.ply", plain_ply(empty));
    put_file(folder / "frame_0004.ply", plain_ply(empty));
    ReadOptions options;
    options.require_velocity = true;
    const auto reader = open_sequence(folder.path.string(), options);
    CHECK(reader->read(0).triangles.empty());
    CHECK(!reader->read(1).triangles.empty());
    CHECK(reader->read(3).triangles.empty());
    const TestFolder cache;
    put_cache(cache.path, 1, 2);
    put_file(cache.path / "mesh/fluid_mesh_0003.bobj.gz", gzip(mantaflow_mesh(Mesh{})));
    put_file(cache.path / "config/config_0003.uni", gzip(mantaflow_config(3, 24, {}, upright)));
    CHECK(open_sequence(cache.path.string(), options)->read(2).triangles.empty());
}

TEST_CASE("a single frame is legal") {
    const TestFolder folder;
    put_balls(folder, 5, 5);
    CHECK(open_sequence(folder.path.string(), {})->info().numbers == std::vector<int>{5});
    const TestFolder cache;
    put_cache(cache.path, 4, 4);
    const auto reader = open_sequence(cache.path.string(), {});
    CHECK(reader->info().numbers == std::vector<int>{4});
    CHECK(reader->read(0).velocities[0].x == doctest::Approx(0.3125));
}

TEST_CASE("inputs that are none") {
    const TestFolder folder;
    CHECK_FAULT(fault(folder.path.string()), folder.path.string(), "empty");
    CHECK_FAULT(fault(folder / "nothing"), "nothing", "no such file");
    CHECK_FAULT(fault(folder / "frame_%04d.ply"), "no file matches");
    CHECK_FAULT(fault(folder / "gone" + "/frame_%04d.ply"), "gone", "No such file");
    put_file(folder / "scene.blend", "BLENDER");
    CHECK_FAULT(fault(folder.path.string()), "no frames found", "Mantaflow", ".ply", ".obj");
    CHECK_FAULT(fault(folder / "scene.blend"), "unknown format", ".blend", ".ply");
    put_balls(folder, 1, 2);
    put_file(folder / "preview_0001.ply", plain_ply(moving_ball(1)));
    CHECK_FAULT(fault(folder.path.string()), "frame 1 is also", "pattern");
    fs::remove(folder / "preview_0001.ply");
    put_file(folder / "frame_0001.obj", "v 0 0 0\n");
    CHECK_FAULT(fault(folder.path.string()), "holds both", "pattern");
    put_file(folder / "notes.ply", "x");
    CHECK_FAULT(fault(folder / "*.ply"), "notes.ply", "no frame number");
    fs::create_directories(folder.path / "cache/mesh");
    fs::create_directories(folder.path / "cache/config");
    CHECK_FAULT(fault(folder / "cache"), "fluid_mesh_");
}

TEST_CASE("OBJ") {
    const TestFolder folder;
    put_file(folder / "w1.obj", "# quad\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\nf -4 -3 -2\n");
    const Mesh mesh = open_sequence(folder / "w1.obj", {})->read(0);
    CHECK(mesh.positions.size() == 4);
    CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}});
    CHECK(mesh.velocities.empty());
    put_file(folder / "w1.obj", "v +0 0 0\r\nv +1e0 0 0\r\nv 1 +1. 0\r\nf 1 2 3\r\n");
    CHECK(open_sequence(folder / "w1.obj", {})->read(0).triangles.size() == 1);
    put_file(folder / "w1.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n");
    CHECK_FAULT(fault(folder / "w1.obj"), "w1.obj");
    put_file(folder / "w1.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 -9\n");
    CHECK_FAULT(fault(folder / "w1.obj"), "w1.obj");
    put_file(folder / "w1.obj", "v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
    CHECK_FAULT(fault(folder / "w1.obj"), "w1.obj");
    put_file(folder / "w1.obj", std::string("\0\1\2\3", 4));
    CHECK_FAULT(fault(folder / "w1.obj"), "w1.obj", "not an OBJ");
    const auto refused = [&](const std::string& text, const char* place, const char* cause) {
        put_file(folder / "w1.obj", text);
        CHECK_FAULT(fault(folder / "w1.obj"), "w1.obj", place, cause);
    };
    const std::string three = "o a\nv 0 0 0\nv 1 0 0\n  v\t1 1 0 1\r\n";
    refused(three + "f 1 2 99999999999999999999\n", "line 5", "'99999999999999999999' is no vertex");
    refused(three + "f 1 2 -99999999999999999999\n", "line 5", "is no vertex");
    refused(three + "f 1 two 3\n", "line 5", "'two' is no vertex");
    refused(three + "f 1/1 2/2\n", "line 5", "a face of fewer than three corners");
    refused(three + "f 1 2", "line 5", "fewer than three");  // cut off
    refused(three + "v 1 2\nf 1 2 3\n", "line 5", "a position of fewer than three numbers");
    refused(three + "v 1 abc 2\nf 1 2 3\n", "line 5", "'abc' is no number");
    refused(three + "v 1 1e400 2\nf 1 2 3\n", "line 5", "is no number");
    refused(three + "v 1 -inf 2\nf 1 2 3\n", "line 5", "a position that is not finite");
    refused(three, "w1.obj", "vertices without a face");
    refused("", "w1.obj", "empty file");
    put_file(folder / "w1.obj", "# no liquid\no water\n");
    CHECK(fault(folder / "w1.obj") == "");
    put_file(folder / "w1.obj", three + "f 1//4\t2/7  -1/1/1 \r\nvt 0 0\nl 1 2\nf 1 2 3");
    CHECK(fault(folder / "w1.obj") == "");
}

TEST_CASE("Draco") {
    const TestFolder folder;
    const Mesh ball = moving_ball(2);
    const std::string good = draco_encode(ball, 14, 14);
    put_file(folder / "d2.drc", good);
    const auto reader = open_sequence(folder / "*.drc", {});
    CHECK(reader->info().velocity == VelocityMeaning::unknown);
    const Mesh mesh = reader->read(0);
    CHECK(mesh.triangles.size() == ball.triangles.size());
    CHECK(signed_volume(mesh) == doctest::Approx(signed_volume(ball)).epsilon(0.001));
    CHECK(mesh.velocities[5].x == doctest::Approx(2.4).epsilon(0.001));
    put_file(folder / "d2.drc", "");
    CHECK_FAULT(fault(folder / "d2.drc"), "d2.drc", "empty file");
    for (size_t length = 1; length < good.size(); length += 7) {
        put_file(folder / "d2.drc", good.substr(0, length));
        CHECK_FAULT(fault(folder / "d2.drc"), "d2.drc");
    }
    // A few bytes that state a hundred million faces, for which Draco would take gigabytes before it looks at them.
    put_file(folder / "d2.drc", std::string("DRACO\x02\x02\x01\x01\0\0\0\x1b\xb2\xb2\xb2\xb2\0/\xb2\xb2\xb2\x30\0\0", 25));
    CHECK_FAULT(fault(folder / "d2.drc"), "in 25 bytes");
    const Mesh flat = plane(300, 1);  // what Draco describes in the fewest bytes
    CHECK(draco_decode(draco_encode(flat, 6, 6), "flat").triangles.size() == flat.triangles.size());
}

TEST_CASE("what is written reads back") {
    const TestFolder folder;
    Mesh mesh = moving_ball(3);
    mesh.normals = vertex_normals(mesh);
    write_frame(folder / "f3.ply", mesh);
    write_frame(folder / "f3.obj", mesh);
    const Mesh ply = open_sequence(folder / "f3.ply", {})->read(0), obj = open_sequence(folder / "f3.obj", {})->read(0);
    CHECK(ply.positions == mesh.positions);
    CHECK(ply.velocities == mesh.velocities);
    CHECK(ply.triangles == mesh.triangles);
    CHECK(obj.triangles == mesh.triangles);
    for (size_t i = 0; i < mesh.positions.size(); ++i) REQUIRE(glm::distance(obj.positions[i], mesh.positions[i]) < 1e-6f);
    CHECK_THROWS_AS(write_frame(folder / "f3.stl", mesh), UsageError);
    CHECK_THROWS_AS(write_frame(folder / "gone" + "/f3.ply", mesh), InputError);
    for (const auto& entry : fs::directory_iterator(folder.path)) CHECK(entry.path().extension() != ".partial");
    CHECK(number_pattern("a_%04d.ply", 7) == "a_0007.ply");
    CHECK(number_pattern("a_%d%%.ply", 12345) == "a_12345%%.ply");
    CHECK_THROWS_AS(number_pattern("%d_%d.ply", 1), UsageError);
}

TEST_CASE("up axis, handedness and scale of the source: assets are right-handed, z up, in metres") {
    const TestFolder folder;
    Mesh ball = moving_ball(3);
    for (size_t i = 0; i < ball.positions.size(); ++i) ball.positions[i] += glm::vec3(1, 2, 3), ball.velocities[i] = {4, 5, 6};
    put_file(folder / "f1.ply", plain_ply(ball));
    const glm::vec3 x = ball.positions[9];
    const auto read = [&](char up, char handedness, double scale) {
        ReadOptions options;
        options.up = up, options.handedness = handedness, options.scale = scale;
        return open_sequence(folder / "f1.ply", options)->read(0);
    };
    const auto same = [](const glm::vec3& a, const glm::vec3& b) { return glm::distance(a, b) < 1e-5f; };
    CHECK(read(0, 0, 0).positions[9] == x);
    CHECK(read('z', 'r', 1).positions[9] == x);
    Mesh mesh = read('y', 0, 0.01);
    CHECK(same(mesh.positions[9], 0.01f * glm::vec3(x.x, -x.z, x.y)));
    CHECK(same(mesh.velocities[9], 0.01f * glm::vec3(4, -6, 5)));
    CHECK(mesh.triangles == ball.triangles);
    CHECK(signed_volume(mesh) == doctest::Approx(1e-6 * signed_volume(ball)));
    // Mirrored back: a program of the other hand winds the other way round, and the surface faces outward all the same.
    CHECK(same(read(0, 'l', 0).positions[9], {x.x, -x.y, x.z}));
    mesh = read('y', 'l', 0);
    CHECK(same(mesh.positions[9], {x.x, x.z, x.y}));
    CHECK(same(mesh.velocities[9], {4, 6, 5}));
    CHECK(signed_volume(mesh) == doctest::Approx(signed_volume(ball)));
}
