// SPDX-License-Identifier: MIT
// Which surface patches cross a lattice cell, for every pattern of corner signs: one vertex stands on
// each patch (dual marching cubes: Nielson 2004; Schaefer, Ju & Warren 2007).
//
// Patches are found by joining, face by face, the cell edges whose ends differ in sign. On a face with
// two diagonal inside corners each inside corner is cut off by itself; both cells at the face see the
// same four signs, so they agree and the surface closes. One case is left that is not manifold: both
// segments of such a face lie on ONE patch in BOTH cells, and the edge between the two vertices would
// be used four times (Wenger, "Isosurfaces", 2013, section 3.3). Those cells then join the face's
// corners the other way, which splits either patch in two. No pattern has more than one such face.
//
// Corners: bit 0 = x, bit 1 = y, bit 2 = z. Edges: 4·axis + u + 2·v with u, v the bits along the next
// two axes (cyclic). Faces: 2·axis + side.
#pragma once
#include <array>
#include <cstdint>

namespace rill {

struct CellPatches {
    uint8_t count = 0;               ///< patches, at most 4
    uint8_t doubled = 0;             ///< bits of ambiguous faces with both segments on one patch
    uint8_t patch[12] = {};          ///< of each sign-changing edge
    uint16_t crossed = 0;            ///< which edges change sign
};

namespace patches_detail {

constexpr uint32_t edge_of(uint32_t axis, uint32_t corner) {
    return 4 * axis + ((corner >> ((axis + 1) % 3)) & 1) + 2 * ((corner >> ((axis + 2) % 3)) & 1);
}
constexpr uint32_t edge_corner(uint32_t edge) {
    const uint32_t axis = edge / 4;
    return ((edge & 1) << ((axis + 1) % 3)) | (((edge >> 1) & 1) << ((axis + 2) % 3));
}
constexpr bool crossed(uint32_t inside, uint32_t edge) {
    const uint32_t corner = edge_corner(edge);
    return ((inside >> corner) ^ (inside >> (corner | 1u << (edge / 4)))) & 1;
}

/// Corners of a face in cyclic order, and the edges from each to the next.
struct Face {
    uint32_t corner[4] = {}, edge[4] = {};
};
constexpr Face face_of(uint32_t face) {
    const uint32_t axis = face / 2, base = (face & 1) << axis;
    const uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    Face f;
    f.corner[0] = base, f.corner[1] = base | 1u << u;
    f.corner[2] = base | 1u << u | 1u << v, f.corner[3] = base | 1u << v;
    f.edge[0] = edge_of(u, f.corner[0]), f.edge[1] = edge_of(v, f.corner[1]);
    f.edge[2] = edge_of(u, f.corner[3]), f.edge[3] = edge_of(v, f.corner[0]);
    return f;
}
constexpr bool ambiguous(uint32_t inside, const Face& f) {
    const bool first = (inside >> f.corner[0]) & 1, second = (inside >> f.corner[1]) & 1;
    return first != second && first == bool((inside >> f.corner[2]) & 1) &&
           second == bool((inside >> f.corner[3]) & 1);
}

struct Joined {
    uint32_t root[12] = {};
    constexpr void join(uint32_t a, uint32_t b) {
        const uint32_t from = root[a], to = root[b];
        for (uint32_t& r : root)
            if (r == from) r = to;
    }
};
constexpr void join_face(Joined& joined, uint32_t inside, const Face& f, bool turned) {
    if (ambiguous(inside, f)) {
        // Cut off the inside corners (turned: the outside ones): join the edges before and after each.
        const bool first = bool((inside >> f.corner[0]) & 1) != turned;
        joined.join(f.edge[first ? 3 : 0], f.edge[first ? 0 : 1]);
        joined.join(f.edge[first ? 1 : 2], f.edge[first ? 2 : 3]);
        return;
    }
    uint32_t before = 12;
    for (uint32_t edge : f.edge) {
        if (!crossed(inside, edge)) continue;
        if (before < 12) joined.join(before, edge);
        before = edge;
    }
}

/// `turned`: bits of the faces whose ambiguity is treated the other way.
constexpr CellPatches trace(uint32_t inside, uint32_t turned) {
    Joined joined;
    for (uint32_t e = 0; e < 12; ++e) joined.root[e] = e;
    for (uint32_t f = 0; f < 6; ++f) join_face(joined, inside, face_of(f), turned >> f & 1);
    CellPatches cell;
    uint32_t name[12] = {};
    for (uint32_t e = 0; e < 12; ++e) {
        if (!crossed(inside, e)) continue;
        uint32_t& n = name[joined.root[e]];
        if (n == 0) n = ++cell.count;
        cell.patch[e] = uint8_t(n - 1), cell.crossed = uint16_t(cell.crossed | 1u << e);
    }
    for (uint32_t f = 0; f < 6; ++f) {
        const Face face = face_of(f);
        if (!ambiguous(inside, face)) continue;
        bool doubled = true;
        for (uint32_t edge : face.edge) doubled = doubled && cell.patch[edge] == cell.patch[face.edge[0]];
        if (doubled) cell.doubled = uint8_t(cell.doubled | 1u << f);
    }
    return cell;
}

/// [0, 256): by corner signs (bit set = inside); [256, 512): the same with the doubled face turned.
constexpr std::array<CellPatches, 512> trace_all() {
    std::array<CellPatches, 512> table{};
    for (uint32_t inside = 0; inside < 256; ++inside) {
        table[inside] = trace(inside, 0);
        table[256 + inside] = trace(inside, table[inside].doubled);
    }
    return table;
}

}  // namespace patches_detail

inline constexpr std::array<CellPatches, 512> cell_patches = patches_detail::trace_all();

/// How a cell is divided: its signs, and bits of the faces that are turned. Fits 14 bits.
struct CellPattern {
    uint16_t bits;
    uint32_t signs() const { return bits & 255; }
    uint32_t turned() const { return uint32_t(bits) >> 8; }
};
constexpr CellPattern pattern_of(uint32_t signs, uint32_t turned) { return {uint16_t(signs | turned << 8)}; }
/// From the table wherever cells are of one size; traced anew for the few on borders with others.
inline CellPatches patches_of(CellPattern pattern) {
    const uint32_t signs = pattern.signs(), turned = pattern.turned();
    if (turned == 0) return cell_patches[signs];
    if (turned == cell_patches[signs].doubled) return cell_patches[256 + signs];
    return patches_detail::trace(signs, turned);
}
inline uint32_t patch_of(CellPattern pattern, uint32_t edge) {
    return pattern.turned() ? patches_of(pattern).patch[edge] : cell_patches[pattern.signs()].patch[edge];
}

}  // namespace rill
