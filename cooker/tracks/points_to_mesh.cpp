// SPDX-License-Identifier: MIT
#include "tracks/points_to_mesh.h"

#include <algorithm>
#include <atomic>

#include "common/parallel.h"
#include "surface/field_to_mesh.h"

namespace rill::cooker {
namespace {

/// Not zeroed: most is never touched.
std::unique_ptr<CacheLine[]> lines_for(size_t bytes) {
    return std::make_unique_for_overwrite<CacheLine[]>((bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine));
}

/// The stages of the mesher on as many threads as it has workers.
void run_stages(Mesher* mesher, uint32_t workers) {
    uint32_t count;
    const Stage* stages = mesh_stages(&count);
    for (const Stage* stage = stages; stage != stages + count; ++stage)
        while (const uint32_t tasks = stage->prepare(mesher)) {
            std::atomic<uint32_t> next{0};
            if (stage->run)
                parallel_for(workers, int(workers), [&](size_t worker) {
                    for (uint32_t i; (i = next.fetch_add(1)) < tasks;) stage->run(mesher, i, uint32_t(worker));
                });
            if (!stage->repeats) break;
        }
}

}  // namespace

PointRows::PointRows(const std::vector<SurfacePoint>& points) {
    for (auto& row : rows_) row.resize(points.size());
    for (size_t i = 0; i < points.size(); ++i) {
        for (int a = 0; a < 3; ++a) {
            rows_[a][i] = points[i].position[a];
            rows_[3 + a][i] = points[i].normal[a];
            rows_[6 + a][i] = points[i].velocity[a];
        }
        rows_[9][i] = 1;
    }
}
void PointRows::add_room(size_t count) {
    for (auto& row : rows_) row.resize(row.size() + count, 0.f);
}
format::PointSet PointRows::set() {
    return {uint32_t(rows_[0].size()), rows_[0].data(), rows_[1].data(), rows_[2].data(), rows_[3].data(), rows_[4].data(),
            rows_[5].data(), rows_[6].data(), rows_[7].data(), rows_[8].data(), rows_[9].data()};
}

PointField::PointField(const std::vector<SurfacePoint>& points, size_t room) {
    PointRows rows(points);
    rows.add_room(room);
    memory_ = lines_for(surface::field_bytes(uint32_t(points.size() + room), 0));
    surface::begin_field(field, memory_.get(), rows.set(), format::DropSet{});
}
PointField::PointField(const std::vector<SurfacePoint>& points, int jobs) : PointField(points, size_t(0)) {
    constexpr uint32_t batch = 256;
    parallel_for((field.point_count + batch - 1) / batch, jobs, [&](size_t part) {
        surface::fit_patches(field, uint32_t(part) * batch, std::min(field.point_count, uint32_t(part + 1) * batch));
    });
    surface::finish_field(field);
}

std::vector<float> PointField::values_at(const std::vector<float>& x, const std::vector<float>& y, const std::vector<float>& z) const {
    const auto range = [](const std::vector<float>& v) { return std::minmax_element(v.begin(), v.end()); };
    std::vector<float> value(x.size());
    if (x.empty()) return value;
    const auto [x0, x1] = range(x);
    const auto [y0, y1] = range(y);
    const auto [z0, z1] = range(z);
    std::vector<uint32_t> candidates(field.point_count);
    const surface::Box box{{*x0, *y0, *z0}, {*x1, *y1, *z1}};
    const uint32_t found = surface::gather(field, box, candidates.data(), uint32_t(candidates.size()));
    surface::evaluate(field, candidates.data(), found, x.data(), y.data(), z.data(), uint32_t(value.size()), value.data());
    return value;
}

Mesh mesh_points(const std::vector<SurfacePoint>& points, float cell, int jobs, size_t about) {
    const PointField decoded(points, jobs);
    const uint32_t workers = uint32_t(threads_of(jobs));
    std::unique_ptr<uint32_t[]> indices;
    Mesh mesh;
    Target target{};
    constexpr uint32_t most = 1u << 26;
    for (uint32_t vertices = uint32_t(std::clamp<size_t>(about + about / 4, 1u << 12, most));; vertices = std::min(2 * vertices, most)) {
        const MeshLimits limits{vertices, 0, 0, workers};
        const std::unique_ptr<CacheLine[]> memory = lines_for(mesher_bytes(limits));
        Mesher* mesher = place_mesher(memory.get(), limits);
        mesh.positions.resize(vertices), indices = std::make_unique_for_overwrite<uint32_t[]>(size_t(vertices) * 8);
        target.position = {mesh.positions.data(), sizeof(glm::vec3)};
        target.indices = indices.get();
        target.vertex_capacity = vertices, target.index_capacity = vertices * 8;
        Levels levels{};
        levels.cell_size = cell;
        begin_mesh(mesher, {&decoded.field, levels, nullptr, 0, false, &target});
        run_stages(mesher, workers);
        if (!mesh_counts(mesher).cut || vertices == most) break;
    }
    mesh.positions.resize(target.vertices_used);
    for (uint32_t i = 0; i + 2 < target.indices_used; i += 3) mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    return mesh;
}

}  // namespace rill::cooker
