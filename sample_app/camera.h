// SPDX-License-Identifier: MIT
// An orbit camera over a z-up world, and what the runtime wants to know about it.
#pragma once
#include <array>
#include <glm/glm.hpp>

#include "rill/rill.h"

namespace player {

struct Bounds {
    glm::vec3 lower{0.0f}, upper{0.0f};
    glm::vec3 centre() const { return 0.5f * (lower + upper); }
    float diagonal() const { return glm::max(glm::length(upper - lower), 1e-6f); }
};

struct Camera {
    glm::vec3 target{0.0f};
    float yaw = 0.6f, pitch = 0.4f;  ///< radians; pitch up from the horizon, short of the poles
    float distance = 1.0f;           ///< metres from the target
    float field_of_view = 0.7f;      ///< vertical, radians

    glm::vec3 eye() const;
    glm::mat4 view() const;
    /// `scene` sets near and far planes so that depth precision goes where the liquid is.
    glm::mat4 projection(float aspect, const Bounds& scene) const;
    /// Frustum planes, eye and pixels per radian.
    rill::View as_rill(int width, int height, const Bounds& scene) const;
    /// That, and a second view of all that may cast a shadow into it, half as fine. `to_light`: unit length.
    std::array<rill::View, 2> with_casters(int width, int height, const Bounds& scene, const glm::vec3& to_light) const;

    /// Puts the eye there, looking at `target`.
    void look(const glm::vec3& eye, const glm::vec3& at);
    /// The whole of `scene` in sight from the current direction.
    void frame(const Bounds& scene, float aspect);
    /// Radians.
    void orbit(float right, float up);
    /// Fractions of the picture's height.
    void pan(float right, float up);
    void zoom(float steps);
};

}  // namespace player
