// SPDX-License-Identifier: MIT
#include "frames/surface_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/parallel.h"

namespace rill::cooker {
namespace {

constexpr float inertia = 0.7f;  // at 0 4 % more bytes at equal p99, at .85 and 1 as many

/// What lies around every vertex, one list after another.
struct Neighbours {
    std::vector<uint32_t> first_corner, first;
    std::vector<glm::uvec2> corner;  ///< of its triangles: the next two vertices
    std::vector<uint32_t> vertex;    ///< over its edges, each once
    explicit Neighbours(const Mesh& mesh) : first_corner(mesh.positions.size() + 1), first(1) {
        for (const Triangle& t : mesh.triangles)
            for (uint32_t v : t) ++first_corner[v + 1];
        for (size_t i = 1; i < first_corner.size(); ++i) first_corner[i] += first_corner[i - 1];
        corner.resize(first_corner.back());
        std::vector<uint32_t> next(first_corner.begin(), first_corner.end() - 1);
        for (const Triangle& t : mesh.triangles)
            for (size_t k = 0; k < 3; ++k) corner[next[t[k]]++] = {t[(k + 1) % 3], t[(k + 2) % 3]};
        vertex.reserve(corner.size());
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            for (uint32_t k = first_corner[i]; k < first_corner[i + 1]; ++k) add(corner[k].x);
            for (uint32_t k = first_corner[i]; k < first_corner[i + 1]; ++k) add(corner[k].y);
            first.push_back(uint32_t(vertex.size()));
        }
    }
    /// Of vertex i, by area.
    glm::vec3 normal(const std::vector<glm::vec3>& positions, size_t i) const {
        glm::vec3 sum(0);
        for (uint32_t k = first_corner[i]; k < first_corner[i + 1]; ++k)
            sum += glm::cross(positions[corner[k].x] - positions[i], positions[corner[k].y] - positions[i]);
        return unit_normal(sum);
    }

private:
    void add(uint32_t v) {
        if (std::find(vertex.begin() + first.back(), vertex.end(), v) == vertex.end()) vertex.push_back(v);
    }
};

/// Where a vertex is pulled, and how strongly: means over what pulls.
struct Pull {
    glm::vec3 residual{}, normal{};
    float weight = 0;
    void add(const glm::vec3& r, const glm::vec3& n, float w) { residual += w * r, normal += w * n, weight += w; }
};

/// Work(index, near) for all indices < count, many of them a task; `near`: for queries that follow one another.
template <class Work>
void for_rows(size_t count, int jobs, const Work& work) {
    constexpr size_t run = 2048;
    parallel_for((count + run - 1) / run, jobs, [&](size_t r) {
        SurfaceIndex::Near near;
        for (size_t i = r * run; i < std::min(count, (r + 1) * run); ++i) work(i, &near);
    });
}
template <class Work>
void for_each(size_t count, int jobs, const Work& work) {
    for_rows(count, jobs, [&](size_t i, SurfaceIndex::Near*) { work(i); });
}

Mesh moved_by(const Mesh& mesh, const std::vector<glm::vec3>& motion) {
    Mesh moved;
    moved.triangles = mesh.triangles, moved.positions = mesh.positions;
    for (size_t i = 0; i < motion.size(); ++i) moved.positions[i] += motion[i];
    return moved;
}

/// Of every `stride`-th vertex of either surface: `moved`, and the one that is gone to.
std::vector<Pull> find_pulls(const SurfaceIndex& moved, const Neighbours& neighbours, const SurfaceIndex& to,
                             const std::vector<glm::vec3>& to_normals, float reach, size_t stride, int jobs) {
    constexpr float alike = 0.3f;  // cosine: across a sheet the other side faces away
    const std::vector<glm::vec3>&here = moved.mesh().positions, &there = to.mesh().positions;
    std::vector<Pull> pulls(here.size());
    for_rows((here.size() + stride - 1) / stride, jobs, [&](size_t k, SurfaceIndex::Near* near) {
        const size_t i = k * stride;
        const SurfaceIndex::Hit hit = to.closest(here[i], reach, near);
        if (!(hit.distance < reach)) return;
        const glm::vec3 n = value_at(hit, to.mesh().triangles[hit.triangle], to_normals);
        if (glm::dot(n, neighbours.normal(here, i)) > alike) pulls[i].add(hit.point - here[i], n, 1);
    });
    // What the next surface has and nothing of this one goes to: crowns and fingers as they shoot out.
    std::vector<SurfaceIndex::Hit> hits((there.size() + stride - 1) / stride);
    for_rows(hits.size(), jobs, [&](size_t k, SurfaceIndex::Near* near) { hits[k] = moved.closest(there[k * stride], reach, near); });
    for (size_t k = 0; k < hits.size(); ++k) {
        const SurfaceIndex::Hit& hit = hits[k];
        const size_t i = k * stride;
        if (!(hit.distance < reach)) continue;
        const Triangle& t = moved.mesh().triangles[hit.triangle];
        const glm::vec3 facing = unit_normal(glm::cross(here[t[1]] - here[t[0]], here[t[2]] - here[t[0]]));
        if (glm::dot(facing, to_normals[i]) <= alike) continue;
        for (int c = 0; c < 3; ++c)
            if (hit.barycentric[c] > 0) pulls[t[size_t(c)]].add(there[i] - hit.point, to_normals[i], hit.barycentric[c]);
    }
    return pulls;
}

/// What a vertex is pulled onto: along a unit normal to so much of it, or nowhere if that is zero.
struct Target {
    glm::vec3 normal{};
    float along = 0;
};

/// One step towards the pulls along their normals, as smooth as `stiffness` asks: Jacobi on
/// Σ w (n·(u − t))² + stiffness · Σ |u_i − u_j|².
void relax(std::vector<glm::vec3>& motion, const std::vector<Pull>& pulls, const Neighbours& neighbours, float stiffness, int sweeps,
           int jobs) {
    const size_t count = motion.size();
    std::vector<Target> targets(count);
    std::vector<glm::vec4> now(count), next(count);  // a fourth component: whole vectors are fetched
    for_each(count, jobs, [&](size_t i) {
        now[i] = glm::vec4(motion[i], 0);
        const float length = glm::length(pulls[i].normal);
        if (!(pulls[i].weight > 0 && length > 0)) return;
        const glm::vec3 n = pulls[i].normal / length;
        targets[i] = {n, glm::dot(n, motion[i] + pulls[i].residual / pulls[i].weight)};
    });
    for (int sweep = 0; sweep < sweeps; ++sweep) {
        for_each(count, jobs, [&](size_t i) {
            const uint32_t begin = neighbours.first[i], end = neighbours.first[i + 1];
            glm::vec4 mean(0);
            for (uint32_t k = begin; k < end; ++k) mean += now[neighbours.vertex[k]];
            mean /= float(std::max(end - begin, 1u));
            const Target& target = targets[i];
            const float wanted = target.along - glm::dot(target.normal, glm::vec3(mean));
            next[i] = mean + glm::vec4(target.normal * (wanted / (1 + stiffness)), 0);
        });
        std::swap(now, next);
    }
    for (size_t i = 0; i < count; ++i) motion[i] = glm::vec3(now[i]);
}

/// To every value those beside it.
void add_neighbours(std::vector<float>& values, const Neighbours& neighbours) {
    const std::vector<float> before = values;
    for (size_t i = 0; i < values.size(); ++i)
        for (uint32_t k = neighbours.first[i]; k < neighbours.first[i + 1]; ++k) values[i] += before[neighbours.vertex[k]];
}

}  // namespace

