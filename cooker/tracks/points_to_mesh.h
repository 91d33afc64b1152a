// SPDX-License-Identifier: MIT
// What a set of points decodes to, as the runtime would draw it.
#pragma once
#include <cstddef>
#include <memory>
#include <vector>

#include "common/mesh.h"
#include "frames/surface_frame.h"
#include "surface/field.h"

namespace rill::cooker {

/// What the runtime's memory is made of: it wants 64-byte alignment.
struct alignas(64) CacheLine {
    std::byte bytes[64];
};

/// Points row by row, as the runtime takes them, all of them active.
class PointRows {
public:
    explicit PointRows(const std::vector<SurfacePoint>& points);
    /// Inactive ones that follow.
    void add_room(size_t count);
    format::PointSet set();

private:
    std::vector<float> rows_[10];
};

/// The runtime's field over a vector of points, memory included. Drops are left out.
class PointField {
public:
    explicit PointField(const std::vector<SurfacePoint>& points, int jobs = 1);
    PointField(const PointField&) = delete;
    surface::Field field;
    /// Its value at each position, metres: negative in the liquid.
    std::vector<float> values_at(const std::vector<float>& x, const std::vector<float>& y, const std::vector<float>& z) const;

protected:
    /// With room for so many more points; nothing is fitted yet.
    PointField(const std::vector<SurfacePoint>& points, size_t room);

private:
    std::unique_ptr<CacheLine[]> memory_;
};

/// The runtime's mesh of the points, with cells of that size (metres): positions and triangles.
/// `about`: how many vertices to expect, for speed.
Mesh mesh_points(const std::vector<SurfacePoint>& points, float cell, int jobs = 1, size_t about = 0);

}  // namespace rill::cooker
