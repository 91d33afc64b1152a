// SPDX-License-Identifier: MIT
// Liquid that was cut off at the sides of its domain is closed there, flat, exactly and evenly.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "asset/asset_directory.h"
#include "cook/cook.h"
#include "frames/cut_to_closed.h"
#include "frames/open_sequence.h"
#include "frames/rings_to_triangles.h"
#include "measure/surface_distance.h"
#include "sequence_files.h"
#include "shapes.h"
#include "verify/verify.h"

using namespace rill::cooker;

namespace {

constexpr float pi = 3.14159265f;

/// What of a mesh lies above `place` along an axis (or below, turned), cut off there and left open.
Mesh cut_off(const Mesh& mesh, int axis, bool keep_upper, float place) {
    Mesh cut = mesh;
    cut.triangles.clear();
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> between;
    const auto inside = [&](uint32_t v) { return (mesh.positions[v][axis] > place) == keep_upper; };
    const auto crossing = [&](uint32_t a, uint32_t b) {
        const auto [low, high] = std::minmax(a, b);
        const auto [at, is_new] = between.try_emplace({low, high}, uint32_t(cut.positions.size()));
        if (is_new) {
            const glm::vec3 p = mesh.positions[low], q = mesh.positions[high];
            glm::vec3 x = glm::mix(p, q, (place - p[axis]) / (q[axis] - p[axis]));
            x[axis] = place;
            cut.positions.push_back(x);
            if (!mesh.velocities.empty()) cut.velocities.push_back(0.5f * (mesh.velocities[low] + mesh.velocities[high]));
        }
        return at->second;
    };
    for (const Triangle& t : mesh.triangles) {
        std::vector<uint32_t> corners;
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t a = t[k], b = t[(k + 1) % 3];
            if (inside(a)) corners.push_back(a);
            if (inside(a) != inside(b)) corners.push_back(crossing(a, b));
        }
        for (size_t k = 1; k + 1 < corners.size(); ++k) cut.triangles.push_back({corners[0], corners[k], corners[k + 1]});
    }
    return part_of(cut, cut.triangles);
}

void turn(Mesh& mesh) {
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

Cut cut_of(const std::vector<Mesh>& frames) {
    const float edge = median_edge(frames[0]);
    WallFacts facts;
    RimOfPatch rim;
    for (const Mesh& mesh : frames) {
        const WallFacts of_frame = wall_facts(mesh, edge);
        facts.add(of_frame, edge), rim.add(rim_of_patch(mesh, of_frame.lower, of_frame.upper));
    }
    return find_cut(facts, rim, edge);
}
Cut cut_of(const Mesh& mesh) { return cut_of(std::vector{mesh}); }
Mesh closed(Mesh mesh) {
    close_at_sides(mesh, cut_of(mesh));
    return mesh;
}
void check_closed(const Mesh& mesh) {
    const Topology shape = topology(mesh);
    CHECK(shape.open_edges == 0);
    CHECK(shape.non_manifold_edges == 0);
}

/// Waves over a square of 2 m, 48 cells wide.
Mesh waves(double seconds) {
    Mesh mesh = plane(48, 2);
    for (glm::vec3& x : mesh.positions) {
        const float phase = 4 * x.x + 3 * x.y - 5 * float(seconds);
        x.z = 0.06f * std::sin(phase);
        mesh.velocities.emplace_back(0, 0, -0.3f * std::cos(phase));
    }
    return mesh;
}

/// The same as the sea does it: water goes round in circles, so the rim goes to and fro, by more than a cell.
Mesh rolling_waves(double seconds) {
    Mesh mesh = plane(48, 2);
    const glm::vec3 ahead(0.8f, 0.6f, 0);
    for (glm::vec3& x : mesh.positions) {
        const float phase = 5 * glm::dot(ahead, x) - 5 * float(seconds);
        x += -0.05f * std::sin(phase) * ahead + glm::vec3(0, 0, 0.06f * std::cos(phase));
        mesh.velocities.push_back(0.25f * std::cos(phase) * ahead + glm::vec3(0, 0, 0.3f * std::sin(phase)));
    }
    return mesh;
}

double area_of(const Mesh& mesh) {
    double area = 0;
    for (float a : vertex_areas(mesh)) area += a;
    return area;
}

}  // namespace