std::vector<glm::vec3> surface_motion(const SurfaceIndex& from, const SurfaceIndex& to, int jobs, std::vector<glm::vec3> start) {
    std::vector<glm::vec3> motion = std::move(start);
    motion.resize(from.mesh().positions.size(), glm::vec3(0));
    if (from.mesh().triangles.empty() || to.mesh().triangles.empty()) return motion;
    const Neighbours neighbours(from.mesh());
    const std::vector<glm::vec3> to_normals = vertex_normals(to.mesh());
    const float edge = median_edge(from.mesh());
    struct Step {
        float stiffness;
        int sweeps;
        float reach;    // in edges: far first, then only what is near
        size_t stride;  // of the vertices that pull: some speak for all. (4 3 2 1 1: three quarters more to look up, no fewer bytes)
    };
    constexpr Step steps[] = {{12, 60, 12, 6}, {4, 40, 10, 4}, {1.5f, 25, 8, 3}, {0.6f, 12, 5, 2}, {0.2f, 8, 3, 2}};
    for (const Step& step : steps) {
        const Mesh moved = moved_by(from.mesh(), motion);
        const std::vector<Pull> pulls =
            find_pulls(SurfaceIndex(moved, from, jobs), neighbours, to, to_normals, step.reach * edge, step.stride, jobs);
        relax(motion, pulls, neighbours, step.stiffness, step.sweeps, jobs);
    }
    return motion;
}

