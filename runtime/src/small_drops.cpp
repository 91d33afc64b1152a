// SPDX-License-Identifier: MIT
// Drops and bubbles that are hardly larger than a cell. Those that touch nothing are no business of cells: a lattice knows them by a corner or two,
// so that they would hop from corner to corner and change their shape and volume as they fly. They are drawn as what they are, an
// ellipsoid, by a mesh of their own that goes where they go and has their volume. Those that touch something, a wall or other liquid that they
// may be one piece with, are made such that cells show them.
#include <algorithm>
#include <cmath>

#include "mesher.h"

namespace rill {
namespace {

constexpr float least_seen = 0.1f;   // of a cell: a radius below is nothing that can be seen
constexpr float largest = 2.2f;      // likewise, root mean square of the half axes: what has a mesh of its own (1.4: pieces of 8 to 15 cubic cells 1.2 % smaller)
constexpr float least_gap = 0.05f;   // cells beyond the drop, where nothing else may be as near
constexpr float same_value = 1e-3f;  // cells
constexpr float sight_margin = 4;    // cells round it: those on the border of sight may be made of it
// Cells cut that share off the volume of an ellipsoid, over the square of its mean radius in cells: .62 (large balls) to .67 (pancakes), less
// of the smallest. (.63: pieces of 4 to 10 cubic cells come out 4 % too large.)
constexpr float cut_off = 0.58f;

// ---- meshes of a ball ------------------------------------------------------------------------------

/// Vertices on the unit ball, triangles counter-clockwise from outside; `scale`: that gives it the ball's volume.
template <uint32_t vertices, uint32_t triangles>
struct BallMesh {
    float vertex[vertices][3] = {};
    uint8_t corner[triangles][3] = {};
    float scale = 1;
    static constexpr uint32_t vertex_count = vertices, triangle_count = triangles;
};

template <uint32_t vertices, uint32_t triangles>
constexpr float scale_of(const BallMesh<vertices, triangles>& ball) {
    double six_volumes = 0;
    for (const auto& t : ball.corner) {
        const float *a = ball.vertex[t[0]], *b = ball.vertex[t[1]], *c = ball.vertex[t[2]];
        six_volumes += double(a[0]) * (b[1] * c[2] - b[2] * c[1]) + double(a[1]) * (b[2] * c[0] - b[0] * c[2]) + double(a[2]) * (b[0] * c[1] - b[1] * c[0]);
    }
    const double cube = 8 * 3.14159265358979 / six_volumes;
    double root = 1;
    for (int i = 0; i < 20; ++i) root -= (root * root * root - cube) / (3 * root * root);
    return float(root);
}

constexpr float short_axis = 0.52573111f, long_axis = 0.85065081f;  // 1 and φ over √(1 + φ²)

constexpr auto icosahedron = [] {
    constexpr float a = short_axis, b = long_axis;
    BallMesh<12, 20> ball{{{-a, b, 0}, {a, b, 0}, {-a, -b, 0}, {a, -b, 0}, {0, -a, b}, {0, a, b}, {0, -a, -b}, {0, a, -b}, {b, 0, -a}, {b, 0, a}, {-b, 0, -a}, {-b, 0, a}},
                     {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8}, {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}}};
    ball.scale = scale_of(ball);
    return ball;
}();

/// The same with the middles of edges, out on the ball.
template <uint32_t vertices, uint32_t triangles>
constexpr auto divided(const BallMesh<vertices, triangles>& from) {
    BallMesh<vertices + triangles * 3 / 2, 4 * triangles> ball;
    uint8_t between[vertices][vertices] = {};
    uint32_t count = vertices, triangle = 0;
    for (uint32_t v = 0; v < vertices; ++v)
        for (int k = 0; k < 3; ++k) ball.vertex[v][k] = from.vertex[v][k];
    for (const auto& t : from.corner) {
        uint8_t middle[3] = {};
        for (uint32_t e = 0; e < 3; ++e) {
            const uint8_t one = t[e], other = t[(e + 1) % 3];
            if (!between[one][other]) {
                float* place = ball.vertex[count];
                double length2 = 0, length = 1;
                for (int k = 0; k < 3; ++k) place[k] = 0.5f * (from.vertex[one][k] + from.vertex[other][k]), length2 += double(place[k]) * place[k];
                for (int i = 0; i < 20; ++i) length = 0.5 * (length + length2 / length);
                for (int k = 0; k < 3; ++k) place[k] = float(place[k] / length);
                between[one][other] = between[other][one] = uint8_t(count++);
            }
            middle[e] = between[one][other];
        }
        const uint8_t parts[4][3] = {{t[0], middle[0], middle[2]}, {t[1], middle[1], middle[0]}, {t[2], middle[2], middle[1]}, {middle[0], middle[1], middle[2]}};
        for (const auto& part : parts) {
            for (int k = 0; k < 3; ++k) ball.corner[triangle][k] = part[k];
            ++triangle;
        }
    }
    ball.scale = scale_of(ball);
    return ball;
}
constexpr auto divided_once = divided(icosahedron);
constexpr auto divided_twice = divided(divided_once);

/// Work(ball) with the mesh of that number; 0 is none.
template <typename Work>
void with_mesh(uint32_t mesh, Work work) {
    if (mesh == 1) work(icosahedron);
    if (mesh == 2) work(divided_once);
    if (mesh == 3) work(divided_twice);
}
/// By the size of a drop in cells: about as many vertices as cells would make.
uint32_t mesh_for(float size) { return 1 + (size > 0.7f) + (size > 1.6f); }

// ---- which ones ------------------------------------------------------------------------------------

/// A drop of the field as {centre + S u}, u on the unit ball.
struct Ellipsoid {
    float centre[3], inverse[6], shape[6], radius;  ///< S⁻¹ and S as xx yy zz xy xz yz; mean, negative for bubbles
    explicit Ellipsoid(const SmallDrop& drop) : radius(drop.radius) {
        std::copy(drop.centre, drop.centre + 3, centre), std::copy(drop.inverse, drop.inverse + 6, inverse);
        const float xx = inverse[0], yy = inverse[1], zz = inverse[2], xy = inverse[3], xz = inverse[4], yz = inverse[5];
        const float c0 = yy * zz - yz * yz, c1 = xz * yz - xy * zz, c2 = xy * yz - yy * xz, k = 1 / (xx * c0 + xy * c1 + xz * c2);
        const float adjugate[6] = {c0, xx * zz - xz * xz, xx * yy - xy * xy, c1, c2, xy * xz - xx * yz};
        for (int a = 0; a < 6; ++a) shape[a] = adjugate[a] * k;
    }
    static void multiply(const float (&m)[6], const float (&v)[3], float (&out)[3]) {
        out[0] = m[0] * v[0] + m[3] * v[1] + m[4] * v[2], out[1] = m[3] * v[0] + m[1] * v[1] + m[5] * v[2], out[2] = m[4] * v[0] + m[5] * v[1] + m[2] * v[2];
    }
    /// Root mean square of the half axes.
    float size() const {
        float sum = 0;
        for (int k = 0; k < 6; ++k) sum += (k < 3 ? 1.f : 2.f) * shape[k] * shape[k];
        return std::sqrt(sum / 3);
    }
    /// Half of its extent along an axis.
    float extent(uint32_t a) const {
        constexpr int row[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        float sum = 0;
        for (int k : row[a]) sum += shape[k] * shape[k];
        return std::sqrt(sum);
    }
};

/// Along the axes and the diagonals of a cube.
constexpr uint32_t directions = 14;
void direction_of(uint32_t k, float (&out)[3]) {
    constexpr float diagonal = 0.57735027f;
    for (uint32_t a = 0; a < 3; ++a) out[a] = k < 6 ? (k / 2 == a ? (k & 1 ? 1.f : -1.f) : 0.f) : (k - 6) >> a & 1 ? diagonal : -diagonal;
}

/// Whether nothing else is as near all round it as it is, and no wall cuts it.
bool touches_nothing(const Mesher& m, MesherScratch& s, const Ellipsoid& drop, float cell) {
    const float gap = least_gap * cell;
    surface::Box box;
    for (uint32_t a = 0; a < 3; ++a) {
        const float reach = drop.extent(a) + gap;
        box.lower[a] = drop.centre[a] - reach, box.upper[a] = drop.centre[a] + reach;
        const surface::Container& container = m.input.field->container;
        if (!(box.lower[a] + gap > container.lower[a] && box.upper[a] - gap < container.upper[a])) return false;
    }
    const uint32_t count = m.access.gather(*m.input.field, box, s.candidates, s.most_candidates);
    if (count > s.most_candidates) return false;
    // Alone, it is all in the air or all in liquid: one place tells.
    const uint32_t asked = count > 1 ? directions : 1;
    float own[directions];
    for (uint32_t k = 0; k < asked; ++k) {
        float u[3], r[3];
        direction_of(k, u);
        const float reach = 1 / length_of(drop.inverse, u) + gap;
        for (uint32_t a = 0; a < 3; ++a) r[a] = u[a] * reach;
        s.x[k] = drop.centre[0] + r[0], s.y[k] = drop.centre[1] + r[1], s.z[k] = drop.centre[2] + r[2];
        own[k] = (length_of(drop.inverse, r) - 1) * drop.radius;
    }
    m.access.evaluate(*m.input.field, s.candidates, count, s.x, s.y, s.z, asked, s.value);
    for (uint32_t k = 0; k < asked; ++k)
        if (!((drop.radius < 0 ? own[k] - s.value[k] : s.value[k] - own[k]) > -same_value * cell)) return false;
    return true;
}

/// Cells cut off more of a drop than a fine mesh would: as much larger as gives its mesh the volume. `radius`: in cells.
float growth_for(float radius) {
    float larger = radius;
    for (int round = 0; round < 12; ++round) larger = std::cbrt(radius * radius * radius + cut_off * larger);  // R³ − cut_off R = r³
    return std::min(larger, radius + most_growth_of_drops) / radius;
}

/// Who draws it, if anybody does.
void judge(const Mesher& m, MesherScratch& s, uint32_t i) {
    const surface::Field& f = *m.input.field;
    SmallDrop& drop = m.drops[i];
    drop = {0, false, 0, 1, 0, 0, {f.dx[i], f.dy[i], f.dz[i]}, {}, f.radius[i], f.reach[i]};
    for (int k = 0; k < 6; ++k) drop.inverse[k] = f.inverse[k][i];
    int32_t level, tile[3];
    if (!leaf_at(m, drop.centre, level, tile)) return;
    const float cell = drop.cell = m.input.levels.cell(level);
    const Ellipsoid shape(drop);
    const float size = shape.size(), reach = std::max({shape.extent(0), shape.extent(1), shape.extent(2)}) + sight_margin * cell;
    if (!(std::abs(drop.radius) > least_seen * cell && in_sight(m, drop.centre, reach))) return;
    drop.in_cells = !(size < largest * cell && touches_nothing(m, s, shape, cell));
    if (drop.in_cells) drop.growth = growth_for(std::abs(drop.radius) / cell);
    else drop.mesh = mesh_for(size / cell);
}

// ---- those that cells draw --------------------------------------------------------------------------

/// One that no corner of the lattice lies in would not be seen, or come and go as it flies: it moves onto the nearest one.
void move_to_corner(const surface::Field& f, uint32_t i, float cell) {
    constexpr float share = 0.5f;  // where in the drop the corner lies then
    constexpr int around = 4;      // corners each way: those of its cell and the next; larger drops nearly always hold one
    const float centre[3] = {f.dx[i], f.dy[i], f.dz[i]}, inverse[6] = {f.inverse[0][i], f.inverse[1][i], f.inverse[2][i], f.inverse[3][i], f.inverse[4][i], f.inverse[5][i]};
    float nearest = surface::unsupported, away[3] = {};
    for (int k = 0; k < around * around * around; ++k) {
        const int step[3] = {k % around - 1, k / around % around - 1, k / (around * around) - 1};
        float r[3];
        for (int a = 0; a < 3; ++a) r[a] = (std::floor(centre[a] / cell) + float(step[a])) * cell - centre[a];
        if (const float length = length_of(inverse, r); length < nearest) nearest = length, std::copy(r, r + 3, away);
    }
    if (!(nearest > 1 - 1e-3f)) return;
    float* const place[3] = {f.dx + i, f.dy + i, f.dz + i};
    for (int a = 0; a < 3; ++a) *place[a] += away[a] * (1 - share / nearest);
}

// ---- their meshes ----------------------------------------------------------------------------------

template <class Ball>
void place_vertex(const Ellipsoid& shape, const Ball& ball, uint32_t vertex, float (&place)[3]) {
    Ellipsoid::multiply(shape.shape, ball.vertex[vertex], place);
    for (uint32_t a = 0; a < 3; ++a) place[a] = shape.centre[a] + (shape.radius < 0 ? -ball.scale : ball.scale) * place[a];
}

template <class Ball>
void cover_drop(const SmallDrop& drop, const Ball& ball, Range& range) {
    const Ellipsoid shape(drop);
    for (uint32_t v = 0; v < Ball::vertex_count; ++v) {
        float place[3];
        place_vertex(shape, ball, v, place);
        for (uint32_t a = 0; a < 3; ++a) range.lower[a] = std::min(range.lower[a], place[a]), range.upper[a] = std::max(range.upper[a], place[a]);
    }
}

template <class Ball>
void write_drop(const Mesher& m, uint32_t index, const Ball& ball) {
    const surface::Field& f = *m.input.field;
    const Target& target = *m.input.target;
    const SmallDrop& drop = m.drops[index];
    const Ellipsoid shape(drop);
    const bool is_bubble = shape.radius < 0;
    const float velocity[3] = {f.dvx[index], f.dvy[index], f.dvz[index]};
    for (uint32_t v = 0; v < Ball::vertex_count; ++v) {
        float place[3], normal[3], length2 = 0;
        place_vertex(shape, ball, v, place);
        Ellipsoid::multiply(shape.inverse, ball.vertex[v], normal);
        for (const float c : normal) length2 += c * c;
        for (float& c : normal) c /= std::sqrt(length2);
        write3(target.position, drop.first_vertex + v, place);
        write3(target.normal, drop.first_vertex + v, normal);
        if (m.input.velocity) write3(target.velocity, drop.first_vertex + v, velocity);
    }
    if (!target.indices) return;
    uint32_t* out = target.indices + drop.first_index;
    for (const auto& t : ball.corner)
        for (uint32_t k = 0; k < 3; ++k) *out++ = drop.first_vertex + t[is_bubble ? 2 - k : k];
}

}  // namespace

uint32_t prepare_judge_drops(void* mesher) {
    Mesher& m = *static_cast<Mesher*>(mesher);
    m.drop_count = usable(m.input) ? std::min(m.input.field->drop_count, m.limits.drops) : 0;
    return tasks_of(m.drop_count, drops_per_task);
}

void run_judge_drops(void* mesher, uint32_t task, uint32_t worker) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, drops_per_task, m.drop_count, [&](uint32_t i) { judge(m, m.scratch[worker], i); });
}

