// SPDX-License-Identifier: MIT
// Binary glTF 2.0: one mesh of one primitive. glTF is y up by its definition; positions are written as they
// are, and a rotation in the node says so.
#include <nlohmann/json.hpp>

#include "writers/frame_writer.h"

namespace rill::cooker {
namespace {

constexpr int array_buffer = 34962, element_buffer = 34963, float_type = 5126, uint_type = 5125;

struct Glb {
    nlohmann::json json = {{"asset", {{"version", "2.0"}, {"generator", "rill"}}}, {"scene", 0}};
    std::string buffer;

    int accessor(const void* data, size_t count, size_t bytes, int target, const char* type, int component) {
        json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes}, {"target", target}});
        buffer.append(static_cast<const char*>(data), bytes);
        json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1}, {"componentType", component},
                                     {"count", count}, {"type", type}});
        return int(json["accessors"].size()) - 1;
    }
    int vectors(const std::vector<glm::vec3>& v) {
        return accessor(v.data(), v.size(), v.size() * sizeof v[0], array_buffer, "VEC3", float_type);
    }
    std::string bytes() {
        if (!buffer.empty()) json["buffers"] = {{{"byteLength", buffer.size()}}};
        std::string text = json.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        std::string out;
        auto word = [&](uint32_t value) { out.append(reinterpret_cast<const char*>(&value), 4); };
        const size_t chunk = buffer.empty() ? 0 : 8 + buffer.size();
        word(0x46546C67), word(2), word(uint32_t(12 + 8 + text.size() + chunk));
        word(uint32_t(text.size())), word(0x4E4F534A), out += text;
        if (chunk) word(uint32_t(buffer.size())), word(0x004E4942), out += buffer;  // all data is in fours already
        return out;
    }
};

}  // namespace

std::string to_glb(const Mesh& mesh) {
    Glb glb;
    if (mesh.triangles.empty()) {  // glTF knows no empty accessors: an empty scene
        glb.json["scenes"] = {nlohmann::json::object()};
        return glb.bytes();
    }
    nlohmann::json attributes;
    glm::vec3 lower = mesh.positions[0], upper = lower;
    for (const glm::vec3& x : mesh.positions) lower = glm::min(lower, x), upper = glm::max(upper, x);
    const int position = glb.vectors(mesh.positions);
    glb.json["accessors"][position]["min"] = {lower.x, lower.y, lower.z};
    glb.json["accessors"][position]["max"] = {upper.x, upper.y, upper.z};
    attributes["POSITION"] = position;
    if (!mesh.normals.empty()) attributes["NORMAL"] = glb.vectors(mesh.normals);
    if (!mesh.velocities.empty()) attributes["_VELOCITY"] = glb.vectors(mesh.velocities);
    const int indices = glb.accessor(mesh.triangles.data(), mesh.triangles.size() * 3, mesh.triangles.size() * 12, element_buffer,
                                     "SCALAR", uint_type);
    glb.json["meshes"] = {{{"primitives", {{{"attributes", attributes}, {"indices", indices}}}}}};
    const double half = 0.70710678118654752;  // −90° about x: the source's z becomes glTF's y
    glb.json["nodes"] = {{{"mesh", 0}, {"rotation", {-half, 0, 0, half}}}};
    glb.json["scenes"] = {{{"nodes", {0}}}};
    return glb.bytes();
}

}  // namespace rill::cooker
