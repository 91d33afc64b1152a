// SPDX-License-Identifier: MIT
#include "mesh_file.h"

#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>

namespace player {

static size_t size_of(const std::string& type) {
    if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
    if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
    if (type == "int" || type == "uint" || type == "float" || type == "int32" || type == "uint32" || type == "float32")
        return 4;
    if (type == "double" || type == "float64") return 8;
    return 0;
}

namespace {
struct Header {
    size_t vertices = 0, faces = 0, stride = 0;
    size_t offset[6];  // of x y z vx vy vz in a vertex; `absent` where it has none
};
constexpr size_t absent = ~size_t(0);
}  // namespace

static bool read_header(std::istream& in, Header& out, std::string& cause) {
    static const char* const names[6] = {"x", "y", "z", "vx", "vy", "vz"};
    for (size_t& offset : out.offset) offset = absent;
    std::string line, element;
    bool binary = false;
    for (int number = 0; std::getline(in, line) && number < 200; ++number) {
        std::istringstream words(line);
        std::string word, type, name;
        words >> word;
        if (number == 0 && word != "ply") break;
        if (word == "format") binary = words >> type && type == "binary_little_endian";
        if (word == "element") words >> element >> (element == "vertex" ? out.vertices : out.faces);
        if (word == "property" && element == "vertex") {
            words >> type >> name;
            for (int i = 0; i < 6; ++i)
                if (name == names[i] && size_of(type) == 4) out.offset[i] = out.stride;
            if (size_of(type) == 0) break;
            out.stride += size_of(type);
        }
        // One list per face, a byte for its length and four for each index: what the tools here write.
        if (word == "property" && element == "face") {
            std::string count, index;
            words >> type >> count >> index;
            if (type != "list" || size_of(count) != 1 || size_of(index) != 4) break;
        }
        if (word == "end_header") {
            if (binary && out.offset[0] != absent && out.offset[1] != absent && out.offset[2] != absent) return true;
            break;
        }
    }
    cause = "not a little endian binary PLY with float x y z and faces";
    return false;
}

static void finish(Mesh& mesh) {
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        Vertex* corner[3];
        for (int c = 0; c < 3; ++c) corner[c] = &mesh.vertices[mesh.indices[i + c]];
        const glm::vec3 normal = glm::cross(corner[1]->position - corner[0]->position,
                                            corner[2]->position - corner[0]->position);
        for (Vertex* vertex : corner) vertex->normal += normal;
    }
    if (!mesh.vertices.empty()) mesh.bounds = {mesh.vertices[0].position, mesh.vertices[0].position};
    for (Vertex& vertex : mesh.vertices) {
        const float length = glm::length(vertex.normal);
        vertex.normal = length > 0.0f ? vertex.normal / length : glm::vec3(0, 0, 1);
        mesh.bounds.lower = glm::min(mesh.bounds.lower, vertex.position);
        mesh.bounds.upper = glm::max(mesh.bounds.upper, vertex.position);
    }
}

/// Polygons as fans of triangles.
static bool read_faces(const char* face, const char* end, const Header& header, Mesh& out, std::string& cause) {
    for (size_t i = 0; i < header.faces; ++i) {
        const size_t corners = face < end ? uint8_t(*face) : 0, bytes = 4 * corners;
        if (face == end || bytes > size_t(end - face) - 1) {
            cause = "ends before its last vertex or face";
            return false;
        }
        uint32_t corner[255];
        std::memcpy(corner, face + 1, bytes);
        face += 1 + bytes;
        for (size_t c = 0; c < corners; ++c)
            if (corner[c] >= header.vertices) {
                cause = "a face names a vertex that there is not";
                return false;
            }
        for (size_t c = 2; c < corners; ++c) out.indices.insert(out.indices.end(), {corner[0], corner[c - 1], corner[c]});
    }
    return true;
}

bool read_ply(const std::string& path, Mesh& out, std::string& cause) {
    out = {};
    std::ifstream in(path, std::ios::binary);
    if (!in) {
        cause = "cannot be opened";
        return false;
    }
    Header header;
    if (!read_header(in, header, cause)) return false;
    std::stringstream rest;
    rest << in.rdbuf();
    const std::string bytes = rest.str();
    // A division, not a product: the count is the file's word.
    if (header.vertices > bytes.size() / header.stride) {
        cause = "ends before its last vertex or face";
        return false;
    }
    out.vertices.resize(header.vertices);
    for (size_t i = 0; i < header.vertices; ++i)
        for (int k = 0; k < 6; ++k) {
            glm::vec3& vector = k < 3 ? out.vertices[i].position : out.vertices[i].velocity;
            vector[k % 3] = 0.0f;
            if (header.offset[k] != absent)
                std::memcpy(&vector[k % 3], bytes.data() + i * header.stride + header.offset[k], 4);
            out.vertices[i].normal = glm::vec3(0.0f);
        }
    if (!read_faces(bytes.data() + header.vertices * header.stride, bytes.data() + bytes.size(), header, out, cause)) return false;
    finish(out);
    return true;
}

// ---- patterns

/// The conversion's place and length, or npos; good = false for any other %.
static size_t find_conversion(const std::string& pattern, size_t& length, bool& good) {
    good = true;
    const size_t at = pattern.find('%');
    if (at == std::string::npos) return at;
    const size_t end = pattern.find_first_not_of("0123456789", at + 1);
    good = end != std::string::npos && pattern[end] == 'd' && end - at <= 3 && pattern.find('%', end) == std::string::npos;
    length = good ? end - at + 1 : 0;
    return at;
}

bool pattern_is_good(const std::string& pattern) {
    size_t length = 0;
    bool good = true;
    find_conversion(pattern, length, good);
    return good;
}

bool pattern_has_number(const std::string& pattern) {
    return pattern_is_good(pattern) && pattern.find('%') != std::string::npos;
}

std::string fill_pattern(const std::string& pattern, int number) {
    size_t length = 0;
    bool good = true;
    const size_t at = find_conversion(pattern, length, good);
    if (at == std::string::npos || !good) return pattern;
    char digits[128];
    std::snprintf(digits, sizeof digits, pattern.substr(at, length).c_str(), number);
    return pattern.substr(0, at) + digits + pattern.substr(at + length);
}

}  // namespace player
