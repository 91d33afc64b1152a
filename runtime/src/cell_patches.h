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
/// The edge of a face that one of its sign-changing edges is joined with. An ambiguous face cuts off its inside corners
/// (`turned`: the outside ones): each joins the edges before and after it.
constexpr uint32_t edge_across(uint32_t inside, uint32_t face, bool turned, uint32_t edge) {
    const Face f = face_of(face);
    uint32_t k = 0;
    while (f.edge[k] != edge) ++k;
    if (ambiguous(inside, f)) {
        const bool begins_cut = bool((inside >> f.corner[k]) & 1) != turned;  // the corner before the edge, or the one after
        return f.edge[(k + (begins_cut ? 3 : 1)) % 4];
    }
    uint32_t other = (k + 1) % 4;
    while (!crossed(inside, f.edge[other])) other = (other + 1) % 4;
    return f.edge[other];
}

/// The face that a patch leaves an edge by, walked counter-clockwise seen from the air.
constexpr uint32_t face_after(uint32_t signs, uint32_t edge) {
    const uint32_t axis = edge / 4, u = 2 * ((axis + 1) % 3) + (edge & 1), v = 2 * ((axis + 2) % 3) + (edge >> 1 & 1);
    const bool liquid_below = signs >> edge_corner(edge) & 1, same_side = (edge & 1) == (edge >> 1 & 1);
    return same_side == liquid_below ? v : u;
}
/// The same edge in the numbers of the cell beyond one of its faces.
constexpr uint32_t edge_beyond(uint32_t edge, uint32_t face) { return edge ^ (face / 2 == (edge / 4 + 1) % 3 ? 1u : 2u); }

/// `turned`: bits of the faces whose ambiguity is treated the other way.
constexpr CellPatches trace(uint32_t inside, uint32_t turned) {
    Joined joined;
    for (uint32_t e = 0; e < 12; ++e) joined.root[e] = e;
    for (uint32_t f = 0; f < 6; ++f)
        for (uint32_t edge : face_of(f).edge)
            if (crossed(inside, edge)) joined.join(edge, edge_across(inside, f, turned >> f & 1, edge));
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
    constexpr uint32_t signs() const { return bits & 255; }
    constexpr uint32_t turned() const { return uint32_t(bits) >> 8; }
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

/// What stands round the vertex of a patch, in order, counter-clockwise seen from the air: the vertices beyond its faces. Of a face
/// that the patch crosses twice, twice.
struct Ring {
    static constexpr uint32_t most = 12;
    uint8_t count = 0;
    uint8_t face[most] = {};
    uint8_t edge[most] = {};  ///< of the cell beyond the face: one that the patch crosses
};

/// Of one of the pattern's patches.
constexpr Ring ring_of(CellPattern pattern, const CellPatches& patches, uint32_t patch) {
    Ring ring;
    uint32_t first = 0;
    while (first < 12 && !(patches.crossed >> first & 1 && patches.patch[first] == patch)) ++first;
    for (uint32_t edge = first; first < 12 && ring.count < Ring::most;) {
        const uint32_t face = patches_detail::face_after(pattern.signs(), edge);
        ring.face[ring.count] = uint8_t(face), ring.edge[ring.count++] = uint8_t(patches_detail::edge_beyond(edge, face));
        edge = patches_detail::edge_across(pattern.signs(), face, pattern.turned() >> face & 1, edge);
        if (edge == first) break;
    }
    return ring;
}

}  // namespace rill
