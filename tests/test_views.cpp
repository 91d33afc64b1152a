// SPDX-License-Identifier: MIT
// What a camera sees and what that costs: bytes, points and cells follow the frustum and the distance, and nothing in
// sight is missing, torn, or different from what a wider view shows.
#include "harness.h"

#include <map>
#include <random>

using namespace harness;
using rill::Status;

namespace {

/// Fine enough in blocks that a corner of the ball is a corner of the file.
const Bytes& blocky_ball() {
    static const Bytes bytes = [] {
        Clip clip;
        clip.frames = 9, clip.points = 12000, clip.across = 6, clip.layers = 4;
        return make_ball(clip);
    }();
    return bytes;
}

void set_identity(float (&m)[12]) {
    for (int i = 0; i < 12; ++i) m[i] = i % 5 == 0 ? 1.0f : 0.0f;
}

/// All of space seen from `eye`; planes are then cut in.
rill::View everything(glm::vec3 eye) {
    rill::View view{};
    for (auto& plane : view.planes) plane[3] = 1;
    for (int a = 0; a < 3; ++a) view.eye[a] = eye[a];
    view.pixels_per_radian = 1000;
    return view;
}

/// A camera at `eye` that looks at `at`: four planes through the eye, near and far.
rill::View looking(glm::vec3 eye, glm::vec3 at, float half_angle) {
    rill::View view = everything(eye);
    const glm::vec3 ahead = glm::normalize(at - eye);
    const glm::vec3 side = glm::normalize(glm::cross(ahead, std::abs(ahead.z) < 0.9f ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0)));
    const glm::vec3 up = glm::cross(side, ahead);
    const float c = std::cos(half_angle), s = std::sin(half_angle);
    const glm::vec3 normals[5] = {s * ahead + c * side, s * ahead - c * side, s * ahead + c * up, s * ahead - c * up, ahead};
    for (int p = 0; p < 5; ++p) {
        for (int a = 0; a < 3; ++a) view.planes[p][a] = normals[p][a];
        view.planes[p][3] = -glm::dot(normals[p], eye);
    }
    return view;
}

bool sees(const rill::View& view, glm::vec3 p, float margin = 0) {
    for (const auto& plane : view.planes)
        if (plane[0] * p.x + plane[1] * p.y + plane[2] * p.z + plane[3] < margin) return false;
    return true;
}

/// Edges of one triangle only, with both ends in sight.
size_t open_edges_in_sight(const Playing& playing, const rill::View& view, size_t* repeated) {
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    for (uint32_t i = 0; i < playing.target.indices_used; i += 3)
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = playing.indices[i + k], b = playing.indices[i + (k + 1) % 3];
            ++edges[{a, b}];
        }
    size_t open = 0;
    for (const auto& [edge, uses] : edges) {
        *repeated += uses > 1;
        if (edges.count({edge.second, edge.first})) continue;
        open += sees(view, playing.positions[edge.first]) && sees(view, playing.positions[edge.second]);
    }
    return open;
}

/// Plays a clip as seen from the x axis, in cells of 4 pixels.
struct AxisCamera {
    Opened opened;
    Playing playing;
    rill::View view{};

    explicit AxisCamera(const Bytes& bytes) : opened(bytes), playing(opened_first(opened)) {
        set_identity(playing.frame.asset_to_world);
        playing.frame.views = &view;
        playing.frame.view_count = 1;
        playing.frame.budget.pixel_error = 4;
    }
    void stand(float distance) { view = everything({distance, 0, 0}); }
    static Opened& opened_first(Opened& clip) {
        REQUIRE(clip.open() == Status::ok);
        return clip;
    }
};

struct Cost {
    uint64_t bytes;
    uint32_t points, vertices;
};
Cost cost_of(const rill::View* view) {
    Opened opened(blocky_ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    set_identity(playing.frame.asset_to_world);
    playing.frame.views = view;
    playing.frame.view_count = view ? 1 : 0;
    playing.frame.budget.cell_size = 0.02f;
    playing.resize(60000, 360000, 4096);
    CHECK(playing.draw(0.1) == Status::ok);
    return {playing.stats.bytes_arrived, playing.stats.points_used, playing.target.vertices_used};
}

}  // namespace

TEST_CASE("a view of an eighth costs a quarter at most: bytes read, points fitted, cells meshed") {
    const glm::vec3 centre = Clip::centre(0.1);
    rill::View corner = everything({9, 9, 9});
    for (int a = 0; a < 3; ++a) corner.planes[a][a] = 1, corner.planes[a][3] = -centre[a];
    const Cost whole = cost_of(nullptr), eighth = cost_of(&corner);
    MESSAGE("bytes ", eighth.bytes, " of ", whole.bytes, ", points ", eighth.points, " of ", whole.points, ", vertices ",
            eighth.vertices, " of ", whole.vertices);
    CHECK(4 * eighth.points <= whole.points);
    CHECK(4 * eighth.vertices <= whole.vertices);
    CHECK(8 * eighth.vertices > whole.vertices);
    CHECK(3 * eighth.bytes <= whole.bytes);  // blocks are sixths of the ball, and act beyond their bounds
}

