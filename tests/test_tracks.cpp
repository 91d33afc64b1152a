// SPDX-License-Identifier: MIT
// Which tracks a window keeps: brief ones that their neighbours make up for go, those that mend a frame end when it is
// mended, and ends that coding takes off the surface are cut. And coefficients chosen against what all tracks decode to.
#include <doctest/doctest.h>

#include <algorithm>

#include "basis_tables.h"
#include "shapes.h"
#include "tracks/frames_to_tracks.h"
#include "tracks/points_to_mesh.h"
#include "tracks/surface_response.h"

using namespace rill::cooker;

namespace {

constexpr float radius = 0.5f;
constexpr int samples = 12;

/// A bumpy ball that stands still.
Window standing_ball() {
    Mesh mesh = bumpy_sphere(64, radius);
    const float edge = float(median_edge(mesh));
    const auto frame = std::make_shared<const SurfaceFrame>(std::move(mesh), edge);
    Window window;
    window.opens_span = true;
    for (int s = 0; s < samples; ++s) {
        window.frames.push_back(frame);
        window.seconds.push_back(s / 24.0);
        if (s > 0) window.motion.emplace_back(frame->mesh.positions.size(), glm::vec3(0));
    }
    return window;
}

WindowGoal goal_of(const Window& window, float edges = 0.3f) {
    WindowGoal goal;
    goal.tolerance = edges * window.frames[0]->edge;
    goal.quantiser = {0.3f * goal.tolerance, 4.f, 0.045f, 0.2f * goal.tolerance, 0.045f};
    goal.jobs = 2;
    return goal;
}

/// The path as it stands in the end, alive at samples first … last.
Path part_of(const Path& whole, int first, int last) {
    Path part = whole;
    part.birth = first, part.death = last, part.cause = Death::none;
    const auto cut = [&](auto& of_samples) { of_samples.assign(size_t(last - first + 1), of_samples.back()); };
    cut(part.at), cut(part.correction), cut(part.tilt);
    return part;
}

/// Paths that cover the ball closely, all of them in all samples.
void cover(Window& window) {
    grow_tracks(window, {}, goal_of(window, 0.05f));
    std::erase_if(window.paths, [](const Path& p) { return p.death < samples - 1; });
    for (Path& path : window.paths) path = part_of(path, 0, samples - 1);
}

/// A point of the surface in the middle between the two paths that stand closest.
Path between_paths(const Window& window) {
    glm::vec3 middle{};
    float closest = INFINITY;
    for (size_t i = 0; i < window.paths.size(); ++i)
        for (size_t k = 0; k < i; ++k) {
            const glm::vec3 &a = window.paths[i].at[0].position, &b = window.paths[k].at[0].position;
            if (glm::distance(a, b) < closest) closest = glm::distance(a, b), middle = 0.5f * (a + b);
        }
    std::vector<VertexTree::Found> found;
    window.frames[0]->tree.nearest(middle, 1, found);
    Path path = window.paths[0];
    path.at[0] = {window.frames[0]->mesh.positions[found[0].vertex], window.frames[0]->mesh.normals[found[0].vertex], {}};
    path.correction[0] = 0, path.tilt[0] = glm::vec2(0);
    return path;
}

}  // namespace

TEST_CASE("a track of few frames goes when its neighbours make up for it, and only then") {
    Window window = standing_ball();
    const WindowGoal goal = goal_of(window);
    cover(window);
    const size_t grown = window.paths.size();
    REQUIRE(grown > 50);
    const Path needless = between_paths(window);
    const auto left_of = [&](const Path& more) {
        Window with = window;
        with.paths.push_back(more);
        code_tracks(with, goal, tables());
        return with.paths.size();
    };
    CHECK(left_of(part_of(needless, 4, 6)) == grown);
    CHECK(left_of(part_of(needless, 2, 9)) == grown + 1);  // its birth is paid for by many frames
    Path continued = part_of(needless, 0, 2);
    continued.continues = true;
    CHECK(left_of(continued) == grown + 1);                // the window before ends with it

    // What its neighbours do not know stays, however brief.
    Path needed = part_of(needless, 4, 6);
    for (SurfacePoint& p : needed.at) p.position += 2 * window.frames[0]->edge * p.normal;
    window.paths.push_back(needed);
    code_tracks(window, goal, tables());
    CHECK(std::any_of(window.paths.begin(), window.paths.end(),
                      [&](const Path& p) { return p.birth == 4 && p.at[0].position == needed.at[0].position; }));
}

