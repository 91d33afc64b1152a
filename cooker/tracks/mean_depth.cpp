// SPDX-License-Identifier: MIT
#include "tracks/mean_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/parallel.h"
#include "frames/walls.h"

namespace rill::cooker {
namespace {

// What is lost, or false, counts for so much at most. Thin liquid has much surface for its volume: a frame of a stream into a glass, torn when
// it was measured, had 15 951 cubic edges for 15 661, and a 50th of an edge would have taken 1.3 % off it.
constexpr float most_of_lost = 0.02f;       // edges
constexpr double most_of_volume = 0.0025;

/// How far the decoded surface lies inside the source's where both are near each other, on average of some of its triangles: metres.
float near_depth(const SurfaceFrame& frame, const Mesh& decoded, const surface::Container& container, int jobs) {
    constexpr size_t every = 7;
    struct Sample {
        float depth = 0, area = 0;
    };
    std::vector<Sample> samples(decoded.triangles.size() / every);
    parallel_for(samples.size(), jobs, [&](size_t i) {
        const Triangle& t = decoded.triangles[every * i];
        const glm::vec3 &a = decoded.positions[t[0]], &b = decoded.positions[t[1]], &c = decoded.positions[t[2]], middle = (a + b + c) / 3.f;
        if (!is_inside(middle, container)) return;
        const SurfaceIndex::Hit hit = frame.index.closest(middle, frame.edge);
        if (!(hit.distance < frame.edge)) return;
        const Triangle& under = frame.mesh.triangles[hit.triangle];
        const glm::vec3& corner = frame.mesh.positions[under[0]];
        const glm::vec3 normal = glm::cross(frame.mesh.positions[under[1]] - corner, frame.mesh.positions[under[2]] - corner);
        samples[i] = {glm::dot(hit.point - middle, normal) > 0 ? hit.distance : -hit.distance, glm::length(glm::cross(b - a, c - a))};
    });
    double sum = 0, area = 0;
    for (const Sample& sample : samples) sum += double(sample.depth) * sample.area, area += sample.area;
    return area > 0 ? float(sum / area) : 0;
}

}  // namespace

float mean_depth(const SurfaceFrame& frame, const Mesh& decoded, const surface::Container& container, int jobs) {
    double area = 0;
    for (size_t v = 0; v < frame.area.size(); ++v)
        if (is_inside(frame.mesh.positions[v], container)) area += frame.area[v];
    if (!(area > 0)) return 0;
    const double volume = volume_inside(frame.mesh, container);
    const float depth = float((volume - volume_inside(decoded, container)) / area);
    const float near = near_depth(frame, decoded, container, jobs), most = std::min(most_of_lost * frame.edge, float(most_of_volume * std::fabs(volume) / area));
    return std::clamp(depth, near - most, near + most);
}

}  // namespace rill::cooker
