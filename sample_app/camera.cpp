// SPDX-License-Identifier: MIT
#include "camera.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>

namespace player {

static constexpr float steepest = 1.55f;

static glm::vec3 direction(const Camera& camera) {  // from the target to the eye
    return {std::cos(camera.pitch) * std::sin(camera.yaw), -std::cos(camera.pitch) * std::cos(camera.yaw),
            std::sin(camera.pitch)};
}

glm::vec3 Camera::eye() const { return target + distance * direction(*this); }

glm::mat4 Camera::view() const { return glm::lookAt(eye(), target, {0, 0, 1}); }

glm::mat4 Camera::projection(float aspect, const Bounds& scene) const {
    const float radius = scene.diagonal();
    const float far_plane = glm::length(eye() - scene.centre()) + 2.0f * radius;
    const float near_plane = std::max(glm::length(eye() - scene.centre()) - radius, 0.005f * radius);
    return glm::perspective(field_of_view, aspect, near_plane, far_plane);
}

rill::View Camera::as_rill(int width, int height, const Bounds& scene) const {
    const float aspect = static_cast<float>(width) / static_cast<float>(height);
    const glm::mat4 clip = projection(aspect, scene) * view();
    rill::View out{};
    // A point is inside when −w ≤ x, y, z ≤ w in clip space: each plane is a sum of two matrix rows.
    for (int plane = 0; plane < 6; ++plane) {
        const float sign = plane % 2 ? -1.0f : 1.0f;
        glm::vec4 row = glm::row(clip, 3) + sign * glm::row(clip, plane / 2);
        row /= glm::length(glm::vec3(row));
        for (int i = 0; i < 4; ++i) out.planes[plane][i] = row[i];
    }
    const glm::vec3 at = eye();
    for (int i = 0; i < 3; ++i) out.eye[i] = at[i];
    out.pixels_per_radian = static_cast<float>(height) / field_of_view;
    return out;
}

std::array<rill::View, 2> Camera::with_casters(int width, int height, const Bounds& scene, const glm::vec3& to_light) const {
    const rill::View seen = as_rill(width, height, scene);
    rill::View casters = seen;
    casters.pixels_per_radian *= 0.5f;
    // From what is seen towards the light one leaves through the planes that face away from it: those are moved out of the way.
    for (auto& plane : casters.planes)
        if (plane[0] * to_light.x + plane[1] * to_light.y + plane[2] * to_light.z < 0.0f) plane[3] += 8.0f * scene.diagonal();
    return {seen, casters};
}

void Camera::look(const glm::vec3& eye, const glm::vec3& at) {
    const glm::vec3 offset = eye - at;
    target = at;
    distance = std::max(glm::length(offset), 1e-6f);
    pitch = std::clamp(std::asin(offset.z / distance), -steepest, steepest);
    yaw = std::atan2(offset.x, -offset.y);
}

void Camera::frame(const Bounds& scene, float aspect) {
    target = scene.centre();
    const glm::mat4 turn = view();  // of the direction alone: the distance follows from the corners
    const float up = std::tan(0.5f * field_of_view), right = up * aspect;
    distance = 1e-3f * scene.diagonal();
    for (int corner = 0; corner < 8; ++corner) {
        const glm::vec3 at(corner & 1 ? scene.upper.x : scene.lower.x, corner & 2 ? scene.upper.y : scene.lower.y,
                           corner & 4 ? scene.upper.z : scene.lower.z);
        const glm::vec3 seen = glm::mat3(turn) * (at - target);
        const float wide = std::max(std::abs(seen.x) / right, std::abs(seen.y) / up);
        distance = std::max(distance, 1.05f * wide + seen.z);
    }
}

void Camera::orbit(float right, float up) {
    yaw -= right;
    pitch = std::clamp(pitch + up, -steepest, steepest);
}

void Camera::pan(float right, float up) {
    const float height = 2.0f * distance * std::tan(0.5f * field_of_view);
    const glm::mat4 turn = view();
    target -= height * (right * glm::vec3(glm::row(turn, 0)) + up * glm::vec3(glm::row(turn, 1)));
}

void Camera::zoom(float steps) { distance *= std::pow(0.88f, steps); }

}  // namespace player
