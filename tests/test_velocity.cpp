// SPDX-License-Identifier: MIT
// Whether velocity carries the surface: units, sign and direction found out; velocity estimated where there is none.
#include <doctest/doctest.h>

#include <cmath>

#include "frames/check_velocity.h"
#include "frames/open_sequence.h"
#include "frames/surface_motion.h"
#include "measure/surface_distance.h"
#include "reader_faults.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;

namespace {

/// A ball that falls ever faster: what brought it to a frame is not what carries it on.
glm::vec3 place(int frame) { return {0, 0, -0.004f * float(frame * frame)}; }
Mesh ball(int frame, bool forward, float factor) {
    Mesh mesh = bumpy_sphere(16, 0.5f, place(frame));
    const glm::vec3 v = (forward ? place(frame + 1) - place(frame) : place(frame) - place(frame - 1)) * 24.0f;
    mesh.velocities.assign(mesh.positions.size(), v * factor);
    return mesh;
}
struct Balls {
    TestFolder folder;
    Balls(bool forward, float factor) {
        for (int frame = 3; frame <= 9; ++frame) {
            const std::string number = std::to_string(frame);
            put_file(folder / ("f" + number + ".ply"), plain_ply(ball(frame, forward, factor)));
        }
    }
};
VelocityFit fit_of(const SequenceReader& reader, std::string& warning) {
    warning.clear();
    return check_velocity(reader, [&](const std::string& text) {
        CHECK(warning.empty());
        CHECK(text.find('\n') == std::string::npos);
        warning = text;
    });
}
/// Mean distance to the next frame, in edges.
double miss(const Mesh& mesh, const Mesh& next, double seconds) {
    const SurfaceIndex index(next);
    double sum = 0;
    for (size_t i = 0; i < mesh.positions.size(); ++i)
        sum += index.closest(mesh.positions[i] + float(seconds) * mesh.velocities[i], 100).distance;
    return sum / double(mesh.positions.size()) / median_edge(mesh);
}

}  // namespace

TEST_CASE("velocity that fits is left alone, its direction found") {
    std::string warning;
    for (const bool forward : {true, false}) {
        const Balls balls(forward, 1);
        const VelocityFit fit = fit_of(*open_sequence(balls.folder.path.string(), {}), warning);
        CHECK(fit.conclusive);
        CHECK(fit.meaning == (forward ? VelocityMeaning::forward : VelocityMeaning::backward));
        CHECK(fit.factor == 1);
        CHECK(fit.carried < 0.1 * fit.still);
        CHECK(warning.empty());
    }
}

TEST_CASE("wrong units and signs: the likely factor") {
    struct Case {
        float stored;
        double factor;
        const char* words;
    };
    std::string warning;
    for (const Case& c : {Case{1 / 24.0f, 24, "--velocity-unit frame"}, Case{24, 1 / 24.0, "multiplied by the frame rate"},
                          Case{-1, -1, "sign"}, Case{0.01f, 100, "100"}}) {
        CAPTURE(c.factor);
        const Balls balls(true, c.stored);
        auto reader = open_sequence(balls.folder.path.string(), {});
        const VelocityFit fit = fit_of(*reader, warning);
        CHECK(fit.conclusive);
        CHECK(fit.factor == doctest::Approx(c.factor).epsilon(0.06));
        CHECK(fit.as_stored > 2 * fit.carried);
        CHECK_FAULT(warning, c.words);
        const auto applied = apply_fit(std::move(reader), fit);
        CHECK(applied->info().velocity == fit.meaning);
        CHECK(fit_of(*applied, warning).factor == 1);
        CHECK(warning.empty());
    }
}

