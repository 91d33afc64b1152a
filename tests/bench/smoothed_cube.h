// SPDX-License-Identifier: MIT
// The smoothed cube of the paper's Table 1: shape, mesh, motion, and the LSQ points that represent it best.
#pragma once
#include <cstdint>
#include <vector>

#include "decoded_field.h"

namespace rill::bench {

/// Side 2 with all edges and corners rounded by balls of this radius.
inline constexpr double cube_half_side = 1, cube_rounding = 0.5;
inline constexpr int cube_frames = 240;

struct CubeMesh {
    std::vector<glm::dvec3> positions, normals;  ///< exact ones of the rounded cube
    std::vector<double> areas;                   ///< that each vertex stands for; they add up to the surface
    uint32_t triangles;
};
/// Grid of a × b × c cells on the sides of a cube, projected onto the rounded cube; 2 (ab + bc + ca) + 2 vertices.
CubeMesh cube_mesh(int a, int b, int c);

/// A rigid motion of the cube. Frame 0 … cube_frames − 1, real between frames.
struct Pose {
    glm::dmat3 turn;
    glm::dvec3 shift;
};
/// 1.3 turns about z at an even pace and 0.7 about x at a growing one, while the centre travels a wave 4 long, 2 wide
/// and 1.5 high. None of it is a function of the time basis.
Pose cube_pose(double frame);

/// Spread over the surface: farthest-point choice among the vertices, then Lloyd's relaxation.
std::vector<Point> even_points(const CubeMesh& mesh, uint32_t count);
/// Moves and turns points until the decoded surface fits the vertices best: Levenberg–Marquardt on the mean of
/// distance^p, p growing from 2 to `power`, with the decoder in the loop and its derivatives by differences.
void fit_points(const CubeMesh& mesh, double power, int steps, std::vector<Point>& points);

}  // namespace rill::bench
