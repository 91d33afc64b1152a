// SPDX-License-Identifier: MIT
#include "commands/bench_detail.h"

#include <algorithm>
#include <limits>

namespace rill::cooker {
namespace {

constexpr size_t most_frames = 8;
constexpr float distances[] = {1, 2, 4, 6, 8};

/// How far one surface is from another, in pixels at that place; over the area of both.
void add_pixels(Spread& pixels, const Mesh& from, const SurfaceIndex& to, const glm::vec3& eye) {
    std::vector<float> area(from.positions.size());
    for (const auto& t : from.triangles) {
        const glm::vec3 a = from.positions[t[0]], b = from.positions[t[1]], c = from.positions[t[2]];
        const float third = glm::length(glm::cross(b - a, c - a)) / 6;
        for (int k = 0; k < 3; ++k) area[t[k]] += third;
    }
    for (size_t v = 0; v < area.size(); ++v) {
        if (!(area[v] > 0)) continue;  // shrunk to nothing: not seen
        const glm::vec3& x = from.positions[v];
        const float distance = to.closest(x, std::numeric_limits<float>::infinity()).distance;
        pixels.add(distance * pixels_per_radian / glm::distance(x, eye), area[v]);
    }
}
void add_both_ways(Spread& pixels, const Mesh& a, const Mesh& b, const glm::vec3& eye) {
    if (a.triangles.empty() || b.triangles.empty()) return;
    add_pixels(pixels, a, SurfaceIndex(b), eye);
    add_pixels(pixels, b, SurfaceIndex(a), eye);
}

/// Where the eye stands, so many diagonals of the bounds away from their middle.
glm::vec3 eye_at(const AssetInfo& info, float diagonals) {
    const glm::vec3 lower(info.lower[0], info.lower[1], info.lower[2]), upper(info.upper[0], info.upper[1], info.upper[2]);
    return 0.5f * (lower + upper) + diagonals * glm::distance(lower, upper) * glm::normalize(glm::vec3(2, -3, 1));
}

}  // namespace

std::vector<ScreenError> screen_errors(BenchPlayer& player, const std::vector<uint32_t>& frames) {
    Spread pixels[std::size(distances)];
    double triangles[std::size(distances)] = {}, microseconds[std::size(distances)] = {}, triangles_whole = 0;
    const size_t count = std::min(most_frames, frames.size());
    for (size_t k = 0; k < count; ++k) {
        const double seconds = player.seconds_of(frames[frames.size() * k / count]);
        Mesh whole;
        player.look(0, false);
        player.play(seconds, 0, &whole);
        triangles_whole += double(whole.triangles.size());
        for (size_t d = 0; d < std::size(distances); ++d) {
            const glm::vec3 eye = eye_at(player.info(), distances[d]);
            Mesh mesh;
            player.look_from(eye, pixels_per_radian, pixel_error_asked);
            microseconds[d] += player.play(seconds, 0, &mesh).microseconds[stage_processor];
            triangles[d] += double(mesh.triangles.size());
            add_both_ways(pixels[d], mesh, whole, eye);
        }
    }
    player.look(0, false);
    std::vector<ScreenError> errors;
    for (size_t d = 0; d < std::size(distances); ++d)
        errors.push_back({distances[d], pixels[d].mean(), pixels[d].p99(), pixels[d].max,
                          triangles_whole > 0 ? triangles[d] / triangles_whole : 0, count ? microseconds[d] / double(count) : 0});
    return errors;
}

CameraJumps camera_jumps(BenchPlayer& player, const std::vector<uint32_t>& frames) {
    constexpr size_t most = 3;
    constexpr float nearest = 1, farthest = 8, step = 1 + 1 / 30.f;
    CameraJumps jumps;
    const size_t count = std::min(most, frames.size());
    for (size_t k = 0; k < count; ++k) {
        const double seconds = player.seconds_of(frames[frames.size() * (2 * k + 1) / (2 * count)]);
        Mesh before;
        uint64_t hash = 0;
        for (float diagonals = nearest; diagonals < farthest; diagonals *= step) {
            const glm::vec3 eye = eye_at(player.info(), diagonals);
            Mesh mesh;
            player.look_from(eye, pixels_per_radian, pixel_error_asked);
            const uint64_t now = player.play(seconds, 0, &mesh).hash;
            if (diagonals > nearest) {
                Spread pixels;
                if (now != hash) add_both_ways(pixels, before, mesh, eye);
                jumps.add(pixels);
            }
            before = std::move(mesh), hash = now;
        }
    }
    player.look(0, false);
    return jumps;
}

void CameraJumps::add(const Spread& pixels) {
    const double large = pixels.weight > 0 ? 1 - pixels.histogram.share_below(pixel_error_asked) : 0;
    ++moves;
    changes += pixels.max > 0, above_cell += pixels.max > pixel_error_asked;
    mean = std::max(mean, pixels.mean()), p99 = std::max(p99, pixels.p99()), max = std::max(max, pixels.max);
    share_above = std::max(share_above, large);
}

}  // namespace rill::cooker
