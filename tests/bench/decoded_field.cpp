// SPDX-License-Identifier: MIT
#include "decoded_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rill::bench {

DecodedField::DecodedField(const std::vector<Point>& points) {
    const uint32_t n = uint32_t(points.size());
    for (auto& row : rows_) row.assign(n, 0);
    for (uint32_t i = 0; i < n; ++i) {
        for (int a = 0; a < 3; ++a) {
            rows_[a][i] = float(points[i].position[a]);
            rows_[3 + a][i] = float(points[i].normal[a]);
        }
        rows_[9][i] = 1;
    }
    const format::PointSet set{n,
                               rows_[0].data(), rows_[1].data(), rows_[2].data(),
                               rows_[3].data(), rows_[4].data(), rows_[5].data(),
                               rows_[6].data(), rows_[7].data(), rows_[8].data(), rows_[9].data()};
    memory_.resize(surface::field_bytes(n, 0) + 64);
    const uintptr_t block = (reinterpret_cast<uintptr_t>(memory_.data()) + 63) & ~uintptr_t(63);
    surface::begin_field(field_, reinterpret_cast<void*>(block), set, format::DropSet{});
    surface::fit_patches(field_, 0, field_.point_count);
    surface::finish_field(field_);
}

std::vector<DecodedField::Sample> DecodedField::evaluate(const std::vector<glm::dvec3>& positions) const {
    constexpr size_t batch = 32;
    std::vector<Sample> samples(positions.size());
    std::vector<uint32_t> candidates(field_.point_count);
    float x[3][batch], value[batch], gradient[3][batch];
    for (size_t first = 0; first < positions.size(); first += batch) {
        const uint32_t n = uint32_t(std::min(batch, positions.size() - first));
        surface::Box box{{1e30f, 1e30f, 1e30f}, {-1e30f, -1e30f, -1e30f}};
        for (uint32_t i = 0; i < n; ++i)
            for (int a = 0; a < 3; ++a) {
                x[a][i] = float(positions[first + i][a]);
                box.lower[a] = std::min(box.lower[a], x[a][i]);
                box.upper[a] = std::max(box.upper[a], x[a][i]);
            }
        const uint32_t found = surface::gather(field_, box, candidates.data(), uint32_t(candidates.size()));
        surface::evaluate_gradient(field_, candidates.data(), found, x[0], x[1], x[2], n, value, gradient[0],
                                   gradient[1], gradient[2], nullptr);
        for (uint32_t i = 0; i < n; ++i)
            samples[first + i] = {value[i], {gradient[0][i], gradient[1][i], gradient[2][i]}};
    }
    return samples;
}

std::vector<double> DecodedField::distances(const std::vector<glm::dvec3>& positions) const {
    std::vector<double> out;
    for (const Sample& s : evaluate(positions)) {
        const double slope = glm::length(s.gradient);
        out.push_back(slope > 0 ? s.value / slope : std::numeric_limits<double>::infinity());
    }
    return out;
}

std::vector<double> DecodedField::distances_along(const std::vector<glm::dvec3>& positions,
                                                  const std::vector<glm::dvec3>& directions) const {
    std::vector<double> t(positions.size(), 0.0);
    std::vector<glm::dvec3> at = positions;
    for (int step = 0; step < 5; ++step) {
        const std::vector<Sample> samples = evaluate(at);
        for (size_t i = 0; i < at.size(); ++i) {
            const double slope = glm::length(samples[i].gradient);
            const double along = glm::dot(samples[i].gradient, directions[i]);
            // A surface seen edge-on would send Newton's method far away: no steeper than 3 : 1.
            t[i] = slope > 0 ? t[i] - samples[i].value / std::max(along, slope / 3)
                             : std::numeric_limits<double>::infinity();
            at[i] = positions[i] + (slope > 0 ? t[i] : 0.0) * directions[i];
        }
    }
    for (double& distance : t) distance = std::fabs(distance);
    return t;
}

}  // namespace rill::bench
