// SPDX-License-Identifier: MIT
// Alembic: all polygon meshes of the archive as one surface in world space, at the times of the mesh that has
// the most samples. Faces are wound clockwise in Alembic. No Alembic library comes with Debian, so the archive is
// read by alembic_archive.h.
#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "readers/alembic_archive.h"
#include "readers/frame_files.h"
#include "readers/velocity_names.h"

namespace rill::cooker {
namespace {

struct Transform {
    std::optional<AbcProperty> operations, values, inherits;
};
/// A mesh object, and what its vertices are moved by.
struct Surface {
    std::string path;
    AbcProperty position, corners, counts;
    std::optional<AbcProperty> velocity, velocity_indices, visible;
    std::vector<Transform> transforms;  ///< innermost first
};

std::optional<AbcProperty> copy_of(const std::vector<AbcProperty>& all, const char* name) {
    const AbcProperty* found = find_property(all, name);
    return found ? std::optional(*found) : std::nullopt;
}

class Alembic : public SequenceReader {
public:
    Alembic(const std::filesystem::path& path, const ReadOptions& options)
        : archive_(path), options_(options) {
        info_.format = "Alembic";
        info_.path = path.string();
        info_.raw_bytes = archive_.file().size();
        for (size_t i = 0; i < archive_.objects().size(); ++i) find_surface(i);
        if (surfaces_.empty()) archive_.file().fail("holds no polygon mesh");
        find_times();
        const auto with = size_t(std::count_if(surfaces_.begin(), surfaces_.end(), [](const Surface& s) { return s.velocity.has_value(); }));
        if (with != 0 && with != surfaces_.size())
            for (const Surface& s : surfaces_)
                if (!s.velocity) archive_.file().fail("'" + s.path + "' has no velocity, though other meshes have: export the liquid alone");
        if (with == 0 && !options.velocity_name.empty()) archive_.file().fail("no mesh has a property '" + options.velocity_name + "'");
        info_.velocity = with ? VelocityMeaning::unknown : VelocityMeaning::none;
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return info_.path + " at " + std::to_string(times_.at(index)) + " s"; }
    std::vector<std::filesystem::path> files(size_t) const override { return {info_.path}; }
    Mesh read(size_t index) const override {
        Mesh mesh;
        for (const Surface& surface : surfaces_) add(mesh, surface, index);
        return mesh;
    }

private:
    void find_surface(size_t index) {
        const AbcArchive::Object& object = archive_.objects()[index];
        if (find_property(object.properties, ".instanceSource"))
            archive_.file().fail("'" + object.path + "' is an instance of another object, which is not read");
        const AbcProperty* geometry = find_property(object.properties, ".geom");
        if (!geometry || geometry->kind != AbcProperty::Kind::compound) return;
        const std::vector<AbcProperty> parts = archive_.children(*geometry);
        const AbcProperty *position = find_property(parts, "P"), *corners = find_property(parts, ".faceIndices"),
                          *counts = find_property(parts, ".faceCounts");
        if (!position || !corners || !counts || position->samples == 0) return;
        Surface surface{object.path, *position, *corners, *counts, {}, {}, copy_of(object.properties, "visible"), {}};
        find_velocity(surface, parts);
        for (int at = int(index); at >= 0; at = archive_.objects()[size_t(at)].parent)
            if (const AbcProperty* transform = find_property(archive_.objects()[size_t(at)].properties, ".xform")) {
                const std::vector<AbcProperty> all = archive_.children(*transform);
                surface.transforms.push_back({copy_of(all, ".ops"), copy_of(all, ".vals"), copy_of(all, ".inherits")});
            }
        surfaces_.push_back(std::move(surface));
    }
    void find_velocity(Surface& surface, const std::vector<AbcProperty>& parts) {
        std::vector<AbcProperty> all;
        if (const AbcProperty* own = find_property(parts, ".velocities"); own && own->samples > 0) all.push_back(*own);
        if (const AbcProperty* more = find_property(parts, ".arbGeomParams"))
            for (AbcProperty& property : archive_.children(*more)) all.push_back(std::move(property));
        int best = -1;
        for (const AbcProperty& property : all) {
            const bool own = property.name == ".velocities" && options_.velocity_name.empty();
            const int rank = own ? 0 : velocity_rank(property.name, options_.velocity_name);
            if (rank < 0 || (best >= 0 && rank >= best)) continue;
            surface.velocity = property, surface.velocity_indices.reset();
            if (property.kind == AbcProperty::Kind::compound) {  // indexed
                const std::vector<AbcProperty> indexed = archive_.children(property);
                surface.velocity = copy_of(indexed, ".vals"), surface.velocity_indices = copy_of(indexed, ".indices");
                if (!surface.velocity || !surface.velocity_indices) archive_.fail(property, "of '" + surface.path + "' lacks .vals or .indices");
            }
            if (surface.velocity->samples == 0) surface.velocity.reset();
            else best = rank;
        }
    }

