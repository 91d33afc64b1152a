// SPDX-License-Identifier: MIT
#include "measure/velocity_error.h"

#include <cmath>
#include <limits>

namespace rill::cooker {
namespace {

constexpr double least_speed = 0.1;  // of the root mean square

/// Nothing has no direction: half way between right and wrong.
double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
    if (b == glm::dvec3(0)) return 90;
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 57.295779513082320877;
}

}  // namespace

VelocityError velocity_error(const Mesh& source, double factor, const Mesh& decoded, const SurfaceIndex& decoded_index) {
    VelocityError error;
    if (source.velocities.empty() || decoded.triangles.empty()) return error;
    const std::vector<float> areas = vertex_areas(source);
    double area = 0, squares = 0;
    for (size_t v = 0; v < areas.size(); ++v) {
        const glm::dvec3 velocity = glm::dvec3(source.velocities[v]) * factor;
        area += areas[v], squares += areas[v] * glm::dot(velocity, velocity);
    }
    const double least = least_speed * std::sqrt(area > 0 ? squares / area : 0);
    for (size_t v = 0; v < areas.size(); ++v) {
        const glm::dvec3 velocity = glm::dvec3(source.velocities[v]) * factor;
        const double speed = glm::length(velocity);
        if (!(areas[v] > 0) || !(speed > 0) || speed < least) continue;
        const SurfaceIndex::Hit hit = decoded_index.closest(source.positions[v], std::numeric_limits<float>::infinity());
        const Triangle& t = decoded.triangles[hit.triangle];
        const glm::dvec3 shown = glm::dvec3(decoded.velocities[t[0]]) * double(hit.barycentric.x) +
                                 glm::dvec3(decoded.velocities[t[1]]) * double(hit.barycentric.y) +
                                 glm::dvec3(decoded.velocities[t[2]]) * double(hit.barycentric.z);
        error.degrees.add(float(degrees_between(velocity, shown)), areas[v]);
        error.length.add(float(std::abs(glm::length(shown) - speed) / speed), areas[v]);
    }
    return error;
}

}  // namespace rill::cooker
