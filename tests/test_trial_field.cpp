// SPDX-License-Identifier: MIT
// A trial is what a field of its own would be, and leaves no trace.
#include <doctest/doctest.h>

#include <random>

#include "tracks/trial_field.h"

using namespace rill;
using namespace rill::cooker;

namespace {

/// Points evenly spread over a ball, and some anywhere on it.
std::vector<SurfacePoint> ball(uint32_t count) {
    std::vector<SurfacePoint> points(count);
    for (uint32_t i = 0; i < count; ++i) {
        const float z = 1 - 2 * (float(i) + 0.5f) / float(count), r = std::sqrt(1 - z * z), turn = 2.399963f * float(i);
        points[i].position = points[i].normal = {r * std::cos(turn), r * std::sin(turn), z};
    }
    return points;
}
std::vector<SurfacePoint> anywhere(uint32_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    std::vector<SurfacePoint> points(count);
    for (SurfacePoint& p : points) {
        p.normal = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
        p.position = 1.02f * p.normal;
    }
    return points;
}
/// At places round the ball.
std::vector<float> values(const PointField& field) {
    std::vector<float> x, y, z;
    std::mt19937 random(5);
    std::uniform_real_distribution<float> height(0.9f, 1.1f);
    for (const SurfacePoint& p : ball(400)) {
        const glm::vec3 at = height(random) * p.position;
        x.push_back(at.x), y.push_back(at.y), z.push_back(at.z);
    }
    return field.values_at(x, y, z);
}
std::vector<SurfacePoint> joined(std::vector<SurfacePoint> a, const std::vector<SurfacePoint>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}
/// How many of the values are farther apart than rounding.
int apart(const std::vector<float>& a, const std::vector<float>& b) {
    int count = 0;
    for (size_t i = 0; i < a.size(); ++i) count += !(std::fabs(a[i] - b[i]) <= 1e-5f);
    return count;
}

}  // namespace

TEST_CASE("with points added a field decodes to what it would with them from the start") {
    for (const uint32_t count : {100u, 333u, 700u}) {
        const std::vector<SurfacePoint> points = ball(count), added = anywhere(3, 99);
        TrialField field(points, added.size());
        CHECK(apart(values(field), values(PointField(points))) == 0);
        field.add(added);
        CHECK(field.field.point_count == count + added.size());
        CAPTURE(count);
        CHECK(apart(values(field), values(PointField(joined(points, added)))) == 0);
        CHECK(apart(values(field), values(PointField(points))) > 10);
    }
}

TEST_CASE("what is taken back leaves no trace") {
    const std::vector<SurfacePoint> points = ball(333);
    TrialField field(points, 4);
    const std::vector<float> before = values(field);
    for (uint32_t seed = 0; seed < 8; ++seed) {
        field.add(anywhere(1 + seed % 4, seed));
        field.take_back();
        CHECK(values(field) == before);
    }
}

TEST_CASE("fields for many threads are one and the same, also after points were kept") {
    const std::vector<SurfacePoint> points = ball(200), kept = anywhere(2, 8), tried = anywhere(1, 9);
    TrialFields fields(points, 4);
    std::vector<float> early, late, fresh, nested;
    fields.with({}, [&](const PointField& field) { early = values(field); });
    CHECK(early == values(TrialField(points, 4)));
    fields.keep(kept);
    fields.with(tried, [&](const PointField& field) {
        late = values(field);
        fields.with(tried, [&](const PointField& other) { nested = values(other); });  // while the first is at work: another
    });
    TrialField own(points, 4);
    own.add(kept);
    own.add(tried);
    CHECK(late == values(own));
    CHECK(nested == late);
}
