// SPDX-License-Identifier: MIT
// glTF and GLB: transforms, merged and compressed primitives, and damaged files.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "frames/open_sequence.h"
#include "reader_faults.h"
#include "readers/draco_mesh.h"
#include "sequence_files.h"
#include "shapes.h"
#include "writers/frame_writer.h"

using namespace rill::cooker;
using nlohmann::json;

namespace {

/// A file put together by hand.
struct File {
    json gltf = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}}};
    std::string data;

    int view(const std::string& bytes, int stride = 0) {
        json view = {{"buffer", 0}, {"byteOffset", data.size()}, {"byteLength", bytes.size()}};
        if (stride) view["byteStride"] = stride;
        data += bytes + std::string((4 - bytes.size() % 4) % 4, '\0');
        gltf["bufferViews"].push_back(view);
        return int(gltf["bufferViews"].size()) - 1;
    }
    int accessor(int view, int component, const char* type, size_t count) {
        json accessor = {{"componentType", component}, {"type", type}, {"count", count}};
        if (view >= 0) accessor["bufferView"] = view;
        gltf["accessors"].push_back(accessor);
        return int(gltf["accessors"].size()) - 1;
    }
    int vectors(const std::vector<glm::vec3>& values) {
        return accessor(view({reinterpret_cast<const char*>(values.data()), values.size() * 12}), 5126, "VEC3", values.size());
    }
    json primitive(const Mesh& mesh, const char* velocity = "_VELOCITY") {
        json primitive = {{"attributes", {{"POSITION", vectors(mesh.positions)}}}};
        if (!mesh.velocities.empty()) primitive["attributes"][velocity] = vectors(mesh.velocities);
        std::string indices;
        for (const Triangle& t : mesh.triangles)
            for (uint32_t v : t) put(indices, uint16_t(v));
        primitive["indices"] = accessor(view(indices), 5123, "SCALAR", mesh.triangles.size() * 3);
        return primitive;
    }
    json compressed(const Mesh& mesh) {
        const std::string bytes = draco_encode(mesh, 14, 14);
        json primitive = {{"attributes",
                           {{"POSITION", accessor(-1, 5126, "VEC3", mesh.positions.size())},
                            {"_VELOCITY", accessor(-1, 5126, "VEC3", mesh.positions.size())}}},
                          {"indices", accessor(-1, 5125, "SCALAR", mesh.triangles.size() * 3)}};
        primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view(bytes)},
                                                                 {"attributes", {{"POSITION", 0}, {"_VELOCITY", 1}}}};
        return primitive;
    }
    std::string glb() {
        gltf["buffers"] = {{{"byteLength", data.size()}}};
        std::string text = gltf.dump(), out;
        text.resize((text.size() + 3) / 4 * 4, ' ');
        for (uint32_t word : {0x46546C67u, 2u, uint32_t(28 + text.size() + data.size()), uint32_t(text.size()), 0x4E4F534Au}) put(out, word);
        out += text;
        for (uint32_t word : {uint32_t(data.size()), 0x004E4942u}) put(out, word);
        return out + data;
    }
};

Mesh ball(int rings = 6) {
    Mesh mesh = bumpy_sphere(rings, 0.5f);
    for (const glm::vec3& x : mesh.positions) mesh.velocities.push_back({1, x.z, -2});
    return mesh;
}
Mesh read(const std::string& file, const ReadOptions& options = {}) { return open_sequence(file, options)->read(0); }

}  // namespace

TEST_CASE("GLB as Rill writes it, z up turned to y up by its node") {
    const TestFolder folder;
    const Mesh source = ball();
    for (int frame : {1, 2}) write_frame(folder / ("f" + std::to_string(frame) + ".glb"), source);
    const auto reader = open_sequence(folder.path.string(), {});
    CHECK(reader->info().format == "glTF sequence");
    CHECK(reader->info().numbers == std::vector<int>{1, 2});
    CHECK(reader->info().velocity == VelocityMeaning::unknown);
    const Mesh mesh = reader->read(1);
    REQUIRE(mesh.positions.size() == source.positions.size());
    CHECK(mesh.triangles == source.triangles);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::vec3 x = source.positions[i], v = source.velocities[i];
        REQUIRE(glm::distance(mesh.positions[i], {x.x, x.z, -x.y}) < 1e-6f);
        REQUIRE(glm::distance(mesh.velocities[i], {v.x, v.z, -v.y}) < 1e-6f);
    }
    write_frame(folder / "f2.glb", Mesh{});
    CHECK(open_sequence(folder.path.string(), {})->read(1).triangles.empty());
}