TEST_CASE("tracks that mend a frame end when it is mended") {
    Window window = standing_ball();
    const WindowGoal goal = goal_of(window);
    cover(window);
    // Nobody covers the cap at one sample.
    constexpr int bare = 5;
    const size_t grown = window.paths.size();
    for (size_t i = 0; i < grown; ++i) {
        if (window.paths[i].at[0].position.z < 0.2f) continue;
        const Path whole = window.paths[i];
        window.paths[i] = part_of(whole, 0, bare - 1);
        window.paths.push_back(part_of(whole, bare + 1, samples - 1));
    }
    code_tracks(window, goal, tables());
    size_t mending = 0, ended = 0;
    for (const Path& path : window.paths)
        if (path.birth == bare) ++mending, ended += path.death <= bare + 1;
    CHECK(mending > 5);
    CHECK(ended > mending / 2);
}

TEST_CASE("ends of lives that are coded off the surface are cut, and no others") {
    Window window = standing_ball();
    const WindowGoal goal = goal_of(window);
    cover(window);
    const uint32_t first = uint32_t(window.paths.size());
    const auto add = [&](size_t like, int birth, int death, int astray) {
        Path path = part_of(window.paths[like], birth, death);
        SurfacePoint& p = path.at[size_t(astray - birth)];
        p.position += 6 * window.frames[0]->edge * p.normal;
        window.paths.push_back(path);
    };
    add(0, 3, samples - 1, 3), add(1, 0, 8, 8), add(2, 3, 8, 3), add(3, 2, samples - 1, samples - 1);
    const CodedWindow coded = code_tracks(window, goal, tables());
    const auto lives = [&](uint32_t i, int birth, int death) {
        const TrackSamples& track = coded.decoded[first + i];
        return window.paths[first + i].birth == birth && window.paths[first + i].death == death && track.birth == birth && track.death == death &&
               track.position.size() == size_t(death - birth + 1) && window.paths[first + i].at.size() == track.position.size();
    };
    CHECK(lives(0, 4, samples - 1));
    CHECK(lives(1, 0, 7));
    CHECK(lives(2, 4, 8));
    CHECK(lives(3, 2, samples - 1));  // goes on in the next window
    for (uint32_t i = 0; i < 3; ++i)
        for (const glm::vec3& x : coded.decoded[first + i].position) CHECK(window.frames[0]->index.within(x, 1.5f * goal.tolerance));
}

