// SPDX-License-Identifier: MIT
// What an Alembic archive says about its objects: names, properties, their samples and times. Written from the
// layout that AbcCoreOgawa reads; only what a surface needs is looked at.
#pragma once
#include <glm/glm.hpp>
#include <memory>
#include <optional>

#include "readers/ogawa.h"

namespace rill::cooker {

/// Uniform (one time and a cycle), cyclic (several) or acyclic (a time for each sample).
struct AbcSampling {
    double cycle = 1;
    std::vector<double> times;
    bool acyclic() const;
    double at(uint64_t sample) const;  ///< acyclic beyond its times: the last
};

struct AbcProperty {
    enum class Kind { compound, scalar, array };
    enum class Pod : uint8_t { boolean, uint8, int8, uint16, int16, uint32, int32, uint64, int64, float16, float32, float64, string, wstring };
    std::string name, metadata;
    Kind kind = Kind::compound;
    Pod pod = Pod::boolean;
    uint32_t extent = 1, samples = 0, first_changed = 0, last_changed = 0, sampling = 0;
    OgawaFile::Node node;
};

class AbcArchive {
public:
    explicit AbcArchive(const std::filesystem::path& path);
    const OgawaFile& file() const { return file_; }

    struct Object {
        std::string path;                     ///< "/domain/liquid"
        std::vector<AbcProperty> properties;  ///< its top compound
        int parent = -1;                      ///< index into objects()
    };
    const std::vector<Object>& objects() const { return objects_; }  ///< parents before children
    std::vector<AbcProperty> children(const AbcProperty& compound) const;

    const AbcSampling& sampling(const AbcProperty& property) const;
    /// The last sample at or before `seconds`, the first when there is none.
    uint64_t sample_at(const AbcProperty& property, double seconds) const;
    std::string bytes(const AbcProperty& property, uint64_t sample) const;  ///< without the key
    std::vector<double> numbers(const AbcProperty& property, uint64_t sample) const;
    std::vector<uint32_t> indices(const AbcProperty& property, uint64_t sample) const;
    std::vector<glm::vec3> vectors(const AbcProperty& property, uint64_t sample) const;
    [[noreturn]] void fail(const AbcProperty& property, const std::string& cause) const;

private:
    void read_samplings(const std::string& bytes);
    void read_metadata(const std::string& bytes);
    std::vector<AbcProperty> read_compound(OgawaFile::Node node, const std::string& owner) const;
    void read_objects(OgawaFile::Node root);
    OgawaFile file_;
    std::vector<AbcSampling> samplings_;
    std::vector<std::string> metadata_;
    std::vector<Object> objects_;
};

inline const AbcProperty* find_property(const std::vector<AbcProperty>& all, const std::string& name) {
    for (const AbcProperty& property : all)
        if (property.name == name) return &property;
    return nullptr;
}

}  // namespace rill::cooker
