// SPDX-License-Identifier: MIT
// Budgets of time and room under a hostile camera. Time is simulated: every position that the field is asked for costs,
// with noise, so that what is tested is the judgement and not the machine.
#include "harness.h"

#include <random>
#include <set>

#include "src/mesher.h"
#include "src/pipeline.h"

using namespace harness;
using rill::Status;

namespace {

double simulated_us, us_per_position;

void slow_values(const rill::surface::Field& f, const uint32_t* c, uint32_t count, const float* x, const float* y,
                 const float* z, uint32_t n, float* value) noexcept {
    simulated_us += us_per_position * n;
    rill::surface::evaluate(f, c, count, x, y, z, n, value);
}
void slow_gradients(const rill::surface::Field& f, const uint32_t* c, uint32_t count, const float* x, const float* y,
                    const float* z, uint32_t n, float* value, float* gx, float* gy, float* gz,
                    float* velocity, float distance) noexcept {
    simulated_us += 2 * us_per_position * n;
    rill::surface::evaluate_at_surface(f, c, count, x, y, z, n, value, gx, gy, gz, velocity, distance);
}
uint64_t simulated_clock(void*) { return uint64_t(simulated_us); }

/// Stays a while, drifts, turns, and every so often is somewhere else, up close or with another lens.
struct HostileCamera {
    std::mt19937 random{17};
    glm::vec3 eye{3, 0, 0}, at{0, 0, 0}, drift{0};
    float half_angle = 0.4f;
    rill::View view{};

    float uniform() { return std::uniform_real_distribution<float>(-1, 1)(random); }
    glm::vec3 anywhere() { return {uniform(), uniform(), uniform()}; }
    void step(int frame) {
        if (frame % 50 == 0) {
            const float away = std::exp2(1.6f + 1.4f * uniform());
            eye = away * glm::normalize(anywhere());
            at = 0.8f * anywhere();
            half_angle = 0.35f + 0.25f * uniform();
            drift = 0.03f * anywhere();
        }
        if (frame % 50 >= 20) eye += drift, at += 0.3f * drift;
        const glm::vec3 ahead = glm::normalize(at - eye);
        const glm::vec3 side = glm::normalize(glm::cross(ahead, std::abs(ahead.z) < 0.9f ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0)));
        const glm::vec3 up = glm::cross(side, ahead);
        const float c = std::cos(half_angle), s = std::sin(half_angle);
        const glm::vec3 normals[6] = {s * ahead + c * side, s * ahead - c * side, s * ahead + c * up,
                                      s * ahead - c * up, ahead, ahead};
        for (int p = 0; p < 6; ++p) {
            for (int a = 0; a < 3; ++a) view.planes[p][a] = normals[p][a], view.eye[a] = eye[a];
            view.planes[p][3] = -glm::dot(normals[p], eye);
        }
        view.pixels_per_radian = 500 / half_angle;
    }
};

void set_identity(float (&m)[12]) {
    for (int i = 0; i < 12; ++i) m[i] = i % 5 == 0 ? 1.0f : 0.0f;
}

struct Ride {
    std::vector<double> microseconds;
    uint32_t cut_away = 0, cut = 0;
};
Ride ride(int frames, uint32_t microseconds, uint32_t vertices) {
    Opened opened(make_ball({.points = 600, .cell = 0.05f}));
    opened.host.clock = simulated_clock;
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    playing.resize(vertices, 6 * vertices, 512);
    playing.player->mesher->access = {rill::surface::gather, slow_values, slow_gradients};
    set_identity(playing.frame.asset_to_world);
    playing.frame.view_count = 1;
    playing.frame.budget.pixel_error = 12;
    playing.frame.budget.microseconds = microseconds;
    HostileCamera camera;
    playing.frame.views = &camera.view;
    Ride result;
    for (int i = 0; i < frames; ++i) {
        camera.step(i);
        us_per_position = 0.1 * (1 + 0.1 * camera.uniform());
        const double before = simulated_us;
        CHECK(playing.draw(std::abs(std::fmod(i / 60.0, 2.0) - 1)) >= Status::ok);
        result.microseconds.push_back(simulated_us - before);
        result.cut |= playing.stats.cut;
        for (uint32_t k = 0; k < playing.target.indices_used; ++k)
            if (playing.indices[k] >= playing.target.vertices_used) ++result.cut_away;
    }
    return result;
}

}  // namespace

TEST_CASE("2000 frames of a hostile camera keep their time") {
    const Ride free = ride(400, 0, 40000);
    std::vector<double> sorted = free.microseconds;
    std::sort(sorted.begin(), sorted.end());
    const double budget = sorted[sorted.size() * 4 / 10];  // what six frames in ten would exceed
    const Ride held = ride(2000, uint32_t(budget), 40000);
    int over = 0;
    double worst = 0, used = 0, spent = 0;
    for (double us : held.microseconds) over += us > budget, worst = std::max(worst, us / budget), spent += us / budget;
    for (double us : free.microseconds) used += std::min(us / budget, 1.0);
    MESSAGE("budget ", budget, " us; unbounded p50 ", sorted[sorted.size() / 2], " max ", sorted.back(), "; over in ", over,
            " of 2000, at most ", worst, " of it; mean use ", spent / 2000, ", could be ", used / 400);
    CHECK(sorted.back() > 1.5 * budget);  // there is something to hold back
    CHECK(over < 20);
    CHECK(worst < 1.2);
    CHECK(spent / 2000 > 0.5 * used / 400);  // not by giving up more than need be
    CHECK((held.cut & rill::cut_time) != 0);
    CHECK(held.cut_away == 0);
}

TEST_CASE("buffers too small: the whole of it coarser, cut off only when nothing coarser is left") {
    Opened opened(make_ball({.points = 600, .cell = 0.05f}));
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    REQUIRE(playing.draw(0.2) == Status::ok);
    const uint32_t vertices = playing.target.vertices_used, indices = playing.target.indices_used;
    const auto open_edges = [&] {
        std::set<std::pair<uint32_t, uint32_t>> edges;
        for (uint32_t i = 0; i < playing.target.indices_used; ++i)
            edges.insert({playing.indices[i], playing.indices[i % 3 == 2 ? i - 2 : i + 1]});
        size_t open = 0;
        for (const auto& [a, b] : edges) open += !edges.count({b, a});
        return open;
    };
    uint32_t before = 0;
    for (const uint32_t room : {0u, 1u, 10u, 100u, 250u, 400u, 700u, 1500u, 3000u, vertices - 1, vertices}) {
        for (const bool few_indices : {false, true}) {
            CAPTURE(room);
            playing.resize(few_indices ? vertices : room, few_indices ? 6 * room : indices, 512);
            const Status status = playing.draw(0.2);
            const rill::Target& t = playing.target;
            CHECK((status == Status::ok) == (few_indices ? 6 * room >= indices : room == vertices));
            CHECK(((playing.stats.cut & rill::cut_vertices) != 0) == (!few_indices && room < vertices));
            CHECK(playing.stats.vertices_wanted == vertices);
            for (uint32_t i = 0; i < t.indices_used; ++i) REQUIRE(playing.indices[i] < t.vertices_used);
            if (room < 250) continue;
            CHECK(open_edges() == 0);  // the whole ball
            CHECK(t.indices_used > 500);
            if (few_indices) continue;
            CHECK(t.vertices_used >= before);  // more room, no less detail
            before = t.vertices_used;
        }
    }
}
