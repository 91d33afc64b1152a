// SPDX-License-Identifier: MIT
#include "commands/bench_detail.h"

#include <algorithm>
#include <limits>

#include "surface_distance.h"

namespace rill::cooker {
namespace {

constexpr size_t most_frames = 8;
constexpr float distances[] = {1, 2, 4, 8};

struct Pixels {
    std::vector<float> all;
    double triangles = 0, triangles_whole = 0;

    /// From every vertex of `from` to the other surface.
    void add(const Mesh& from, const SurfaceIndex& to, const glm::vec3& eye) {
        for (const glm::vec3& x : from.positions)
            all.push_back(to.closest(x, std::numeric_limits<float>::infinity()).distance * pixels_per_radian / glm::distance(x, eye));
    }
    /// Mean, p99 and max into a report.
    template <class Report>
    void sum_up(Report& report) {
        if (all.empty()) return;
        std::sort(all.begin(), all.end());
        for (float pixels : all) report.mean += pixels / double(all.size());
        report.p99 = all[size_t(0.99 * double(all.size() - 1))], report.max = all.back();
    }
    ScreenError result(float diagonals) {
        ScreenError error{diagonals};
        error.triangles = triangles_whole > 0 ? triangles / triangles_whole : 0;
        sum_up(error);
        return error;
    }
};

/// Where the eye stands, so many diagonals of the bounds away from their middle.
glm::vec3 eye_at(const AssetInfo& info, float diagonals) {
    const glm::vec3 lower(info.lower[0], info.lower[1], info.lower[2]), upper(info.upper[0], info.upper[1], info.upper[2]);
    return 0.5f * (lower + upper) + diagonals * glm::distance(lower, upper) * glm::normalize(glm::vec3(2, -3, 1));
}

}  // namespace

std::vector<ScreenError> screen_errors(BenchPlayer& player, const std::vector<uint32_t>& frames) {
    Pixels pixels[std::size(distances)];
    const size_t count = std::min(most_frames, frames.size());
    for (size_t k = 0; k < count; ++k) {
        const double seconds = player.seconds_of(frames[frames.size() * k / count]);
        Mesh whole;
        player.look(0, false);
        player.play(seconds, 0, &whole);
        const SurfaceIndex whole_index(whole);
        for (size_t d = 0; d < std::size(distances); ++d) {
            const glm::vec3 eye = eye_at(player.info(), distances[d]);
            Mesh mesh;
            player.look_from(eye, pixels_per_radian, pixel_error_asked);
            player.play(seconds, 0, &mesh);
            pixels[d].triangles += double(mesh.triangles.size()), pixels[d].triangles_whole += double(whole.triangles.size());
            if (mesh.triangles.empty() || whole.triangles.empty()) continue;
            pixels[d].add(mesh, whole_index, eye);
            pixels[d].add(whole, SurfaceIndex(mesh), eye);
        }
    }
    player.look(0, false);
    std::vector<ScreenError> errors;
    for (size_t d = 0; d < std::size(distances); ++d) errors.push_back(pixels[d].result(distances[d]));
    return errors;
}

CameraJumps camera_jumps(BenchPlayer& player, const std::vector<uint32_t>& frames) {
    constexpr size_t most = 3;
    constexpr float nearest = 1, farthest = 8, step = 1 + 1 / 30.f;
    CameraJumps jumps;
    Pixels pixels;
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
            const bool first = diagonals == nearest;
            jumps.moves += !first;
            if (!first && now != hash && !mesh.triangles.empty() && !before.triangles.empty()) {
                ++jumps.changes;
                pixels.add(mesh, SurfaceIndex(before), eye);
                pixels.add(before, SurfaceIndex(mesh), eye);
            }
            before = std::move(mesh), hash = now;
        }
    }
    player.look(0, false);
    pixels.sum_up(jumps);
    const auto above = pixels.all.end() - std::upper_bound(pixels.all.begin(), pixels.all.end(), pixel_error_asked);
    if (!pixels.all.empty()) jumps.above = double(above) / double(pixels.all.size());
    return jumps;
}

}  // namespace rill::cooker
