// SPDX-License-Identifier: MIT
// The whole way: meshes of a liquid whose every moment is known are cooked, and what the runtime makes of the asset
// is held against them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "asset/asset_directory.h"
#include "asset/asset_player.h"
#include "cook/cook.h"
#include "frames/open_sequence.h"
#include "measure/surface_distance.h"
#include "sequence_files.h"
#include "shapes.h"
#include "verify/verify.h"

using namespace rill::cooker;

namespace {

constexpr double fps = 24;

/// A ball that sways and is squeezed, beside a ring that drifts and turns: x = A(t) X + c(t), volumes kept.
struct Motion {
    glm::mat3 shape{1};
    glm::vec3 centre{};
    glm::vec3 operator()(const glm::vec3& x) const { return shape * x + centre; }
};
Motion ball(double t) {
    const float squeeze = 1 + 0.15f * float(std::sin(6 * t));
    return {{{squeeze, 0, 0}, {0, 1 / squeeze, 0}, {0, 0, 1}}, {0.3f * float(std::sin(4 * t)), 0, 0}};
}
Motion ring(double t) {
    const float c = float(std::cos(2 * t)), s = float(std::sin(2 * t));
    return {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}, {0, 0.6f * float(t), 1.6f}};
}
glm::vec3 velocity(Motion (*motion)(double), double t, const glm::vec3& material) {
    const double step = 1e-3;
    return (motion(t + step)(material) - motion(t - step)(material)) / float(2 * step);
}

Mesh torus(uint32_t around, uint32_t across, float major, float minor) {
    Mesh mesh;
    for (uint32_t i = 0; i < around; ++i)
        for (uint32_t k = 0; k < across; ++k) {
            const float u = 6.2831853f * float(i) / float(around), v = 6.2831853f * float(k) / float(across);
            const float r = major + minor * std::cos(v);
            mesh.positions.push_back({r * std::cos(u), r * std::sin(u), minor * std::sin(v)});
            const uint32_t a = i * across + k, b = (i + 1) % around * across + k;
            const uint32_t c = i * across + (k + 1) % across, d = (i + 1) % around * across + (k + 1) % across;
            mesh.triangles.push_back({a, b, d}), mesh.triangles.push_back({a, d, c});
        }
    return mesh;
}
void move(Mesh& mesh, Motion (*motion)(double), double t) {
    mesh.velocities.clear();
    for (glm::vec3& x : mesh.positions) mesh.velocities.push_back(velocity(motion, t, x)), x = motion(t)(x);
}
Mesh liquid(double t) {
    Mesh mesh = sphere(32, 0.5f), other = torus(48, 20, 0.5f, 0.2f);
    move(mesh, ball, t), move(other, ring, t);
    append(mesh, other);
    return mesh;
}
/// What the liquid does at x, whose motion is that of the nearer of the two.
glm::vec3 true_velocity(double t, const glm::vec3& x) {
    Motion (*motion)(double) = x.z < 0.8f ? ball : ring;
    return velocity(motion, t, glm::inverse(motion(t).shape) * (x - motion(t).centre));
}

constexpr int first_frame = 11, frames = 8;

struct Cooked {
    TestFolder folder;
    std::string input = folder / "in", asset = folder / "out.rill";
    CookSettings settings;
    CookReport report;

    explicit Cooked(const std::function<Mesh(int)>& frame, int count = frames) {
        for (int i = 0; i < count; ++i) put_file(input + "/f" + std::to_string(first_frame + i) + ".ply", plain_ply(frame(i)));
        settings.error = "0.15e", settings.window = 3, settings.jobs = 2, settings.layers = 3;
    }
    Cooked& cook() {
        report = rill::cooker::cook(input, asset, settings, [](const CookProgress&) {});
        return *this;
    }
};
Mesh of_frame(int i) { return liquid(i / fps); }