std::vector<glm::vec3> motion_goes_on(const SurfaceIndex& before, const std::vector<glm::vec3>& motion, const Mesh& now, float longer, int jobs) {
    constexpr float reach = 2;  // edges
    std::vector<glm::vec3> next(now.positions.size(), glm::vec3(0));
    if (before.mesh().triangles.empty()) return next;
    const Mesh moved = moved_by(before.mesh(), motion);
    const SurfaceIndex index(moved, before, jobs);
    const float near = reach * median_edge(now);
    for_rows(next.size(), jobs, [&](size_t i, SurfaceIndex::Near* last) {
        const SurfaceIndex::Hit hit = index.closest(now.positions[i], near, last);
        if (hit.distance < near) next[i] = inertia * longer * value_at(hit, moved.triangles[hit.triangle], motion);
    });
    return next;
}

std::vector<glm::vec3> liquid_motion(const Mesh& from, const Mesh& to, const SurfaceIndex& to_index, double seconds, int jobs) {
    std::vector<glm::vec3> motion(from.positions.size(), glm::vec3(0));
    if (from.velocities.empty() || to.velocities.empty() || to.triangles.empty()) return motion;
    const float dt = float(seconds);
    for_rows(motion.size(), jobs, [&](size_t i, SurfaceIndex::Near* near) {
        const glm::vec3 step = dt * from.velocities[i];
        const SurfaceIndex::Hit hit = to_index.closest(from.positions[i] + step, std::numeric_limits<float>::infinity(), near);
        motion[i] = 0.5f * (step + dt * value_at(hit, to.triangles[hit.triangle], to.velocities));
    });
    return motion;
}

double mean_miss(const Mesh& from, const std::vector<glm::vec3>& motion, const SurfaceIndex& to_index, float most, int jobs) {
    std::vector<float> miss(motion.size());
    for_rows(miss.size(), jobs, [&](size_t i, SurfaceIndex::Near* near) {
        miss[i] = std::min(most, to_index.closest(from.positions[i] + motion[i], most, near).distance);
    });
    double sum = 0;
    for (const float m : miss) sum += m;
    return miss.empty() ? 0 : sum / double(miss.size());
}

double mean_stretch(const Mesh& mesh, const std::vector<glm::vec3>& motion) {
    if (mesh.triangles.empty()) return 0;
    std::vector<float> now(motion.size(), 0.f), then(motion.size(), 0.f);
    for (const Triangle& t : mesh.triangles) {
        const glm::vec3 a = mesh.positions[t[0]], b = mesh.positions[t[1]] - a, c = mesh.positions[t[2]] - a;
        const glm::vec3 moved = motion[t[0]], d = b + motion[t[1]] - moved, e = c + motion[t[2]] - moved;
        for (uint32_t v : t) now[v] += glm::length(glm::cross(b, c)), then[v] += glm::length(glm::cross(d, e));
    }
    const Neighbours neighbours(mesh);
    for (int ring = 0; ring < 3; ++ring) add_neighbours(now, neighbours), add_neighbours(then, neighbours);
    double sum = 0;
    for (size_t i = 0; i < now.size(); ++i) sum += now[i] > 0 && then[i] > 0 ? std::abs(std::log(then[i] / now[i])) : 0;
    return sum / double(now.size());
}

}  // namespace rill::cooker
