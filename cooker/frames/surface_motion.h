// SPDX-License-Identifier: MIT
// How a surface moves. With the liquid, where that is known and calm. Else by its shape alone: the smoothest motion that lays
// it onto the next; points that go with it stay where the surface needs them, while those that go with violent liquid
// crowd where it converges, leave gaps where it parts, and dive.
#pragma once
#include <glm/glm.hpp>
#include <vector>

#include "common/mesh.h"
#include "measure/surface_distance.h"

namespace rill::cooker {

/// Motion of every vertex of `from`, metres, onto the surface of `to`: closest points that face alike, asked for
/// from both sides, under a smoothness that loosens step by step; zero where there is nothing to go to. It begins at
/// `start`, or at rest if that is empty. The same for any `jobs`.
std::vector<glm::vec3> surface_motion(const SurfaceIndex& from, const SurfaceIndex& to, int jobs, std::vector<glm::vec3> start = {});
/// A start for `now`: most of the `motion` that brought `before` here, times `longer`: the next step's time over the last one's.
std::vector<glm::vec3> motion_goes_on(const SurfaceIndex& before, const std::vector<glm::vec3>& motion, const Mesh& now, float longer,
                                      int jobs);

/// Motion of every vertex of `from` with the liquid, metres: by the mean of the velocities where it starts and where it lands
/// on `to`. At rest without velocities. `to_index`: of `to`.
std::vector<glm::vec3> liquid_motion(const Mesh& from, const Mesh& to, const SurfaceIndex& to_index, double seconds, int jobs);
/// How far from a surface the motion ends, metres: the mean of at most `most`.
double mean_miss(const Mesh& from, const std::vector<glm::vec3>& motion, const SurfaceIndex& to_index, float most, int jobs);
/// How much a motion stretches or squeezes the surface, a few rings at a time: mean |log of area|. Points that go with it must
/// be born, or die, at that rate.
double mean_stretch(const Mesh& mesh, const std::vector<glm::vec3>& motion);

}  // namespace rill::cooker