const Cooked& whole() {
    static Cooked cooked(of_frame);
    static const Cooked& done = cooked.cook();
    return done;
}
/// A ball whose skin streams to its north pole: it stands, and points that went with the liquid would crowd there.
glm::vec3 streaming(const glm::vec3& x, float speed) {
    const glm::vec3 n = glm::normalize(x);
    return speed * (glm::vec3(0, 0, 1) - n * n.z);
}
Mesh streaming_ball(float speed) {
    Mesh mesh = sphere(32, 0.5f);
    for (const glm::vec3& x : mesh.positions) mesh.velocities.push_back(streaming(x, speed));
    return mesh;
}
/// Nothing on one side only: infinitely far.
SurfaceDistance distance(const Mesh& a, const Mesh& b) { return surface_distance(a, SurfaceIndex(a), b, SurfaceIndex(b)); }

}  // namespace

TEST_CASE("a glance at a third of the samples finds about the same errors" * doctest::test_suite("threads")) {
    const auto source = open_sequence(whole().input, {});
    const Verification glance = verify(whole().asset, *source, 2, {}, Scrutiny::glance), plain = verify(whole().asset, *source, 2);
    CHECK(glance.p99 == doctest::Approx(plain.p99).epsilon(0.04));
    CHECK(glance.mean == doctest::Approx(plain.mean).epsilon(0.02));
    CHECK(glance.totals.area < 0.4 * plain.totals.area);
}

TEST_CASE("the decoded surface lies within the promised error, in every frame") {
    const Cooked& cooked = whole();
    INFO("p99 ", cooked.report.measured_p99, ", aimed at ", cooked.report.target_p99);
    CHECK(cooked.report.target_met);
    AssetPlayer player(cooked.asset);
    CHECK(player.info().frames == frames);
    CHECK(player.info().first_frame == first_frame);
    CHECK(player.info().windows == 2);  // of three frames and four
    DistanceHistogram all;
    for (uint32_t i = 0; i < frames; ++i) {
        CAPTURE(i);
        CHECK(player.frame_seconds(i) == doctest::Approx(i / fps));
        const Mesh source = of_frame(int(i)), decoded = player.mesh(player.frame_seconds(i));
        const SurfaceDistance d = distance(source, decoded);
        all.add(d.histogram);
        CHECK(d.p99 < 1.5 * cooked.report.target_p99);
        CHECK(d.normal_degrees < 10);
        const Topology shape = topology(decoded);
        CHECK(shape.open_edges == 0);
        CHECK(shape.non_manifold_edges == 0);
        CHECK(shape.components == 2);
        CHECK(shape.volume == doctest::Approx(signed_volume(source)).epsilon(0.03));
    }
    // What the report says is what is.
    CHECK(all.quantile(0.99) == doctest::Approx(cooked.report.measured_p99).epsilon(0.05));
}

TEST_CASE("between frames the surface is where the liquid was") {
    AssetPlayer player(whole().asset);
    for (double frame : {0.5, 2.25, 3.5, 6.75}) {
        CAPTURE(frame);
        const SurfaceDistance d = distance(liquid(frame / fps), player.mesh(frame / fps));
        CHECK(d.p99 < 2 * whole().report.target_p99);
        CHECK(d.mean < whole().report.target_p99);
    }
}

TEST_CASE("the same input gives the same bytes at 1, 2 and 8 jobs" * doctest::test_suite("threads")) {
    const std::string bytes = get_file(whole().asset);
    Cooked again(of_frame);
    for (int jobs : {1, 8}) {
        CAPTURE(jobs);
        again.settings.jobs = jobs;
        CHECK(get_file(again.cook().asset) == bytes);
    }
}

TEST_CASE("layers: closed from the first on, nearer with each, and cheap first") {
    AssetPlayer player(whole().asset);
    REQUIRE(player.info().layers == 3);
    double mean[3] = {};
    for (uint32_t i = 0; i < frames; ++i) {
        CAPTURE(i);
        const Mesh source = of_frame(int(i));
        for (uint32_t layers = 1; layers <= 3; ++layers) {
            CAPTURE(layers);
            const Mesh decoded = player.mesh(i / fps, 0, layers);
            const Topology shape = topology(decoded);
            CHECK(shape.open_edges == 0);
            CHECK(shape.non_manifold_edges == 0);
            const double error = distance(source, decoded).mean;
            mean[layers - 1] += error / frames;
        }
    }
    CHECK(mean[1] < 0.5 * mean[0]);
    CHECK(mean[2] < 0.5 * mean[1]);
    const AssetDirectory directory = read_directory(whole().asset);
    uint64_t first = 0, all = 0;
    for (const auto& chunk : directory.chunks) {
        if (chunk.layer == 0) first += chunk.bytes;
        all += chunk.bytes;
    }
    CHECK(first < 0.28 * double(all));  // an eighth, but for what a chunk of thirty tracks costs before its first
}