void change_drops(Mesher& m) noexcept {
    const surface::Field& f = *m.input.field;
    for (uint32_t i = 0; i < m.drop_count; ++i) {
        const SmallDrop& drop = m.drops[i];
        if (!drop.in_cells) {
            f.reach[i] = 0;
            continue;
        }
        for (float* const row : f.inverse) row[i] /= drop.growth;
        f.radius[i] *= drop.growth, f.reach[i] *= drop.growth;
        if (std::abs(drop.radius) < drop.cell) move_to_corner(f, i, drop.cell);
    }
    surface::bound_drops(f);
}

void give_back_drops(Mesher& m) noexcept {
    if (!m.drop_count) return;
    const surface::Field& f = *m.input.field;
    while (m.drop_count) {
        const uint32_t i = --m.drop_count;
        const SmallDrop& drop = m.drops[i];
        f.dx[i] = drop.centre[0], f.dy[i] = drop.centre[1], f.dz[i] = drop.centre[2], f.radius[i] = drop.radius, f.reach[i] = drop.reach;
        for (int k = 0; k < 6; ++k) f.inverse[k][i] = drop.inverse[k];
    }
    surface::bound_drops(f);
}

uint32_t vertices_of(const SmallDrop& drop) noexcept {
    uint32_t count = 0;
    with_mesh(drop.mesh, [&](const auto& ball) { count = ball.vertex_count; });
    return count;
}
uint32_t indices_of(const SmallDrop& drop) noexcept {
    uint32_t count = 0;
    with_mesh(drop.mesh, [&](const auto& ball) { count = 3 * ball.triangle_count; });
    return count;
}

void cover(const SmallDrop& drop, Range& range) noexcept {
    with_mesh(drop.mesh, [&](const auto& ball) { cover_drop(drop, ball, range); });
}

uint32_t prepare_small_drops(void* mesher) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    return m.input.target ? tasks_of(m.drops_kept, drops_per_task) : 0;
}

void run_small_drops(void* mesher, uint32_t task, uint32_t) {
    const Mesher& m = *static_cast<Mesher*>(mesher);
    for_tiles(task, drops_per_task, m.drops_kept, [&](uint32_t i) {
        with_mesh(m.drops[i].mesh, [&](const auto& ball) { write_drop(m, i, ball); });
    });
}

}  // namespace rill
