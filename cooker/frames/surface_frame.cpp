// SPDX-License-Identifier: MIT
#include "frames/surface_frame.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <numeric>

namespace rill::cooker {
namespace {

struct Cloud {
    const std::vector<glm::vec3>& points;
    size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(size_t i, size_t axis) const { return points[i][glm::length_t(axis)]; }
    template <class Box> bool kdtree_get_bbox(Box&) const { return false; }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, uint32_t>;

/// Cubes of `size`, in the order of their coordinates.
void group_vertices(SurfaceFrame& frame, float size) {
    const auto& p = frame.mesh.positions;
    frame.order.resize(p.size());
    std::iota(frame.order.begin(), frame.order.end(), 0u);
    const auto key = [&](uint32_t v) {
        const glm::ivec3 c(glm::floor(p[v] / size));
        return std::array<int, 3>{c.z, c.y, c.x};
    };
    std::vector<std::array<int, 3>> keys(p.size());
    for (uint32_t v = 0; v < p.size(); ++v) keys[v] = key(v);
    std::sort(frame.order.begin(), frame.order.end(),
              [&](uint32_t a, uint32_t b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; });
    for (uint32_t i = 0; i < frame.order.size();) {
        VertexGroup group{i, 0, p[frame.order[i]], p[frame.order[i]]};
        const auto cell = keys[frame.order[i]];
        for (; i < frame.order.size() && keys[frame.order[i]] == cell && group.count < 256; ++i, ++group.count) {
            group.lower = glm::min(group.lower, p[frame.order[i]]);
            group.upper = glm::max(group.upper, p[frame.order[i]]);
        }
        frame.groups.push_back(group);
    }
}

/// On every sixth vertex's normal, near and farther, wherever no other surface comes close.
void place_probes(SurfaceFrame& frame) {
    for (const VertexGroup& group : frame.groups) {
        frame.first_probe.push_back(uint32_t(frame.probes.size()));
        for (uint32_t i = group.first; i < group.first + group.count; i += 6) {
            const uint32_t v = frame.order[i];
            for (const float edges : {-1.5f, 1.5f, 4.f}) {
                const float away = edges * frame.edge;
                const glm::vec3 x = frame.mesh.positions[v] + away * frame.mesh.normals[v];
                const float clear = 0.7f * std::fabs(away);
                if (frame.index.within(x, clear)) continue;
                frame.probes.push_back({x, v, away > 0});
            }
        }
    }
    frame.first_probe.push_back(uint32_t(frame.probes.size()));
}

}  // namespace

struct VertexTree::Impl {
    Cloud cloud;
    Tree tree;
    explicit Impl(const std::vector<glm::vec3>& points) : cloud{points}, tree(3, cloud, {16}) {}
};
VertexTree::VertexTree(const std::vector<glm::vec3>& points) : impl_(std::make_unique<Impl>(points)) {}
VertexTree::~VertexTree() = default;

void VertexTree::nearest(const glm::vec3& x, size_t count, std::vector<Found>& out) const {
    out.clear();
    thread_local std::vector<uint32_t> ids;
    thread_local std::vector<float> distances;
    ids.resize(count), distances.resize(count);
    const size_t found = impl_->cloud.points.empty() ? 0 : impl_->tree.knnSearch(&x.x, count, ids.data(), distances.data());
    for (size_t i = 0; i < found; ++i) out.push_back({ids[i], distances[i]});
    std::sort(out.begin(), out.end(), [](const Found& a, const Found& b) {
        return a.distance2 != b.distance2 ? a.distance2 < b.distance2 : a.vertex < b.vertex;
    });
}

void VertexTree::within(const glm::vec3& x, float radius, std::vector<Found>& out) const {
    out.clear();
    if (impl_->cloud.points.empty()) return;
    thread_local std::vector<std::pair<uint32_t, float>> found;
    nanoflann::SearchParams parameters;
    parameters.sorted = false;
    impl_->tree.radiusSearch(&x.x, radius * radius, found, parameters);
    for (const auto& [vertex, distance2] : found) out.push_back({vertex, distance2});
}

SurfaceFrame::SurfaceFrame(Mesh source, float edge_length, std::vector<Drop> pieces)
    : mesh(std::move(source)), drops(std::move(pieces)), area(vertex_areas(mesh)), tree(mesh.positions), index(mesh), edge(edge_length) {
    if (mesh.normals.empty()) mesh.normals = vertex_normals(mesh);
    group_vertices(*this, 6 * edge);
    place_probes(*this);
}

bool settle(const SurfaceFrame& frame, float radius, SurfacePoint& point) {
    constexpr float faces_alike = 0.4f;
    thread_local std::vector<VertexTree::Found> found;
    frame.tree.within(point.position, radius, found);
    const glm::dvec3 n = point.normal;
    const glm::dvec3 t1 = glm::normalize(std::abs(n.z) < 0.9 ? glm::cross(n, glm::dvec3(0, 0, 1)) : glm::cross(n, glm::dvec3(1, 0, 0)));
    const glm::dvec3 t2 = glm::cross(n, t1);
    Eigen::Matrix<double, 6, 6> m = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> rhs = Eigen::Matrix<double, 6, 1>::Zero();
    glm::dvec3 velocity(0);
    double total = 0;
    int rows = 0;
    for (const auto& [v, d2] : found) {
        if (glm::dot(glm::dvec3(frame.mesh.normals[v]), n) < faces_alike) continue;
        const glm::dvec3 r = glm::dvec3(frame.mesh.positions[v] - point.position) / double(radius);
        const double u = std::sqrt(double(d2)) / radius, k = 1 - u;
        const double w = frame.area[v] * k * k * k * k * (4 * u + 1);
        if (!(w > 0)) continue;
        const double x = glm::dot(r, t1), y = glm::dot(r, t2), h = glm::dot(r, n);
        Eigen::Matrix<double, 6, 1> row;
        row << 1, x, y, x * x, x * y, y * y;
        m.selfadjointView<Eigen::Lower>().rankUpdate(row, w);
        rhs += w * h * row;
        if (!frame.mesh.velocities.empty()) velocity += w * glm::dvec3(frame.mesh.velocities[v]);
        total += w;
        ++rows;
    }
    if (rows < 4) return false;
    m = m.selfadjointView<Eigen::Lower>();
    // Few rows give a plane, or a constant, rather than a wild patch: ridge grows with the order.
    const double k = total * 1e-5;
    m.diagonal() += Eigen::Matrix<double, 6, 1>(0, k, k, 10 * k, 10 * k, 10 * k);
    const Eigen::Matrix<double, 6, 1> fit = m.ldlt().solve(rhs);
    if (!fit.allFinite() || std::abs(fit[0]) > 1) return false;
    point.position += glm::vec3(n * (fit[0] * radius));
    point.normal = glm::vec3(glm::normalize(n - fit[1] * t1 - fit[2] * t2));
    point.velocity = glm::vec3(velocity / total);
    return true;
}

float depth_at(const SurfaceFrame& frame, const glm::vec3& x, float most, SurfaceIndex::Near* near) {
    const SurfaceIndex::Hit hit = frame.index.closest(x, most, near);
    if (!(hit.distance < most)) return 0;
    const Triangle& t = frame.mesh.triangles[hit.triangle];
    return glm::dot(value_at(hit, t, frame.mesh.normals), x - hit.point) > 0 ? -hit.distance : hit.distance;
}

}  // namespace rill::cooker
