// SPDX-License-Identifier: MIT
// Source meshes for pictures beside the decoded ones: binary PLY, and printf patterns of file names.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "camera.h"

namespace player {

/// As the runtime writes it into a Target.
struct Vertex {
    glm::vec3 position, normal, velocity;
};
struct Mesh {
    std::vector<Vertex> vertices;
    std::vector<uint32_t> indices;
    Bounds bounds;
};

/// Little endian binary PLY of polygons with float x y z and, if it has them, vx vy vz; normals are
/// the area-weighted mean of the triangles'. False: `cause` says why in one line.
bool read_ply(const std::string& path, Mesh& out, std::string& cause);

/// "frame_%04d.png" and 7 → "frame_0007.png". Nothing but one %d or %0Nd may be in it; a pattern
/// without one is returned as it is.
std::string fill_pattern(const std::string& pattern, int number);
bool pattern_has_number(const std::string& pattern);
/// False when `pattern` holds a % that fill_pattern does not know.
bool pattern_is_good(const std::string& pattern);

}  // namespace player
