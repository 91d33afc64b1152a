// SPDX-License-Identifier: MIT
// Table 1 of the paper: what the moving smoothed cube costs, and how far it decodes from the source mesh.
#pragma once
#include <cstdint>
#include <vector>

#include "smoothed_cube.h"

namespace rill::bench {

struct CubeError {
    double average, max;  ///< normal distance from the source's vertices to the decoded surface, all frames
};
struct CubeCost {
    CubeError error;
    uint64_t words;       ///< floats and integers of the representation
    uint64_t bytes;       ///< of entropy-coded chunks; 0: there are none
};

/// No time coding: every frame has its exact points.
CubeError uncoded_error(const CubeMesh& mesh, const std::vector<Point>& points);
/// The shipping codec: windows of 60 frames that share their border frames, quantised, entropy coded, decoded.
/// rte: required temporal error of positions (metres) and of unit normals.
CubeCost code_in_windows(const CubeMesh& mesh, const std::vector<Point>& points, double rte);
/// As the paper counts: one Fourier extension of 240 frames per channel, coefficients kept as floats.
CubeCost code_in_one_segment(const CubeMesh& mesh, const std::vector<Point>& points, double rte);

}  // namespace rill::bench
