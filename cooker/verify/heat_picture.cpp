// SPDX-License-Identifier: MIT
#include "verify/heat_picture.h"

#include <algorithm>
#include <cmath>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace rill::cooker {
namespace {

/// Parallel projection from the front, right and above; z up, as solvers have it.
struct Projection {
    glm::vec3 right, up, towards, centre;
    float scale;
    glm::vec2 middle;

    explicit Projection(const PictureFrame& frame)
        : right(glm::normalize(glm::vec3(1, 0.6f, 0))), towards(glm::normalize(glm::vec3(0.45f, -0.75f, 0.5f))),
          centre(0.5f * (frame.lower + frame.upper)), middle(0.5f * float(frame.width), 0.5f * float(frame.height)) {
        up = glm::cross(towards, right);
        glm::vec2 most(1e-6f);
        for (int corner = 0; corner < 8; ++corner) {
            const glm::vec3 x((corner & 1 ? frame.upper : frame.lower).x, (corner & 2 ? frame.upper : frame.lower).y,
                              (corner & 4 ? frame.upper : frame.lower).z);
            most = glm::max(most, glm::abs(glm::vec2(glm::dot(x - centre, right), glm::dot(x - centre, up))));
        }
        scale = 0.96f * std::min(middle.x / most.x, middle.y / most.y);
    }
    glm::vec3 operator()(const glm::vec3& x) const {
        const glm::vec3 d = x - centre;
        return {middle.x + scale * glm::dot(d, right), middle.y - scale * glm::dot(d, up), glm::dot(d, towards)};
    }
};

glm::vec3 heat_colour(float heat) {
    const glm::vec3 stops[] = {{0.16f, 0.35f, 0.72f}, {0.35f, 0.75f, 0.55f}, {0.98f, 0.86f, 0.3f}, {0.85f, 0.15f, 0.12f}};
    const float at = std::clamp(heat, 0.0f, 1.0f) * 3;
    const int i = std::min(2, int(at));
    return glm::mix(stops[i], stops[i + 1], at - float(i));
}

struct Canvas {
    int width, height;
    std::vector<uint8_t> pixels;
    std::vector<float> depth;

    void fill(const glm::vec3 (&at)[3], const glm::vec3 (&colour)[3]) {
        const float area = (at[1].x - at[0].x) * (at[2].y - at[0].y) - (at[2].x - at[0].x) * (at[1].y - at[0].y);
        if (!(std::abs(area) > 1e-12f)) return;
        auto low = [](float a, float b, float c) { return std::min({a, b, c}); };
        const int x0 = std::max(0, int(std::ceil(low(at[0].x, at[1].x, at[2].x) - 0.5f)));
        const int y0 = std::max(0, int(std::ceil(low(at[0].y, at[1].y, at[2].y) - 0.5f)));
        const int x1 = std::min(width - 1, int(std::floor(std::max({at[0].x, at[1].x, at[2].x}) - 0.5f)));
        const int y1 = std::min(height - 1, int(std::floor(std::max({at[0].y, at[1].y, at[2].y}) - 0.5f)));
        for (int y = y0; y <= y1; ++y)
            for (int x = x0; x <= x1; ++x) {
                const float px = float(x) + 0.5f, py = float(y) + 0.5f;
                const float b = ((px - at[0].x) * (at[2].y - at[0].y) - (at[2].x - at[0].x) * (py - at[0].y)) / area;
                const float c = ((at[1].x - at[0].x) * (py - at[0].y) - (px - at[0].x) * (at[1].y - at[0].y)) / area;
                const float a = 1 - b - c;
                if (a < 0 || b < 0 || c < 0) continue;
                const size_t i = size_t(y) * size_t(width) + size_t(x);
                const float z = a * at[0].z + b * at[1].z + c * at[2].z;
                if (z <= depth[i]) continue;
                depth[i] = z;
                const glm::vec3 shade = glm::clamp(colour[0] * a + colour[1] * b + colour[2] * c, 0.0f, 1.0f);
                for (int k = 0; k < 3; ++k) pixels[3 * i + size_t(k)] = uint8_t(255 * std::sqrt(shade[k]) + 0.5f);
            }
    }
};

}  // namespace

std::string draw_png(const Mesh& mesh, const PictureFrame& frame, const std::vector<float>* heat) {
    const size_t count = size_t(frame.width) * size_t(frame.height);
    Canvas canvas{frame.width, frame.height, std::vector<uint8_t>(count * 3, 248), std::vector<float>(count, -1e30f)};
    const Projection project(frame);
    const std::vector<glm::vec3> normals = mesh.normals.empty() ? vertex_normals(mesh) : mesh.normals;
    const glm::vec3 light = glm::normalize(project.towards + 0.7f * project.up - 0.4f * project.right);
    for (const Triangle& t : mesh.triangles) {
        glm::vec3 at[3], colour[3];
        for (int k = 0; k < 3; ++k) {
            const uint32_t v = t[size_t(k)];
            at[k] = project(mesh.positions[v]);
            // Surfaces seen from inside, through a hole, are red.
            const float facing = glm::dot(normals[v], project.towards);
            const glm::vec3 base = facing < -0.3f ? glm::vec3(0.7f, 0.2f, 0.2f) : heat ? heat_colour((*heat)[v]) : glm::vec3(0.3f, 0.5f, 0.7f);
            const float shine = std::pow(std::max(0.0f, glm::dot(normals[v], glm::normalize(light + project.towards))), 40.0f);
            colour[k] = base * (0.25f + 0.75f * std::max(0.0f, glm::dot(normals[v], light))) + (heat ? 0.0f : 0.4f * shine);
        }
        canvas.fill(at, colour);
    }
    std::string png;
    stbi_write_png_to_func([](void* to, void* data, int size) { static_cast<std::string*>(to)->append(static_cast<char*>(data), size_t(size)); },
                           &png, frame.width, frame.height, 3, canvas.pixels.data(), frame.width * 3);
    return png;
}

std::string base64(const std::string& bytes) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t word = 0;
        for (size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? digits[word >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

}  // namespace rill::cooker
