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
    ScreenError result(float diagonals) {
        ScreenError error{diagonals};
        error.triangles = triangles_whole > 0 ? triangles / triangles_whole : 0;
        if (all.empty()) return error;
        std::sort(all.begin(), all.end());
        for (float pixels : all) error.mean += pixels / double(all.size());
        error.p99 = all[size_t(0.99 * double(all.size() - 1))], error.max = all.back();
        return error;
    }
};

}  // namespace

std::vector<ScreenError> screen_errors(BenchPlayer& player, const std::vector<uint32_t>& frames) {
    const AssetInfo& info = player.info();
    const glm::vec3 lower(info.lower[0], info.lower[1], info.lower[2]), upper(info.upper[0], info.upper[1], info.upper[2]);
    const glm::vec3 aside = glm::normalize(glm::vec3(2, -3, 1));
    Pixels pixels[std::size(distances)];
    const size_t count = std::min(most_frames, frames.size());
    for (size_t k = 0; k < count; ++k) {
        const double seconds = player.seconds_of(frames[frames.size() * k / count]);
        Mesh whole;
        player.look(0, false);
        player.play(seconds, 0, &whole);
        const SurfaceIndex whole_index(whole);
        for (size_t d = 0; d < std::size(distances); ++d) {
            const glm::vec3 eye = 0.5f * (lower + upper) + distances[d] * glm::distance(lower, upper) * aside;
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

}  // namespace rill::cooker