TEST_CASE("a ball in eight parts: each is closed in three sides, and together they are the ball") {
    const Mesh ball = sphere(96, 1);
    double volume = 0;
    for (int part = 0; part < 8; ++part) {
        CAPTURE(part);
        const Mesh open = cut_off(cut_off(cut_off(ball, 0, part & 1, -0.31f), 1, part & 2, 0.42f), 2, part & 4, -0.23f);
        const Cut cut = cut_of(open);
        CHECK(cut.sides == uint32_t((part & 1 ? 1 : 2) | (part & 2 ? 4 : 8) | (part & 4 ? 16 : 32)));
        const Mesh whole = closed(open);
        check_closed(whole);
        CHECK(topology(whole).components == 1);
        volume += signed_volume(whole);
        // What there was stays as it is.
        CHECK(std::equal(open.triangles.begin(), open.triangles.end(), whole.triangles.begin()));
        CHECK(std::equal(open.positions.begin(), open.positions.end(), whole.positions.begin()));
    }
    CHECK(volume == doctest::Approx(signed_volume(ball)).epsilon(1e-5));
}

TEST_CASE("what is added is even") {
    const Mesh open = cut_off(cut_off(sphere(96, 1), 2, true, -0.2f), 0, true, -0.3f), whole = closed(open);
    const float edge = median_edge(open);
    float longest = 0;
    double area = 0;
    for (size_t i = open.triangles.size(); i < whole.triangles.size(); ++i) {
        const Triangle& t = whole.triangles[i];
        const glm::vec3 a = whole.positions[t[0]], b = whole.positions[t[1]], c = whole.positions[t[2]];
        longest = std::max({longest, glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
        area += 0.5 * glm::length(glm::cross(b - a, c - a));
    }
    const double added = double(whole.triangles.size() - open.triangles.size());
    CHECK(added > area / (edge * edge));
    CHECK(added < 3 * area / (edge * edge));  // 2.3 of equal sides
    CHECK(longest < 3.5 * edge);
}

TEST_CASE("air that was cut off, too, is no liquid, and drops beside it are") {
    Mesh ball = sphere(96, 1), air = sphere(48, 0.5f, {0.1f, 0, 0}), drop = sphere(24, 0.1f, {1.3f, 0, 0});
    turn(air);
    const double whole_volume = signed_volume(ball) + signed_volume(air) + signed_volume(drop);
    append(ball, air), append(ball, drop);
    double volume = 0;
    for (const bool upper : {false, true}) {
        const Mesh half = closed(cut_off(ball, 2, upper, 0.03f));
        check_closed(half);
        volume += signed_volume(half);
    }
    CHECK(volume == doctest::Approx(whole_volume).epsilon(1e-5));
}

TEST_CASE("waves without a floor stand on one, some way down") {
    const Mesh open = waves(0);
    const Cut cut = cut_of(open);
    CHECK(cut.sides == 15);
    CHECK(cut.moving == 0);
    const Mesh whole = closed(open);
    check_closed(whole);
    const float depth = -cut.lower.z;
    CHECK(depth > 0.06f + 5 * median_edge(open));
    double above = 0;  // of the waves over z = 0
    for (const Triangle& t : open.triangles) {
        const glm::dvec3 a = open.positions[t[0]], b = open.positions[t[1]], c = open.positions[t[2]];
        above += 0.5 * ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) * (a.z + b.z + c.z) / 3;
    }
    CHECK(signed_volume(whole) == doctest::Approx(4 * double(depth) + above).epsilon(1e-4));
    CHECK(whole.velocities.size() == whole.positions.size());
    // A full basin: its rim at the top is all there is.
    Mesh full = waves(0);
    for (glm::vec3& x : full.positions) x.z = 0;
    check_closed(closed(full));
}

TEST_CASE("a patch of waves whose rim moves sideways is carried on to its bounds, level, and closed there") {
    std::vector<Mesh> frames;
    for (int i = 0; i < 6; ++i) frames.push_back(rolling_waves(i / 12.));
    const Cut cut = cut_of(frames);
    CHECK(cut.sides == 15);
    CHECK(cut.moving == 15);
    for (const Mesh& open : frames) {
        Mesh whole = open;
        close_at_sides(whole, cut);
        check_closed(whole);
        const WallFacts facts = wall_facts(whole, cut.edge);
        CHECK((facts.walls(cut.edge) & 31) == 31);  // sides and floor
        CHECK(glm::distance(facts.lower, cut.lower) < cut.within());
        for (int a = 0; a < 2; ++a) CHECK(std::fabs(facts.upper[a] - cut.upper[a]) < cut.within());
        const glm::dvec3 extent = cut.upper - cut.lower;
        CHECK(signed_volume(whole) == doctest::Approx(extent.x * extent.y * double(-cut.lower.z)).epsilon(0.03));
        // The strips go on outward, nowhere back; what they end in moves along its side.
        size_t folded = 0, moving = 0;
        for (const Triangle& t : whole.triangles) {
            const glm::vec3 a = whole.positions[t[0]], normal = unit_normal(glm::cross(whole.positions[t[1]] - a, whole.positions[t[2]] - a));
            folded += a.z > -0.1f && normal.z < -0.01f;
        }
        CHECK(folded == 0);
        for (size_t v = open.positions.size(); v < whole.positions.size(); ++v) {
            const glm::vec3 x = whole.positions[v], u = whole.velocities[v];
            if (u != glm::vec3(0)) ++moving;
            for (int a = 0; a < 2; ++a)
                if (std::min(x[a] - cut.lower[a], cut.upper[a] - x[a]) < cut.within()) CHECK(std::fabs(u[a]) < 0.02f);  // 0, but for what came there by itself
        }
        CHECK(moving > 150);
    }
    // A sea with a hole in it is no such patch, nor with another open surface beside it, nor one that faces down.
    Mesh holed = frames[0], joined = frames[0], turned = frames[0];
    holed.triangles.erase(holed.triangles.begin() + 2000, holed.triangles.begin() + 2040);
    append(joined, cut_off(sphere(16, 0.2f, {1, 1, 1}), 2, true, 1));
    turn(turned);
    for (const Mesh& other : {holed, joined, turned}) CHECK(cut_of(other).moving == 0);
}

TEST_CASE("liquid in the domain's corner takes the corner in") {
    // A ball around the lower corner of the domain, and one around an edge of it.
    for (const glm::vec3& centre : {glm::vec3(0.05f, 0.04f, 0.03f), glm::vec3(2, 0.04f, 0.03f)}) {
        Mesh mesh = sphere(64, 0.5f, centre);
        append(mesh, sphere(32, 0.2f, {1, 1, 1}));
        mesh = cut_off(cut_off(cut_off(mesh, 0, true, 0), 1, true, 0), 2, true, 0);
        const Mesh whole = closed(mesh);
        check_closed(whole);
        CHECK(topology(whole).components == 2);
        const bool has_corner = std::find(whole.positions.begin(), whole.positions.end(), glm::vec3(0)) != whole.positions.end();
        CHECK(has_corner == (centre.x < 1));
    }
}

TEST_CASE("other holes stay, and nothing that is not cut changes") {
    Mesh ball = sphere(48, 1);
    CHECK(cut_of(ball).sides == 0);
    CHECK(closed(ball).triangles == ball.triangles);
    ball.triangles.erase(ball.triangles.begin() + 700, ball.triangles.begin() + 704);
    CHECK(open_edges(ball).size() > 3);
    CHECK(cut_of(ball).sides == 0);
    CHECK(closed(ball).triangles == ball.triangles);
    // Torn beside the cut: what cannot be outlined is not filled; other pieces are.
    Mesh torn = cut_off(sphere(48, 1), 2, true, 0.1f);
    const OpenEdge gone = open_edges(torn).front();
    torn.triangles.erase(torn.triangles.begin() + gone.triangle);
    append(torn, cut_off(sphere(32, 0.4f, {2, 0, 0}), 2, true, 0.1f));
    const Topology before = topology(torn), after = topology(closed(torn));
    CHECK(before.open_edges > 60);
    CHECK(after.open_edges > 40);
    CHECK(after.open_edges < before.open_edges - 20);
}

TEST_CASE("which side of an open surface is the liquid is as stored, but for those that are inside out") {
    const TestFolder folder;
    Mesh corner = cut_off(cut_off(sphere(64, 1), 2, true, -0.4f), 0, true, 0.2f), sheet = waves(0.3), tube = cut_off(cut_off(sphere(64, 1), 0, true, -0.5f), 0, false, 0.5f);
    for (Mesh* mesh : {&corner, &sheet, &tube})
        for (const bool turned : {false, true}) {
            CAPTURE(turned);
            Mesh stored = *mesh;
            stored.velocities.assign(stored.positions.size(), glm::vec3(0));
            if (turned) turn(stored);
            put_file(folder / "in/f1.ply", plain_ply(stored));
            const Mesh read = open_sequence(folder / "in/f1.ply", {})->read(0), whole = closed(read);
            check_closed(whole);
            CHECK(signed_volume(whole) > 0);
            CHECK(signed_volume(whole) == doctest::Approx(signed_volume(closed(*mesh))).epsilon(1e-4));
        }
}

TEST_CASE("rings of any kind are filled where they go round counter-clockwise") {
    const FlatPlane plane{0, 1, 0.5f};
    const auto ring_of = [](Mesh& mesh, const std::vector<glm::vec2>& places) {
        Ring ring;
        for (const glm::vec2& x : places) ring.push_back(uint32_t(mesh.positions.size())), mesh.positions.emplace_back(x, 0.5f);
        return ring;
    };
    const auto circle = [](glm::vec2 centre, float radius, int n, float way) {
        std::vector<glm::vec2> places;
        for (int i = 0; i < n; ++i) places.push_back(centre + radius * glm::vec2(std::cos(2 * pi * float(i) / float(n)), way * std::sin(2 * pi * float(i) / float(n))));
        return places;
    };
    const auto polygon_area = [](float radius, int n) { return 0.5 * n * radius * radius * std::sin(2 * double(pi) / n); };
    Mesh mesh;
    SUBCASE("a disc with a hole, and an island in it") {
        const std::vector<Ring> rings = {ring_of(mesh, circle({0, 0}, 1, 200, 1)), ring_of(mesh, circle({0.1f, 0}, 0.6f, 120, -1)), ring_of(mesh, circle({0.2f, 0}, 0.2f, 40, 1))};
        const size_t outline = mesh.positions.size();
        fill_rings(mesh, rings, plane, 0.04f, 1e-4f);
        CHECK(area_of(mesh) == doctest::Approx(polygon_area(1, 200) - polygon_area(0.6f, 120) + polygon_area(0.2f, 40)).epsilon(1e-5));
        CHECK(open_edges(mesh).size() == outline);
        CHECK(topology(mesh).non_manifold_edges == 0);
        CHECK(topology(mesh).components == 2);
        for (const Triangle& t : mesh.triangles) {
            const glm::vec3 a = mesh.positions[t[0]], up = glm::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
            CHECK(up.z > 0);
        }
    }
    SUBCASE("clockwise: nothing") {
        const std::vector<Ring> rings = {ring_of(mesh, circle({0, 0}, 1, 50, -1))};
        fill_rings(mesh, rings, plane, 0.04f, 1e-4f);
        CHECK(mesh.triangles.empty());
    }
    SUBCASE("crossing itself: the lobe that goes the right way") {
        const std::vector<Ring> rings = {ring_of(mesh, {{-1, -1}, {1, 1}, {1, -1}, {-1, 1}})};
        fill_rings(mesh, rings, plane, 0.1f, 1e-4f);
        CHECK(area_of(mesh) == doctest::Approx(1).epsilon(1e-4));
    }
    SUBCASE("larger than its squares may be many, or without any") {
        const std::vector<Ring> rings = {ring_of(mesh, circle({0, 0}, 1, 50, 1))};
        fill_rings(mesh, rings, plane, 1e-7f, 1e-9f);
        CHECK(area_of(mesh) == doctest::Approx(polygon_area(1, 50)).epsilon(1e-4));
        CHECK(mesh.triangles.size() < 20'000'000);
        Mesh none;
        fill_rings(none, {}, plane, 0.1f, 1e-4f);
        CHECK(none.triangles.empty());
    }
}

TEST_CASE("a sequence that is cut off cooks like a whole one, and is verified against the closed source") {
    const TestFolder folder;
    constexpr int frames = 4;
    for (int i = 0; i < frames; ++i) put_file(folder / "in" + "/f" + std::to_string(1 + i) + ".ply", plain_ply(waves(i / 24.)));
    std::vector<std::string> warnings;
    CookSettings settings;
    settings.jobs = 2, settings.read.warn = [&](const std::string& text) { warnings.push_back(text); };
    settings.survey = folder / "survey.json";
    const CookReport report = cook(folder / "in", folder / "out.rill", settings, [](const CookProgress&) {});
    CHECK(report.target_met);
    CHECK(std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) { return w.find("cut off at sides") != std::string::npos; }));
    CHECK(std::none_of(warnings.begin(), warnings.end(), [](const std::string& w) { return w.find("open edges") != std::string::npos; }));
    const AssetDirectory directory = read_directory(folder / "out.rill");
    CHECK((directory.header.walls & 0b011111) == 0b011111);
    CHECK((directory.header.walls >> rill::format::sharp_rims_shift) == 0b011111);  // not the crests
    const auto source = open_source_of(folder / "out.rill", folder / "in", {});
    const Verification result = verify(folder / "out.rill", *source, 2);
    for (const FrameMeasure& frame : result.frames) {
        CHECK(frame.source.open_edges == 0);
        CHECK(frame.decoded.open_edges == 0);
        CHECK(frame.volume_ratio() == doctest::Approx(1).epsilon(0.01));
    }
    CHECK(result.p99 < 1.1 * result.target_p99);
    // The kept survey says the same.
    settings.force = true;
    cook(folder / "in", folder / "again.rill", settings, [](const CookProgress&) {});
    CHECK(get_file(folder / "again.rill") == get_file(folder / "out.rill"));
}