TEST_CASE("node transforms, several primitives, 16-bit indices, a mirror") {
    const TestFolder folder;
    File file;
    const Mesh source = ball();
    file.gltf["meshes"] = {{{"primitives", {file.primitive(source), file.primitive(source)}}}, {{"primitives", {file.primitive(source)}}}};
    file.gltf["nodes"] = {{{"translation", {1, 2, 3}}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}, {"scale", {2, 1, 1}}, {"children", {1, 2}}},
                          {{"mesh", 0}},
                          {{"mesh", 1}, {"matrix", {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1}}}};
    put_file(folder / "s_7.glb", file.glb());
    const Mesh mesh = read(folder / "s_7.glb");
    const size_t n = source.positions.size();
    REQUIRE(mesh.positions.size() == 3 * n);
    REQUIRE(mesh.velocities.size() == 3 * n);
    REQUIRE(mesh.triangles.size() == 3 * source.triangles.size());
    const auto moved = [](const glm::vec3& x) { return glm::vec3(1 - x.y, 2 + 2 * x.x, 3 + x.z); };
    const glm::vec3 x = source.positions[9], v = source.velocities[9];
    CHECK(glm::distance(mesh.positions[9], moved(x)) < 1e-5f);
    CHECK(glm::distance(mesh.positions[n + 9], moved(x)) < 1e-5f);
    CHECK(glm::distance(mesh.positions[2 * n + 9], moved({-x.x, x.y, x.z + 5})) < 1e-5f);
    CHECK(glm::distance(mesh.velocities[9], {-v.y, 2 * v.x, v.z}) < 1e-5f);
    CHECK(glm::distance(mesh.velocities[2 * n + 9], {-v.y, -2 * v.x, v.z}) < 1e-5f);
    Mesh mirrored = mesh;  // turned back outward
    mirrored.triangles.erase(mirrored.triangles.begin(), mirrored.triangles.begin() + long(2 * source.triangles.size()));
    CHECK(signed_volume(mirrored) > 0);
}

TEST_CASE("Draco-compressed primitives, beside plain ones") {
    const TestFolder folder;
    File file;
    const Mesh source = ball(10);
    file.gltf["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    file.gltf["meshes"] = {{{"primitives", {file.compressed(source)}}}};
    file.gltf["nodes"] = {{{"mesh", 0}}};
    put_file(folder / "d1.glb", file.glb());
    const Mesh mesh = read(folder / "d1.glb");
    CHECK(mesh.triangles.size() == source.triangles.size());
    CHECK(signed_volume(mesh) == doctest::Approx(signed_volume(source)).epsilon(0.001));
    REQUIRE(mesh.velocities.size() == mesh.positions.size());
    for (size_t i = 0; i < mesh.positions.size(); ++i) REQUIRE(mesh.velocities[i].y == doctest::Approx(mesh.positions[i].z).epsilon(0.01));
    file.gltf["meshes"][0]["primitives"].push_back(file.primitive(source));
    put_file(folder / "d1.glb", file.glb());
    CHECK(read(folder / "d1.glb").triangles.size() == 2 * source.triangles.size());
    file.gltf["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 44;
    put_file(folder / "d1.glb", file.glb());
    CHECK_FAULT(fault(folder / "d1.glb"), "d1.glb", "no positions");
}

TEST_CASE("text glTF with its buffer beside it or inside; strips; quantised values") {
    const TestFolder folder;
    File file;
    std::string shorts;
    for (const glm::ivec3& x : {glm::ivec3(0), glm::ivec3(2, 0, 0), glm::ivec3(0, 2, 0), glm::ivec3(2, 2, -1)})
        for (int a = 0; a < 4; ++a) put(shorts, int16_t(a < 3 ? x[a] : 99));  // padded to 8 bytes
    json primitive = {{"attributes", {{"POSITION", file.accessor(file.view(shorts, 8), 5122, "VEC3", 4)}}}, {"mode", 5}};
    file.gltf["meshes"] = {{{"primitives", {primitive}}}};
    file.gltf["nodes"] = {{{"mesh", 0}}};
    file.gltf["images"] = {{{"uri", "not_there.png"}}};
    put_file(folder / "s1.bin", file.data);
    file.gltf["buffers"] = {{{"byteLength", file.data.size()}, {"uri", "s1.bin"}}};
    put_file(folder / "s1.gltf", file.gltf.dump());
    const Mesh mesh = read(folder / "s1.gltf");
    CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {2, 2, -1}});
    CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}});
    CHECK(mesh.velocities.empty());
    put_file(folder / "s1.bin", file.data.substr(8));
    CHECK_FAULT(fault(folder / "s1.gltf"), "s1.gltf");
    std::filesystem::remove(folder / "s1.bin");
    CHECK_FAULT(fault(folder / "s1.gltf"), "s1.gltf", "s1.bin");
}

