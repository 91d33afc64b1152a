// SPDX-License-Identifier: MIT
#include "estimate_velocity.h"

#include <algorithm>
#include <cmath>

#include "surface_distance.h"

namespace rill::cooker {
namespace {

/// Neighbours of every vertex over its edges, one list after another.
struct Neighbours {
    std::vector<uint32_t> first, vertex;
    explicit Neighbours(const Mesh& mesh) : first(mesh.positions.size() + 1) {
        for (const Triangle& t : mesh.triangles)
            for (uint32_t v : t) first[v + 1] += 2;
        for (size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
        vertex.resize(first.back());
        std::vector<uint32_t> next(first.begin(), first.end() - 1);
        for (const Triangle& t : mesh.triangles)
            for (int k = 0; k < 3; ++k) vertex[next[t[k]]++] = t[(k + 1) % 3], vertex[next[t[k]]++] = t[(k + 2) % 3];
    }
};

/// Where a vertex is pulled, and how strongly: means over what pulls.
struct Pull {
    glm::vec3 residual{}, normal{};
    float weight = 0;
    void add(const glm::vec3& r, const glm::vec3& n, float w) { residual += w * r, normal += w * n, weight += w; }
};

std::vector<Pull> find_pulls(const Mesh& from, const Mesh& to, const SurfaceIndex& to_index, const std::vector<glm::vec3>& to_normals,
                             const std::vector<glm::vec3>& motion, float reach) {
    constexpr float alike = 0.3f;  // cosine: across a sheet the other side faces away
    Mesh moved;
    moved.triangles = from.triangles, moved.positions = from.positions;
    for (size_t i = 0; i < motion.size(); ++i) moved.positions[i] += motion[i];
    const std::vector<glm::vec3> normals = vertex_normals(moved);
    std::vector<Pull> pulls(motion.size());
    for (size_t i = 0; i < motion.size(); ++i) {
        const SurfaceIndex::Hit hit = to_index.closest(moved.positions[i], reach);
        if (!(hit.distance < reach)) continue;
        const Triangle& t = to.triangles[hit.triangle];
        const glm::vec3 n = hit.barycentric.x * to_normals[t[0]] + hit.barycentric.y * to_normals[t[1]] + hit.barycentric.z * to_normals[t[2]];
        if (glm::dot(n, normals[i]) > alike) pulls[i].add(hit.point - moved.positions[i], n, 1);
    }
    // What the next surface has and nothing of this one goes to: crowns and fingers as they shoot out.
    const SurfaceIndex moved_index(moved);
    for (size_t i = 0; i < to.positions.size(); ++i) {
        const SurfaceIndex::Hit hit = moved_index.closest(to.positions[i], reach);
        if (!(hit.distance < reach)) continue;
        const Triangle& t = moved.triangles[hit.triangle];
        const glm::vec3 n = hit.barycentric.x * normals[t[0]] + hit.barycentric.y * normals[t[1]] + hit.barycentric.z * normals[t[2]];
        if (glm::dot(n, to_normals[i]) <= alike) continue;
        for (int k = 0; k < 3; ++k)
            if (hit.barycentric[k] > 0) pulls[t[size_t(k)]].add(to.positions[i] - hit.point, to_normals[i], hit.barycentric[k]);
    }
    return pulls;
}

/// One step towards the pulls along their normals, as smooth as `stiffness` asks: Jacobi on
/// Σ w (n·(u − t))² + stiffness · Σ |u_i − u_j|².
void relax(std::vector<glm::vec3>& motion, const std::vector<Pull>& pulls, const Neighbours& neighbours, float stiffness, int sweeps) {
    const std::vector<glm::vec3> start = motion;
    std::vector<glm::vec3> next(motion.size());
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        for (size_t i = 0; i < motion.size(); ++i) {
            const uint32_t begin = neighbours.first[i], end = neighbours.first[i + 1];
            if (begin == end) continue;
            glm::vec3 mean(0);
            for (uint32_t k = begin; k < end; ++k) mean += motion[neighbours.vertex[k]];
            mean /= float(end - begin);
            next[i] = mean;
            const float length = glm::length(pulls[i].normal);
            if (pulls[i].weight > 0 && length > 0) {
                const glm::vec3 n = pulls[i].normal / length;
                const float wanted = glm::dot(n, start[i] + pulls[i].residual / pulls[i].weight) - glm::dot(n, mean);
                next[i] += n * (wanted / (1 + stiffness));
            }
        }
        std::swap(motion, next);
    }
}

}  // namespace

std::vector<glm::vec3> estimate_motion(const Mesh& from, const Mesh& to) {
    std::vector<glm::vec3> motion(from.positions.size(), glm::vec3(0));
    if (from.triangles.empty() || to.triangles.empty()) return motion;
    const Neighbours neighbours(from);
    const SurfaceIndex to_index(to);
    const std::vector<glm::vec3> to_normals = vertex_normals(to);
    const float edge = median_edge(from);
    struct Step {
        float stiffness;
        int sweeps;
        float reach;  // in edges: far first, then only what is near
    };
    constexpr Step steps[] = {{30, 60, 12}, {15, 40, 12}, {8, 30, 10}, {4, 20, 8}, {2, 12, 6}, {1, 8, 4}, {0.5f, 6, 3}};
    for (const Step& step : steps)
        relax(motion, find_pulls(from, to, to_index, to_normals, motion, step.reach * edge), neighbours, step.stiffness, step.sweeps);
    return motion;
}

namespace {
class Estimated : public SequenceReader {
public:
    explicit Estimated(std::unique_ptr<SequenceReader> source) : source_(std::move(source)), info_(source_->info()) {
        info_.velocity = VelocityMeaning::forward;
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
        mesh.velocities = estimate_motion(mesh, source_->read_surface(other));
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
