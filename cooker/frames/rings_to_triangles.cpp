// SPDX-License-Identifier: MIT
// GLU's tessellator knows every outline there is, but makes slivers from one end to the other: it gets the margin alone, and what it
// makes of that is turned into Delaunay's triangles by Lawson's flips. (Slivers halved until none is long: forty times as many
// triangles; turned and halved by turns: ten times.)
#include "frames/rings_to_triangles.h"

#include <GL/glu.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <new>
#include <unordered_map>

#include "common/mesh_edges.h"

namespace rill::cooker {
namespace {

constexpr size_t most_turns = 1000;    // a triangle: more than any margin needs
constexpr double most_squares = 2048;  // along a side: larger where it is longer

/// Squares that rings go round, none of them near one.
class Squares {
public:
    Squares(Mesh& mesh, const std::vector<Ring>& rings, const FlatPlane& plane, float pitch) : mesh_(mesh), plane_(plane), pitch_(pitch) {
        for (const Ring& ring : rings)
            for (size_t i = 0; i < ring.size(); ++i) {
                const glm::dvec2 a = at(ring[i]), b = at(ring[(i + 1) % ring.size()]);
                lower_ = glm::min(lower_, a), upper_ = glm::max(upper_, a), lines_.push_back({a, b});
            }
        if (lines_.empty()) return;
        const glm::dvec2 size = upper_ - lower_;
        pitch_ = std::max({pitch_, size.x / most_squares, size.y / most_squares});
        first_ = glm::ivec2(glm::floor(lower_ / pitch_));
        count_ = glm::ivec2(glm::floor(upper_ / pitch_)) - first_ + 1;
        state_.assign(size_t(count_.x) * size_t(count_.y), 0);
        for (int y = 0; y < count_.y; ++y) find_inside(y);
        for (const auto& line : lines_) clear_near(line[0], line[1]);
    }
    /// Adds their triangles to the mesh; returns their outlines, the other way round.
    std::vector<Ring> build() {
        std::unordered_map<uint32_t, std::vector<uint32_t>> after;
        std::vector<uint32_t> starts;
        const auto step = [&](uint32_t from, uint32_t to) { after[from].push_back(to), starts.push_back(from); };
        for (int y = 0; y < count_.y; ++y)
            for (int x = 0; x < count_.x; ++x) {
                if (!has(x, y)) continue;
                const uint32_t a = corner(x, y), b = corner(x + 1, y), c = corner(x + 1, y + 1), d = corner(x, y + 1);
                mesh_.triangles.push_back({a, b, c}), mesh_.triangles.push_back({a, c, d});
                if (!has(x, y - 1)) step(b, a);
                if (!has(x + 1, y)) step(c, b);
                if (!has(x, y + 1)) step(d, c);
                if (!has(x - 1, y)) step(a, d);
            }
        std::vector<Ring> rings;
        for (uint32_t start : starts) {
            Ring ring;
            for (uint32_t v = start; !after[v].empty();) {
                ring.push_back(v);
                const uint32_t next = after[v].back();
                after[v].pop_back(), v = next;
            }
            if (!ring.empty()) rings.push_back(std::move(ring));
        }
        return rings;
    }

private:
    glm::dvec2 at(uint32_t v) const { return {mesh_.positions[v][plane_.u], mesh_.positions[v][plane_.v]}; }
    size_t index(int x, int y) const { return size_t(y) * size_t(count_.x) + size_t(x); }
    bool has(int x, int y) const { return x >= 0 && y >= 0 && x < count_.x && y < count_.y && state_[index(x, y)]; }

    /// Squares of a row whose middles have a winding number of one or more.
    void find_inside(int y) {
        const double height = (first_.y + y + 0.5) * pitch_;
        std::vector<std::pair<double, int>> crossings;
        for (const auto& [a, b] : lines_)
            if ((a.y <= height) != (b.y <= height)) crossings.emplace_back(a.x + (height - a.y) / (b.y - a.y) * (b.x - a.x), a.y > height ? 1 : -1);
        std::sort(crossings.begin(), crossings.end());
        size_t next = 0;
        int winding = 0;
        for (int x = 0; x < count_.x; ++x) {
            for (; next < crossings.size() && crossings[next].first < (first_.x + x + 0.5) * pitch_; ++next) winding += crossings[next].second;
            state_[index(x, y)] = winding > 0;
        }
    }
    /// The squares that a line goes through, and all beside them, are the margin.
    void clear_near(const glm::dvec2& a, const glm::dvec2& b) {
        const int steps = int(std::ceil(2 * glm::distance(a, b) / pitch_)) + 1;
        for (int i = 0; i <= steps; ++i) {
            const glm::ivec2 square = glm::ivec2(glm::floor(glm::mix(a, b, double(i) / steps) / pitch_)) - first_;
            for (int y = std::max(square.y - 1, 0); y <= std::min(square.y + 1, count_.y - 1); ++y)
                for (int x = std::max(square.x - 1, 0); x <= std::min(square.x + 1, count_.x - 1); ++x) state_[index(x, y)] = 0;
        }
    }
    uint32_t corner(int x, int y) {
        const auto [at, is_new] = corners_.try_emplace(uint64_t(y) << 32 | uint32_t(x), uint32_t(mesh_.positions.size()));
        if (is_new) {
            glm::vec3 place(plane_.place);
            place[plane_.u] = float((first_.x + x) * pitch_), place[plane_.v] = float((first_.y + y) * pitch_);
            mesh_.positions.push_back(place);
            if (!mesh_.velocities.empty()) mesh_.velocities.emplace_back(0);
        }
        return at->second;
    }

