// SPDX-License-Identifier: MIT
#include "tracks/surface_response.h"

#include <algorithm>
#include <cmath>

#include "surface/field_kernels.h"
#include "surface/field_rules.h"
#include "tracks/pipeline.h"

namespace rill::cooker {
namespace {

constexpr float least_share = 0.05f;  // .01: a twentieth of the cook's time more, bytes at equal p99 the same

/// One patch's fit of a quadratic through its neighbours.
struct PatchFit {
    struct Neighbour {
        uint32_t point;
        glm::dvec3 row;  ///< its monomials, weighted
        double x, y, height;
    };
    std::vector<Neighbour> neighbours;
    glm::dmat3 inverse{0.0};  ///< of the normal equations; 0: the patch stays flat
    glm::dvec3 quadratic{0.0};  ///< xx, xy, yy: height over the surface has it added

    void begin(double reach, double scale) { reach_ = reach, scale_ = scale, equations_ = glm::dmat3(0.0), neighbours.clear(); }
    void add(uint32_t point, double distance, double x, double y, double height) {
        const double u = distance / reach_, v = 1 - u, weight = v * v * v * v * (4 * u + 1);
        const glm::dvec3 monomials = glm::dvec3(x * x, x * y, y * y) * (scale_ * scale_);
        equations_ += weight * glm::outerProduct(monomials, monomials);
        neighbours.push_back({point, weight * monomials, x, y, height});
    }
    void solve(double support) {
        const double trace = equations_[0][0] + equations_[1][1] + equations_[2][2];
        for (int a = 0; a < 3; ++a) equations_[a][a] += surface::ridge * trace;
        inverse = trace > 0 && glm::determinant(equations_) > 0 ? glm::inverse(equations_) : glm::dmat3(0.0);
        glm::dvec3 q(0);
        for (const Neighbour& n : neighbours) q += by(n) * n.height;
        const double middle = 0.5 * (q.x + q.z), half = 0.5 * (q.x - q.z);
        const double bend = (std::abs(middle) + std::sqrt(half * half + 0.25 * q.y * q.y)) * support;
        const double kept = bend > surface::most_bend ? surface::most_bend / bend : 1;
        inverse *= kept, quadratic = q * kept;
    }
    /// The quadratic per metre of a neighbour's height.
    glm::dvec3 by(const Neighbour& n) const { return inverse * n.row * (-scale_ * scale_); }

private:
    double reach_ = 0, scale_ = 0;
    glm::dmat3 equations_{0.0};
};

}  // namespace

template <class Row>
void SurfaceResponse::Rows<Row>::sort(const std::vector<std::pair<uint32_t, Row>>& rows, size_t points) {
    first.assign(points + 1, 0);
    for (const auto& [point, r] : rows) ++first[point + 1];
    for (size_t i = 0; i < points; ++i) first[i + 1] += first[i];
    row.resize(rows.size());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (const auto& [point, r] : rows) row[next[point]++] = r;
}

SurfaceResponse::SurfaceResponse(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points, float credible)
    : residual(measure_residual(frame, points).distance), area(frame.area) {
    for (const SurfacePoint& p : points) tangents.push_back(tangent_frame(p.normal));
    for (size_t v = 0; v < area.size(); ++v)
        if (std::fabs(residual[v]) > credible) area[v] = 0;
    twists_.assign(points.size(), {}), curvature.assign(points.size(), glm::vec3(0));
    if (points.empty()) return;
    const PointField decoded(points);
    find_shares(frame, points, decoded.field);
    find_bends(points, decoded.field);
}

void SurfaceResponse::find_shares(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points, const surface::Field& field) {
    std::vector<std::pair<uint32_t, Share>> shares;
    std::vector<uint32_t> candidates(field.point_count);
    std::vector<float> weight(field.point_count);
    const auto normal_of = [](const surface::Patch& p) { return glm::vec3(p.nx, p.ny, p.nz); };
    const auto add_vertex = [&](uint32_t v, uint32_t count) {
        const glm::vec3& place = frame.mesh.positions[v];
        float nearest = INFINITY, sum = 0;
        glm::vec3 facing(0);
        for (uint32_t c = 0; c < count; ++c) {
            const surface::Patch& patch = field.patches[candidates[c]];
            const glm::vec3 r = place - glm::vec3(patch.x, patch.y, patch.z);
            const float h = glm::dot(normal_of(patch), r), d2 = glm::dot(r, r);
            const float u2 = (d2 + surface::flatten * h * h) * patch.inverse, left = std::max(1 - u2, 0.f);
            weight[c] = left * left * left / (u2 + surface::soften);
            if (left > 0 && d2 < nearest) nearest = d2, facing = normal_of(patch);
        }
        for (uint32_t c = 0; c < count; ++c) {
            if (weight[c] == 0) continue;
            const float agree = glm::dot(normal_of(field.patches[candidates[c]]), facing);
            const float gate = std::clamp((agree - surface::opposed) * surface::gate_scale, 0.f, 1.f);
            sum += weight[c] *= gate * gate;
        }
        for (uint32_t c = 0; c < count; ++c) {
            if (!(weight[c] > least_share * sum)) continue;
            const uint32_t i = field.source[candidates[c]];
            const glm::vec3 r = place - points[i].position;
            const float share = weight[c] / sum, x = glm::dot(r, tangents[i].t1), y = glm::dot(r, tangents[i].t2);
            shares.push_back({i, {v, share, share * x, share * y, share * glm::vec3(x * x, x * y, y * y)}});
        }
    };
    for (const VertexGroup& group : frame.groups) {
        const surface::Box box{{group.lower.x, group.lower.y, group.lower.z}, {group.upper.x, group.upper.y, group.upper.z}};
        const uint32_t count = surface::gather(field, box, candidates.data(), field.point_count);
        for (uint32_t i = 0; i < group.count; ++i)
            if (const uint32_t v = frame.order[group.first + i]; area[v] > 0) add_vertex(v, count);
    }
    shares_.sort(shares, points.size());
}

void SurfaceResponse::find_bends(const std::vector<SurfacePoint>& points, const surface::Field& field) {
    std::vector<std::pair<uint32_t, Bend>> bends;
    surface::Nearest near;
    PatchFit fit;
    const auto add_patch = [&](uint32_t i, uint32_t lane) {
        const auto there = [&](uint32_t k) { return near.d2[k][lane] < near.beyond; };
        float last2 = 0;
        for (uint32_t k = 0; k < surface::most_neighbours; ++k)
            if (there(k)) last2 = near.d2[k][lane];
        if (last2 == 0) return;
        const uint32_t own = field.source[i];
        const SurfacePoint& centre = points[own];
        fit.begin(surface::fit_reach * std::sqrt(last2), surface::support_scale / field.support[i]);
        for (uint32_t k = 0; k < surface::most_neighbours; ++k) {
            if (!there(k)) continue;
            const uint32_t other = field.source[near.id[k][lane]];
            const glm::vec3 r = points[other].position - centre.position;
            fit.add(other, std::sqrt(near.d2[k][lane]), glm::dot(r, tangents[own].t1), glm::dot(r, tangents[own].t2), glm::dot(r, centre.normal));
        }
        fit.solve(field.support[i]);
        curvature[own] = glm::vec3(-2 * fit.quadratic.x, -fit.quadratic.y, -2 * fit.quadratic.z);
        glm::dvec3 moved(0), turned[2] = {glm::dvec3(0), glm::dvec3(0)};
        for (const PatchFit::Neighbour& n : fit.neighbours) {
            const glm::dvec3 by = fit.by(n);
            moved -= by, turned[0] += by * n.x, turned[1] += by * n.y;
            bends.push_back({n.point, {own, glm::vec3(by) * glm::dot(points[n.point].normal, centre.normal)}});
        }
        bends.push_back({own, {own, glm::vec3(moved)}});
        twists_[own] = {glm::vec3(turned[0]), glm::vec3(turned[1])};
    };
    for (uint32_t first = 0; first < field.point_count; first += surface::lanes) {
        field.kernels->nearest(field, first / surface::lanes, near);
        for (uint32_t i = first; i < std::min(field.point_count, first + surface::lanes); ++i) add_patch(i, i - first);
    }
    bends_.sort(bends, points.size());
}

void SurfaceResponse::of(uint32_t point, std::vector<Response>& out, std::vector<uint32_t>& slots) const {
    constexpr uint32_t none = ~0u;
    if (slots.size() < residual.size()) slots.resize(residual.size(), none);
    out.clear();
    const auto slot = [&](uint32_t v) -> glm::vec3& {
        if (slots[v] == none) slots[v] = uint32_t(out.size()), out.push_back({v, glm::vec3(0)});
        return out[slots[v]].by;
    };
    for (uint32_t k = shares_.first[point]; k < shares_.first[point + 1]; ++k) {
        const Share& s = shares_.row[k];
        slot(s.vertex) += glm::vec3(-s.share, s.x, s.y);
    }
    for (uint32_t b = bends_.first[point]; b < bends_.first[point + 1]; ++b) {
        const Bend& bend = bends_.row[b];
        for (uint32_t k = shares_.first[bend.patch]; k < shares_.first[bend.patch + 1]; ++k) {
            const Share& s = shares_.row[k];
            glm::vec3& by = slot(s.vertex);
            by.x += glm::dot(s.monomials, bend.by);
            if (bend.patch != point) continue;
            by.y += glm::dot(s.monomials, twists_[point][0]), by.z += glm::dot(s.monomials, twists_[point][1]);
        }
    }
    for (const Response& r : out) slots[r.vertex] = none;
}

SurfaceResponse::Grip SurfaceResponse::grip_of(uint32_t point) const {
    Grip grip;
    for (uint32_t k = shares_.first[point]; k < shares_.first[point + 1]; ++k) {
        const double share = shares_.row[k].share, part = share * double(area[shares_.row[k].vertex]);
        grip.area += part, grip.square += part * share;
    }
    return grip;
}

}  // namespace rill::cooker
