// SPDX-License-Identifier: MIT
// glTF 2.0, text or binary, one file per frame: all triangles of the scene as one mesh in the scene's space,
// velocity from `_VELOCITY`. TinyGLTF takes the file apart; without its Draco support, which knows nothing of
// velocities, so primitives that are compressed go to Draco here. What no surface needs (images, materials,
// animations, …) is dropped before TinyGLTF sees it.
#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <nlohmann/json.hpp>

// Debian's libdraco exports a TinyGLTF of its own, of another build, under the same names as libtinygltf: which
// one a program gets would hang on its link order. So it is compiled in here, under a name that clashes with neither.
#define tinygltf rill_tinygltf
#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_INCLUDE_JSON
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_USE_CPP14
#include <tiny_gltf.h>

#include "readers/draco_mesh.h"
#include "readers/file_bytes.h"
#include "readers/frame_files.h"
#include "readers/velocity_names.h"

namespace rill::cooker {
namespace {
using nlohmann::json;
constexpr const char* draco_extension = "KHR_draco_mesh_compression";

/// A sequence in one file, each frame a node that is shown for a while, as `rill export` writes one: other animation does not matter.
bool shows_nodes_in_turn(const json& all) {
    if (!all.contains("animations") || !all["animations"].is_array()) return false;
    for (const json& animation : all["animations"]) {
        if (!animation.is_object() || !animation.contains("channels") || !animation["channels"].is_array()) continue;
        const json& channels = animation["channels"];
        const auto scales = std::count_if(channels.begin(), channels.end(), [&](const json& channel) {
            return channel.is_object() && channel.contains("target") && channel["target"].is_object() && channel["target"].contains("path") &&
                   channel["target"]["path"] == "scale";
        });
        if (scales > 1) return true;
    }
    return false;
}

/// The JSON without what is not needed here, and without nesting that would exhaust a recursive reader.
std::string reduce(const std::string& text, const std::string& name) {
    constexpr int deepest = 32;
    json all = json::parse(text, [](int depth, json::parse_event_t, const json&) { return depth < deepest; }, false);
    if (!all.is_object()) throw InputError(name + ": its JSON is damaged or ends early");
    if (all.contains("extensionsRequired") && all["extensionsRequired"].is_array())
        for (const json& extension : all["extensionsRequired"]) {
            const std::string needed = extension.is_string() ? extension.get<std::string>() : "";
            if (needed != draco_extension && needed != "KHR_mesh_quantization" && needed.rfind("KHR_materials_", 0) != 0 &&
                needed.rfind("KHR_texture_", 0) != 0)
                throw InputError(name + ": needs the extension '" + needed + "', which is not read");
        }
    if (shows_nodes_in_turn(all)) throw InputError(name + ": is an animation of many meshes, which is not read; write a file per frame (%04d)");
    json kept = json::object();
    for (const char* key : {"asset", "buffers", "bufferViews", "accessors", "meshes", "nodes", "scenes", "scene"})
        if (all.contains(key)) kept[key] = std::move(all[key]);
    if (kept.contains("meshes") && kept["meshes"].is_array())
        for (json& mesh : kept["meshes"]) {
            if (!mesh.is_object() || !mesh.contains("primitives") || !mesh["primitives"].is_array()) continue;
            for (json& primitive : mesh["primitives"]) {
                if (!primitive.is_object()) continue;
                primitive.erase("targets");
                if (primitive.contains("extensions") && primitive["extensions"].is_object() &&
                    primitive["extensions"].contains(draco_extension))
                    primitive.erase("indices");  // lies in the compressed data, and has no buffer view
            }
        }
    return kept.dump(-1, ' ', false, json::error_handler_t::replace);
}

tinygltf::Model parse(const std::filesystem::path& path) {
    const std::string name = path.string(), bytes = read_file(path);
    tinygltf::TinyGLTF loader;
    tinygltf::Model model;
    std::string error, warning;
    bool ok = false;
    const std::string folder = path.parent_path().string();
    if (bytes.compare(0, 4, "glTF") == 0) {
        ByteCursor cursor(bytes, name);
        cursor.skip(4);
        const uint32_t version = cursor.take<uint32_t>("header");
        if (version != 2) cursor.fail("glTF of version " + std::to_string(version) + "; 2 is read");
        const uint32_t length = cursor.take<uint32_t>("header");
        if (length != bytes.size())
            cursor.fail("states " + std::to_string(length) + " bytes, the file has " + std::to_string(bytes.size()));
        const uint32_t json_length = cursor.take<uint32_t>("header"), kind = cursor.take<uint32_t>("header");
        if (kind != 0x4E4F534A || json_length > cursor.left()) cursor.fail("no JSON chunk of " + std::to_string(json_length) + " bytes");
        std::string text = reduce(bytes.substr(cursor.at(), json_length), name);
        text.resize((text.size() + 3) / 4 * 4, ' ');
        const std::string rest = bytes.substr(cursor.at() + json_length);
        const uint32_t head[5] = {0x46546C67, 2, uint32_t(20 + text.size() + rest.size()), uint32_t(text.size()), 0x4E4F534A};
        if (rest.size() >= 8) {
            uint32_t binary;
            std::memcpy(&binary, rest.data(), 4);
            if (binary > rest.size() - 8) cursor.fail("states a binary chunk of " + std::to_string(binary) + " bytes, but " +
                                                      std::to_string(rest.size() - 8) + " follow");
        }
        const std::string smaller = std::string(reinterpret_cast<const char*>(head), sizeof head) + text + rest;
        if (smaller.size() > UINT32_MAX) cursor.fail("larger than 4 GiB");
        ok = loader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<const unsigned char*>(smaller.data()),
                                         unsigned(smaller.size()), folder);
    } else {
        const std::string text = reduce(bytes, name);
        ok = loader.LoadASCIIFromString(&model, &error, &warning, text.data(), unsigned(text.size()), folder);
    }
    for (char& c : error) c = c == '\n' ? ' ' : c;
    if (!ok) throw InputError(name + ": not a usable glTF file: " + (error.empty() ? "no cause given" : error.substr(0, 300)));
    return model;
}

class Scene {
public:
    Scene(const std::filesystem::path& path, const ReadOptions& options)
        : name_(path.string()), asked_(options.velocity_name), model_(parse(path)) {}