TEST_CASE("slow liquid tells over several frames") {
    std::string warning;
    for (const float stored : {1.f, 1 / 120.f}) {
        TestFolder folder;
        for (int frame = 1; frame <= 20; ++frame) {
            Mesh mesh = bumpy_sphere(16, 0.5f, {0, 0, -0.005f * float(frame)});  // a twentieth of an edge a frame
            mesh.velocities.assign(mesh.positions.size(), {0, 0, -0.005f * 120 * stored});
            put_file(folder / (std::to_string(frame) + ".ply"), plain_ply(mesh));
        }
        ReadOptions options;
        options.frames_per_second = 120;
        const VelocityFit fit = fit_of(*open_sequence(folder.path.string(), options), warning);
        CHECK(fit.conclusive);
        CHECK(fit.factor == doctest::Approx(1 / stored).epsilon(0.06));
        CHECK(warning.empty() == (stored == 1));
    }
}

TEST_CASE("frames that are not as far apart in time as stated") {
    TestFolder folder;  // frame 6 is taken half a frame early
    for (int frame = 3; frame <= 9; ++frame) {
        Mesh mesh = ball(0, true, 1);
        for (glm::vec3& x : mesh.positions) x.z -= 0.12f * (frame == 6 ? 5.5f : float(frame));
        mesh.velocities.assign(mesh.positions.size(), {0, 0, -0.12f * 24});
        put_file(folder / (std::to_string(frame) + ".ply"), plain_ply(mesh));
    }
    std::string warning;
    const VelocityFit fit = fit_of(*open_sequence(folder.path.string(), {}), warning);
    CHECK(fit.conclusive);
    CHECK(fit.factor == 1);
    CHECK_FAULT(warning, "unevenly", "frame 5 to 6", "0.5");
}

TEST_CASE("velocity of something else, no velocity, nothing that moves") {
    std::string warning;
    TestFolder folder;
    for (int frame = 3; frame <= 9; ++frame) {
        Mesh mesh = ball(frame, true, 1);
        for (size_t i = 0; i < mesh.positions.size(); ++i) mesh.velocities[i] = {std::sin(float(i) * 91), std::sin(float(i) * 37), std::sin(float(i) * 53)};
        put_file(folder / (std::to_string(frame) + ".ply"), plain_ply(mesh));
    }
    const VelocityFit fit = fit_of(*open_sequence(folder.path.string(), {}), warning);
    CHECK_FALSE(fit.conclusive);
    CHECK(fit.factor == 1);
    CHECK_FAULT(warning, "does not carry", "estimate");
    for (int frame = 3; frame <= 9; ++frame) {
        Mesh mesh = ball(frame, true, 0);
        put_file(folder / (std::to_string(frame) + ".ply"), plain_ply(mesh));
    }
    CHECK_FALSE(fit_of(*open_sequence(folder.path.string(), {}), warning).conclusive);
    CHECK_FAULT(warning, "velocities are 0 where the surface moves", "estimate");
    for (int frame = 3; frame <= 9; ++frame) {
        Mesh mesh = ball(0, true, 1);
        put_file(folder / (std::to_string(frame) + ".ply"), plain_ply(mesh));
    }
    CHECK_FALSE(fit_of(*open_sequence(folder.path.string(), {}), warning).conclusive);
    CHECK(warning.empty());
    CHECK(fit_of(*open_sequence(folder / "3.ply", {}), warning).factor == 1);
}

TEST_CASE("real caches: Mantaflow carries on, FLIP Fluids brought it here") {
    std::string warning;
    const VelocityFit manta = fit_of(*open_sequence(RILL_CONTENT "/drop_splash", {}), warning);
    CHECK(manta.conclusive);
    CHECK(manta.meaning == VelocityMeaning::forward);
    CHECK(manta.factor == 1);
    CHECK(warning.empty());
    const VelocityFit flip = fit_of(*open_sequence(RILL_TEST_DATA "/flip_fluids", {}), warning);
    CHECK(flip.conclusive);
    CHECK(flip.meaning == VelocityMeaning::backward);
    CHECK(flip.factor == 1);
}

