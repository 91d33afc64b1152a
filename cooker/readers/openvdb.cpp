// SPDX-License-Identifier: MIT
// OpenVDB: the surface is the zero of a level set, the velocity a vector grid beside it. Built only where the library is.
// It runs in a process of its own: fuzzed, the library asks for gigabytes within seconds and leaks what it gives up.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <tbb/global_control.h>

#include <algorithm>
#include <array>

#include "readers/frame_files.h"
#include "readers/mesh_in_child.h"
#include "readers/velocity_names.h"

namespace rill::cooker {
namespace {

constexpr std::array<const char*, 5> surface_names = {"surface", "sdf", "levelset", "liquid", "ls_surface"};

std::string listed(const openvdb::GridPtrVec& grids) {
    std::string text;
    for (const auto& grid : grids) text += (text.empty() ? "" : ", ") + grid->getName() + " (" + grid->valueType() + ")";
    return text.empty() ? "none" : text;
}

/// The level set: by class, or a float grid called like one. Null when there is none.
openvdb::FloatGrid::Ptr find_surface(const openvdb::GridPtrVec& grids) {
    openvdb::FloatGrid::Ptr named;
    for (const auto& grid : grids) {
        const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
        if (!floats) continue;
        if (grid->getGridClass() == openvdb::GRID_LEVEL_SET) return floats;
        const std::string plain = plain_name(grid->getName());
        if (!named && std::find(surface_names.begin(), surface_names.end(), plain) != surface_names.end()) named = floats;
    }
    return named;
}

openvdb::Vec3SGrid::Ptr find_velocity(const openvdb::GridPtrVec& grids, const std::string& asked) {
    openvdb::Vec3SGrid::Ptr best;
    int best_rank = 1000;
    for (const auto& grid : grids) {
        const int rank = velocity_rank(grid->getName(), asked);
        const auto vectors = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid);
        if (vectors && rank >= 0 && rank < best_rank) best = vectors, best_rank = rank;
    }
    return best;
}

/// Sampled a voxel inside the liquid: outside of it many solvers store nothing.
template <class Sampler>
void sample(Mesh& mesh, const openvdb::Vec3SGrid& grid, const std::vector<glm::vec3>& normals, float inside) {
    const openvdb::tools::GridSampler<openvdb::Vec3SGrid, Sampler> sampler(grid);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::vec3 x = mesh.positions[i] - inside * normals[i];
        const openvdb::Vec3s v = sampler.wsSample(openvdb::Vec3d(x.x, x.y, x.z));
        mesh.velocities.emplace_back(v.x(), v.y(), v.z());
    }
}

Mesh mesh_of(const openvdb::FloatGrid& surface) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(surface, points, triangles, quads, 0.0, 0.0);
    Mesh mesh;
    for (const openvdb::Vec3s& p : points) mesh.positions.emplace_back(p.x(), p.y(), p.z());
    // OpenVDB winds clockwise seen from outside.
    for (const openvdb::Vec3I& t : triangles) mesh.triangles.push_back({t[0], t[2], t[1]});
    for (const openvdb::Vec4I& q : quads) mesh.triangles.push_back({q[0], q[2], q[1]}), mesh.triangles.push_back({q[0], q[3], q[2]});
    return mesh;
}

Mesh parse(const std::string& path, const ReadOptions& options) {
    // Frames are read side by side already; and a thread that is not there needs no memory.
    const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
    openvdb::initialize();
    openvdb::io::File file(path);
    file.open(false);  // no delayed loading: damage shows here
    const openvdb::GridPtrVec grids = *file.getGrids();
    const openvdb::FloatGrid::Ptr surface = find_surface(grids);
    if (!surface) throw InputError("no level set; it holds " + listed(grids));
    Mesh mesh = mesh_of(*surface);
    const openvdb::Vec3SGrid::Ptr velocity = find_velocity(grids, options.velocity_name);
    if (!velocity && !options.velocity_name.empty())
        throw InputError("no vector grid '" + options.velocity_name + "'; it holds " + listed(grids));
    if (!velocity || mesh.positions.empty()) return mesh;
    const std::vector<glm::vec3> normals = vertex_normals(mesh);
    const float inside = float(surface->voxelSize().x());
    if (velocity->getGridClass() == openvdb::GRID_STAGGERED) sample<openvdb::tools::StaggeredBoxSampler>(mesh, *velocity, normals, inside);
    else sample<openvdb::tools::BoxSampler>(mesh, *velocity, normals, inside);
    return mesh;
}

}  // namespace

Mesh read_vdb(const std::filesystem::path& path, const ReadOptions& options) {
    std::error_code error;
    const uint64_t size = std::filesystem::file_size(path, error);
    if (error) throw InputError(path.string() + ": " + error.message());
    const uint32_t seconds = uint32_t(60 + (size >> 20));
    const ChildLimits limits = {(uint64_t(1) << 30) + 64 * size, seconds, 10 * seconds};  // tiles and packed leaves unfold
    return mesh_in_child(path, limits, [&] { return parse(path.string(), options); });
}

}  // namespace rill::cooker
