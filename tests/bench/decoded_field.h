// SPDX-License-Identifier: MIT
// The runtime's own field over a handful of points, asked how far positions lie from its surface.
#pragma once
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "surface/field.h"

namespace rill::bench {

/// An LSQ point of the paper: where, and which way out (unit).
struct Point {
    glm::dvec3 position, normal;
};

class DecodedField {
public:
    explicit DecodedField(const std::vector<Point>& points);

    /// First-order distance f / |grad f| of each position, positive outside; +inf where nothing is decoded.
    /// Positions that follow each other should lie close together: they share a gather.
    std::vector<double> distances(const std::vector<glm::dvec3>& positions) const;
    /// Distance from each position to the surface along the direction given with it, found by Newton's method.
    std::vector<double> distances_along(const std::vector<glm::dvec3>& positions,
                                        const std::vector<glm::dvec3>& directions) const;

private:
    struct Sample {
        double value;
        glm::dvec3 gradient;
    };
    std::vector<Sample> evaluate(const std::vector<glm::dvec3>& positions) const;

    std::vector<float> rows_[10];
    std::vector<uint8_t> memory_;
    surface::Field field_;
};

}  // namespace rill::bench
