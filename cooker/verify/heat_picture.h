// SPDX-License-Identifier: MIT
// Meshes drawn in software, for reports: enough to see a hole or a spike, no more.
#pragma once
#include <string>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {

struct PictureFrame {
    glm::vec3 lower{}, upper{};  ///< what fits into the picture
    int width = 480, height = 360;
};
/// `heat`, if given, holds 0 (good) … 1 (bad) per vertex and colours the surface. PNG bytes.
std::string draw_png(const Mesh& mesh, const PictureFrame& frame, const std::vector<float>* heat = nullptr);
std::string base64(const std::string& bytes);

}  // namespace rill::cooker
