// SPDX-License-Identifier: MIT
// Field → closed triangle mesh: dual contouring (Ju, Losasso, Schaefer & Warren 2002) marched from
// the decoded points (Keeler & Bridson, section 1), one manifold vertex per surface patch of a cell.
// The cooker meshes with it, too: where the decoded surface stands off the source, points are missing.
#pragma once
#include <cstddef>
#include <cstdint>

#include "rill/rill.h"
#include "src/levels.h"
#include "src/relay.h"
#include "surface/field.h"

namespace rill {

/// In cells: half axes of drops that cells draw are longer by as much at most, for what they cut off.
inline constexpr float most_growth_of_drops = 0.15f;

struct MeshLimits {
    uint32_t vertices;           ///< scratch capacity, all workers together
    uint32_t drops;              ///< of fields at most; beyond, cells draw them as they are
    uint32_t tiles;              ///< of 8³ cells; 0: derived from vertices
    uint32_t workers;
};
struct FrustumPlanes {
    float planes[6][4];  ///< asset space, inward
};
struct MeshInput {
    const surface::Field* field;  ///< finished, or at least alive until the first mesh stage prepares; its drops are changed
                                  ///< while the stages run, and as they were afterwards
    Levels levels;                ///< sizes of cells
    const FrustumPlanes* views;   ///< none: everything
    uint32_t view_count;
    bool velocity;                ///< wanted in the output
    Target* target;               ///< may be null: mesh but write nothing
    /// What does not fit is meshed again with larger cells, up to so many octaves, before anything is cut off.
    float most_octaves = 0;
    /// May be null. Asked between rounds; true: what has been found so far takes too long already.
    bool (*late)(void* user) = nullptr;
    void* user = nullptr;
};
struct MeshCounts {
    uint32_t cut;                 ///< Cut bits
    uint32_t vertices_wanted, indices_wanted;  ///< as asked; when tiles ran out: twice MeshLimits::vertices at least
    uint32_t ranges_wanted, corners_evaluated;
    uint32_t vertices;            ///< of what was meshed in the end
    float octaves;                ///< coarser than asked
};
struct Mesher;  ///< lives in the memory given

size_t mesher_bytes(const MeshLimits& limits) noexcept;
Mesher* place_mesher(void* memory, const MeshLimits& limits) noexcept;
/// Sets the work; then run mesh_stages() with the Mesher as context. Afterwards target's *_used are set.
void begin_mesh(Mesher* mesher, const MeshInput& input) noexcept;
const Stage* mesh_stages(uint32_t* count) noexcept;
MeshCounts mesh_counts(const Mesher* mesher) noexcept;

}  // namespace rill