    Mesh read() {
        struct Visit {
            int node;
            glm::dmat4 parent;
        };
        std::vector<Visit> open;
        for (int root : roots()) open.push_back({root, glm::dmat4(1)});
        std::vector<bool> seen(model_.nodes.size());
        for (size_t next = 0; next < open.size(); ++next) {  // in the order of the file
            const Visit visit = open[next];
            const tinygltf::Node& node = at(model_.nodes, visit.node, "node");
            if (seen[size_t(visit.node)]) fail("node " + std::to_string(visit.node) + " has two parents");
            seen[size_t(visit.node)] = true;
            const glm::dmat4 world = visit.parent * local(node, visit.node);
            if (node.mesh >= 0) {
                if (node.skin >= 0) fail("node " + std::to_string(visit.node) + " is skinned, which is not read");
                for (const tinygltf::Primitive& primitive : at(model_.meshes, node.mesh, "mesh").primitives) add(primitive, world);
            }
            for (int child : node.children) open.push_back({child, world});
        }
        if (with_velocity_ > 0 && with_velocity_ != primitives_)
            fail(std::to_string(primitives_ - with_velocity_) + " of " + std::to_string(primitives_) + " primitives have no velocity");
        if (!asked_.empty() && primitives_ > 0 && with_velocity_ == 0) fail("no attribute '" + asked_ + "'");
        return std::move(mesh_);
    }

private:
    [[noreturn]] void fail(const std::string& cause) const { throw InputError(name_ + ": " + cause); }
    template <class T>
    const T& at(const std::vector<T>& all, int index, const char* what) const {
        if (index < 0 || size_t(index) >= all.size())
            fail(std::string("refers to ") + what + " " + std::to_string(index) + " of " + std::to_string(all.size()));
        return all[size_t(index)];
    }
    std::vector<int> roots() const {
        if (!model_.scenes.empty()) return at(model_.scenes, std::max(model_.defaultScene, 0), "scene").nodes;
        std::vector<bool> child(model_.nodes.size());
        for (const tinygltf::Node& node : model_.nodes)
            for (int c : node.children) at(model_.nodes, c, "node"), child[size_t(c)] = true;
        std::vector<int> all;
        for (size_t n = 0; n < child.size(); ++n)
            if (!child[n]) all.push_back(int(n));
        return all;
    }
    glm::dmat4 local(const tinygltf::Node& node, int index) const {
        glm::dmat4 matrix(1);
        if (node.matrix.size() == 16) matrix = glm::make_mat4(node.matrix.data());
        if (node.translation.size() == 3) matrix[3] = glm::dvec4(node.translation[0], node.translation[1], node.translation[2], 1);
        glm::dmat3 turn(1);
        if (node.rotation.size() == 4)
            turn = glm::mat3_cast(glm::normalize(glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2])));
        for (int a = 0; a < 3 && node.matrix.empty(); ++a)
            matrix[a] = glm::dvec4(turn[a] * (node.scale.size() == 3 ? node.scale[size_t(a)] : 1.0), 0);
        for (int i = 0; i < 16; ++i)
            if (!(std::abs(matrix[i / 4][i % 4]) <= 1e9)) fail("the transform of node " + std::to_string(index) + " is not finite");
        return matrix;
    }

    /// Where the `components` of every element of an accessor lie; checked against the bytes that are there.
    struct Data {
        const unsigned char* first;
        size_t count, stride;
        int component;
        bool normalized;
    };
    Data data(int index, int type, const char* what) const {
        const tinygltf::Accessor& accessor = at(model_.accessors, index, "accessor");
        const auto fault = [&](const std::string& cause) { fail(std::string(what) + " (accessor " + std::to_string(index) + ") " + cause); };
        if (accessor.sparse.isSparse) fault("is sparse, which is not read");
        if (accessor.type != type) fault(type == TINYGLTF_TYPE_VEC3 ? "is not of three components" : "is not of one component");
        const tinygltf::BufferView& view = at(model_.bufferViews, accessor.bufferView, "buffer view");
        const tinygltf::Buffer& buffer = at(model_.buffers, view.buffer, "buffer");
        const int one = tinygltf::GetComponentSizeInBytes(uint32_t(accessor.componentType));
        if (one <= 0) fault("has no known component type");
        const size_t each = size_t(one) * (type == TINYGLTF_TYPE_VEC3 ? 3 : 1), stride = view.byteStride ? view.byteStride : each;
        const size_t limit = size_t(1) << 40;  // so that nothing below overflows
        if (view.byteOffset > buffer.data.size() || view.byteLength > buffer.data.size() - view.byteOffset)
            fault("lies beyond the end of its buffer");
        if (stride > limit || accessor.byteOffset > limit || accessor.count > limit / std::max(stride, each) || stride < each ||
            (accessor.count > 0 && accessor.byteOffset + (accessor.count - 1) * stride + each > view.byteLength))
            fault("states " + std::to_string(accessor.count) + " elements, more than its buffer view of " +
                  std::to_string(view.byteLength) + " bytes holds");
        return {buffer.data.data() + view.byteOffset + accessor.byteOffset, accessor.count, stride, accessor.componentType, accessor.normalized};
    }
    double value(const Data& data, const unsigned char* from) const {
        const auto as = [&](auto type, double scale) {
            std::memcpy(&type, from, sizeof type);
            return data.normalized ? std::max(double(type) / scale, -1.0) : double(type);
        };
        switch (data.component) {
            case TINYGLTF_COMPONENT_TYPE_BYTE: return as(int8_t(), 127);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return as(uint8_t(), 255);
            case TINYGLTF_COMPONENT_TYPE_SHORT: return as(int16_t(), 32767);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return as(uint16_t(), 65535);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return as(uint32_t(), 1);
            case TINYGLTF_COMPONENT_TYPE_FLOAT: return as(float(), 1);
            default: fail("component type " + std::to_string(data.component) + " is not glTF's");
        }
    }
    std::vector<glm::vec3> vectors(int accessor, const char* what) const {
        const Data source = data(accessor, TINYGLTF_TYPE_VEC3, what);
        const size_t one = size_t(tinygltf::GetComponentSizeInBytes(uint32_t(source.component)));
        std::vector<glm::vec3> values(source.count);
        for (size_t i = 0; i < values.size(); ++i)
            for (size_t a = 0; a < 3; ++a) values[i][int(a)] = float(value(source, source.first + i * source.stride + a * one));
        return values;
    }
    std::vector<uint32_t> indices(const tinygltf::Primitive& primitive, size_t vertices) const {
        std::vector<uint32_t> order;
        if (primitive.indices < 0) {
            for (size_t i = 0; i < vertices; ++i) order.push_back(uint32_t(i));
            return order;
        }
        const Data source = data(primitive.indices, TINYGLTF_TYPE_SCALAR, "indices");
        order.resize(source.count);
        for (size_t i = 0; i < order.size(); ++i) {
            const double index = value(source, source.first + i * source.stride);
            if (!(index >= 0 && index < double(vertices)))
                fail("index " + std::to_string(i) + " refers to vertex " + std::to_string(int64_t(index)) + " of " + std::to_string(vertices));
            order[i] = uint32_t(index);
        }
        return order;
    }
    std::vector<Triangle> triangles(const tinygltf::Primitive& primitive, size_t vertices) const {
        const std::vector<uint32_t> order = indices(primitive, vertices);
        std::vector<Triangle> all;
        const bool strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP, fan = primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
        for (size_t i = 0; i + 2 < order.size(); i += strip || fan ? 1 : 3)
            all.push_back(fan ? Triangle{order[0], order[i + 1], order[i + 2]}
                          : strip && i % 2 ? Triangle{order[i + 1], order[i], order[i + 2]}
                                           : Triangle{order[i], order[i + 1], order[i + 2]});
        return all;
    }
    /// The attribute that is velocity by name; null when there is none.
    template <class Names>
    const std::string* velocity_among(const Names& names) const {
        const std::string* best = nullptr;
        for (const auto& name : names) {
            const int rank = velocity_rank(name, asked_);
            if (rank >= 0 && (!best || rank < velocity_rank(*best, asked_))) best = &name;
        }
        return best;
    }
    Mesh decompress(const tinygltf::Primitive& primitive, const std::string* velocity) const {
        const tinygltf::Value& extension = primitive.extensions.at(draco_extension);
        const auto number = [&](const tinygltf::Value& object, const std::string& key) {
            if (!object.IsObject() || !object.Has(key) || !object.Get(key).IsInt()) fail(std::string(draco_extension) + " has no integer " + key);
            return object.Get(key).GetNumberAsInt();
        };
        const tinygltf::BufferView& view = at(model_.bufferViews, number(extension, "bufferView"), "buffer view");
        const tinygltf::Buffer& buffer = at(model_.buffers, view.buffer, "buffer");
        if (view.byteOffset > buffer.data.size() || view.byteLength > buffer.data.size() - view.byteOffset || view.byteLength == 0)
            fail("Draco data lies beyond the end of its buffer");
        if (!extension.Has("attributes")) fail(std::string(draco_extension) + " has no attributes");
        const tinygltf::Value& attributes = extension.Get("attributes");
        const std::string bytes(reinterpret_cast<const char*>(buffer.data.data()) + view.byteOffset, view.byteLength);
        return draco_decode(bytes, name_, {number(attributes, "POSITION"), velocity && attributes.Has(*velocity) ? number(attributes, *velocity) : -1});
    }
    void add(const tinygltf::Primitive& primitive, const glm::dmat4& world) {
        const int mode = primitive.mode;
        if (mode != -1 && mode != TINYGLTF_MODE_TRIANGLES && mode != TINYGLTF_MODE_TRIANGLE_STRIP && mode != TINYGLTF_MODE_TRIANGLE_FAN)
            return;  // points and lines bound no liquid
        const auto position = primitive.attributes.find("POSITION");
        if (position == primitive.attributes.end()) fail("a primitive has no POSITION");
        std::vector<std::string> names;
        for (const auto& [name, accessor] : primitive.attributes) names.push_back(name);
        const std::string* velocity = velocity_among(names);
        Mesh part;
        if (primitive.extensions.count(draco_extension)) {
            part = decompress(primitive, velocity);
        } else {
            part.positions = vectors(position->second, "POSITION");
            if (velocity) part.velocities = vectors(primitive.attributes.at(*velocity), velocity->c_str());
            part.triangles = triangles(primitive, part.positions.size());
        }
        if (part.positions.empty()) return;
        if (!part.velocities.empty() && part.velocities.size() != part.positions.size())
            fail(std::to_string(part.velocities.size()) + " velocities for " + std::to_string(part.positions.size()) + " vertices");
        if (mesh_.positions.size() + part.positions.size() > UINT32_MAX) fail("more vertices than 32 bits count");
        ++primitives_, with_velocity_ += part.velocities.empty() ? 0 : 1;
        const uint32_t base = uint32_t(mesh_.positions.size());
        const glm::dmat3 linear(world);
        for (const glm::vec3& x : part.positions) mesh_.positions.emplace_back(world * glm::dvec4(x, 1));
        for (const glm::vec3& v : part.velocities) mesh_.velocities.emplace_back(linear * glm::dvec3(v));
        const bool mirrored = glm::determinant(linear) < 0;
        for (Triangle t : part.triangles) {
            for (uint32_t& v : t) {
                if (v >= part.positions.size()) fail("a triangle refers to vertex " + std::to_string(v) + " of " + std::to_string(part.positions.size()));
                v += base;
            }
            if (mirrored) std::swap(t[1], t[2]);
            mesh_.triangles.push_back(t);
        }
    }

    std::string name_, asked_;
    tinygltf::Model model_;
    Mesh mesh_;
    size_t primitives_ = 0, with_velocity_ = 0;
};

}  // namespace