    Mesh& mesh_;
    const FlatPlane plane_;
    double pitch_;
    glm::dvec2 lower_{HUGE_VAL}, upper_{-HUGE_VAL};
    glm::ivec2 first_{0}, count_{0};
    std::vector<std::array<glm::dvec2, 2>> lines_;
    std::vector<uint8_t> state_;  ///< of a square: whether it is one
    std::unordered_map<uint64_t, uint32_t> corners_;
};

/// GLU's tessellator, writing triangles of vertex numbers.
class Tessellator {
public:
    Tessellator(Mesh& mesh, const FlatPlane& plane, float within) : mesh_(mesh), plane_(plane), within_(within), glu_(gluNewTess(), gluDeleteTess) {
        if (!glu_) throw std::bad_alloc();
        using Callback = void (*)();
        gluTessProperty(glu_.get(), GLU_TESS_WINDING_RULE, GLU_TESS_WINDING_POSITIVE);
        gluTessNormal(glu_.get(), 0, 0, 1);
        gluTessCallback(glu_.get(), GLU_TESS_VERTEX_DATA, reinterpret_cast<Callback>(&take_vertex));
        gluTessCallback(glu_.get(), GLU_TESS_EDGE_FLAG_DATA, reinterpret_cast<Callback>(&take_edge_flag));
        gluTessCallback(glu_.get(), GLU_TESS_COMBINE_DATA, reinterpret_cast<Callback>(&combine));
    }
    std::vector<Triangle> run(const std::vector<Ring>& rings) {
        std::deque<std::array<GLdouble, 3>> places;  // GLU may keep pointers to them
        gluTessBeginPolygon(glu_.get(), this);
        for (const Ring& ring : rings) {
            gluTessBeginContour(glu_.get());
            for (uint32_t v : ring) {
                places.push_back({mesh_.positions[v][plane_.u], mesh_.positions[v][plane_.v], 0});
                gluTessVertex(glu_.get(), places.back().data(), handle_of(v));
            }
            gluTessEndContour(glu_.get());
        }
        gluTessEndPolygon(glu_.get());
        std::vector<Triangle> triangles;
        for (size_t i = 0; i + 2 < corners_.size(); i += 3) {
            const Triangle t = {corners_[i], corners_[i + 1], corners_[i + 2]};
            if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
        }
        return triangles;
    }

private:
    // A null pointer would be no vertex.
    static void* handle_of(uint32_t v) { return reinterpret_cast<void*>(uintptr_t(v) + 1); }
    static uint32_t vertex_of(const void* handle) { return uint32_t(reinterpret_cast<uintptr_t>(handle) - 1); }

    static void take_vertex(void* vertex, void* self) { static_cast<Tessellator*>(self)->corners_.push_back(vertex_of(vertex)); }
    static void take_edge_flag(GLboolean, void*) {}  // there, so that it makes triangles, no strips and fans
    /// The vertex where rings cross or touch: one of theirs, if it stands there.
    static void combine(GLdouble place[3], void* near[4], GLfloat[4], void** out, void* self) {
        Tessellator& c = *static_cast<Tessellator*>(self);
        glm::vec3 x(c.plane_.place);
        x[c.plane_.u] = float(place[0]), x[c.plane_.v] = float(place[1]);
        for (int k = 0; k < 4; ++k)
            if (near[k] && glm::distance(c.mesh_.positions[vertex_of(near[k])], x) <= c.within_) {
                *out = near[k];
                return;
            }
        c.mesh_.positions.push_back(x);
        if (!c.mesh_.velocities.empty()) c.mesh_.velocities.emplace_back(0);
        *out = handle_of(uint32_t(c.mesh_.positions.size() - 1));
    }