TEST_CASE("the last layer but one is as fine as cells of two edges can show, and not much finer") {
    const AssetDirectory directory = read_directory(whole().asset);
    const float shown = rill::format::fine_enough * 2 * directory.header.cell_size;
    size_t count = 0;
    for (const auto& chunk : directory.chunks) {
        if (chunk.layer != 1) continue;
        ++count;
        CHECK(chunk.error_p99 <= 1.05f * shown);  // where another track would open a gap, it stays a little above
        CHECK(chunk.error_p99 > 0.3f * shown);
    }
    CHECK(count >= directory.windows.size());
}

TEST_CASE("at a window's border nothing pops: either side is within the coding error of the same frame") {
    AssetPlayer player(whole().asset);
    const AssetDirectory directory = read_directory(whole().asset);
    REQUIRE(directory.windows.size() > 1);
    for (size_t w = 1; w < directory.windows.size(); ++w) {
        CAPTURE(w);
        const double t = directory.windows[w].first_sample / fps, nearly = 1e-6;
        const Mesh before = player.mesh(t - nearly), after = player.mesh(t + nearly);
        CHECK(distance(before, after).p99 < 2 * whole().report.target_p99);
    }
}

TEST_CASE("velocity: that of the liquid, and of the surface itself") {
    AssetPlayer player(whole().asset);
    for (double frame : {0.5, 1.5, 4.0, 4.5}) {
        CAPTURE(frame);
        const double t = frame / fps;
        const Mesh mesh = player.mesh(t);
        REQUIRE(mesh.velocities.size() == mesh.positions.size());
        // Along the surface the points may slide (it looks the same); across it they may not.
        double wrong = 0, speed = 0;
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            const glm::vec3 truth = true_velocity(t, mesh.positions[i]);
            wrong += std::fabs(glm::dot(mesh.velocities[i] - truth, mesh.normals[i])), speed += glm::length(truth);
        }
        CHECK(wrong < 0.2 * speed);
        // Moved by its own velocity, the surface meets itself a moment later.
        const double step = 0.25 / fps;
        Mesh moved = mesh;
        for (size_t i = 0; i < moved.positions.size(); ++i) moved.positions[i] += float(step) * moved.velocities[i];
        const Mesh later = player.mesh(t + step);
        const double stayed = distance(mesh, later).mean, went = distance(moved, later).mean;
        INFO("moved ", went, ", unmoved ", stayed);
        CHECK(went < 0.42 * stayed);  // not 0: points that fade in and out move it too
    }
}

TEST_CASE("liquid that streams along a surface that stands: the points stay, and the velocity is the liquid's") {
    constexpr float speed = 6;
    Cooked cooked([](int) { return streaming_ball(speed); });
    cooked.cook();
    CHECK(cooked.report.json["bytes"]["slip"] > 0);
    CHECK(whole().report.json["bytes"]["slip"] == 0);  // calm: points go with it
    const Mesh mesh = AssetPlayer(cooked.asset).mesh(3.5 / fps);
    double wrong = 0, all = 0;
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::vec3 truth = streaming(mesh.positions[i], speed);
        wrong += glm::distance(mesh.velocities[i], truth), all += glm::length(truth);
    }
    CHECK(wrong < 0.4 * all);  // steps of slip are a third of the speed; without slip all of it is missing
}

TEST_CASE("liquid that streams faster and faster along a surface that stands") {
    const auto speed = [](int frame) { return 2.f + float(frame); };
    Cooked cooked([&](int frame) { return streaming_ball(speed(frame)); });
    cooked.settings.window = 7;
    cooked.cook();
    AssetPlayer player(cooked.asset);
    for (const int frame : {1, 4, 7}) {
        const Mesh mesh = player.mesh(frame / fps);
        double shown = 0, true_speed = 0;
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            const glm::vec3 truth = streaming(mesh.positions[i], speed(frame));
            shown += glm::dot(mesh.velocities[i], truth), true_speed += glm::dot(truth, truth);
        }
        CAPTURE(frame);
        CHECK(shown == doctest::Approx(true_speed).epsilon(0.4));  // a slip that stays: 1.8 times as fast as it is, .5 times at last
    }
}