    /// Frames stand where the mesh with the most samples has them; numbered by their time where that is a whole
    /// number of frames, else from 1.
    void find_times() {
        const AbcProperty* most = &surfaces_.front().position;
        for (const Surface& surface : surfaces_)
            if (surface.position.samples > most->samples) most = &surface.position;
        const AbcSampling& sampling = archive_.sampling(*most);
        if (most->samples > archive_.file().size() || (sampling.acyclic() && most->samples > sampling.times.size()))
            archive_.fail(*most, "states " + std::to_string(most->samples) + " samples, more than there can be");
        for (uint64_t i = 0; i < most->samples; ++i) times_.push_back(sampling.at(i));
        std::vector<double> gaps;
        for (size_t i = 1; i < times_.size(); ++i) gaps.push_back(times_[i] - times_[i - 1]);
        if (!gaps.empty()) {
            std::nth_element(gaps.begin(), gaps.begin() + long(gaps.size() / 2), gaps.end());
            rate_ = sampling.acyclic() ? 1 / gaps[gaps.size() / 2] : double(sampling.times.size()) / sampling.cycle;
        }
        if (std::abs(rate_ - std::round(rate_)) < 1e-4 * rate_) rate_ = std::round(rate_);
        bool whole = true;
        for (size_t i = 0; i < times_.size(); ++i) {
            const double place = times_[i] * rate_;
            whole = whole && std::abs(place) < 1e9 && std::abs(place - std::round(place)) < 0.02;
            info_.numbers.push_back(whole ? int(std::lround(place)) : 0);
            whole = whole && (i == 0 || info_.numbers[i] > info_.numbers[i - 1]);
        }
        for (size_t i = 0; i < times_.size() && !whole; ++i) info_.numbers[i] = int(i) + 1;
        info_.frames_per_second = options_.frames_per_second > 0 ? options_.frames_per_second : rate_;
        for (double t : times_) info_.seconds.push_back(t * rate_ / info_.frames_per_second);
    }

    glm::dmat4 operation(uint8_t code, const double* v) const {
        const glm::dmat4 one(1);
        switch (code >> 4) {
            case 0: return glm::scale(one, {v[0], v[1], v[2]});
            case 1: return glm::translate(one, {v[0], v[1], v[2]});
            case 2: {
                const glm::dvec3 axis(v[0], v[1], v[2]);
                return glm::length(axis) > 0 ? glm::rotate(one, glm::radians(v[3]), axis) : one;
            }
            case 3: {
                glm::dmat4 matrix;
                for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = v[i];  // rows there are columns here
                return matrix;
            }
            case 4: return glm::rotate(one, glm::radians(v[0]), {1, 0, 0});
            case 5: return glm::rotate(one, glm::radians(v[0]), {0, 1, 0});
            default: return glm::rotate(one, glm::radians(v[0]), {0, 0, 1});
        }
    }
    glm::dmat4 local(const Transform& transform, double seconds) const {
        glm::dmat4 matrix(1);
        if (!transform.operations || !transform.values || transform.operations->samples == 0 || transform.values->samples == 0) return matrix;
        const AbcProperty& values = *transform.values;
        const uint64_t before = archive_.sample_at(values, seconds), after = std::min<uint64_t>(before + 1, values.samples - 1);
        std::vector<double> v = archive_.numbers(values, before);
        const double begin = archive_.sampling(values).at(before), end = archive_.sampling(values).at(after);
        if (seconds > begin + 1e-6 && end > begin) {  // between samples transforms move evenly
            const std::vector<double> next = archive_.numbers(values, after);
            const double share = std::min(1.0, (seconds - begin) / (end - begin));
            for (size_t i = 0; i < std::min(v.size(), next.size()); ++i) v[i] += share * (next[i] - v[i]);
        }
        size_t at = 0;
        for (const char raw : archive_.bytes(*transform.operations, 0)) {
            const uint8_t code = uint8_t(raw);
            constexpr size_t channels[] = {3, 3, 4, 16, 1, 1, 1};
            if ((code >> 4) > 6 || channels[code >> 4] > v.size() - at) archive_.fail(values, "does not fit the operations of its transform");
            matrix = matrix * operation(code, v.data() + at);
            at += channels[code >> 4];
        }
        return matrix;
    }
    glm::dmat4 world(const Surface& surface, double seconds) const {
        glm::dmat4 matrix(1);
        for (const Transform& transform : surface.transforms) {
            matrix = local(transform, seconds) * matrix;
            if (!transform.inherits || transform.inherits->samples == 0) continue;
            const std::vector<double> inherits = archive_.numbers(*transform.inherits, archive_.sample_at(*transform.inherits, seconds));
            if (!inherits.empty() && inherits[0] == 0) break;
        }
        for (int i = 0; i < 16; ++i)
            if (!(std::abs(matrix[i / 4][i % 4]) <= 1e9)) archive_.file().fail("the transform of '" + surface.path + "' is not finite");
        return matrix;
    }

