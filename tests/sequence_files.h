// SPDX-License-Identifier: MIT
// Input files for tests, written byte by byte here and nowhere else: what the readers are held against.
#pragma once
#include <zlib.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "common/scratch_folder.h"

struct TestFolder : rill::cooker::ScratchFolder {
    std::string operator/(const std::string& name) const { return (path / name).string(); }
};

inline void put_file(const std::filesystem::path& path, const std::string& bytes) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
}
inline std::string get_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}
template <class T>
void put(std::string& bytes, const T& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline std::string gzip(const std::string& bytes) {
    z_stream stream{};
    deflateInit2(&stream, 1, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
    std::string packed(deflateBound(&stream, uLong(bytes.size())) + 32, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = uInt(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = uInt(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

/// Positions are stored as they are: in the solver's own space.
inline std::string mantaflow_mesh(const rill::cooker::Mesh& mesh) {
    std::string bytes;
    put(bytes, int32_t(mesh.positions.size()));
    for (const glm::vec3& x : mesh.positions) put(bytes, x);
    put(bytes, int32_t(mesh.positions.size()));
    for (size_t i = 0; i < mesh.positions.size(); ++i) put(bytes, glm::vec3(0, 0, 1));
    put(bytes, int32_t(mesh.triangles.size()));
    for (const rill::cooker::Triangle& t : mesh.triangles) put(bytes, t);
    return bytes;
}
inline std::string mantaflow_velocity(const std::vector<glm::vec3>& velocities) {
    std::string bytes = "MD01";
    put(bytes, int32_t(velocities.size()));
    for (int32_t junk : {32528, 1455494760, 32528, 1, 12}) put(bytes, junk);
    bytes += std::string(256, 'x');
    put(bytes, uint64_t(1700000000000));
    for (const glm::vec3& v : velocities) put(bytes, v);
    return bytes;
}
/// A domain of 4 × 2 × 2 m around `origin`, 32 base cells long, at time scale 1 and `fps`.
inline std::string mantaflow_config(int frame, float fps, const glm::vec3& origin, const float (&rows)[9]) {
    std::string bytes;
    for (int32_t v : {0, 32, 16, 16}) put(bytes, v);
    put(bytes, 1.0f / 32), put(bytes, 0.05f);
    for (int twice = 0; twice < 3; ++twice) {
        put(bytes, twice == 1 ? glm::vec3(2, 1, 1) : glm::vec3(-2, -1, -1));
    }
    for (int i = 0; i < 6; ++i) put(bytes, int32_t(0));
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) put(bytes, rows[3 * r + c]);
        put(bytes, 0.0f);
    }
    put(bytes, origin), put(bytes, 1.0f);
    for (int32_t v : {32, 16, 16, 0, 0, 0, 32, 16, 16}) put(bytes, v);
    put(bytes, glm::vec3(0)), put(bytes, 2.5f / fps * float(frame));
    bytes += std::string("C01\0", 4);
    return bytes;
}

/// As exporters write it: x y z, vx vy vz if the mesh has them, triangles.
inline std::string plain_ply(const rill::cooker::Mesh& mesh) {
    const bool velocity = !mesh.velocities.empty();
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.positions.size()) +
                        "\nproperty float x\nproperty float y\nproperty float z\n" +
                        (velocity ? "property float vx\nproperty float vy\nproperty float vz\n" : "") + "element face " +
                        std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        put(bytes, mesh.positions[i]);
        if (velocity) put(bytes, mesh.velocities[i]);
    }
    for (const rill::cooker::Triangle& t : mesh.triangles) bytes += char(3), put(bytes, t);
    return bytes;
}
