// SPDX-License-Identifier: MIT
#include "frames/estimate_velocity.h"

#include "frames/surface_motion.h"

namespace rill::cooker {
namespace {
class Estimated : public SequenceReader {
public:
    explicit Estimated(std::unique_ptr<SequenceReader> source) : source_(std::move(source)), info_(source_->info()) {
        info_.velocity = VelocityMeaning::forward, info_.velocity_estimated = true;
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return source_->name(index); }
    std::vector<std::filesystem::path> files(size_t index) const override {
        std::vector<std::filesystem::path> all = source_->files(index);
        if (info_.seconds.size() > 1)
            for (std::filesystem::path& path : source_->files(neighbour(index))) all.push_back(std::move(path));
        return all;
    }
    Mesh read_surface(size_t index) const override { return source_->read_surface(index); }
    Mesh read(size_t index) const override {
        Mesh mesh = source_->read_surface(index);
        mesh.velocities.assign(mesh.positions.size(), glm::vec3(0));
        if (info_.seconds.size() < 2 || mesh.triangles.empty()) return mesh;
        const size_t other = neighbour(index);
        const double seconds = info_.seconds[other] - info_.seconds[index];  // negative at the end
        const Mesh next = source_->read_surface(other);
        mesh.velocities = surface_motion(SurfaceIndex(mesh), SurfaceIndex(next), 1);
        for (glm::vec3& v : mesh.velocities) v *= float(1 / seconds);
        return mesh;
    }

private:
    size_t neighbour(size_t index) const { return index + 1 < info_.seconds.size() ? index + 1 : index - 1; }
    std::unique_ptr<SequenceReader> source_;
    SequenceInfo info_;
};
}  // namespace

std::unique_ptr<SequenceReader> estimate_velocity(std::unique_ptr<SequenceReader> source) {
    return std::make_unique<Estimated>(std::move(source));
}

}  // namespace rill::cooker