TEST_CASE("velocity by other names") {
    const TestFolder folder;
    for (const char* name : {"_VELOCITY", "_v", "_VEL", "_flip_velocity", "velocity", "_Velocity"}) {
        CAPTURE(name);
        File file;
        file.gltf["meshes"] = {{{"primitives", {file.primitive(ball(), name)}}}};
        file.gltf["nodes"] = {{{"mesh", 0}}};
        put_file(folder / "n1.glb", file.glb());
        CHECK(read(folder / "n1.glb").velocities == ball().velocities);
    }
    File file;
    file.gltf["meshes"] = {{{"primitives", {file.primitive(ball(), "_SWIRL")}}}};
    file.gltf["nodes"] = {{{"mesh", 0}}};
    put_file(folder / "n1.glb", file.glb());
    CHECK(read(folder / "n1.glb").velocities.empty());
    ReadOptions options;
    options.velocity_name = "swirl";
    CHECK(read(folder / "n1.glb", options).velocities == ball().velocities);
    options.velocity_name = "flow";
    CHECK_FAULT(fault(folder / "n1.glb", options), "n1.glb", "flow");
    Mesh still = ball();
    still.velocities.clear();
    file.gltf["meshes"][0]["primitives"].push_back(file.primitive(still));
    file.gltf["meshes"][0]["primitives"].push_back(file.primitive(ball()));
    put_file(folder / "n1.glb", file.glb());
    CHECK_FAULT(fault(folder / "n1.glb"), "n1.glb", "primitives have no velocity");
}

TEST_CASE("damage") {
    const TestFolder folder;
    File plain, packed;
    plain.gltf["meshes"] = {{{"primitives", {plain.primitive(ball(6))}}}};
    packed.gltf["meshes"] = {{{"primitives", {packed.compressed(ball(6))}}}};
    plain.gltf["nodes"] = packed.gltf["nodes"] = {{{"mesh", 0}}};
    put_file(folder / "f1.glb", plain.glb());
    CHECK(damage_everywhere(folder / "f1.glb", folder / "f1.glb", "f1.glb", 7) > 200);
    put_file(folder / "f1.glb", packed.glb());
    CHECK(damage_everywhere(folder / "f1.glb", folder / "f1.glb", "f1.glb", 7) > 200);

    const auto with = [&](const char* pointer, const json& value) {
        File file = plain;
        file.gltf[json::json_pointer(pointer)] = value;
        const std::string bytes = file.glb();
        put_file(folder / "f1.glb", bytes);
        return fault(folder / "f1.glb");
    };
    CHECK(with("/nodes/0/mesh", 0) == "");
    CHECK_FAULT(with("/nodes/0/mesh", 7), "f1.glb", "mesh 7 of 1");
    CHECK_FAULT(with("/nodes/0/children", {0}), "f1.glb", "two parents");
    CHECK_FAULT(with("/nodes/0/children", {-5}), "f1.glb");
    CHECK_FAULT(with("/nodes/0/skin", 0), "f1.glb", "skinned");
    CHECK_FAULT(with("/nodes/0/scale", {1e300, 1, 1}), "f1.glb", "transform of node 0");
    CHECK_FAULT(with("/scenes/0/nodes", {3}), "f1.glb", "node 3 of 1");
    CHECK_FAULT(with("/scene", 9), "f1.glb", "scene");
    CHECK_FAULT(with("/accessors/0/count", 2000000000), "f1.glb", "2000000000 elements");
    CHECK_FAULT(with("/accessors/0/count", 1), "f1.glb", "vert");
    CHECK_FAULT(with("/accessors/0/byteOffset", 4000000000u), "f1.glb", "POSITION");
    CHECK_FAULT(with("/accessors/0/type", "VEC2"), "f1.glb", "three components");
    CHECK_FAULT(with("/accessors/0/bufferView", 12), "f1.glb", "buffer view 12");
    CHECK_FAULT(with("/bufferViews/0/byteLength", 4000000000u), "f1.glb", "end of its buffer");
    CHECK_FAULT(with("/bufferViews/0/buffer", 3), "f1.glb", "buffer 3");
    CHECK_FAULT(with("/extensionsRequired", {"EXT_meshopt_compression"}), "f1.glb", "EXT_meshopt_compression");
    CHECK_FAULT(with("/meshes/0/primitives/0/attributes/POSITION", 99), "f1.glb", "accessor 99");
    File file = plain;
    const uint16_t far = 60000;
    std::memcpy(file.data.data() + file.gltf["bufferViews"][2]["byteOffset"].get<size_t>(), &far, 2);
    put_file(folder / "f1.glb", file.glb());
    CHECK_FAULT(fault(folder / "f1.glb"), "f1.glb", "refers to vertex 60000");
    file = plain;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(file.data.data() + 16, &nan, 4);
    put_file(folder / "f1.glb", file.glb());
    CHECK_FAULT(fault(folder / "f1.glb"), "f1.glb", "position of vertex 1 is not finite");
    put_file(folder / "f1.gltf", R"({"asset":{"version":"2.0"},"x":)" + std::string(200000, '['));
    CHECK_FAULT(fault(folder / "f1.gltf"), "f1.gltf", "JSON");
    put_file(folder / "f1.gltf", R"({"asset":{"version":"2.0"},"nodes":)" + std::string(200000, '[') + std::string(200000, ']') + "}");
    CHECK_FAULT(fault(folder / "f1.gltf"), "f1.gltf");
    put_file(folder / "f1.gltf", "");
    CHECK_FAULT(fault(folder / "f1.gltf"), "f1.gltf");
}