TEST_CASE("what a point does to the decoded surface is known to first order") {
    Window window = standing_ball();
    const SurfaceFrame& frame = *window.frames[0];
    const WindowGoal goal = goal_of(window);
    grow_tracks(window, {}, goal);
    std::vector<SurfacePoint> points;
    for (const Path& path : window.paths)
        if (path.alive(0)) points.push_back(path.target(0));
    const SurfaceResponse surface(frame, points, 3 * goal.tolerance);
    std::vector<Response> does;
    std::vector<uint32_t> slots;
    double all = 0, missed = 0;  // squares of what changes, and of what that is not as told
    const auto try_move = [&](uint32_t i, glm::vec3 move, const glm::vec2& slide = glm::vec2(0)) {
        std::vector<SurfacePoint> moved = points;
        const TangentFrame tangents = surface.tangents[i];
        moved[i].position += move.x * points[i].normal + slide.x * tangents.t1 + slide.y * tangents.t2;
        moved[i].normal = glm::normalize(points[i].normal + move.y * tangents.t1 + move.z * tangents.t2);
        const std::vector<float> after = measure_residual(frame, moved).distance;
        std::vector<float> told(after.size(), 0.f);
        const glm::vec3& bent = surface.curvature[i];
        move += glm::vec3(0, bent.x * slide.x + bent.y * slide.y, bent.y * slide.x + bent.z * slide.y);
        surface.of(i, does, slots);
        for (const Response& r : does) told[r.vertex] = glm::dot(r.by, move);
        for (size_t v = 0; v < after.size(); ++v) {
            if (surface.area[v] == 0) continue;
            const double change = double(after[v]) - double(surface.residual[v]);
            all += change * change, missed += (change - told[v]) * (change - told[v]);
        }
    };
    const float small = 0.05f;  // edges; radians
    for (const glm::vec3& move : {glm::vec3(small * frame.edge, 0, 0), glm::vec3(0, small, 0), glm::vec3(0, 0, small)}) {
        all = missed = 0;
        for (uint32_t i = 0; i < points.size(); i += 5) try_move(i, move);
        INFO("share missed: " << missed / all);
        CHECK(missed < 0.1 * all);
    }
    for (const glm::vec2& slide : {glm::vec2(4 * small * frame.edge, 0), glm::vec2(0, 4 * small * frame.edge)}) {
        all = missed = 0;
        for (uint32_t i = 0; i < points.size(); i += 5) try_move(i, glm::vec3(0), slide);
        INFO("share missed: " << missed / all);
        CHECK(missed < 0.5 * all);
    }
}

TEST_CASE("coefficients chosen anew make up for each other, the same for any number of threads" * doctest::test_suite("threads")) {
    Window window = standing_ball();
    WindowGoal goal = goal_of(window);
    grow_tracks(window, {}, goal);
    const CodedWindow coded = code_tracks(window, goal, tables());
    const auto error = [&](const CodedWindow& of) {
        double sum = 0;
        for (int s = 0; s < samples; ++s) {
            const Residual residual = measure_residual(*window.frames[size_t(s)], decoded_points(of.decoded, s));
            for (size_t v = 0; v < residual.distance.size(); ++v) {
                const double off = std::min(std::fabs(residual.distance[v]), 3 * goal.tolerance);  // one vertex shall not decide
                sum += double(window.frames[size_t(s)]->area[v]) * off * off;
            }
        }
        return sum;
    };
    // Every fifth track two steps too high, every fifth from the third on aslant.
    CodedWindow spoilt = coded;
    for (size_t i = 0; i < spoilt.tracks.size(); i += 5) {
        spoilt.tracks[i].position[2] += 2;
        spoilt.decoded[i] = dequantise_track(spoilt.tracks[i], spoilt.quantiser, goal.origin, tables());
    }
    for (size_t i = 2; i < spoilt.tracks.size(); i += 5) {
        spoilt.tracks[i].axis[0] += spoilt.tracks[i].axis[0] > 0 ? -1 : 1;
        spoilt.decoded[i] = dequantise_track(spoilt.tracks[i], spoilt.quantiser, goal.origin, tables());
    }
    CodedWindow refitted = spoilt, again = spoilt;
    const SurfaceAim at_source{std::vector<float>(samples, 0.f), {}};
    refit_tracks(window, refitted, goal, tables(), at_source);
    CHECK(error(spoilt) > 1.5 * error(coded));
    CHECK(error(refitted) < 1.25 * error(coded));
    goal.jobs = 1;
    refit_tracks(window, again, goal, tables(), at_source);
    for (size_t i = 0; i < refitted.tracks.size(); ++i) {
        CHECK(refitted.tracks[i].position == again.tracks[i].position);
        CHECK(refitted.tracks[i].second == again.tracks[i].second);
    }
}