    std::vector<glm::vec3> velocities(const Surface& surface, double seconds, size_t vertices) const {
        const AbcProperty& property = *surface.velocity;
        std::vector<glm::vec3> values = archive_.vectors(property, archive_.sample_at(property, seconds));
        if (surface.velocity_indices) {
            const AbcProperty& indexed = *surface.velocity_indices;
            std::vector<glm::vec3> each;
            for (uint32_t i : archive_.indices(indexed, archive_.sample_at(indexed, seconds))) {
                if (i >= values.size()) archive_.fail(indexed, "refers to velocity " + std::to_string(i) + " of " + std::to_string(values.size()));
                each.push_back(values[i]);
            }
            values = std::move(each);
        }
        if (values.size() != vertices)
            archive_.fail(property, "of '" + surface.path + "' has " + std::to_string(values.size()) + " values for " +
                                        std::to_string(vertices) + " vertices at " + std::to_string(seconds) + " s");
        return values;
    }
    void add(Mesh& mesh, const Surface& surface, size_t index) const {
        const double seconds = times_.at(index);
        const auto now = [&](const AbcProperty& property) { return archive_.sample_at(property, seconds); };
        if (surface.visible && surface.visible->samples > 0) {
            const std::vector<double> visible = archive_.numbers(*surface.visible, now(*surface.visible));
            if (!visible.empty() && visible[0] == 0) return;
        }
        const std::vector<glm::vec3> positions = archive_.vectors(surface.position, now(surface.position));
        if (positions.empty()) return;
        if (mesh.positions.size() + positions.size() > UINT32_MAX) archive_.file().fail("more vertices than 32 bits count");
        const glm::dmat4 matrix = world(surface, seconds);
        const size_t base = mesh.positions.size();
        for (const glm::vec3& x : positions) mesh.positions.emplace_back(matrix * glm::dvec4(x, 1));
        if (surface.velocity) {
            // What the object's own motion adds: the chord of its neighbours in time.
            const double from = times_[index == 0 ? 0 : index - 1], to = times_[std::min(index + 1, times_.size() - 1)];
            const glm::dmat4 drift = to > from ? (world(surface, to) - world(surface, from)) / (to - from) : glm::dmat4(0);
            const double played = info_.frames_per_second / rate_, unit = played * (options_.velocity_per_frame ? rate_ : 1);
            const std::vector<glm::vec3> own = velocities(surface, seconds, positions.size());
            for (size_t i = 0; i < own.size(); ++i)
                mesh.velocities.emplace_back(glm::dmat3(matrix) * glm::dvec3(own[i]) * unit + glm::dvec3(drift * glm::dvec4(positions[i], 1)) * played);
        }
        add_faces(mesh, surface, index, base, positions.size(), glm::determinant(glm::dmat3(matrix)) < 0);
    }
    void add_faces(Mesh& mesh, const Surface& surface, size_t index, size_t base, size_t vertices, bool mirrored) const {
        const double seconds = times_[index];
        const std::vector<uint32_t> counts = archive_.indices(surface.counts, archive_.sample_at(surface.counts, seconds));
        const std::vector<uint32_t> corners = archive_.indices(surface.corners, archive_.sample_at(surface.corners, seconds));
        size_t at = 0;
        for (uint32_t count : counts) {
            if (count > corners.size() - at)
                archive_.fail(surface.counts, "of '" + surface.path + "' counts more corners than its " + std::to_string(corners.size()) + " at " + std::to_string(seconds) + " s");
            for (uint32_t k = 0; k < count; ++k)
                if (corners[at + k] >= vertices)
                    archive_.fail(surface.corners, "of '" + surface.path + "' refers to vertex " + std::to_string(corners[at + k]) + " of " +
                                                       std::to_string(vertices) + " at " + std::to_string(seconds) + " s");
            for (uint32_t k = 2; k < count; ++k) {  // a polygon becomes a fan
                Triangle t = {uint32_t(base + corners[at]), uint32_t(base + corners[at + k]), uint32_t(base + corners[at + k - 1])};
                if (mirrored) std::swap(t[1], t[2]);
                mesh.triangles.push_back(t);
            }
            at += count;
        }
        if (at != corners.size())
            archive_.fail(surface.corners, "of '" + surface.path + "' has " + std::to_string(corners.size() - at) + " corners that belong to no face");
    }

    AbcArchive archive_;
    ReadOptions options_;
    std::vector<Surface> surfaces_;
    std::vector<double> times_;  // as the archive states them
    double rate_ = 24;           // of the archive
    SequenceInfo info_;
};

}  // namespace

std::unique_ptr<SequenceReader> open_alembic(const std::filesystem::path& path, const ReadOptions& options) {
    return std::make_unique<Alembic>(path, options);
}

Mesh read_alembic_frame(const std::filesystem::path& path, const ReadOptions& options) {
    ReadOptions plain = options;  // the sequence of files deals with rate and unit
    plain.frames_per_second = 0, plain.velocity_per_frame = false;
    return Alembic(path, plain).read(0);
}

}  // namespace rill::cooker