TEST_CASE("what is in sight does not depend on what is out of it") {
    Opened opened(blocky_ball());
    REQUIRE(opened.open() == Status::ok);
    Playing whole(opened), part(opened);
    rill::View corner = everything({9, 9, 9});
    for (int a = 0; a < 3; ++a) corner.planes[a][a] = 1, corner.planes[a][3] = -Clip::centre(0.1)[a];
    set_identity(part.frame.asset_to_world);
    part.frame.views = &corner;
    part.frame.view_count = 1;
    for (Playing* playing : {&whole, &part}) {
        playing->frame.budget.cell_size = 0.04f;
        CHECK(playing->draw(0.1) == Status::ok);
    }
    std::vector<glm::vec3> seen;
    for (uint32_t v = 0; v < part.target.vertices_used; ++v)
        if (sees(corner, part.positions[v])) seen.push_back(part.positions[v]);
    size_t expected = 0, missing = 0;
    for (uint32_t v = 0; v < whole.target.vertices_used; ++v) {
        if (!sees(corner, whole.positions[v], 0.01f)) continue;
        ++expected;
        float nearest = 1;
        for (const glm::vec3& p : seen) nearest = std::min(nearest, glm::length(p - whole.positions[v]));
        missing += nearest > 0.004f;  // a tenth of a cell
    }
    CHECK(expected > 500);
    CHECK(missing == 0);
}

TEST_CASE("a camera that trembles asks for nothing new") {
    AxisCamera camera(blocky_ball());
    const auto layers_from = [&](float distance) {
        camera.stand(distance);
        CHECK(camera.playing.stream(0.1) == Status::ok);
        return camera.playing.stats.layers_wanted;
    };
    uint32_t changes = 0, trembles = 0, held = 0;
    for (float distance = 2; distance < 100; distance *= 1.03f) {
        layers_from(1.02f * distance), layers_from(0.98f * distance);
        const uint32_t wanted = layers_from(distance);
        changes += held && wanted != held, held = wanted;
        for (const float shaken : {1.02f, 0.98f, 1.f}) trembles += layers_from(shaken * distance) != held;
    }
    CHECK(changes > 0);
    CHECK(trembles == 0);
}

TEST_CASE("a layer ends a few points at a time as the camera moves away, and begins so as it comes back") {
    AxisCamera camera(make_ball({.points = 2400}));
    const auto points_from = [&](float distance) {
        camera.stand(distance);
        CHECK(camera.playing.draw(0.1) >= Status::ok);
        return camera.playing.stats.points_used;
    };
    const uint32_t all = points_from(2);
    for (const float step : {1.01f, 1 / 1.01f}) {
        CAPTURE(step);
        const bool away = step > 1;
        uint32_t before = points_from(away ? 2 : 200), largest = 0, back = 0;
        for (float distance = away ? 2 : 200; distance >= 2 && distance <= 200; distance *= step) {
            const uint32_t now = points_from(distance), gone = away ? before - now : now - before;
            if (away ? now > before : now < before) ++back;
            else largest = std::max(largest, gone);
            before = now;
        }
        CHECK((away ? before < all / 3 : before == all));
        CHECK(largest < all / 20);
        CHECK(back == 0);
    }
}

TEST_CASE("no open edge in sight at random cameras, and finer where it is nearer") {
    Opened opened(make_ball({.points = 2400}));
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    set_identity(playing.frame.asset_to_world);
    playing.frame.view_count = 1;
    playing.frame.budget.pixel_error = 50;
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(-1, 1);
    size_t open = 0, repeated = 0, drawn = 0;
    for (int i = 0; i < 150; ++i) {
        const glm::vec3 from = glm::normalize(glm::vec3(unit(random), unit(random), unit(random))) * (2.5f + 1.4f * unit(random));
        const glm::vec3 at = 0.7f * glm::vec3(unit(random), unit(random), unit(random));
        const rill::View view = looking(from, at, 0.1f + 0.25f * (1 + unit(random)));
        playing.frame.views = &view;
        CHECK(playing.draw(0.45 * (1 + unit(random))) >= Status::ok);
        open += open_edges_in_sight(playing, view, &repeated);
        drawn += playing.target.indices_used > 0;
    }
    CHECK(open == 0);
    CHECK(repeated == 0);
    CHECK(drawn > 120);
}
