// SPDX-License-Identifier: MIT
// Meshes with fewer triangles, for the rivals.
#pragma once
#include <string>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {

/// One mesh for each share of the triangles (1: the mesh itself). Velocities are kept.
std::vector<Mesh> decimate_by_meshoptimizer(const Mesh& mesh, const std::vector<double>& keeps);
/// The same by a program: see RivalSettings::decimator. Velocities are those of the nearest source vertices. Throws
/// InputError when it cannot be run or does not write what it should.
std::vector<Mesh> decimate_by_program(const std::string& program, const Mesh& mesh, const std::vector<double>& keeps);

}  // namespace rill::cooker
