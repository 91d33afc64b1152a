// SPDX-License-Identifier: MIT
#include "writers/frame_writer.h"

#include <charconv>
#include <cstdio>

#include "common/number_place.h"
#include "common/output_file.h"

namespace rill::cooker {
namespace {

// What tells our own files from others, near their beginnings. (Of GLB: its JSON's generator.)
constexpr char ply_begins[] = "ply\nformat binary_little_endian 1.0\ncomment metres, metres per second\n", obj_begins[] = "# metres\n",
               glb_says[] = R"("generator":"rill")";
constexpr size_t looked_through = 1 << 20;  // bytes

using Encode = std::string (*)(const Mesh&);
Encode encoder_of(const std::filesystem::path& path) {
    const std::string extension = path.extension().string();
    if (extension == ".ply") return to_ply;
    if (extension == ".obj") return to_obj;
    if (extension == ".glb") return to_glb;
    throw UsageError(path.string() + ": frames are written as .ply, .obj or .glb");
}

template <class T>
void append(std::string& bytes, const T& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

bool has_number_place(const std::string& pattern) { return find_number_place(pattern).has_value(); }

std::string number_pattern(const std::string& pattern, int number) {
    const auto place = find_number_place(pattern);
    if (!place) return pattern;
    if (find_number_place(pattern, place->end)) throw UsageError(pattern + ": more than one place for the frame number");
    char text[128];
    std::snprintf(text, sizeof text, place->zeros ? "%0*d" : "%*d", place->width, number);
    return pattern.substr(0, place->begin) + text + pattern.substr(place->end);
}

void check_frame_extension(const std::filesystem::path& path) { encoder_of(path); }

void check_frame_output(const std::filesystem::path& path) {
    const auto is_ours = [](std::string_view begins) {
        return begins.starts_with(ply_begins) || begins.starts_with(obj_begins) ||
               (begins.starts_with("glTF") && begins.find(glb_says) != std::string_view::npos);
    };
    spare_others(path, looked_through, is_ours, "no export of Rill's");
}

void write_frame(const std::filesystem::path& path, const Mesh& mesh) { write_file(path, encoder_of(path)(mesh)); }

std::string to_ply(const Mesh& mesh) {
    std::string bytes = ply_begins + ("element vertex " + std::to_string(mesh.positions.size())) + "\nproperty float x\nproperty float y\nproperty float z\n";
    if (!mesh.normals.empty()) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!mesh.velocities.empty()) bytes += "property float vx\nproperty float vy\nproperty float vz\n";
    bytes += "element face " + std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
    bytes.reserve(bytes.size() + mesh.positions.size() * 36 + mesh.triangles.size() * 13);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        append(bytes, mesh.positions[i]);
        if (!mesh.normals.empty()) append(bytes, mesh.normals[i]);
        if (!mesh.velocities.empty()) append(bytes, mesh.velocities[i]);
    }
    for (const Triangle& t : mesh.triangles) {
        bytes += char(3);
        append(bytes, t);
    }
    return bytes;
}

std::string to_obj(const Mesh& mesh) {
    std::string text = obj_begins;
    auto line = [&](const char* key, const glm::vec3& v) {
        text += key;
        for (int a = 0; a < 3; ++a) {
            char number[32];
            text += ' ';
            text.append(number, std::to_chars(number, number + sizeof number, v[a]).ptr);  // shortest that reads back exactly
        }
        text += '\n';
    };
    for (const glm::vec3& x : mesh.positions) line("v", x);
    for (const glm::vec3& n : mesh.normals) line("vn", n);
    for (const Triangle& t : mesh.triangles) {
        text += 'f';
        for (uint32_t v : t) {
            const std::string index = std::to_string(v + 1);
            text += ' ' + index + (mesh.normals.empty() ? "" : "//" + index);
        }
        text += '\n';
    }
    return text;
}

}  // namespace rill::cooker
