// SPDX-License-Identifier: MIT
// What must be known of the whole sequence before any part of it is cooked. Every machine of a farm needs the same
// answer: it is a pure function of the input, and can be kept in a file.
#pragma once
#include <functional>
#include <glm/glm.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "frames/check_velocity.h"
#include "frames/cut_to_closed.h"
#include "readers/reader.h"

namespace rill::cooker {

struct Survey {
    glm::vec3 lower{0}, upper{0};         ///< of the surface over all frames; equal when there is none
    float edge = 1;                       ///< median edge, metres
    uint32_t walls = 0;                   ///< as format::Header
    double wall_share = 0;                ///< of the surface of all frames: lies in them
    uint32_t sharp = 0;                   ///< walls that surface leaves at a crease, likewise
    float bevel = 0;                      ///< metres, as surface::Container
    Cut cut;                              ///< all else is of frames closed there
    double triangles = 0, vertices = 0;   ///< of all frames together
    VelocityFit fit;
    std::string input;                    ///< hash of the contents of all files
    double diagonal() const { return glm::distance(lower, upper); }
};
/// Looks at every frame; tells `warn` what of the source will disappoint, with advice.
/// `file`: kept there, and taken from there when the input has not been touched since; empty: not kept.
/// `input`: hash of the contents, if known already. `progress` is called by one thread at a time.
Survey survey_input(const SequenceReader& reader, const ReadOptions& options, const std::string& file, const std::string& input, int jobs,
                    const std::function<void(uint32_t done)>& progress);
/// Hash of the input's contents, from `file` if that still tells it.
std::string known_input(const SequenceReader& reader, const ReadOptions& options, const std::string& file, int jobs);
/// The options that decide what a frame is, as they stand in assets and keys.
nlohmann::json read_settings(const ReadOptions& options);

}  // namespace rill::cooker
