// SPDX-License-Identifier: MIT
// Liquid that its exporter cut off at the sides of the domain, as marching cubes do at the end of a grid and as waves are that
// have no floor: an open surface whose edges lie in the sides of a box. What is missing is flat, and lies in those sides.
#pragma once
#include <memory>
#include <nlohmann/json_fwd.hpp>

#include "frames/walls.h"
#include "frames/widen_patch.h"
#include "readers/reader.h"

namespace rill::cooker {

/// The box that all frames are cut off by. One for the whole sequence: a side where a frame is open may be a wall of another.
struct Cut {
    uint32_t sides = 0;             ///< bit 2 axis + (0 lower, 1 upper): open edges of some frame lie in it
    glm::vec3 lower{0}, upper{0};   ///< metres; sides that nothing is open in stand off the liquid, so that waves have depth
    float edge = 0;                 ///< of the source, metres
    uint32_t moving = 0;            ///< of those sides: where the rim moves to and fro, and is carried on to the side
    float within() const { return cut_within * edge; }  ///< of a side's plane: lies in it
};
/// `facts`, `rim`: of all frames; `edge`: their median edge.
Cut find_cut(const WallFacts& facts, const RimOfPatch& rim, float edge);

/// Sides that a sequence of these bounds, closed there, ends in: bits as Cut::sides, those it got a floor in among them.
uint32_t closed_sides(const Cut& cut, const glm::vec3& lower, const glm::vec3& upper);

/// Widens the surface to the sides where its rim moves. Closes it where its open edges lie in the sides of the cut, and where these are the liquid's only bound; other holes
/// stay as they are. New vertices are at rest. Liquid is on the inner side of triangles.
void close_at_sides(Mesh& mesh, const Cut& cut);

/// As it stands in surveys and in assets. cut_from_json() throws nlohmann::json::exception.
nlohmann::json cut_json(const Cut& cut);
Cut cut_from_json(const nlohmann::json& json);

/// The frames of `reader`, closed. Takes it over.
std::unique_ptr<SequenceReader> cut_to_closed(std::unique_ptr<SequenceReader> reader, const Cut& cut);

}  // namespace rill::cooker
