// SPDX-License-Identifier: MIT
#include "rivals/meshopt_mesh.h"

#include <meshoptimizer.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace rill::cooker {
namespace {

struct Head {
    uint32_t vertices, indices, vertex_bytes, index_bytes, stream_bytes;  ///< stream_bytes: of both, coded, before zstd
    uint16_t with_velocity, reserved;
    float lower[3], step, velocity_step;
};
using Vertex = std::array<uint16_t, 4>;             ///< x y z 0
using MovingVertex = std::array<uint16_t, 8>;       ///< x y z 0 u v w 0

float longest(const glm::vec3& v) { return std::max({v.x, v.y, v.z}); }
uint16_t zigzag(float v) {
    const int32_t i = int32_t(std::lround(v));
    return uint16_t(i < 0 ? -2 * i - 1 : 2 * i);
}

template <class V>
std::vector<unsigned char> vertex_stream(const std::vector<V>& vertices) {
    std::vector<unsigned char> out(meshopt_encodeVertexBufferBound(vertices.size(), sizeof(V)));
    out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), vertices.data(), vertices.size(), sizeof(V)));
    return out;
}

}  // namespace

std::string meshopt_encode(const Mesh& mesh, int bits, int velocity_bits) {
    if (mesh.triangles.empty()) return {};
    std::vector<uint32_t> indices(mesh.triangles.size() * 3), remap(mesh.positions.size());
    meshopt_optimizeVertexCacheStrip(indices.data(), mesh.triangles[0].data(), indices.size(), mesh.positions.size());
    const size_t used = meshopt_optimizeVertexFetchRemap(remap.data(), indices.data(), indices.size(), mesh.positions.size());
    for (uint32_t& i : indices) i = remap[i];
    Head head{uint32_t(used), uint32_t(indices.size()), 0, 0, 0, uint16_t(!mesh.velocities.empty()), 0, {}, 0, 0};
    glm::vec3 lower = mesh.positions[0], upper = lower, fastest(0);
    for (const glm::vec3& x : mesh.positions) lower = glm::min(lower, x), upper = glm::max(upper, x);
    for (const glm::vec3& v : mesh.velocities) fastest = glm::max(fastest, glm::abs(v));
    head.step = std::max(longest(upper - lower), 1e-20f) / float((1 << bits) - 1);
    head.velocity_step = std::max(longest(fastest), 1e-20f) / float((1 << (velocity_bits - 1)) - 1);
    std::memcpy(head.lower, &lower, sizeof head.lower);
    std::vector<Vertex> still(used);
    std::vector<MovingVertex> moving(head.with_velocity ? used : 0);
    for (size_t i = 0; i < remap.size(); ++i) {
        if (remap[i] == UINT32_MAX) continue;
        const glm::vec3 at = (mesh.positions[i] - lower) / head.step;
        for (int c = 0; c < 3; ++c) {
            still[remap[i]][size_t(c)] = uint16_t(std::lround(at[c]));
            if (!head.with_velocity) continue;
            moving[remap[i]][size_t(c)] = uint16_t(std::lround(at[c]));
            moving[remap[i]][size_t(4 + c)] = zigzag(mesh.velocities[i][c] / head.velocity_step);
        }
    }
    std::vector<unsigned char> stream = head.with_velocity ? vertex_stream(moving) : vertex_stream(still);
    head.vertex_bytes = uint32_t(stream.size());
    std::vector<unsigned char> order(meshopt_encodeIndexBufferBound(indices.size(), used));
    order.resize(meshopt_encodeIndexBuffer(order.data(), order.size(), indices.data(), indices.size()));
    head.index_bytes = uint32_t(order.size());
    stream.insert(stream.end(), order.begin(), order.end());
    head.stream_bytes = uint32_t(stream.size());
    std::string bytes(sizeof head + ZSTD_compressBound(stream.size()), '\0');
    std::memcpy(bytes.data(), &head, sizeof head);
    const size_t packed = ZSTD_compress(bytes.data() + sizeof head, bytes.size() - sizeof head, stream.data(), stream.size(), 19);
    if (ZSTD_isError(packed)) throw InputError(std::string("zstd: ") + ZSTD_getErrorName(packed));
    bytes.resize(sizeof head + packed);
    return bytes;
}

Mesh meshopt_decode(const std::string& bytes) {
    Mesh mesh;
    if (bytes.empty()) return mesh;
    Head head;
    if (bytes.size() < sizeof head) throw InputError("meshoptimizer: too short");
    std::memcpy(&head, bytes.data(), sizeof head);
    std::vector<unsigned char> stream(head.stream_bytes);
    const size_t size = ZSTD_decompress(stream.data(), stream.size(), bytes.data() + sizeof head, bytes.size() - sizeof head);
    const size_t stride = head.with_velocity ? sizeof(MovingVertex) : sizeof(Vertex);
    std::vector<uint16_t> vertices(head.vertices * stride / 2);
    mesh.triangles.resize(head.indices / 3);
    if (size != stream.size() || head.vertex_bytes > size || head.vertex_bytes + head.index_bytes != size ||
        meshopt_decodeVertexBuffer(vertices.data(), head.vertices, stride, stream.data(), head.vertex_bytes) != 0 ||
        meshopt_decodeIndexBuffer(mesh.triangles[0].data(), head.indices, stream.data() + head.vertex_bytes, head.index_bytes) != 0)
        throw InputError("meshoptimizer: damaged stream");
    for (size_t i = 0; i < head.vertices; ++i) {
        const uint16_t* v = &vertices[i * stride / 2];
        mesh.positions.push_back(glm::vec3(head.lower[0], head.lower[1], head.lower[2]) + head.step * glm::vec3(v[0], v[1], v[2]));
        const auto signed_value = [&](uint16_t u) { return head.velocity_step * float(u & 1 ? -int(u / 2) - 1 : int(u / 2)); };
        if (head.with_velocity) mesh.velocities.push_back({signed_value(v[4]), signed_value(v[5]), signed_value(v[6])});
    }
    return mesh;
}

}  // namespace rill::cooker
