// SPDX-License-Identifier: MIT
// Wavefront OBJ through tinyobjloader: positions and faces. The format has no velocities.
#include <tiny_obj_loader.h>

#include <sstream>

#include "readers/file_bytes.h"
#include "readers/frame_files.h"

namespace rill::cooker {

Mesh read_obj(const std::filesystem::path& path, const ReadOptions&) {
    const std::string name = path.string();
    const std::string bytes = read_file(path);
    if (bytes.find('\0') != std::string::npos) throw InputError(name + ": not an OBJ file (it holds NUL bytes)");
    // tinyobjloader takes what is no number, such as nan, for 0.
    for (size_t at = 0; at < bytes.size(); at = bytes.find('\n', at) == std::string::npos ? bytes.size() : bytes.find('\n', at) + 1)
        if (bytes.compare(at, 2, "v ") == 0 && bytes.substr(at + 2, bytes.find('\n', at) - at - 2).find_first_of("nN") != std::string::npos)
            throw InputError(name + ": a position that is not finite at byte " + std::to_string(at));
    std::istringstream stream(bytes);
    tinyobj::attrib_t attributes;
    std::vector<tinyobj::shape_t> shapes;
    std::vector<tinyobj::material_t> materials;
    std::string warning, error;
    const bool ok = tinyobj::LoadObj(&attributes, &shapes, &materials, &warning, &error, &stream, nullptr, false, false);
    auto one_line = [](std::string text) {
        for (char& c : text) c = c == '\n' ? ' ' : c;
        return text;
    };
    if (!ok || !error.empty()) throw InputError(name + ": " + one_line(error.empty() ? "not an OBJ file" : error));
    Mesh mesh;
    for (size_t i = 0; i + 2 < attributes.vertices.size(); i += 3)
        mesh.positions.emplace_back(attributes.vertices[i], attributes.vertices[i + 1], attributes.vertices[i + 2]);
    for (const tinyobj::shape_t& shape : shapes) {
        size_t at = 0;
        for (const uint32_t corners : shape.mesh.num_face_vertices) {
            for (uint32_t k = 2; k < corners; ++k)
                mesh.triangles.push_back({uint32_t(shape.mesh.indices[at].vertex_index),
                                          uint32_t(shape.mesh.indices[at + k - 1].vertex_index),
                                          uint32_t(shape.mesh.indices[at + k].vertex_index)});
            at += corners;
        }
    }
    return mesh;
}

}  // namespace rill::cooker