TEST_CASE("how liquid slides does not depend on when it does") {
    const TestFolder folder;
    const int first[2] = {1, 20'000'000};  // nine days later, where a float knows no frames any more
    Mesh mesh[2];
    for (int late = 0; late < 2; ++late) {
        const std::string input = folder / (late ? "late" : "early"), asset = input + ".rill";
        for (int i = 0; i < frames; ++i)
            put_file(input + "/f" + std::to_string(first[late] + i) + ".ply", plain_ply(streaming_ball(2.f + float(i))));
        CookSettings settings;
        settings.error = "0.2e", settings.jobs = 2;
        CHECK(rill::cooker::cook(input, asset, settings, [](const CookProgress&) {}).json["bytes"]["slip"] > 0);
        mesh[late] = AssetPlayer(asset).mesh(5 / fps);
    }
    REQUIRE(mesh[0].positions.size() == mesh[1].positions.size());
    double apart = 0, speed = 0;
    for (size_t i = 0; i < mesh[0].positions.size(); ++i)
        apart += glm::distance(mesh[0].velocities[i], mesh[1].velocities[i]), speed += glm::length(mesh[0].velocities[i]);
    CHECK(apart < 0.01 * speed);
}

TEST_CASE("closed at cells of 1, 2 and 4 times the source's, and coarser with each") {
    AssetPlayer player(whole().asset);
    const float cell = player.info().cell_size;
    size_t before = SIZE_MAX;
    for (float times : {1.f, 2.f, 4.f}) {
        CAPTURE(times);
        const Mesh mesh = player.mesh(2.5 / fps, times * cell);
        const Topology shape = topology(mesh);
        CHECK(shape.open_edges == 0);
        CHECK(shape.non_manifold_edges == 0);
        CHECK(mesh.triangles.size() < before);
        before = mesh.triangles.size();
        if (times > 1) continue;  // drawn with fewer layers: of a clip this small, a handful of points
        CHECK(shape.components == 2);
        CHECK(shape.volume == doctest::Approx(signed_volume(liquid(2.5 / fps))).epsilon(0.15));
    }
}

TEST_CASE("liquid that is gone for some frames, and liquid that comes late") {
    const auto there = [](int i) { return i != 2 && i != 3 && i != 4; };
    Cooked cooked([&](int i) { return there(i) ? of_frame(i) : Mesh{}; });
    cooked.settings.error = "0.5e";
    cooked.cook();
    AssetPlayer player(cooked.asset);
    for (uint32_t i = 0; i < frames; ++i) {
        CAPTURE(i);
        const Mesh decoded = player.mesh(player.frame_seconds(i));
        CHECK(decoded.triangles.empty() == !there(int(i)));
        if (there(int(i))) CHECK(distance(of_frame(int(i)), decoded).p99 < 2 * cooked.report.target_p99);
    }
}

