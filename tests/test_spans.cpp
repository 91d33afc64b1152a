// SPDX-License-Identifier: MIT
// Spans: cooked anywhere, in any order, interrupted and resumed, they make the same asset to the byte.
#include <doctest/doctest.h>

#include <cmath>

#include "asset/asset_player.h"
#include "cook/cook.h"
#include "cook/parts_to_asset.h"
#include "measure/surface_distance.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;
namespace fs = std::filesystem;

namespace {

constexpr int frames = 13;  // in windows of 1, spans of 4: three spans

Mesh of_frame(int i) {
    Mesh mesh = bumpy_sphere(12, 0.5f, {0.03f * float(i), 0.02f * float(i % 5), 0.5f});
    mesh.velocities.assign(mesh.positions.size(), {0.03f * 24, 0, 0});
    return mesh;
}

struct Clip {
    TestFolder folder;
    std::string input = folder / "in", asset = folder / "out.rill";
    CookSettings settings;
    Clip() {
        for (int i = 0; i < frames; ++i) put_file(input + "/f" + std::to_string(i + 1) + ".ply", plain_ply(of_frame(i)));
        settings.error = "0.4e", settings.window = 1, settings.jobs = 2, settings.layers = 2;
    }
    CookReport cook(const std::string& output, const std::function<void(const CookProgress&)>& progress = [](const CookProgress&) {}) const {
        return rill::cooker::cook(input, output, settings, progress);
    }
    std::vector<std::string> segments(uint32_t count) {
        std::vector<std::string> parts;
        for (uint32_t i = 0; i < count; ++i) {
            settings.segment = i, settings.segments = count;
            parts.push_back(folder / ("part" + std::to_string(i) + "of" + std::to_string(count)));
            cook(parts.back());
        }
        settings.segments = 0;
        return parts;
    }
    size_t files() const { return size_t(std::distance(fs::directory_iterator(folder.path), {})); }
};
/// Cooked in one go, once for all tests.
const std::string& whole() {
    static const std::string bytes = [] {
        const Clip clip;
        clip.cook(clip.asset);
        return get_file(clip.asset);
    }();
    return bytes;
}
std::string message_of(const std::function<void()>& work) {
    try {
        work();
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}
bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("spans cover every frame, share their borders, and none is tiny") {
    for (uint32_t window : {1u, 3u, 24u})
        for (uint32_t count = 1; count < 400; ++count) {
            const SpanPlan plan{count, window};
            CAPTURE(window);
            CAPTURE(count);
            REQUIRE(plan.first(0) == 0);
            REQUIRE(plan.last(plan.spans() - 1) == count - 1);
            for (uint32_t s = 0; s < plan.spans(); ++s) {
                if (s > 0) REQUIRE(plan.first(s) == plan.last(s - 1));
                if (plan.spans() > 1) REQUIRE(2 * (plan.last(s) - plan.first(s)) >= plan.length());
            }
            uint32_t next = 0;
            for (uint32_t i = 0; i < 7; ++i) {
                const SpanRange share = segment_of(plan, i, 7);
                REQUIRE(share.first == next);
                next = share.end;
            }
            REQUIRE(next == plan.spans());
        }
}

TEST_CASE("windows fill a span and are of even length; calm ones are longer, but not too long") {
    for (uint32_t window : {1u, 3u, 24u, 64u})
        for (uint32_t steps = 1; steps < 600; ++steps) {
            const SpanPlan plan{steps + 1, window, window == usual_window ? usual_calm_window : 0};
            CAPTURE(window);
            CAPTURE(steps);
            uint32_t shortest = UINT32_MAX, longest = 0;
            for (uint32_t begin = 0, end; begin < steps; begin = end) {
                end = plan.window_end(begin, steps);
                REQUIRE((end > begin && end <= steps));
                shortest = std::min(shortest, end - begin), longest = std::max(longest, end - begin);
                const uint32_t calm = plan.calm_window_end(begin, steps);
                REQUIRE((calm >= end && calm <= steps && calm - begin <= std::max(end - begin, plan.calm_window)));
            }
            REQUIRE(longest - shortest <= 1);
            REQUIRE((longest <= SpanPlan::most_window && 2 * longest <= 3 * window));
            if (steps >= window && window < SpanPlan::most_window) REQUIRE(3 * shortest >= 2 * window - 2);
        }
    CHECK(SpanPlan{100, 24, 48}.calm_window_end(0, 96) == 48);
    CHECK(SpanPlan{100, 24, 0}.calm_window_end(0, 96) == 24);
}

TEST_CASE("segments, linked in any order, are the asset that one machine makes") {
    Clip clip;
    REQUIRE(SpanPlan{frames, 1}.spans() == 3);
    for (uint32_t count : {1u, 3u, 5u}) {
        CAPTURE(count);
        std::vector<std::string> parts = clip.segments(count);
        std::reverse(parts.begin(), parts.end());
        const Linked linked = link_asset(parts, clip.asset);
        CHECK(get_file(clip.asset) == whole());
        CHECK(linked.target_met);
        // Parts of parts: as if gathered on the way.
        if (count == 3) {
            link_part({parts[1], parts[0]}, clip.folder / "both");
            link_asset({parts[2], clip.folder / "both"}, clip.asset);
            CHECK(get_file(clip.asset) == whole());
        }
    }
}

TEST_CASE("a part is an asset of its frames") {
    Clip clip;
    const std::vector<std::string> parts = clip.segments(3);
    AssetPlayer player(parts[1]);
    CHECK(player.info().first_frame == 5);
    CHECK(player.info().frames == 5);
    CHECK(!player.mesh(player.frame_seconds(2)).triangles.empty());
}

TEST_CASE("one survey serves all segments, until the input is touched") {
    Clip clip;
    clip.settings.survey = clip.folder / "survey.json";
    link_asset(clip.segments(2), clip.asset);
    CHECK(get_file(clip.asset) == whole());
    // Only who looked at the frames says so.
    bool surveyed = false;
    const auto watch = [&](const CookProgress& p) { surveyed |= p.stage == "surveying"; };
    clip.cook(clip.folder / "again.rill", watch);
    CHECK(!surveyed);
    put_file(clip.input + "/f3.ply", plain_ply(of_frame(3)));
    clip.cook(clip.folder / "changed.rill", watch);
    CHECK(surveyed);
    CHECK(get_file(clip.folder / "changed.rill") != whole());
    put_file(clip.settings.survey, "{\"report\": 7}");
    clip.cook(clip.folder / "damaged.rill");
    CHECK(get_file(clip.folder / "damaged.rill") == get_file(clip.folder / "changed.rill"));
}

TEST_CASE("link names what does not fit, and writes nothing") {
    Clip clip;
    const std::vector<std::string> parts = clip.segments(3);
    const auto fails = [&](const std::vector<std::string>& given, const std::string& cause) {
        const std::string message = message_of([&] { link_asset(given, clip.asset); });
        CAPTURE(message);
        CHECK(has(message, cause));
        CHECK(!fs::exists(clip.asset));
    };
    fails({parts[1], parts[2]}, "before frame 5 are missing");
    fails({parts[0], parts[2]}, "between frames 5 and 9 are missing");
    fails({parts[0], parts[1]}, "after frame 9 are missing");
    fails({parts[0], parts[1], parts[1], parts[2]}, "also in");
    fails({}, "nothing to link");
    fails({clip.folder / "none"}, "none: cannot be read");
    std::string damaged = get_file(parts[1]);
    damaged[damaged.size() - 7] = char(damaged[damaged.size() - 7] ^ 4);
    put_file(clip.folder / "damaged", damaged);
    fails({parts[0], clip.folder / "damaged", parts[2]}, "damaged: the checksum of chunk");
    clip.settings.error = "0.5e";
    const std::vector<std::string> others = clip.segments(2);
    fails({parts[0], others[1]}, "not of the same cook");
    put_file(clip.folder / "whole.rill", whole());
    fails({clip.folder / "whole.rill"}, "no part");
    put_file(clip.folder / "none of 9", "");
    fails({clip.folder / "none of 9"}, "no part given holds a span");
}

TEST_CASE("an interrupted cook goes on from its finished spans; damaged ones are cooked again") {
    struct Stop {};
    Clip clip;
    const auto stop_at = [&](uint32_t frame) {
        CHECK_THROWS_AS(clip.cook(clip.asset, [&](const CookProgress& p) { if (p.stage == "cooking" && p.frames_done >= frame) throw Stop(); }), Stop);
    };
    std::string said;
    clip.settings.read.warn = [&](const std::string& message) { said += message; };
    stop_at(1);  // within the first: nothing to keep
    CHECK(clip.files() == 1);
    CHECK(!has(said, "keeps the finished spans"));
    stop_at(9);  // within the third span
    CHECK(has(said, "keeps the finished spans"));
    REQUIRE(clip.files() == 2);
    fs::path kept;
    for (const auto& entry : fs::directory_iterator(clip.folder.path))
        if (entry.is_directory() && has(entry.path().filename().string(), "out.rill.cook-")) kept = entry.path();
    REQUIRE(!kept.empty());
    const std::string second = (kept / "span_00002_of_00003.rill").string();
    CHECK(std::distance(fs::directory_iterator(kept), {}) == 2);
    CHECK(plan_cook(clip.input, clip.asset, clip.settings).finished == 2);

    uint32_t expected = 1;
    SUBCASE("resumed") { expected = 2; }
    SUBCASE("damaged") { put_file(second, get_file(second).substr(0, 700)); }
    SUBCASE("another's") { put_file(second, get_file(kept / "span_00001_of_00003.rill")); }
    SUBCASE("flipped") {
        std::string bytes = get_file(second);
        bytes[bytes.size() - 9] = char(bytes[bytes.size() - 9] ^ 1);
        put_file(second, bytes);
    }
    const uint32_t finished = plan_cook(clip.input, clip.asset, clip.settings).finished;
    CHECK(finished == expected);
    uint32_t calls = 0;
    clip.cook(clip.asset, [&](const CookProgress& p) { calls += p.stage == "cooking" ? 1 : 0; });
    CHECK(calls == 3 * (windows_per_span + 1) - windows_per_span * finished);  // a span's end, and its windows where it is cooked
    CHECK(get_file(clip.asset) == whole());
    CHECK(clip.files() == 2);  // input and asset: what was kept is gone
}

TEST_CASE("of two cooks of one output the second is told of the first, which goes on") {
    Clip clip;
    std::string same, other;
    uint32_t calls = 0;
    clip.cook(clip.asset, [&](const CookProgress& p) {
        if (p.stage != "cooking" || calls++) return;
        same = message_of([&] { clip.cook(clip.asset); });
        Clip with_other_settings;
        with_other_settings.settings.error = "0.3e";
        other = message_of([&] { with_other_settings.cook(clip.asset); });
    });
    CHECK(has(same, "out.rill: another cook is writing it"));
    CHECK(other == same);
    CHECK(get_file(clip.asset) == whole());
    CHECK(clip.files() == 2);
    clip.settings.force = true;
    clip.cook(clip.asset);  // when it is done, others may
    CHECK(get_file(clip.asset) == whole());
}

TEST_CASE("what is there already is not cooked again: same input, settings and tool") {
    Clip clip;
    put_file(clip.asset, whole());
    const auto time = fs::last_write_time(clip.asset);
    uint32_t steps = 0;
    const auto count = [&](const CookProgress&) { ++steps; };
    CookReport report = clip.cook(clip.asset, count);
    CHECK(report.up_to_date);
    CHECK(report.target_met);
    CHECK(report.json["measured"]["frames"] == frames);
    CHECK(steps == 0);
    CHECK(fs::last_write_time(clip.asset) == time);
    CHECK(plan_cook(clip.input, clip.asset, clip.settings).up_to_date);

    SUBCASE("moved, and under other names of the same order: still the same input") {
        fs::rename(clip.input, clip.folder / "elsewhere");
        clip.input = clip.folder / "elsewhere";
        CHECK(clip.cook(clip.asset, count).up_to_date);
    }
    SUBCASE("forced") {
        clip.settings.force = true;
        CHECK(!clip.cook(clip.asset, count).up_to_date);
        CHECK(get_file(clip.asset) == whole());
    }
    SUBCASE("another setting") {
        clip.settings.layers = 3;
        CHECK(!clip.cook(clip.asset, count).up_to_date);
    }
    SUBCASE("a byte of the input") {
        std::string bytes = get_file(clip.input + "/f7.ply");
        bytes[bytes.find("end_header") + 40] ^= 1;
        put_file(clip.input + "/f7.ply", bytes);
        CHECK(!clip.cook(clip.asset, count).up_to_date);
    }
    SUBCASE("a damaged asset") {
        std::string bytes = get_file(clip.asset);
        bytes[bytes.size() - 5] ^= 1;
        put_file(clip.asset, bytes);
        CHECK(!clip.cook(clip.asset, count).up_to_date);
        CHECK(get_file(clip.asset) == whole());
    }
    SUBCASE("a part, likewise") {
        clip.settings.segments = 2;
        clip.cook(clip.folder / "p");
        CHECK(clip.cook(clip.folder / "p", count).up_to_date);
        clip.settings.segment = 1;
        CHECK(!clip.cook(clip.folder / "p", count).up_to_date);
    }
}

TEST_CASE("at a span's border nothing pops more than at a window's") {
    Clip clip;
    const CookReport report = clip.cook(clip.asset);
    AssetPlayer player(clip.asset);
    for (int border : {2, 4, 6, 8, 10}) {  // 4 and 8 are spans'
        CAPTURE(border);
        const double t = border / 24.0, nearly = 1e-6;
        const Mesh before = player.mesh(t - nearly), after = player.mesh(t + nearly);
        CHECK(surface_distance(before, SurfaceIndex(before), after, SurfaceIndex(after)).p99 < 2 * report.target_p99);
    }
}

TEST_CASE("a gap in the frames: true times, the source's numbers") {
    Clip clip;
    for (int gone : {4, 5, 11}) fs::remove(clip.input + "/f" + std::to_string(gone) + ".ply");
    const CookReport report = clip.cook(clip.asset);
    CHECK(report.target_met);
    const AssetDirectory directory = read_directory(clip.asset);
    REQUIRE(directory.header.frame_count == 10);
    CHECK(directory.numbers == std::vector<int>{1, 2, 3, 6, 7, 8, 9, 10, 12, 13});
    CHECK(directory.index_of(6) == 3);
    CHECK(has(message_of([&] { directory.index_of(5); }), "no frame 5"));
    AssetPlayer player(clip.asset);
    CHECK(player.frame_seconds(3) == doctest::Approx(5 / 24.0));
    link_asset(clip.segments(2), clip.folder / "linked.rill");
    CHECK(get_file(clip.folder / "linked.rill") == get_file(clip.asset));
    // Verified frame by frame against the same input.
    const auto source = open_source_of(clip.asset, clip.input, {});
    CHECK(verify(clip.asset, *source, 2).p99 < 1.2 * report.target_p99);
}

TEST_CASE("the asset remembers how its source was to be read") {
    Clip clip;
    clip.settings.read.up = 'y', clip.settings.read.handedness = 'l', clip.settings.read.scale = 0.5, clip.settings.read.frames_per_second = 48;
    for (int i = 4; i <= frames; ++i) fs::remove(clip.input + "/f" + std::to_string(i) + ".ply");
    const CookReport report = clip.cook(clip.asset);
    CHECK(report.json["settings"]["read"]["scale"] == 0.5);
    const auto source = open_source_of(clip.asset, clip.input, {});
    CHECK(source->info().frames_per_second == 48);
    const Verification result = verify(clip.asset, *source, 2);
    CHECK(result.p99 < 1.5 * report.target_p99);  // a bumpy ball as an ellipsoid
    CHECK(read_directory(clip.asset).header.upper[1] > 0.4);  // the source's z, which reaches higher than its y
    ReadOptions other;
    other.scale = 1;
    CHECK(verify(clip.asset, *open_source_of(clip.asset, clip.input, other), 2).p99 > 2 * report.target_p99);
}