    Mesh& mesh_;
    const FlatPlane plane_;
    const float within_;
    std::unique_ptr<GLUtesselator, void (*)(GLUtesselator*)> glu_;
    std::vector<uint32_t> corners_;
};

/// Turns edges between two triangles of a flat mesh whose far corners add up to more than two right angles, until there are none.
class Turning {
public:
    Turning(Mesh& flat, const FlatPlane& plane) : flat_(flat), plane_(plane), beside_(flat.triangles.size(), {none, none, none}) { find_neighbours(); }
    void run() {
        size_t left = most_turns * flat_.triangles.size();
        for (; !asked_.empty() && left > 0; --left) {
            const auto [triangle, corner] = asked_.back();
            asked_.pop_back();
            turn(triangle, corner);
        }
    }

private:
    static constexpr uint32_t none = ~0u;

    glm::dvec2 at(uint32_t v) const { return {flat_.positions[v][plane_.u], flat_.positions[v][plane_.v]}; }
    static double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

    /// a → b, with c to its left and d to its right.
    bool is_better_turned(uint32_t a, uint32_t b, uint32_t c, uint32_t d) const {
        const glm::dvec2 ca = at(a) - at(c), cb = at(b) - at(c), da = at(a) - at(d), db = at(b) - at(d);
        const double cos_c = glm::dot(ca, cb), sin_c = cross(ca, cb), cos_d = glm::dot(db, da), sin_d = cross(db, da);
        const double size = (glm::length(ca) * glm::length(cb)) * (glm::length(da) * glm::length(db));
        if (!(sin_c * cos_d + cos_c * sin_d < -1e-6 * size)) return false;
        return cross(at(d) - at(a), at(c) - at(a)) > 0 && cross(at(c) - at(b), at(d) - at(b)) > 0;
    }

    void find_neighbours() {
        const std::vector<MeshEdge> edges = sorted_edges(flat_.triangles);
        for (size_t i = 0, next; i < edges.size(); i = next) {
            for (next = i + 1; next < edges.size() && edges[next].ends == edges[i].ends;) ++next;
            const MeshEdge &one = edges[i], &other = edges[next - 1];
            if (next - i != 2 || flat_.triangles[one.triangle][one.corner] == flat_.triangles[other.triangle][other.corner]) continue;
            beside_[one.triangle][one.corner] = other.triangle, beside_[other.triangle][other.corner] = one.triangle;
            asked_.emplace_back(one.triangle, one.corner);
        }
    }

    void replace(uint32_t triangle, uint32_t old, uint32_t now) {
        if (triangle != none) *std::find(beside_[triangle].begin(), beside_[triangle].end(), old) = now;
    }

    void turn(uint32_t i, uint32_t k) {
        const uint32_t j = beside_[i][k];
        if (j == none) return;
        Triangle &t = flat_.triangles[i], &u = flat_.triangles[j];
        const uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
        const auto m = uint32_t(std::find(u.begin(), u.end(), b) - u.begin());
        const uint32_t d = u[(m + 2) % 3];
        if (!is_better_turned(a, b, c, d)) return;
        const uint32_t bc = beside_[i][(k + 1) % 3], ca = beside_[i][(k + 2) % 3], ad = beside_[j][(m + 1) % 3], db = beside_[j][(m + 2) % 3];
        t = {a, d, c}, u = {d, b, c};
        beside_[i] = {ad, j, ca}, beside_[j] = {db, bc, i};
        replace(ad, j, i), replace(bc, i, j);
        asked_.insert(asked_.end(), {{i, 0}, {i, 2}, {j, 0}, {j, 1}});
    }

    Mesh& flat_;
    const FlatPlane plane_;
    std::vector<std::array<uint32_t, 3>> beside_;         ///< by triangle and corner: the triangle beyond the edge that goes on from it
    std::vector<std::pair<uint32_t, uint32_t>> asked_;  ///< triangle and corner
};

}  // namespace

void fill_rings(Mesh& mesh, const std::vector<Ring>& rings, const FlatPlane& plane, float pitch, float within) {
    std::vector<Ring> outlines = Squares(mesh, rings, plane, pitch).build();
    outlines.insert(outlines.end(), rings.begin(), rings.end());
    std::vector<Triangle> rest = Tessellator(mesh, plane, within).run(outlines);
    mesh.triangles.swap(rest);  // the margin alone
    Turning(mesh, plane).run();
    rest.insert(rest.end(), mesh.triangles.begin(), mesh.triangles.end());
    mesh.triangles = std::move(rest);
}

}  // namespace rill::cooker