Mesh read_gltf(const std::filesystem::path& path, const ReadOptions& options) { return Scene(path, options).read(); }

namespace {
size_t glb_json_bytes(const std::string& bytes) {
    uint32_t count;
    std::memcpy(&count, bytes.data() + 12, sizeof count);
    return count;
}
}  // namespace

std::vector<std::filesystem::path> gltf_buffers(const std::filesystem::path& path) {
    std::string text = read_file(path);
    if (text.compare(0, 4, "glTF") == 0) text = text.substr(std::min<size_t>(20, text.size()), text.size() < 20 ? 0 : glb_json_bytes(text));
    const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    std::vector<std::filesystem::path> files;
    if (!json.is_object() || !json.contains("buffers") || !json["buffers"].is_array()) return files;
    for (const nlohmann::json& buffer : json["buffers"]) {
        if (!buffer.is_object() || !buffer.contains("uri") || !buffer["uri"].is_string()) continue;
        const std::string uri = buffer["uri"];
        if (uri.compare(0, 5, "data:") == 0) continue;
        std::string name;
        for (size_t i = 0; i < uri.size(); ++i) {
            const bool escaped = uri[i] == '%' && i + 2 < uri.size();
            name += escaped ? char(std::strtol(uri.substr(i + 1, 2).c_str(), nullptr, 16)) : uri[i];
            if (escaped) i += 2;
        }
        if (std::filesystem::exists(path.parent_path() / name)) files.push_back(path.parent_path() / name);
    }
    return files;
}

}  // namespace rill::cooker
