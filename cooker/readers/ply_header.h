// SPDX-License-Identifier: MIT
// The header of a PLY file: which elements of which properties follow, and where the data begins.
#pragma once
#include <string>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {

enum class PlyType : uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
size_t ply_size(PlyType type);

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;
    bool list = false;
    PlyType count_type = PlyType::uint8;  ///< of a list
};
struct PlyElement {
    std::string name;
    uint64_t count = 0;
    std::vector<PlyProperty> properties;
    int find(const std::string& property) const;  ///< its place, or -1
};
enum class PlyEncoding { ascii, little_endian, big_endian };
struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::ascii;
    std::vector<PlyElement> elements;
    size_t data_begin = 0;
};
/// Throws InputError naming `name`, the line and the cause. Counts are checked against bytes.size(): no
/// element can claim more than the file could hold.
PlyHeader parse_ply_header(const std::string& bytes, const std::string& name);

}  // namespace rill::cooker
