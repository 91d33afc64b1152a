// SPDX-License-Identifier: MIT
#include "rivals/decimated_meshes.h"

#include <meshoptimizer.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/scratch_folder.h"
#include "frames/open_sequence.h"
#include "frames/surface_frame.h"
#include "writers/frame_writer.h"

namespace rill::cooker {
namespace {
namespace fs = std::filesystem;

Mesh by_meshoptimizer(const Mesh& mesh, double keep) {
    std::vector<uint32_t> indices(mesh.triangles.size() * 3);
    const size_t target = size_t(double(mesh.triangles.size()) * keep) * 3;
    indices.resize(meshopt_simplify(indices.data(), mesh.triangles[0].data(), mesh.triangles.size() * 3, &mesh.positions[0].x,
                                    mesh.positions.size(), sizeof(glm::vec3), target, 1.0f, 0, nullptr));
    std::vector<Triangle> kept;
    for (size_t i = 0; i < indices.size(); i += 3) kept.push_back({indices[i], indices[i + 1], indices[i + 2]});
    return part_of(mesh, kept);
}

void run_program(const std::vector<std::string>& words) {
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    pid_t child = 0;
    int status = 0;
    if (posix_spawnp(&child, arguments[0], nullptr, nullptr, arguments.data(), environ) != 0)
        throw InputError(words[0] + ": cannot be run");
    if (waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw InputError(words[0] + ": failed");
}

}  // namespace

std::vector<Mesh> decimate_by_meshoptimizer(const Mesh& mesh, const std::vector<double>& keeps) {
    std::vector<Mesh> result;
    for (const double keep : keeps) result.push_back(keep >= 1 || mesh.triangles.empty() ? mesh : by_meshoptimizer(mesh, keep));
    return result;
}

std::vector<Mesh> decimate_by_program(const std::string& program, const Mesh& mesh, const std::vector<double>& keeps) {
    if (mesh.triangles.empty()) return std::vector<Mesh>(keeps.size(), mesh);
    const ScratchFolder scratch;
    std::vector<std::string> words = {program, (scratch.path / "in.ply").string()};
    std::vector<std::string> outputs;
    Mesh bare;
    bare.positions = mesh.positions, bare.triangles = mesh.triangles;
    write_frame(words[1], bare);
    for (size_t i = 0; i < keeps.size(); ++i) {
        outputs.push_back((scratch.path / ("out" + std::to_string(i) + ".ply")).string());
        words.push_back(std::to_string(keeps[i])), words.push_back(outputs.back());
    }
    run_program(words);
    const VertexTree tree(mesh.positions);
    std::vector<VertexTree::Found> found;
    std::vector<Mesh> result;
    for (const std::string& output : outputs) {
        Mesh simplified = open_sequence(output, {})->read(0);
        simplified.velocities.clear();
        for (const glm::vec3& x : simplified.positions) {
            if (mesh.velocities.empty()) break;
            tree.nearest(x, 1, found);
            simplified.velocities.push_back(mesh.velocities[found[0].vertex]);
        }
        result.push_back(std::move(simplified));
    }
    return result;
}

}  // namespace rill::cooker
