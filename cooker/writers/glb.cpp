// SPDX-License-Identifier: MIT
// Binary glTF 2.0: a mesh of one primitive, or one per frame and an animation that shows them in turn. glTF is y up by its
// definition; positions are written as they are, and a rotation in the root node says so.
#include <nlohmann/json.hpp>

#include "writers/frame_writer.h"

namespace rill::cooker {
namespace {

constexpr int array_buffer = 34962, element_buffer = 34963, float_type = 5126, uint_type = 5125;

const nlohmann::json turned_up = {-0.70710678118654752, 0, 0, 0.70710678118654752};  // −90° about x: the source's z becomes glTF's y

struct Glb {
    nlohmann::json json = {{"asset", {{"version", "2.0"}, {"generator", "rill"}}}, {"scene", 0}};
    std::string buffer;

    int accessor(const void* data, size_t count, size_t bytes, int target, const char* type, int component) {
        if (buffer.size() + bytes > 0xF0000000u) throw InputError("GLB files end at 4 GiB: fewer frames, or larger cells (--cell)");
        json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", bytes}});
        if (target) json["bufferViews"].back()["target"] = target;
        buffer.append(static_cast<const char*>(data), bytes);
        json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1}, {"componentType", component},
                                     {"count", count}, {"type", type}});
        return int(json["accessors"].size()) - 1;
    }
    int vectors(const std::vector<glm::vec3>& v, int target = array_buffer) {
        return accessor(v.data(), v.size(), v.size() * sizeof v[0], target, "VEC3", float_type);
    }
    /// Key times: glTF wants their range.
    int times(const std::vector<float>& t) {
        const int index = accessor(t.data(), t.size(), t.size() * sizeof t[0], 0, "SCALAR", float_type);
        json["accessors"][size_t(index)]["min"] = {t.front()}, json["accessors"][size_t(index)]["max"] = {t.back()};
        return index;
    }
    /// Index of the new mesh, which has triangles.
    int mesh(const Mesh& mesh) {
        nlohmann::json attributes;
        glm::vec3 lower = mesh.positions[0], upper = lower;
        for (const glm::vec3& x : mesh.positions) lower = glm::min(lower, x), upper = glm::max(upper, x);
        const int position = vectors(mesh.positions);
        json["accessors"][size_t(position)]["min"] = {lower.x, lower.y, lower.z};
        json["accessors"][size_t(position)]["max"] = {upper.x, upper.y, upper.z};
        attributes["POSITION"] = position;
        if (!mesh.normals.empty()) attributes["NORMAL"] = vectors(mesh.normals);
        if (!mesh.velocities.empty()) attributes["_VELOCITY"] = vectors(mesh.velocities);
        const int indices = accessor(mesh.triangles.data(), mesh.triangles.size() * 3, mesh.triangles.size() * 12, element_buffer,
                                     "SCALAR", uint_type);
        json["meshes"].push_back({{"primitives", {{{"attributes", attributes}, {"indices", indices}}}}});
        return int(json["meshes"].size()) - 1;
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
    glb.json["nodes"] = {{{"mesh", glb.mesh(mesh)}, {"rotation", turned_up}}};
    glb.json["scenes"] = {{{"nodes", {0}}}};
    return glb.bytes();
}

struct AnimatedGlb::Impl {
    Glb glb;
    std::vector<int> meshes;      // of every frame; −1: nothing to see
    std::vector<float> seconds;
};
AnimatedGlb::AnimatedGlb() : impl_(std::make_unique<Impl>()) {}
AnimatedGlb::~AnimatedGlb() = default;

void AnimatedGlb::add(const Mesh& mesh, double seconds) {
    impl_->meshes.push_back(mesh.triangles.empty() ? -1 : impl_->glb.mesh(mesh));
    impl_->seconds.push_back(float(seconds));
}

std::string AnimatedGlb::bytes(double last_for) {
    // Visibility cannot be animated in plain glTF; a node whose scale is 0 is not drawn.
    Glb& glb = impl_->glb;
    const std::vector<float>& seconds = impl_->seconds;
    const float start = seconds.front(), end = seconds.back() + float(last_for);
    nlohmann::json samplers = nlohmann::json::array(), channels = nlohmann::json::array(), shown = nlohmann::json::array();
    glb.json["nodes"] = {{{"name", "liquid"}, {"rotation", turned_up}}};
    for (size_t i = 0; i < seconds.size(); ++i) {
        if (impl_->meshes[i] < 0) continue;
        std::vector<float> times;
        std::vector<glm::vec3> scales;
        const auto key = [&](float at, float scale) { times.push_back(at - start), scales.emplace_back(scale); };
        if (i > 0) key(start, 0);
        key(seconds[i], 1);
        const bool last = i + 1 == seconds.size();
        key(last ? end : seconds[i + 1], last ? 1 : 0);
        const size_t node = glb.json["nodes"].size();
        const float scale = i == 0 ? 1 : 0;
        glb.json["nodes"].push_back({{"mesh", impl_->meshes[i]}, {"scale", {scale, scale, scale}}});
        shown.push_back(node);
        samplers.push_back({{"input", glb.times(times)}, {"output", glb.vectors(scales, 0)}, {"interpolation", "STEP"}});
        channels.push_back({{"sampler", samplers.size() - 1}, {"target", {{"node", node}, {"path", "scale"}}}});
    }
    glb.json["scenes"] = {{{"nodes", {0}}}};
    if (!shown.empty()) {
        glb.json["nodes"][0]["children"] = shown;
        glb.json["animations"] = {{{"name", "frames"}, {"samplers", samplers}, {"channels", channels}}};
    }
    return glb.bytes();
}

}  // namespace rill::cooker