TEST_CASE("coefficients chosen anew aim as far outside the source as they are told") {
    Window window = standing_ball();
    const WindowGoal goal = goal_of(window);
    grow_tracks(window, {}, goal);
    const CodedWindow coded = code_tracks(window, goal, tables());
    const auto outside = [&](const CodedWindow& of) {  // on average
        const SurfaceFrame& frame = *window.frames[0];
        const Residual residual = measure_residual(frame, decoded_points(of.decoded, 0));
        double sum = 0, area = 0;
        for (size_t v = 0; v < residual.distance.size(); ++v) {
            if (std::fabs(residual.distance[v]) > 3 * goal.tolerance) continue;
            sum -= double(frame.area[v]) * residual.distance[v], area += frame.area[v];
        }
        return sum / area;
    };
    for (const float by : {0.3f, -0.3f}) {
        CodedWindow moved = coded;
        refit_tracks(window, moved, goal, tables(), {std::vector<float>(samples, by * goal.tolerance), {}});
        CHECK((outside(moved) - outside(coded)) / goal.tolerance == doctest::Approx(by).epsilon(0.08));
    }
}

TEST_CASE("a window begins nearly where the one before ended") {
    Window window = standing_ball();
    window.frames.resize(2), window.seconds.resize(2), window.motion.resize(1);
    const WindowGoal goal = goal_of(window);
    const SurfaceFrame& frame = *window.frames[0];
    grow_tracks(window, {}, goal);
    std::vector<SurfacePoint> before;
    for (const Path& path : window.paths) {
        if (!path.alive(0)) continue;
        before.push_back(path.target(0));
        before.back().position += (before.size() % 2 ? 0.6f : -0.6f) * goal.tolerance * before.back().normal;
    }
    const std::vector<float> left = measure_residual(frame, before).distance;
    const auto apart = [&](Window of) {  // rms, of what the window before and this one decode to
        const std::vector<float> distance = measure_residual(frame, decoded_points(code_tracks(of, goal, tables()).decoded, 0)).distance;
        double sum = 0, area = 0;
        for (size_t v = 0; v < distance.size(); ++v) {
            const double off = distance[v] - left[v];
            if (std::fabs(off) < 3 * goal.tolerance) sum += double(frame.area[v]) * off * off, area += frame.area[v];
        }
        return std::sqrt(sum / area);
    };
    const double alone = apart(window);
    window.before = before;
    CHECK(apart(window) < 0.75 * alone);
    // Only there.
    const SurfaceAim aim{{0.1f, 0.2f}, seam_of(window, goal)};
    std::vector<float> first(left.size(), 0.f), second = first;
    aim_at(aim, 0, frame, goal.container, first), aim_at(aim, 1, frame, goal.container, second);
    CHECK(first != std::vector<float>(left.size(), 0.1f));
    CHECK(second == std::vector<float>(left.size(), 0.2f));
}

TEST_CASE("the volume of thin liquid is the source's") {
    Window window = standing_ball();
    Mesh sheet = bumpy_sphere(160, radius);
    for (glm::vec3& x : sheet.positions) x.z *= 0.15f;
    const float edge = median_edge(sheet);
    const auto frame = std::make_shared<const SurfaceFrame>(std::move(sheet), edge);
    for (auto& motion : window.motion) motion.assign(frame->mesh.positions.size(), glm::vec3(0));
    std::fill(window.frames.begin(), window.frames.end(), frame);
    const WindowGoal goal = goal_of(window);
    grow_tracks(window, {}, goal);
    const CodedWindow coded = code_tracks(window, goal, tables());
    double mean = 0;
    for (int s = 0; s < samples; ++s) {
        const double ratio = signed_volume(mesh_points(decoded_points(coded.decoded, s), frame->edge)) / signed_volume(frame->mesh);
        mean += ratio / samples;
        CHECK(std::fabs(ratio - 1) < 0.015);
    }
    CHECK(std::fabs(mean - 1) < 0.0025);
}

