// SPDX-License-Identifier: MIT
// The `rill` tool cooks to a rate; apart from test_cli, for it takes most of the time.
#include "cli_harness.h"

TEST_CASE("cook: a rate is met within 3 %, by the best error that it allows") {
    const TestFolder folder;
    const std::string input = RILL_CONTENT "/drop_splash", few = " --frames 20:24 --window 4 ";
    const auto cook = [&](const std::string& rate, const std::string& asset, const std::string& more) {
        return run_rill("cook " + input + few + "-o " + (folder / asset) + " --bitrate " + rate + " " + more);
    };
    double p99[2];
    for (int i = 0; i < 2; ++i) {
        const int rate = i ? 400 : 250;
        const Result result = cook(std::to_string(rate), "a.rill", "--jobs 1 --quiet --report " + (folder / "a.json"));
        CAPTURE(result.text);
        CHECK(result.code == 0);
        CHECK(double(fs::file_size(folder / "a.rill")) * 8 / 1000 / (5 / 24.0) == doctest::Approx(rate).epsilon(0.03));
        const nlohmann::json report = json_of(folder / "a.json");
        CHECK(report["settings"]["bitrate"] == rate);
        CHECK(!report["settings"].contains("error"));
        CHECK(report["target"]["kilobits_per_second"] == rate);
        CHECK(report["spans"][0]["attempts"] <= 6);
        p99[i] = report["measured"]["p99_m"];
        if (i) continue;
        // The same on three threads, and by a recipe; known when there already.
        put_file(folder / "r.json", R"({"window": 4, "frames": "20:24", "output": "b.rill", "bitrate": 250, "jobs": 3})");
        CHECK(run_rill("cook " + input + " --quiet --recipe " + (folder / "r.json")).code == 0);
        CHECK(get_file(folder / "b.rill") == get_file(folder / "a.rill"));
        const Result again = cook("250", "a.rill", "");
        CHECK(again.code == 0);
        CHECK(has(again, "up to date"));
        CHECK(has(again, "kbit/s, aimed at 250 kbit/s"));
    }
    CHECK(p99[1] < p99[0]);
    check_bytes(folder / "a.rill");
}

TEST_CASE("cook: a rate that cannot be met, and one beside an error") {
    const TestFolder folder;
    const std::string cook = "cook " + clip().input + " --window 3 -o " + (folder / "a.rill") + " ", recipe = folder / "r.json";
    const Result missed = run_rill(cook + "--quiet --bitrate 1");  // less than the directory takes
    CHECK(missed.code == 3);
    CHECK(has(missed, "target missed: the rate is"));
    CHECK(fs::remove(folder / "a.rill"));
    const Result both = run_rill(cook + "--error 1e --bitrate 100");
    CHECK(both.code == 1);
    CHECK(has(both, "--error excludes --bitrate"));
    CHECK(run_rill(cook + "--bitrate -1").code == 1);
    put_file(recipe, R"({"error": "1e", "bitrate": 100})");
    const Result in_recipe = run_rill(cook + "--recipe " + recipe);
    CHECK(in_recipe.code == 1);
    CHECK(has(in_recipe, "r.json: 'bitrate' stands in place of 'error'"));
    CHECK(!fs::exists(folder / "a.rill"));
    put_file(recipe, R"({"bitrate": 100})");  // on the command line either goes before both
    CHECK(run_rill(cook + "--quiet --error 0.4e --recipe " + recipe).code == 0);
    CHECK(get_file(folder / "a.rill") == get_file(clip().asset));
}
