// SPDX-License-Identifier: MIT
#include "readers/ply_header.h"

#include <charconv>
#include <optional>
#include <sstream>

namespace rill::cooker {
namespace {

std::optional<PlyType> type_of(const std::string& name) {
    static constexpr struct { const char *name, *sized; PlyType type; } names[] = {
        {"char", "int8", PlyType::int8},      {"uchar", "uint8", PlyType::uint8},
        {"short", "int16", PlyType::int16},   {"ushort", "uint16", PlyType::uint16},
        {"int", "int32", PlyType::int32},     {"uint", "uint32", PlyType::uint32},
        {"float", "float32", PlyType::float32}, {"double", "float64", PlyType::float64},
    };
    for (const auto& entry : names)
        if (name == entry.name || name == entry.sized) return entry.type;
    return std::nullopt;
}

/// Fewest bytes one row can take.
uint64_t smallest_row(const PlyElement& element, PlyEncoding encoding) {
    uint64_t bytes = 0;
    for (const PlyProperty& p : element.properties)
        bytes += encoding == PlyEncoding::ascii ? 2 : ply_size(p.list ? p.count_type : p.type);  // digit and space
    return bytes;
}

class HeaderParser {
public:
    HeaderParser(const std::string& bytes, const std::string& name) : bytes_(bytes), name_(name) {}
    PlyHeader parse() {
        if (next_line() != "ply") fail("not a PLY file");
        bool format = false;
        for (;;) {
            const std::string line = next_line();
            std::istringstream words(line);
            std::string word;
            words >> word;
            if (word == "end_header") break;
            if (word.empty() || word == "comment" || word == "obj_info") continue;
            if (word == "format")
                parse_format(words), format = true;
            else if (word == "element")
                parse_element(words);
            else if (word == "property")
                parse_property(words);
            else
                fail("'" + line.substr(0, 60) + "' is no header line");
        }
        if (!format) fail("no format line");
        header_.data_begin = at_;
        const uint64_t left = bytes_.size() - at_;
        for (const PlyElement& element : header_.elements) {
            const uint64_t row = smallest_row(element, header_.encoding);
            if (row > 0 && element.count > (left + 1) / row)
                fail("states " + std::to_string(element.count) + " of element " + element.name + ", but only " +
                     std::to_string(left) + " bytes of data follow");
        }
        return std::move(header_);
    }

private:
    [[noreturn]] void fail(const std::string& cause) const {
        throw InputError(name_ + ": header line " + std::to_string(line_) + ": " + cause);
    }
    std::string next_line() {
        ++line_;
        constexpr size_t longest_line = 4096;
        const size_t end = bytes_.find('\n', at_);
        if (end == std::string::npos || end - at_ > longest_line || line_ > 1000)
            fail(line_ == 1 ? "not a PLY file" : "the header has no end");
        std::string line = bytes_.substr(at_, end - at_);
        at_ = end + 1;
        if (!line.empty() && line.back() == '\r') line.pop_back();
        return line;
    }
    void parse_format(std::istringstream& words) {
        std::string encoding, version;
        words >> encoding >> version;
        if (encoding == "ascii") header_.encoding = PlyEncoding::ascii;
        else if (encoding == "binary_little_endian") header_.encoding = PlyEncoding::little_endian;
        else if (encoding == "binary_big_endian") header_.encoding = PlyEncoding::big_endian;
        else fail("unknown encoding '" + encoding + "'");
        if (version != "1.0") fail("unknown version '" + version + "'");
    }
    void parse_element(std::istringstream& words) {
        PlyElement element;
        std::string count;
        words >> element.name >> count;
        const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
        if (element.name.empty() || error != std::errc() || end != count.data() + count.size())
            fail("element needs a name and a count, not '" + element.name + " " + count + "'");
        header_.elements.push_back(std::move(element));
    }
    void parse_property(std::istringstream& words) {
        if (header_.elements.empty()) fail("property before any element");
        PlyProperty property;
        std::string type, count_type;
        words >> type;
        if ((property.list = type == "list")) words >> count_type >> type;
        words >> property.name;
        const auto value = type_of(type);
        const auto count = property.list ? type_of(count_type) : PlyType::uint8;
        if (!value || !count || property.name.empty()) fail("property of unknown type '" + type + "'");
        if (property.list && *count >= PlyType::float32) fail("list counted in '" + count_type + "'");
        property.type = *value, property.count_type = *count;
        header_.elements.back().properties.push_back(std::move(property));
    }

    const std::string& bytes_;
    const std::string& name_;
    PlyHeader header_;
    size_t at_ = 0, line_ = 0;
};

}  // namespace

size_t ply_size(PlyType type) {
    static constexpr size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[size_t(type)];
}

int PlyElement::find(const std::string& property) const {
    for (size_t i = 0; i < properties.size(); ++i)
        if (properties[i].name == property) return int(i);
    return -1;
}

PlyHeader parse_ply_header(const std::string& bytes, const std::string& name) {
    return HeaderParser(bytes, name).parse();
}

}  // namespace rill::cooker