TEST_CASE("heights of few points are stepped until the volume is the source's, and no more; the same for any number of threads" * doctest::test_suite("threads")) {
    Window window = standing_ball();
    WindowGoal goal = goal_of(window, 0.6f);
    grow_tracks(window, {}, goal);
    CodedWindow coded = code_tracks(window, goal, tables());
    const auto volume = [&](int s) {
        const SurfaceFrame& frame = *window.frames[size_t(s)];
        return signed_volume(mesh_points(decoded_points(coded.decoded, s), frame.edge)) / signed_volume(frame.mesh);
    };
    const auto refitted = [&](const CodedWindow& from, int jobs) {
        CodedWindow to = from;
        goal.jobs = jobs;
        refit_volume(window, to, goal, tables());
        size_t stepped = 0;
        for (size_t i = 0; i < to.tracks.size(); ++i) stepped += to.tracks[i].position != from.tracks[i].position;
        return std::pair{to, stepped};
    };
    REQUIRE(decoded_points(coded.decoded, 0).size() < 100);
    CHECK(refitted(coded, 2).second == 0);
    for (size_t i = 0; i < coded.tracks.size(); i += 4) {
        coded.tracks[i].position[2] -= 2;
        coded.decoded[i] = dequantise_track(coded.tracks[i], coded.quantiser, goal.origin, tables());
    }
    for (int s = 0; s < samples; ++s) REQUIRE(volume(s) < 0.996);
    const auto [alone, stepped_alone] = refitted(coded, 1);
    const auto [together, stepped] = refitted(coded, 2);
    CHECK(stepped == stepped_alone);
    CHECK(stepped < 0.7 * double(coded.tracks.size()));
    for (size_t i = 0; i < coded.tracks.size(); ++i) CHECK(alone.tracks[i].position == together.tracks[i].position);
    coded = together;
    for (int s = 0; s < samples; ++s) CHECK(std::fabs(volume(s) - 1) < 0.003);
    CHECK(refitted(coded, 2).second == 0);
}

TEST_CASE("so are heights of many points where liquid is thin; where it is thick they stay") {
    for (const float flat : {0.06f, 1.f}) {
        CAPTURE(flat);
        Window window = standing_ball();
        Mesh mesh = bumpy_sphere(200, radius);
        for (glm::vec3& x : mesh.positions) x.z *= flat;
        const float edge = median_edge(mesh);
        const auto frame = std::make_shared<const SurfaceFrame>(std::move(mesh), edge);
        window.frames.resize(2), window.seconds.resize(2), window.motion.resize(1);
        window.motion[0].assign(frame->mesh.positions.size(), glm::vec3(0));
        std::fill(window.frames.begin(), window.frames.end(), frame);
        const WindowGoal goal = goal_of(window, 0.02f);
        grow_tracks(window, {}, goal);
        CodedWindow coded = code_tracks(window, goal, tables());
        REQUIRE(decoded_points(coded.decoded, 0).size() > 1000);
        for (size_t i = 0; i < coded.tracks.size(); ++i) {
            coded.tracks[i].position[2] -= 2;
            coded.decoded[i] = dequantise_track(coded.tracks[i], coded.quantiser, goal.origin, tables());
        }
        const auto off = [&] {
            return std::fabs(signed_volume(mesh_points(decoded_points(coded.decoded, 0), edge)) / signed_volume(frame->mesh) - 1);
        };
        const double before = off();
        refit_volume(window, coded, goal, tables());
        if (flat < 1) {
            REQUIRE(before > 0.006);
            CHECK(off() < 0.003);
        } else {
            CHECK(off() == before);
        }
    }
}

