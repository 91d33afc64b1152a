// SPDX-License-Identifier: MIT
#include "frames/sequence_to_frames.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "frames/turn_alike.h"
#include "frames/walls.h"
#include "frames/weld_seams.h"
#include "frames/widen_patch.h"

namespace rill::cooker {
namespace {

/// Beyond this many metres a float no longer resolves a grain of sand, and squares overflow soon after.
constexpr float largest_coordinate = 1e9f;

bool usable(const glm::vec3& v) {
    return std::abs(v.x) <= largest_coordinate && std::abs(v.y) <= largest_coordinate &&
           std::abs(v.z) <= largest_coordinate;  // false for NaN and infinities
}

void check_values(const std::vector<glm::vec3>& values, const char* what, const std::string& name) {
    for (size_t i = 0; i < values.size(); ++i)
        if (!usable(values[i]))
            throw InputError(name + ": " + what + " of vertex " + std::to_string(i) + " is not finite (or beyond 1e9): " +
                             std::to_string(values[i].x) + " " + std::to_string(values[i].y) + " " +
                             std::to_string(values[i].z));
}

/// From the source's space to that of assets: right-handed, z up, metres.
glm::mat3 to_asset_space(const ReadOptions& options) {
    const float scale = options.scale > 0 ? float(options.scale) : 1.f, side = options.handedness == 'l' ? -scale : scale;
    if (options.up == 'y') return {{scale, 0, 0}, {0, 0, scale}, {0, -side, 0}};
    return {{scale, 0, 0}, {0, side, 0}, {0, 0, scale}};
}

/// Which of the source's frames are wanted, as indices.
std::vector<size_t> select(const SequenceInfo& info, const ReadOptions& options) {
    const std::vector<int>& numbers = info.numbers;
    std::vector<size_t> chosen;
    for (size_t i = 0; i < numbers.size(); ++i) {
        const bool in_range = options.step == 0 || (numbers[i] >= options.first && numbers[i] <= options.last &&
                                                    (int64_t(numbers[i]) - options.first) % options.step == 0);
        if (in_range) chosen.push_back(i);
    }
    const std::string range = std::to_string(numbers.front()) + " to " + std::to_string(numbers.back());
    if (options.step != 0) {
        for (int wanted : {options.first, options.last})
            if (wanted < numbers.front() || wanted > numbers.back())
                throw InputError(info.path + ": no frame " + std::to_string(wanted) + " as asked for: it holds frames " + range);
        if (chosen.empty() || numbers[chosen.front()] != options.first)
            throw InputError(info.path + ": frame " + std::to_string(options.first) + " is missing among frames " + range);
    }
    int64_t step = 0;
    for (size_t i = 1; i < chosen.size(); ++i) {
        const int64_t gap = int64_t(numbers[chosen[i]]) - numbers[chosen[i - 1]];
        step = step == 0 ? gap : std::min(step, gap);
    }
    if (options.step > 1) step = options.step;
    size_t missing = 0;
    std::string first_missing;
    for (size_t i = 1; i < chosen.size(); ++i) {
        const int64_t before = numbers[chosen[i - 1]], gap = numbers[chosen[i]] - before;
        if (gap % step != 0)
            throw InputError(info.path + ": frame " + std::to_string(numbers[chosen[i]]) + " does not fit: frames " + range + " step by " +
                             std::to_string(step) + "; choose an even part with --frames");
        if (gap != step && missing == 0) first_missing = std::to_string(before + step);
        missing += size_t(gap / step - 1);
    }
    if (missing > 0 && options.warn)
        options.warn(info.path + ": frame " + first_missing + " is missing" + (missing > 1 ? " and " + std::to_string(missing - 1) + " more" : "") +
                     ": the liquid is carried across the gap, at its true speed; bake what is missing for a better asset");
    return chosen;
}

/// Where liquid is cut off at sides of its bounds, what is missing lies in them: seen from where these meet it has no volume, and from between
/// two of them it adds some. Waves without a floor lie above their lowest point; liquid is below a patch of them.
bool faces_inward(const Mesh& mesh) {
    if (mesh.triangles.empty() || open_edges(mesh).empty()) return signed_volume(mesh) < 0;
    const WallFacts facts = wall_facts(mesh, median_edge(mesh));
    Mesh turned = mesh;
    for (Triangle& t : turned.triangles) std::swap(t[1], t[2]);
    for (const Mesh* either : {&mesh, static_cast<const Mesh*>(&turned)})
        if (rim_of_patch(*either, facts.lower, facts.upper).sides()) return either == &turned;
    glm::vec3 apex;
    for (int a = 0; a < 3; ++a) {
        const bool lower = facts.open[2 * a] > 0, upper = facts.open[2 * a + 1] > 0;
        const float share = lower != upper ? float(upper) : a == 2 && !lower ? 0.f : 0.5f;
        apex[a] = facts.lower[a] + share * (facts.upper[a] - facts.lower[a]);
    }
    return signed_volume(mesh, apex) < 0;
}

class Frames : public SequenceReader {
public:
    Frames(std::unique_ptr<SequenceReader> source, const ReadOptions& options)
        : source_(std::move(source)), info_(source_->info()), warn_(options.warn), space_(to_asset_space(options)) {
        if (info_.numbers.empty()) throw InputError(info_.path + ": no frames");
        chosen_ = select(info_, options);
        if (options.require_velocity && info_.velocity == VelocityMeaning::none)
            throw InputError(name(0) + ": no velocity: Rill carries the surface along by it, so export it with the mesh "
                             "(per vertex, see --velocity and --velocity-unit)");
        SequenceInfo chosen = info_;
        chosen.numbers.clear(), chosen.seconds.clear();
        for (size_t i : chosen_) {
            chosen.numbers.push_back(info_.numbers[i]);
            chosen.seconds.push_back(info_.seconds[i]);
        }
        info_ = std::move(chosen);
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return source_->name(chosen_.at(index)); }
    std::vector<std::filesystem::path> files(size_t index) const override { return source_->files(chosen_.at(index)); }
    Mesh read_surface(size_t index) const override {
        Mesh mesh = source_->read_surface(chosen_.at(index));
        return checked(std::move(mesh), index);
    }
    Mesh read(size_t index) const override {
        Mesh mesh = source_->read(chosen_.at(index));
        if (info_.velocity != VelocityMeaning::none && mesh.velocities.empty() && !mesh.positions.empty())
            throw InputError(name(index) + ": no velocity, though other frames have it");
        return checked(std::move(mesh), index);
    }

private:
    Mesh checked(Mesh mesh, size_t index) const {
        if (space_ != glm::mat3(1)) {
            for (glm::vec3& x : mesh.positions) x = space_ * x;
            for (glm::vec3& v : mesh.velocities) v = space_ * v;
            for (glm::vec3& n : mesh.normals) n = glm::normalize(space_ * n);
        }
        if (info_.velocity == VelocityMeaning::none && !mesh.velocities.empty()) {
            warn_once(name(index) + ": has velocity, but earlier frames have none, so it is not used");
            mesh.velocities.clear();
        }
        check_frame(mesh, name(index), [this](const std::string& message) { warn_once(message); });
        return mesh;
    }
    /// A sequence usually has the same flaw in every frame, and frames are read several times.
    void warn_once(const std::string& message) const {
        const std::lock_guard lock(mutex_);
        const std::string kind = message.substr(message.rfind(": ") + 1);
        if (!warn_ || std::find(warned_.begin(), warned_.end(), kind) != warned_.end()) return;
        warned_.push_back(kind);
        warn_(message);
    }
    std::unique_ptr<SequenceReader> source_;
    SequenceInfo info_;
    std::function<void(const std::string&)> warn_;
    glm::mat3 space_;
    std::vector<size_t> chosen_;
    mutable std::mutex mutex_;
    mutable std::vector<std::string> warned_;
};

}  // namespace

void check_frame(Mesh& mesh, const std::string& name, const std::function<void(const std::string&)>& warn) {
    const size_t vertices = mesh.positions.size();
    if (!mesh.velocities.empty() && mesh.velocities.size() != vertices)
        throw InputError(name + ": " + std::to_string(mesh.velocities.size()) + " velocities for " +
                         std::to_string(vertices) + " vertices");
    check_values(mesh.positions, "position", name);
    check_values(mesh.velocities, "velocity", name);
    for (size_t i = 0; i < mesh.triangles.size(); ++i)
        for (uint32_t v : mesh.triangles[i])
            if (v >= vertices)
                throw InputError(name + ": triangle " + std::to_string(i) + " refers to vertex " + std::to_string(v) +
                                 " of " + std::to_string(vertices));
    drop_degenerate(mesh);
    if (const size_t closed = weld_seams(mesh); closed > 0 && warn)
        warn(name + " (" + std::to_string(closed) + " edges): vertices at the same place are taken as one");
    if (const size_t turned = turn_alike(mesh); turned > 0 && warn)
        warn(name + " (" + std::to_string(turned) + " triangles): triangles that face otherwise than their neighbours are turned");
    if (faces_inward(mesh)) {
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
        for (glm::vec3& n : mesh.normals) n = -n;
        if (warn) warn(name + ": triangles face inward; turned outward");
    }
}

std::unique_ptr<SequenceReader> sequence_to_frames(std::unique_ptr<SequenceReader> source, const ReadOptions& options) {
    return std::make_unique<Frames>(std::move(source), options);
}

}  // namespace rill::cooker
