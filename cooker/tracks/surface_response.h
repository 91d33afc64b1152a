// SPDX-License-Identifier: MIT
// What moving and turning points does to the decoded surface at the source's vertices, to first order: heights and slopes
// of their patches, blended with the weights they have, and the quadratics of the neighbours that are fitted through them.
#pragma once
#include <array>
#include <vector>

#include "tracks/points_to_mesh.h"

namespace rill::cooker {

/// What a point does to the residual of one vertex: per metre along its normal, per tilt towards either tangent.
struct Response {
    uint32_t vertex;
    glm::vec3 by;
};

class SurfaceResponse {
public:
    /// Vertices whose residual is more than `credible` metres take no part: they are another sheet's, or for a birth to mend.
    SurfaceResponse(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points, float credible);
    std::vector<float> residual;          ///< per vertex, metres: Residual::distance
    std::vector<float> area;              ///< per vertex, m²; 0: takes no part
    std::vector<TangentFrame> tangents;   ///< per point: its tilts are along these
    std::vector<glm::vec3> curvature;     ///< per point, 1/m: xx, xy, yy of its patch, along its tangents, up along its normal
    /// All that the point does. `slots` is memory for the caller to keep between calls.
    void of(uint32_t point, std::vector<Response>& out, std::vector<uint32_t>& slots) const;
    /// Sums over the vertices: area × the point's share, area × share², m².
    struct Grip {
        double area = 0, square = 0;
    };
    Grip grip_of(uint32_t point) const;

private:
    /// A patch's share in the surface at a vertex, and that times where the vertex is on its tangents, x and y, and times xx, xy and yy.
    struct Share {
        uint32_t vertex;
        float share, x, y;
        glm::vec3 monomials;
    };
    /// What a point does to the quadratic of a patch (xx, xy, yy), per metre along the point's normal.
    struct Bend {
        uint32_t patch;
        glm::vec3 by;
    };
    /// Rows of one kind, by point.
    template <class Row>
    struct Rows {
        std::vector<uint32_t> first;
        std::vector<Row> row;
        void sort(const std::vector<std::pair<uint32_t, Row>>& rows, size_t points);
    };
    void find_shares(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points, const surface::Field& field);
    void find_bends(const std::vector<SurfacePoint>& points, const surface::Field& field);
    Rows<Share> shares_;
    Rows<Bend> bends_;
    std::vector<std::array<glm::vec3, 2>> twists_;  ///< what a point does to its own quadratic, per tilt
};

}  // namespace rill::cooker
