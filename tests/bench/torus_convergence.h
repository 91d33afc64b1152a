// SPDX-License-Identifier: MIT
// Figure 1 of the paper: how fast the blended surface converges to a torus as points are scattered more densely.
#pragma once
#include <cstdint>
#include <vector>

namespace rill::bench {

inline constexpr double torus_radius = 1, torus_tube = 0.4;

struct TorusError {
    double spacing;        ///< of the Poisson disks: no two points closer
    uint32_t points;
    double mean, max;      ///< |f| / |grad f| over the true surface; mean weighted by area
};
/// Poisson-disk points with exact normals at each spacing, measured at 46 080 positions of the torus.
std::vector<TorusError> torus_convergence(const std::vector<double>& spacings);

/// log error = order · log spacing + log factor, least squares.
struct Order {
    double order, factor;
};
Order fitted_order(const std::vector<TorusError>& errors, double TorusError::*which);

}  // namespace rill::bench