TEST_CASE("slow rolling waves: cooked as well, with the velocity that the coded points have not") {
    const TestFolder folder;
    for (int i = 0; i < 4; ++i) put_file(folder / "in" + "/f" + std::to_string(1 + i) + ".ply", plain_ply(rolling_waves(i / 24.)));
    double degrees[2] = {};
    for (const bool slip : {false, true}) {
        std::vector<std::string> warnings;
        CookSettings settings;
        settings.jobs = 2, settings.slip = slip, settings.read.warn = [&](const std::string& text) { warnings.push_back(text); };
        const std::string asset = folder / (slip ? "slip.rill" : "none.rill");
        CHECK(cook(folder / "in", asset, settings, [](const CookProgress&) {}).target_met);
        CHECK(std::any_of(warnings.begin(), warnings.end(), [](const std::string& w) { return w.find("moves sideways") != std::string::npos; }));
        const auto source = open_source_of(asset, folder / "in", {});
        const Verification result = verify(asset, *source, 2, {}, Scrutiny::close);
        for (const FrameMeasure& frame : result.frames) {
            CHECK(frame.source.open_edges == 0);
            CHECK(frame.decoded.open_edges == 0);
        }
        degrees[slip] = result.velocity.degrees.mean();
    }
    CAPTURE(degrees[0]);
    CHECK(degrees[1] < 0.75 * degrees[0]);
}

TEST_CASE("a cut as it is stored") {
    const Cut cut{0b010011, {-1, -2, -3}, {4, 5.5f, 6}, 0.125f, 0b000010};
    const nlohmann::json json = nlohmann::json::parse(cut_json(cut).dump());
    const Cut back = cut_from_json(json);
    CHECK(back.sides == cut.sides);
    CHECK(back.lower == cut.lower);
    CHECK(back.upper == cut.upper);
    CHECK(back.edge == cut.edge);
    CHECK(back.moving == cut.moving);
    nlohmann::json bad = json;
    SUBCASE("no edge") { bad.erase("edge"); }
    SUBCASE("edge of nothing") { bad["edge"] = 0; }
    SUBCASE("no number") { bad["lower"][1] = "low"; }
    SUBCASE("two axes") { bad["lower"].erase(2); }
    SUBCASE("no box") { bad["upper"][0] = -1; }
    SUBCASE("too large") { bad["upper"][0] = 1e60; }
    CHECK_THROWS_AS(cut_from_json(bad), nlohmann::json::exception);
}
