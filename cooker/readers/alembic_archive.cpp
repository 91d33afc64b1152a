// SPDX-License-Identifier: MIT
#include "readers/alembic_archive.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "readers/file_bytes.h"

namespace rill::cooker {
namespace {
constexpr size_t most_objects = 100000;  // a few bytes can refer to one group again and again
constexpr int most_levels = 64;

size_t pod_size(AbcProperty::Pod pod) {
    constexpr size_t sizes[] = {1, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8, 0, 0};
    return sizes[size_t(pod)];
}

std::string take_text(ByteCursor& cursor, const std::string& bytes, uint64_t length, const char* what) {
    if (length > cursor.left()) cursor.fail(std::string("a ") + what + " of " + std::to_string(length) + " bytes, " + std::to_string(cursor.left()) + " follow");
    std::string text = bytes.substr(cursor.at(), length);
    cursor.skip(length);
    return text;
}
/// Numbers are as wide as the largest of a header needs.
uint32_t take_number(ByteCursor& cursor, uint32_t width) {
    if (width == 0) return cursor.take<uint8_t>("property header");
    if (width == 1) return cursor.take<uint16_t>("property header");
    if (width == 2) return cursor.take<uint32_t>("property header");
    cursor.fail("damaged property header");
}

template <class T, class Out>
void convert(const std::string& bytes, std::vector<Out>& out) {
    out.resize(bytes.size() / sizeof(T));
    for (size_t i = 0; i < out.size(); ++i) {
        T value;
        std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
        out[i] = Out(value);
    }
}
}  // namespace

bool AbcSampling::acyclic() const { return cycle == std::numeric_limits<double>::max() / 32; }

double AbcSampling::at(uint64_t sample) const {
    if (acyclic()) return times[std::min<uint64_t>(sample, times.size() - 1)];
    return times[sample % times.size()] + cycle * double(sample / times.size());
}

AbcArchive::AbcArchive(const std::filesystem::path& path) : file_(path) {
    const std::vector<OgawaFile::Node> root = file_.group(file_.root(), "root");
    if (root.size() < 6 || root[2].is_data) file_.fail("not an Alembic archive: its root lacks parts");
    const std::string version = file_.data(root[0], "version");
    if (version != std::string(4, '\0')) file_.fail("an Alembic archive of an unknown version");
    read_samplings(file_.data(root[4], "time samplings"));
    read_metadata(file_.data(root[5], "metadata"));
    read_objects(root[2]);
}

void AbcArchive::read_samplings(const std::string& bytes) {
    ByteCursor cursor(bytes, file_.name() + ": time samplings");
    while (cursor.left() > 0) {
        AbcSampling sampling;
        cursor.take<uint32_t>("count");  // the most samples that use it
        sampling.cycle = cursor.take<double>("cycle");
        const uint32_t count = cursor.take<uint32_t>("count");
        if (count < 1 || count > cursor.left() / 8) cursor.fail("states " + std::to_string(count) + " times");
        for (uint32_t i = 0; i < count; ++i) sampling.times.push_back(cursor.take<double>("times"));
        const bool sane = std::all_of(sampling.times.begin(), sampling.times.end(), [](double t) { return std::abs(t) < 1e9; });
        if (!sane || (!sampling.acyclic() && !(sampling.cycle > 0 && sampling.cycle < 1e9)) ||
            !std::is_sorted(sampling.times.begin(), sampling.times.end(), std::less_equal<>()) ||
            (!sampling.acyclic() && sampling.times.back() >= sampling.times.front() + sampling.cycle))
            cursor.fail("sampling " + std::to_string(samplings_.size()) + ": its times do not ascend");
        samplings_.push_back(std::move(sampling));
    }
    if (samplings_.empty()) samplings_.push_back({1, {0}});
}

void AbcArchive::read_metadata(const std::string& bytes) {
    metadata_.emplace_back();
    ByteCursor cursor(bytes, file_.name() + ": metadata");
    while (cursor.left() > 0) metadata_.push_back(take_text(cursor, bytes, cursor.take<uint8_t>("length"), "text"));
}

std::vector<AbcProperty> AbcArchive::read_compound(OgawaFile::Node node, const std::string& owner) const {
    std::vector<AbcProperty> properties;
    const std::vector<OgawaFile::Node> parts = file_.group(node, owner.c_str());
    if (parts.empty() || !parts.back().is_data) return properties;
    const std::string bytes = file_.data(parts.back(), owner.c_str());
    ByteCursor cursor(bytes, file_.name() + ": properties of " + owner);
    while (cursor.left() > 0) {
        const uint32_t info = cursor.take<uint32_t>("property header"), width = (info >> 2) & 3, kind = info & 3;
        AbcProperty property;
        property.kind = kind == 0 ? AbcProperty::Kind::compound : kind == 1 ? AbcProperty::Kind::scalar : AbcProperty::Kind::array;
        if (property.kind != AbcProperty::Kind::compound) {
            const uint32_t pod = (info >> 4) & 15;
            if (pod > uint32_t(AbcProperty::Pod::wstring)) cursor.fail("a property of unknown type " + std::to_string(pod));
            property.pod = AbcProperty::Pod(pod);
            property.extent = (info >> 12) & 0xff;
            property.samples = take_number(cursor, width);
            if (info & 0x200) {
                property.first_changed = take_number(cursor, width);
                property.last_changed = take_number(cursor, width);
            } else if (!(info & 0x800)) {
                property.first_changed = 1;
                property.last_changed = property.samples - 1;
            }
            if (info & 0x100) property.sampling = take_number(cursor, width);
            if (property.sampling >= samplings_.size())
                cursor.fail("refers to time sampling " + std::to_string(property.sampling) + " of " + std::to_string(samplings_.size()));
        }
        property.name = take_text(cursor, bytes, take_number(cursor, width), "name");
        const uint32_t metadata = (info >> 20) & 0xff;
        if (metadata == 0xff) property.metadata = take_text(cursor, bytes, take_number(cursor, width), "metadata");
        else if (metadata < metadata_.size()) property.metadata = metadata_[metadata];
        else cursor.fail("refers to metadata " + std::to_string(metadata) + " of " + std::to_string(metadata_.size()));
        if (properties.size() + 1 >= parts.size()) cursor.fail("more properties than groups");
        property.node = parts[properties.size()];
        property.name = property.name.substr(0, 1000);
        properties.push_back(std::move(property));
    }
    return properties;
}

std::vector<AbcProperty> AbcArchive::children(const AbcProperty& compound) const {
    if (compound.kind != AbcProperty::Kind::compound) fail(compound, "is not a compound");
    return read_compound(compound.node, compound.name);
}

void AbcArchive::read_objects(OgawaFile::Node root) {
    struct Open {
        OgawaFile::Node node;
        int index, level;  // index: into objects_
    };
    objects_.push_back({"", {}, -1});
    std::vector<Open> open = {{root, 0, 0}};
    for (size_t next = 0; next < open.size(); ++next) {
        const Open at = open[next];
        const std::string path = objects_[size_t(at.index)].path, shown = path.empty() ? "/" : path;
        if (at.level > most_levels) file_.fail(shown.substr(0, 60) + "…: objects within objects without end");
        const std::vector<OgawaFile::Node> parts = file_.group(at.node, shown.c_str());
        if (parts.empty()) continue;
        if (!parts[0].is_data) objects_[size_t(at.index)].properties = read_compound(parts[0], shown);
        if (!parts.back().is_data) continue;
        std::string bytes = file_.data(parts.back(), shown.c_str());
        bytes.resize(bytes.size() > 32 ? bytes.size() - 32 : 0);  // the last 32 are hashes
        ByteCursor cursor(bytes, file_.name() + ": children of " + shown);
        for (size_t child = 1; cursor.left() > 0; ++child) {
            const std::string name = take_text(cursor, bytes, cursor.take<uint32_t>("object name"), "name");
            if (cursor.take<uint8_t>("metadata index") == 0xff)
                take_text(cursor, bytes, cursor.take<uint32_t>("metadata"), "metadata");
            if (child + 1 >= parts.size()) cursor.fail("more objects than groups");
            if (objects_.size() >= most_objects) cursor.fail("more than " + std::to_string(most_objects) + " objects");
            objects_.push_back({(path + "/" + name).substr(0, 1000), {}, at.index});
            open.push_back({parts[child], int(objects_.size()) - 1, at.level + 1});
        }
    }
}

const AbcSampling& AbcArchive::sampling(const AbcProperty& property) const { return samplings_[property.sampling]; }

uint64_t AbcArchive::sample_at(const AbcProperty& property, double seconds) const {
    const AbcSampling& times = sampling(property);
    uint64_t from = 0, to = property.samples;  // the answer lies in [from, to)
    while (to - from > 1) {
        const uint64_t middle = (from + to) / 2;
        (times.at(middle) <= seconds + 1e-6 ? from : to) = middle;
    }
    return from;
}

void AbcArchive::fail(const AbcProperty& property, const std::string& cause) const { file_.fail("property '" + property.name + "' " + cause); }

std::string AbcArchive::bytes(const AbcProperty& property, uint64_t sample) const {
    if (property.kind == AbcProperty::Kind::compound) fail(property, "is a compound where values must be");
    if (sample >= property.samples) fail(property, "has " + std::to_string(property.samples) + " samples, " + std::to_string(sample) + " is wanted");
    const int64_t first = property.first_changed, last = property.last_changed, wanted = int64_t(sample);
    int64_t slot = 0;  // equal samples are stored once
    if (wanted >= first && !(first == 0 && last == 0)) slot = (wanted >= last ? last : wanted) - first + 1;
    const std::vector<OgawaFile::Node> parts = file_.group(property.node, property.name.c_str());
    const int64_t place = property.kind == AbcProperty::Kind::array ? 2 * slot : slot;
    if (place < 0 || place >= int64_t(parts.size()))
        fail(property, "lacks sample " + std::to_string(sample) + " of the " + std::to_string(property.samples) + " it states");
    constexpr uint64_t key = 16;
    return file_.data(parts[size_t(place)], property.name.c_str(), key);
}

std::vector<double> AbcArchive::numbers(const AbcProperty& property, uint64_t sample) const {
    const std::string raw = bytes(property, sample);
    std::vector<double> values;
    if (pod_size(property.pod) && raw.size() % pod_size(property.pod) != 0) fail(property, "ends in the middle of a value");
    switch (property.pod) {
        case AbcProperty::Pod::boolean:
        case AbcProperty::Pod::uint8: convert<uint8_t>(raw, values); break;
        case AbcProperty::Pod::int8: convert<int8_t>(raw, values); break;
        case AbcProperty::Pod::float32: convert<float>(raw, values); break;
        case AbcProperty::Pod::float64: convert<double>(raw, values); break;
        default: fail(property, "is of a type that it should not have");
    }
    return values;
}

std::vector<uint32_t> AbcArchive::indices(const AbcProperty& property, uint64_t sample) const {
    if (property.pod != AbcProperty::Pod::int32 && property.pod != AbcProperty::Pod::uint32) fail(property, "is not of 32-bit integers");
    const std::string raw = bytes(property, sample);
    if (raw.size() % 4 != 0) fail(property, "ends in the middle of a value");
    std::vector<uint32_t> values;
    convert<uint32_t>(raw, values);
    return values;
}

std::vector<glm::vec3> AbcArchive::vectors(const AbcProperty& property, uint64_t sample) const {
    const size_t each = pod_size(property.pod);
    if (property.pod != AbcProperty::Pod::float32 && property.pod != AbcProperty::Pod::float64) fail(property, "is not of floats");
    if (property.extent != 3 && property.extent != 1) fail(property, "is not of three components");
    const std::string raw = bytes(property, sample);
    if (raw.size() % (3 * each) != 0) fail(property, "ends in the middle of a vector");
    std::vector<glm::vec3> values(raw.size() / (3 * each));
    if (each == 4) {
        if (!values.empty()) std::memcpy(static_cast<void*>(values.data()), raw.data(), raw.size());
    } else {
        std::vector<float> flat;
        convert<double>(raw, flat);
        for (size_t i = 0; i < values.size(); ++i) values[i] = {flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]};
    }
    return values;
}

}  // namespace rill::cooker
