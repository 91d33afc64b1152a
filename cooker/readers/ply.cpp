// SPDX-License-Identifier: MIT
// PLY with whatever properties the exporter put in. (The PLY libraries in Debian drop velocities or read
// counts without checking them, so this reader is our own.)
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <utility>

#include "readers/file_bytes.h"
#include "readers/frame_files.h"
#include "readers/ply_header.h"
#include "readers/velocity_names.h"

namespace rill::cooker {
namespace {

/// Takes one value after another out of the data, whatever the encoding.
class Values {
public:
    Values(const std::string& bytes, const PlyHeader& header, std::string name)
        : bytes_(bytes), encoding_(header.encoding), name_(std::move(name)), at_(header.data_begin) {}
    [[noreturn]] void fail(const std::string& cause) const { throw InputError(name_ + ": " + cause); }

    double next(PlyType type, const PlyElement& element, uint64_t row) {
        if (encoding_ == PlyEncoding::ascii) return next_word(element, row);
        const size_t size = ply_size(type);
        if (size > bytes_.size() - at_) end_early(element, row);
        uint8_t raw[8];
        std::memcpy(raw, bytes_.data() + at_, size);
        at_ += size;
        if (encoding_ == PlyEncoding::big_endian) std::reverse(raw, raw + size);
        switch (type) {
            case PlyType::int8: return as<int8_t>(raw);
            case PlyType::uint8: return as<uint8_t>(raw);
            case PlyType::int16: return as<int16_t>(raw);
            case PlyType::uint16: return as<uint16_t>(raw);
            case PlyType::int32: return as<int32_t>(raw);
            case PlyType::uint32: return as<uint32_t>(raw);
            case PlyType::float32: return as<float>(raw);
            case PlyType::float64: return as<double>(raw);
        }
        return 0;
    }
    /// How many entries a list has; what they need at least is still there.
    uint64_t list_count(const PlyProperty& property, const PlyElement& element, uint64_t row) {
        const double count = next(property.count_type, element, row);
        const size_t each = encoding_ == PlyEncoding::ascii ? 1 : ply_size(property.type);
        if (!(count >= 0 && count <= double((bytes_.size() - at_) / each)) || count != double(uint64_t(count)))
            fail(element.name + " " + std::to_string(row) + " states a list of " + std::to_string(count) +
                 " entries, but " + std::to_string(bytes_.size() - at_) + " bytes follow");
        return uint64_t(count);
    }

private:
    template <class T>
    static double as(const uint8_t* raw) {
        T value;
        std::memcpy(&value, raw, sizeof(T));
        return double(value);
    }
    [[noreturn]] void end_early(const PlyElement& element, uint64_t row) const {
        fail("ends in the middle of " + element.name + " " + std::to_string(row) + " of " + std::to_string(element.count));
    }
    double next_word(const PlyElement& element, uint64_t row) {
        auto space = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
        while (at_ < bytes_.size() && space(bytes_[at_])) ++at_;
        size_t end = at_;
        while (end < bytes_.size() && !space(bytes_[end])) ++end;
        if (end == at_) end_early(element, row);
        const char* begin = bytes_.data() + at_ + (bytes_[at_] == '+' ? 1 : 0);
        double value = 0;
        const auto [stop, error] = std::from_chars(begin, bytes_.data() + end, value);
        // Out of range: a denormal that underflowed; anything too large ends as 0 only here, so refuse it.
        if (stop != bytes_.data() + end || (error != std::errc() && !underflow(begin, stop)))
            fail(element.name + " " + std::to_string(row) + ": '" + bytes_.substr(at_, std::min<size_t>(end - at_, 40)) + "' is not a number");
        at_ = end;
        return value;
    }
    static bool underflow(const char* begin, const char* end) {
        const std::string text(begin, end);
        return text.find("e-") != std::string::npos || text.find("E-") != std::string::npos;
    }