TEST_CASE("small pieces of points have their volume, too, beside a large one that keeps its own") {
    Window window = standing_ball();
    const float edge = window.frames[0]->edge;
    Mesh both = bumpy_sphere(64, radius);
    append(both, sphere(24, 5 * edge, {1.2f, 0, 0}, 0.3f));
    const auto frame = std::make_shared<const SurfaceFrame>(both, edge);
    for (auto& motion : window.motion) motion.assign(both.positions.size(), glm::vec3(0));
    std::fill(window.frames.begin(), window.frames.end(), frame);
    WindowGoal goal = goal_of(window);
    grow_tracks(window, {}, goal);
    CodedWindow coded = code_tracks(window, goal, tables());
    const auto is_small = [](const glm::vec3& x) { return x.x > 0.8f; };
    const auto parts = [&](const Mesh& mesh) {  // volumes of the large piece and the small one
        std::array<Mesh, 2> part;
        for (Mesh& p : part) p.positions = mesh.positions;
        for (const Triangle& t : mesh.triangles) part[is_small(mesh.positions[t[0]])].triangles.push_back(t);
        return std::array{signed_volume(part[0]), signed_volume(part[1])};
    };
    const auto volumes = [&] {  // in the source's
        const auto decoded = parts(mesh_points(decoded_points(coded.decoded, 5), edge)), source = parts(frame->mesh);
        return std::array{decoded[0] / source[0], decoded[1] / source[1]};
    };
    CHECK(std::fabs(volumes()[1] - 1) < 0.035);
    const double large = volumes()[0];
    for (size_t i = 0; i < coded.tracks.size(); ++i) {
        if (!is_small(coded.decoded[i].position[0])) continue;
        coded.tracks[i].position[2] -= 3;
        coded.decoded[i] = dequantise_track(coded.tracks[i], coded.quantiser, goal.origin, tables());
    }
    REQUIRE(volumes()[1] < 0.93);
    refit_volume(window, coded, goal, tables());
    CHECK(std::fabs(volumes()[1] - 1) < 0.035);
    CHECK(volumes()[0] == doctest::Approx(large).epsilon(1e-5));
}

TEST_CASE("pieces that are a third of their frame each have its volume, not only about their own") {
    Window window = standing_ball();
    const float edge = window.frames[0]->edge;
    Mesh three;
    for (int k = 0; k < 3; ++k) append(three, sphere(24, 5 * edge, {1.2f * float(k), 0.01f * float(k), 0}, 0.3f));
    const auto frame = std::make_shared<const SurfaceFrame>(three, edge);
    for (auto& motion : window.motion) motion.assign(three.positions.size(), glm::vec3(0));
    std::fill(window.frames.begin(), window.frames.end(), frame);
    const WindowGoal goal = goal_of(window);
    grow_tracks(window, {}, goal);
    CodedWindow coded = code_tracks(window, goal, tables());
    for (size_t i = 0; i < coded.tracks.size(); i += 4) {
        coded.tracks[i].position[2] -= 2;
        coded.decoded[i] = dequantise_track(coded.tracks[i], coded.quantiser, goal.origin, tables());
    }
    const auto volume = [&] { return signed_volume(mesh_points(decoded_points(coded.decoded, 5), edge)) / signed_volume(frame->mesh); };
    REQUIRE(volume() > 0.97);
    REQUIRE(volume() < 0.99);
    refit_volume(window, coded, goal, tables());
    CHECK(std::fabs(volume() - 1) < 0.006);
}

TEST_CASE("pieces that have run into one keep their volume: it is not one's alone") {
    Window window = standing_ball();
    const float edge = window.frames[0]->edge;
    Mesh both = sphere(64, radius);
    append(both, sphere(32, 6 * edge, {radius + 6.25f * edge, 0, 0}));
    const auto frame = std::make_shared<const SurfaceFrame>(both, edge);
    for (auto& motion : window.motion) motion.assign(both.positions.size(), glm::vec3(0));
    std::fill(window.frames.begin(), window.frames.end(), frame);
    const WindowGoal goal = goal_of(window);
    grow_tracks(window, {}, goal);
    const CodedWindow coded = code_tracks(window, goal, tables());
    const Mesh decoded = mesh_points(decoded_points(coded.decoded, 5), edge);
    const std::vector<uint32_t> label = label_components(decoded);
    CHECK(signed_volume(decoded) == doctest::Approx(signed_volume(both)).epsilon(0.01));
    CHECK(std::count(label.begin(), label.end(), label[0]) == std::ptrdiff_t(label.size()));  // or this tells nothing
}
