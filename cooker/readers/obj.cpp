// SPDX-License-Identifier: MIT
// Wavefront OBJ through tinyobjloader: positions and faces. The format has no velocities.
#include <tiny_obj_loader.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>

#include "readers/file_bytes.h"
#include "readers/frame_files.h"

namespace rill::cooker {
namespace {

/// Takes the next word off a line; empty: there is none.
std::string_view take_word(std::string_view& line) {
    constexpr const char* space = " \t\r";
    line.remove_prefix(std::min(line.find_first_not_of(space), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(space));
    line.remove_prefix(word.size());
    return word;
}
std::string quoted(std::string_view word) { return std::string("'").append(word.substr(0, 60)).append("'"); }
template <class T>
bool parse_all(std::string_view word, T& value) {
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

/// Why a line cannot be used, or nothing. tinyobjloader takes what is no number for 0, and any index too large for another.
std::string fault_of(std::string_view line) {
    const std::string_view kind = take_word(line);
    if (kind == "v")
        for (int axis = 0; axis < 3; ++axis) {
            const std::string_view word = take_word(line);
            double value = 0;
            if (word.empty()) return "a position of fewer than three numbers";
            if (!parse_all(word, value)) return quoted(word) + " is no number";
            if (!std::isfinite(value)) return "a position that is not finite";
        }
    if (kind == "f")
        for (int corner = 0;; ++corner) {
            const std::string_view word = take_word(line), index = word.substr(0, word.find('/'));
            int32_t value = 0;
            if (word.empty() && corner < 3) return "a face of fewer than three corners";
            if (word.empty()) break;
            if (!parse_all(index, value) || value == 0) return quoted(index) + " is no vertex";
        }
    return "";
}

void check_lines(std::string_view bytes, const std::string& name) {
    for (size_t at = 0, end, line = 1; at < bytes.size(); at = end + 1, ++line) {
        end = std::min(bytes.find('\n', at), bytes.size());
        const std::string fault = fault_of(bytes.substr(at, end - at));
        if (!fault.empty()) throw InputError(name + ": line " + std::to_string(line) + ": " + fault);
    }
}

}  // namespace

Mesh read_obj(const std::filesystem::path& path, const ReadOptions&) {
    const std::string name = path.string();
    const std::string bytes = read_file(path);
    if (bytes.find('\0') != std::string::npos) throw InputError(name + ": not an OBJ file (it holds NUL bytes)");
    if (bytes.empty()) throw InputError(name + ": empty file");
    check_lines(bytes, name);
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
    if (mesh.triangles.empty() && !mesh.positions.empty()) throw InputError(name + ": vertices without a face are not a surface");
    return mesh;
}

}  // namespace rill::cooker
