// SPDX-License-Identifier: MIT
// Whether decoded liquid is too thin, told from balls of known size.
#include <doctest/doctest.h>

#include "shapes.h"
#include "tracks/mean_depth.h"

using namespace rill;
using namespace rill::cooker;

namespace {
constexpr float edge = 0.06f;  // of a ball of radius 1 in 96 segments
float depth(const Mesh& source, const Mesh& decoded, const surface::Container& container = surface::everywhere) {
    return mean_depth(SurfaceFrame(source, edge), decoded, container, 2) / edge;
}
}  // namespace

TEST_CASE("a ball that is too small lies inside, one that is too large outside") {
    const Mesh source = sphere(96, 1);
    for (const float off : {-0.3f, -0.05f, 0.f, 0.05f, 0.3f}) {
        CAPTURE(off);
        CHECK(depth(source, sphere(96, 1 - off * edge)) == doctest::Approx(off).epsilon(0.03).scale(0.01));
    }
}

TEST_CASE("liquid that is lost or that nobody has is not what the rest lies inside of") {
    Mesh two = sphere(96, 1);
    append(two, sphere(48, 0.5f, {2, 0, 0}));
    const Mesh one = sphere(96, 1 - 0.1f * edge);
    CHECK(depth(two, one) > 0.1f);  // a little of it counts
    CHECK(depth(two, one) < 0.125f);
    Mesh false_liquid = one;
    append(false_liquid, sphere(48, 0.5f, {2, 0, 0}));
    CHECK(depth(sphere(96, 1), false_liquid) < 0.1f);
    CHECK(depth(sphere(96, 1), false_liquid) > 0.075f);
}

TEST_CASE("of thin liquid, that counts for a quarter of a per cent of its volume at most") {
    Mesh sheet = sphere(96, 1);
    for (glm::vec3& x : sheet.positions) x.z *= 0.04f;
    Mesh with_more = sheet;
    append(with_more, sphere(48, 0.3f, {2, 0, 0}));
    const double volume_over_area = 0.04 * 4 / 3 * 3.14 / 6.3;
    CHECK(depth(with_more, sheet) > 0);
    CHECK(depth(with_more, sheet) * edge < 0.004 * volume_over_area);  // the ball has volume and surface, too
}

TEST_CASE("what lies beyond a wall is nobody's concern") {
    surface::Container half = surface::everywhere;
    half.lower[0] = 0;
    const Mesh source = sphere(96, 1);
    Mesh decoded = source;
    for (glm::vec3& x : decoded.positions)
        if (x.x < -0.1f) x *= 0.5f;
    CHECK(std::abs(depth(source, decoded, half)) < 0.01f);
    CHECK(depth(source, decoded) > 0.01f);
}

TEST_CASE("nothing decoded, or no source") {
    CHECK(std::abs(depth(sphere(96, 1), {})) <= 0.02f);
    CHECK(depth({}, sphere(96, 1)) == 0);
}