    const std::string& bytes_;
    PlyEncoding encoding_;
    std::string name_;
    size_t at_;
};

bool find_triple(const PlyElement& vertex, const std::array<std::string, 3>& names, int (&place)[3]) {
    for (int a = 0; a < 3; ++a)
        if ((place[a] = vertex.find(names[a])) < 0 || vertex.properties[place[a]].list) return false;
    return true;
}

/// Three components called NAME and an ending: NAME as users know velocity, or as they asked for it.
bool find_velocity(const PlyElement& vertex, const std::string& asked, int (&place)[3]) {
    using Endings = std::array<std::string, 3>;
    static const Endings endings[] = {{"_x", "_y", "_z"}, {"x", "y", "z"}, {".x", ".y", ".z"}, {"_0", "_1", "_2"},
                                      {"[0]", "[1]", "[2]"}, {"_X", "_Y", "_Z"}, {"X", "Y", "Z"}};
    int best = -1;
    for (const PlyProperty& first : vertex.properties)
        for (const Endings& ends : endings) {
            if (!first.name.ends_with(ends[0])) continue;
            const std::string name = first.name.substr(0, first.name.size() - ends[0].size());
            const int rank = velocity_rank(name, asked);
            int found[3];
            if (rank < 0 || (best >= 0 && rank >= best) || !find_triple(vertex, {name + ends[0], name + ends[1], name + ends[2]}, found)) continue;
            best = rank;
            std::copy(found, found + 3, place);
        }
    return best >= 0 || (asked.empty() && find_triple(vertex, {"u", "v", "w"}, place));
}

void read_vertices(Mesh& mesh, const PlyElement& element, Values& values, const std::string& asked) {
    int position[3], velocity[3];
    if (!find_triple(element, {"x", "y", "z"}, position)) values.fail("its vertices have no x y z");
    const bool has_velocity = find_velocity(element, asked, velocity);
    if (!asked.empty() && !has_velocity) values.fail("no vertex properties '" + asked + "' (as " + asked + "_x, " + asked + "x, …)");
    mesh.positions.resize(element.count);
    if (has_velocity) mesh.velocities.resize(element.count);
    std::vector<float> row(element.properties.size());
    for (uint64_t i = 0; i < element.count; ++i) {
        for (size_t p = 0; p < row.size(); ++p) {
            const PlyProperty& property = element.properties[p];
            if (property.list)
                for (uint64_t n = values.list_count(property, element, i); n > 0; --n) values.next(property.type, element, i);
            else
                row[p] = float(values.next(property.type, element, i));
        }
        for (int a = 0; a < 3; ++a) mesh.positions[i][a] = row[position[a]];
        if (has_velocity)
            for (int a = 0; a < 3; ++a) mesh.velocities[i][a] = row[velocity[a]];
    }
}

void read_faces(Mesh& mesh, const PlyElement& element, Values& values) {
    int corners = element.find("vertex_indices");
    if (corners < 0) corners = element.find("vertex_index");
    if (corners < 0 || !element.properties[corners].list) values.fail("its faces have no list vertex_indices");
    mesh.triangles.reserve(element.count);
    for (uint64_t i = 0; i < element.count; ++i)
        for (size_t p = 0; p < element.properties.size(); ++p) {
            const PlyProperty& property = element.properties[p];
            const uint64_t count = property.list ? values.list_count(property, element, i) : 1;
            uint32_t first = 0, previous = 0;
            for (uint64_t k = 0; k < count; ++k) {
                const double value = values.next(property.type, element, i);
                if (int(p) != corners) continue;
                if (!(value >= 0 && value <= 4294967295.0) || value != double(uint32_t(value)))
                    values.fail("face " + std::to_string(i) + " refers to vertex " + std::to_string(value));
                const uint32_t index = uint32_t(value);
                if (k == 0) first = index;
                if (k >= 2) mesh.triangles.push_back({first, previous, index});  // a polygon becomes a fan
                previous = index;
            }
        }
}

}  // namespace

Mesh read_ply(const std::filesystem::path& path, const ReadOptions& options) {
    const std::string bytes = read_file(path);
    const std::string name = path.string();
    const PlyHeader header = parse_ply_header(bytes, name);
    Values values(bytes, header, name);
    Mesh mesh;
    bool vertices = false, faces = false;
    for (const PlyElement& element : header.elements) {
        if (element.name == "vertex") {
            if (std::exchange(vertices, true)) values.fail("two vertex elements");
            read_vertices(mesh, element, values, options.velocity_name);
        } else if (element.name == "face") {
            if (std::exchange(faces, true)) values.fail("two face elements");
            read_faces(mesh, element, values);
        } else if (!vertices || !faces) {  // what follows both is of no interest
            if (element.properties.empty()) continue;
            for (uint64_t i = 0; i < element.count; ++i)
                for (const PlyProperty& property : element.properties)
                    for (uint64_t n = property.list ? values.list_count(property, element, i) : 1; n > 0; --n)
                        values.next(property.type, element, i);
        }
    }
    if (!vertices) values.fail("no vertex element");
    if (!faces && !mesh.positions.empty()) values.fail("no face element: points alone are not a surface");
    return mesh;
}

}  // namespace rill::cooker