TEST_CASE("estimated velocity lands on the next surface") {
    ReadOptions options;
    options.velocity_name = "estimate";
    const auto real = open_sequence(RILL_CONTENT "/drop_splash", options);
    CHECK(real->info().velocity == VelocityMeaning::forward);
    const double step = real->info().seconds[1] - real->info().seconds[0];
    for (const size_t k : {10, 30}) {
        const Mesh now = real->read(k), next = real->read(k + 1);
        CHECK(miss(now, next, step) < 0.2 * miss(now, next, 0));
        CHECK(now.velocities == real->read(k).velocities);
    }
    const Mesh last = real->read(59), before = real->read(58);  // looks back
    CHECK(miss(last, before, -step) < 0.2 * miss(last, before, 0));

    const auto onto = [](const Mesh& from, const Mesh& to, int jobs, std::vector<glm::vec3> start = {}) {
        return surface_motion(SurfaceIndex(from), SurfaceIndex(to), jobs, std::move(start));
    };
    // A ball that falls two edges: not the surface alone, every vertex goes along, tangentially too.
    const Mesh a = bumpy_sphere(16, 0.5f), b = bumpy_sphere(16, 0.5f, {0, 0, -0.15f});
    const std::vector<glm::vec3> motion = onto(a, b, 0);
    glm::vec3 mean(0);
    for (const glm::vec3& m : motion) mean += m / float(motion.size());
    CHECK(glm::distance(mean, {0, 0, -0.15f}) < 0.03f);
    CHECK(onto(a, Mesh{}, 0) == std::vector<glm::vec3>(a.positions.size(), glm::vec3(0)));
    CHECK(onto(Mesh{}, a, 0).empty());
    const Mesh many = bumpy_sphere(128, 0.5f), moved = bumpy_sphere(128, 0.5f, {0, 0, -0.05f});
    REQUIRE(many.positions.size() > 3 * 2048);  // of work for three
    CHECK(onto(many, moved, 1) == onto(many, moved, 3));

    // It goes on, for the most part, from where it came to, and by as much as there is time.
    const Mesh c = bumpy_sphere(16, 0.5f, {0, 0, -0.3f});
    const std::vector<glm::vec3> all(a.positions.size(), {0, 0, -0.15f});
    for (const glm::vec3& m : motion_goes_on(SurfaceIndex(a), all, b, 1, 0)) CHECK(glm::distance(m, {0, 0, 0.7f * -0.15f}) < 1e-5f);
    for (const glm::vec3& m : motion_goes_on(SurfaceIndex(a), all, b, 2, 0)) CHECK(glm::distance(m, {0, 0, 1.4f * -0.15f}) < 1e-5f);
    CHECK(mean_miss(b, onto(b, c, 0, all), SurfaceIndex(c), 1, 0) < 0.005);
}

TEST_CASE("the motion of the liquid: where it is sound, how it stretches the surface") {
    // Falling and gathering speed: half of each velocity, and the surface is met.
    Mesh a = bumpy_sphere(16, 0.5f), b = bumpy_sphere(16, 0.5f, {0, 0, -0.15f});
    a.velocities.assign(a.positions.size(), {0, 0, -1}), b.velocities.assign(b.positions.size(), {0, 0, -2});
    const std::vector<glm::vec3> fall = liquid_motion(a, b, SurfaceIndex(b), 0.1, 0);
    for (const glm::vec3& m : fall) CHECK(glm::distance(m, {0, 0, -0.15f}) < 1e-6f);
    CHECK(mean_stretch(a, fall) < 1e-5);
    CHECK(mean_miss(a, fall, SurfaceIndex(b), 1, 0) < 1e-5);
    // At rest, where the surface is not.
    const std::vector<glm::vec3> rest = liquid_motion(a, Mesh{}, SurfaceIndex(b), 0.1, 0);
    CHECK(mean_stretch(a, rest) == 0);
    CHECK(mean_miss(a, rest, SurfaceIndex(b), 1, 0) > 0.05);
    CHECK(mean_miss(a, rest, SurfaceIndex(b), 0.01f, 0) < 0.0101);
    // A tenth larger in every direction: a fifth of the area.
    std::vector<glm::vec3> grow = a.positions;
    for (glm::vec3& g : grow) g *= 0.1f;
    CHECK(mean_stretch(a, grow) == doctest::Approx(std::log(1.21)).epsilon(1e-3));
}