TEST_CASE("a drop that one frame alone shows comes and goes the way the liquid does, and shrinks by half half way") {
    const glm::vec3 place(0, 1.5f, -0.2f), drift(0, -0.5f, 0.1f);  // metres; metres a frame
    const auto drop = [&] {
        Mesh mesh = sphere(12, 0.09f);
        for (glm::vec3& x : mesh.positions) x += place, mesh.velocities.push_back(float(fps) * drift);
        return mesh;
    };
    Cooked cooked([&](int i) {
        Mesh mesh = of_frame(i);
        if (i == 4) append(mesh, drop());
        return mesh;
    });
    cooked.cook();
    AssetPlayer player(cooked.asset);
    const auto flying = [&](double frame) {
        Mesh mesh = player.mesh(frame / fps);
        std::erase_if(mesh.triangles, [&](const Triangle& t) { return mesh.positions[t[0]].y < 0.7f || mesh.positions[t[0]].z > 0.5f; });
        return part_of(mesh, mesh.triangles);
    };
    const double whole_volume = signed_volume(flying(4));
    CHECK(whole_volume == doctest::Approx(signed_volume(drop())).epsilon(0.05));
    float reach = -1e9f;  // of the chunks, along y
    for (const auto& chunk : read_directory(cooked.asset).chunks) reach = std::max(reach, chunk.upper[1]);
    for (const float away : {-0.5f, 0.5f}) {
        CAPTURE(away);
        const Mesh mesh = flying(4 + away);
        REQUIRE(!mesh.triangles.empty());
        CHECK(signed_volume(mesh) == doctest::Approx(0.5 * whole_volume).epsilon(0.05));
        glm::vec3 lower(1e9f), upper(-1e9f);
        for (const glm::vec3& x : mesh.positions) lower = glm::min(lower, x), upper = glm::max(upper, x);
        CHECK(glm::distance(0.5f * (lower + upper), place + away * drift) < 0.02f);
        for (const glm::vec3& v : mesh.velocities) CHECK(glm::distance(v, float(fps) * drift) < 0.05f * float(fps) * glm::length(drift));
    }
    CHECK(reach > place.y - drift.y);
    for (const double gone : {2.99, 3.00001, 4.99999, 5.0}) CHECK(flying(gone).triangles.empty());  // nothing is left to vanish at once
}

TEST_CASE("a single frame, and windows of a single frame") {
    Cooked one(of_frame, 1);
    one.cook();
    AssetPlayer still(one.asset);
    CHECK(still.info().seconds == 0);
    CHECK(distance(of_frame(0), still.mesh(0)).p99 < 1.2 * one.report.target_p99);

    Cooked many(of_frame, 4);
    many.settings.window = 1;
    many.cook();
    AssetPlayer player(many.asset);
    CHECK(player.info().windows == 3);
    for (uint32_t i = 0; i < 4; ++i) CHECK(distance(of_frame(int(i)), player.mesh(i / fps)).p99 < 1.5 * many.report.target_p99);
}

TEST_CASE("shells that overlap are warned of, and no others") {
    for (const float apart : {0.7f, 1.2f}) {
        std::string warnings;
        Cooked cooked([apart](int) {
            Mesh mesh = sphere(16, 0.5f), other = sphere(16, 0.5f, {apart, 0, 0});
            append(mesh, other);
            return mesh;
        }, 1);
        cooked.settings.error = "1e", cooked.settings.read.require_velocity = false;
        cooked.settings.read.warn = [&](const std::string& text) { warnings += text; };
        cooked.cook();
        CHECK((warnings.find("inside other liquid") != std::string::npos) == (apart < 1));
    }
}

TEST_CASE("windows are longer where the liquid is calm, unless it is told how long") {
    const auto calm = [](int i) {
        Mesh mesh = torus(24, 12, 0.5f, 0.2f);
        move(mesh, ring, i / fps);
        return mesh;
    };
    const auto tears = [&](int i) {
        Mesh mesh = calm(i);
        for (size_t v = 0; v < mesh.velocities.size(); v += 2) mesh.velocities[v] *= -10.f;
        return mesh;
    };
    const auto windows = [](const std::function<Mesh(int)>& frame, int window) {
        Cooked cooked(frame, 38);
        cooked.settings.error = "1e", cooked.settings.window = window;
        return AssetPlayer(cooked.cook().asset).info().windows;
    };
    CHECK(windows(calm, 0) == 1);
    CHECK(windows(calm, 24) == 2);
    CHECK(windows(tears, 0) == 2);
}

TEST_CASE("a cook that is stopped, or cannot be written, leaves nothing behind") {
    struct Stop {};
    Cooked cooked(of_frame, 4);
    for (const char* stage : {"surveying", "cooking"}) {
        CAPTURE(stage);
        CHECK_THROWS_AS(cook(cooked.input, cooked.asset, cooked.settings, [&](const CookProgress& p) { if (p.stage == stage) throw Stop(); }), Stop);
        CHECK(std::distance(std::filesystem::directory_iterator(cooked.folder.path), {}) == 1);
    }
    cooked.asset = cooked.folder / "no/where.rill";
    CHECK_THROWS_AS(cooked.cook(), InputError);
}
