// SPDX-License-Identifier: MIT
// The `rill` tool cooks: exit codes, messages, files left and not left behind.
#include <algorithm>
#include <csignal>
#include <functional>

#include "cli_harness.h"

TEST_CASE("usage: help is 0, mistakes are 1 and name the option") {
    CHECK(run_rill("--help").code == 0);
    CHECK(has(run_rill("--help"), "verify"));
    CHECK(run_rill("cook --help").code == 0);
    CHECK(run_rill("--version").code == 0);
    CHECK(run_rill("").code == 1);
    CHECK(run_rill("boil").code == 1);
    CHECK(run_rill("cook").code == 1);
    const TestFolder folder;
    const std::string somewhere = " -o " + (folder / "a.rill");
    CHECK(run_rill("cook " + clip().input).code == 1);
    for (const char* bad : {"--error 3x", "--error -1e", "--frames a:b", "--frames 5:3", "--frames 1:2:0", "--frames 1:2:3:4", "--fps -3",
                            "--velocity-unit hour", "--jobs -1", "--window 0", "--nonsense"}) {
        CAPTURE(bad);
        const Result result = run_rill("cook " + clip().input + somewhere + " " + bad);
        CAPTURE(result.text);
        CHECK(result.code == 1);
        CHECK(has(result, std::string(bad).substr(0, std::string(bad).find(' '))));
    }
    CHECK(!fs::exists(folder / "a.rill"));
}

TEST_CASE("cook: an asset, a report, nothing left beside them") {
    CAPTURE(clip().cooked.text);
    REQUIRE(clip().cooked.code == 0);
    CHECK(fs::file_size(clip().asset) > 100);
    CHECK(json_of(clip().report).is_object());
    CHECK(std::distance(fs::directory_iterator(clip().folder.path), {}) == 3);
    CHECK(has(clip().cooked, "cook"));  // progress, in plain lines
}

TEST_CASE("cook: --quiet says nothing, and the same input gives the same bytes at any number of jobs") {
    const TestFolder folder;
    const Result quiet = run_rill("cook " + clip().input + " -o " + (folder / "b.rill") + " --error 0.4e --window 3 --jobs 1 --quiet");
    CHECK(quiet.code == 0);
    CHECK(quiet.text == "");
    CHECK(get_file(folder / "b.rill") == get_file(clip().asset));
}

TEST_CASE("cook: a recipe, over which the command line goes") {
    const TestFolder folder;
    const std::string recipe = folder / "r.json";
    put_file(recipe, R"({"error": "0.4e", "window": 3, "jobs": 2})");
    CHECK(run_rill("cook " + clip().input + " -o " + (folder / "b.rill") + " --quiet --recipe " + recipe).code == 0);
    CHECK(get_file(folder / "b.rill") == get_file(clip().asset));
    put_file(recipe, R"({"error": "9x", "window": 3})");
    CHECK(run_rill("cook " + clip().input + " -o " + (folder / "c.rill") + " --quiet --error 0.4e --recipe " + recipe).code == 0);
    CHECK(get_file(folder / "c.rill") == get_file(clip().asset));
    CHECK(run_rill("cook " + clip().input + " -o " + (folder / "d.rill") + " --recipe " + recipe).code == 1);
    const auto refused = [&](const std::string& text, int code, const std::string& cause) {
        put_file(recipe, text);
        const Result result = run_rill("cook " + clip().input + " -o " + (folder / "d.rill") + " --recipe " + recipe);
        CAPTURE(result.text);
        CHECK(result.code == code);
        CHECK(has(result, "r.json: " + cause));
        CHECK(std::count(result.text.begin(), result.text.end(), '\n') == 1);
    };
    refused(R"({"eror": "1e"})", 1, "'eror' is no setting of a recipe; there are");
    refused(R"({"depfile": "x"})", 1, "'depfile' is no setting");
    refused(R"({"error": "1e", "error": "2e"})", 1, "'error' stands there twice");
    refused(R"({"window": "6"})", 1, "'window' must be a number");
    refused(R"({"slip": "no"})", 1, "'slip' must be true or false");
    refused(R"({"error": 6})", 1, "'error' must be a text");
    refused(R"({"window": 900})", 1, "--window");
    refused(R"({"version": 2})", 1, "version 2 is not known");
    refused(R"({"targets": {"bytes": 3}})", 1, "'bytes' is no target");
    refused(R"({"targets": {"max_percent": -3}})", 1, "target 'max_percent' must be");
    refused("[", 2, "not JSON: parse error at line 1, column 2");
    refused("[]", 2, "not a JSON object");

    // Whole: input and output beside the recipe, and what the asset must keep to.
    put_file(recipe, R"({"version": 1, "input": "../)" + fs::path(clip().folder.path).filename().string() +
                         R"(/ball", "output": "own.rill", "error": "0.4e", "window": 3, "targets": {"bytes_per_frame": 1e6}})");
    CHECK(run_rill("cook --quiet --recipe " + recipe).code == 0);
    CHECK(get_file(folder / "own.rill") == get_file(clip().asset));
    put_file(recipe, R"({"input": "/", "output": "own.rill", "error": "0.4e", "window": 3, "targets": {"bytes_per_frame": 1, "normal_degrees": 90}})");
    const Result missed = run_rill("cook --quiet " + clip().input + " --recipe " + recipe);
    CHECK(missed.code == 3);
    CHECK(has(missed, "bytes_per_frame"));
    CHECK(!has(missed, "normal_degrees"));
}

TEST_CASE("cook: errors there are no numbers for, and an output that is no asset") {
    const TestFolder folder;
    const std::string cook = "cook " + clip().input + " --quiet -o ";
    for (const char* error : {"1e-30m", "0.00001%", "1000e", "1e30e"}) {
        const Result result = run_rill(cook + (folder / "a.rill") + " --error " + error);
        CAPTURE(result.text);
        CHECK(result.code == 1);
        CHECK(has(result, std::string("--error '") + error + "' is"));
    }
    // Points come no nearer to the source than .02 edges: finer aims are missed by what that gives.
    const Result fine = run_rill(cook + (folder / "a.rill") + " --error 0.001e"), finer = run_rill(cook + (folder / "c.rill") + " --error 0.0001e");
    CHECK(fine.code == 3);
    CHECK(finer.code == 3);
    CHECK(fs::file_size(folder / "c.rill") == doctest::Approx(fs::file_size(folder / "a.rill")).epsilon(0.05));
    const std::string source = plain_ply(Clip::frame(1));
    put_file(folder / "f1.ply", source);
    for (const std::string& command : {"cook " + (folder / "f1.ply") + " --force", cook.substr(0, cook.size() - 4), cook.substr(0, cook.size() - 4) + " --dry-run", "link " + (folder / "f1.ply")}) {
        const Result result = run_rill(command + " --quiet -o " + (folder / "f1.ply"));
        CAPTURE(result.text);
        CHECK(result.code == 2);
        CHECK(has(result, "f1.ply: is there already and no Rill asset"));
        CHECK(get_file(folder / "f1.ply") == source);
    }
    put_file(folder / "b.rill", "");  // as mktemp leaves it
    CHECK(run_rill(cook + (folder / "b.rill") + " --error 0.4e --window 3").code == 0);
    CHECK(get_file(folder / "b.rill") == get_file(clip().asset));
}

TEST_CASE("cook: bad input is 2, one line, and no asset") {
    const TestFolder folder;
    const std::string asset = folder / "a.rill", input = folder / "in";
    auto check = [&](const std::string& cause) {
        const Result result = run_rill("cook " + input + " -o " + asset + " --quiet");
        CAPTURE(result.text);
        CHECK(result.code == 2);
        CHECK(has(result, cause));
        CHECK(std::count(result.text.begin(), result.text.end(), '\n') == 1);
        CHECK(std::distance(fs::directory_iterator(folder.path), {}) == (fs::exists(input) ? 1 : 0));
    };
    check("no such file");
    fs::create_directories(input);
    check("empty");
    for (int number : {1, 3, 6}) put_file(input + "/f" + std::to_string(number) + ".ply", plain_ply(Clip::frame(number)));
    check("frame 6 does not fit");
    fs::remove_all(input);
    for (int number : {1, 2, 4}) put_file(input + "/f" + std::to_string(number) + ".ply", plain_ply(Clip::frame(number)));
    Mesh bad = Clip::frame(3);
    bad.positions[7].x = std::nanf("");
    put_file(input + "/f3.ply", plain_ply(bad));
    check("f3.ply: position of vertex 7");
    bad = Clip::frame(3);
    bad.triangles[5][1] = uint32_t(bad.positions.size());
    put_file(input + "/f3.ply", plain_ply(bad));
    check("f3.ply: triangle 5 refers to vertex");
    put_file(input + "/f3.ply", plain_ply(Clip::frame(3)).substr(0, 5000));
    check("f3.ply");
    fs::remove_all(input);
    put_file(input + "/config/config_0001.uni", gzip(mantaflow_config(1, 24, {}, {1, 0, 0, 0, 1, 0, 0, 0, 1})));
    put_file(input + "/mesh/lVelMesh_0001.uni", gzip(mantaflow_velocity(Clip::frame(1).velocities)));
    const std::string packed = gzip(mantaflow_mesh(Clip::frame(1)));
    put_file(input + "/mesh/fluid_mesh_0001.bobj.gz", packed.substr(0, packed.size() / 2));
    check("fluid_mesh_0001.bobj.gz");
    put_file(input + "/mesh/lVelMesh_0001.uni", gzip(mantaflow_velocity({})));
    put_file(input + "/mesh/fluid_mesh_0001.bobj.gz", packed);
    check("velocities for 0 vertices");
    fs::remove_all(input);
    for (int number : {1, 2, 3}) {
        Mesh wide = Clip::frame(number);
        for (size_t i = 0; i < wide.positions.size(); ++i) wide.positions[i] *= 1e6f, wide.velocities[i] *= 1e6f;
        put_file(input + "/f" + std::to_string(number) + ".ply", plain_ply(wide));
    }
    check("m across, more than 1e+05 m");
    const Result result = run_rill("cook " + clip().input + " -o " + (folder / "no/where.rill") + " --quiet");
    CHECK(result.code == 2);
    CHECK(has(result, "where.rill"));
}

TEST_CASE("output that cannot be written: 2, one line, nothing left behind") {
    const TestFolder folder;
    const auto check = [&](const Result& result, const std::string& cause, int left) {
        CAPTURE(result.text);
        CHECK(result.code == 2);
        CHECK(has(result, cause));
        CHECK(std::count(result.text.begin(), result.text.end(), '\n') == 1);
        CHECK(std::distance(fs::directory_iterator(folder.path), {}) == left);
    };
    // A full disk, as a limit of 512 or 1024 bytes a file.
    const std::string cook = "cook " + clip().input + " --error 0.4e --window 3 --quiet -o ";
    check(run_rill(cook + (folder / "a.rill"), "trap '' XFSZ; ulimit -f 1; "), "a.rill", 0);
    check(run_rill("export " + clip().asset + " --frames 3 -o " + (folder / "a%d.ply"), "trap '' XFSZ; ulimit -f 1; "), "a3.ply", 0);
    check(run_rill("info --json " + clip().asset + " 3>&1 >/dev/full 2>&3"), "standard output", 0);
    fs::create_directory(folder / "d");  // in the way
    check(run_rill(cook + (folder / "d")), "d: cannot be written", 1);
    check(run_rill("export " + clip().asset + " --frames 3 -o " + (folder / "no/a%d.ply")), "a3.ply", 1);
}

TEST_CASE("output through links goes where they lead, into devices as they are, and never over the input") {
    const TestFolder folder;
    const std::string sure = "cook " + clip().input + " --error 0.4e --window 3 --quiet -o " + (folder / "a.rill");
    put_file(folder / "real.json", "old");
    fs::create_symlink(folder / "real.json", folder / "link.json");
    fs::create_symlink("/dev/null", folder / "null");
    CHECK(run_rill(sure + " --report " + (folder / "link.json")).code == 0);
    CHECK(fs::is_symlink(folder / "link.json"));
    CHECK(json_of(folder / "real.json").is_object());
    CHECK(run_rill(sure + " --report " + (folder / "null")).code == 0);
    CHECK(fs::is_symlink(folder / "null"));
    CHECK(run_rill("cook " + clip().input + " --quiet -o " + (folder / "null")).code == 2);
    CHECK(fs::is_symlink(folder / "null"));

    put_file(folder / "b.rill", "");
    fs::create_symlink(folder / "b.rill", folder / "link.rill");
    CHECK(run_rill("cook " + clip().input + " --error 0.4e --window 3 --quiet -o " + (folder / "link.rill")).code == 0);
    CHECK(fs::is_symlink(folder / "link.rill"));
    CHECK(get_file(folder / "b.rill") == get_file(clip().asset));

    const std::string mine = folder / "in", frame = mine + "/frame_0003.ply";
    fs::copy(clip().input, mine);
    REQUIRE(fs::exists(frame));
    const std::string before = get_file(frame);
    for (const std::string& line : {"cook " + mine + " -o " + (folder / "c.rill") + " --report ", "verify " + clip().asset + " " + mine + " --json ",
                                    "cook " + mine + " -o " + (folder / "c.rill") + " --depfile "}) {
        const Result result = run_rill(line + frame);
        CAPTURE(result.text);
        CHECK(result.code == 2);
        CHECK(has(result, "frame_0003.ply: is a file of the input"));
        CHECK(get_file(frame) == before);
    }
    CHECK(!fs::exists(folder / "c.rill"));
}

TEST_CASE("frame numbers: where the pattern says, and below zero") {
    const TestFolder folder;
    for (int number = 3; number <= 5; ++number) {
        const std::string bytes = get_file(clip().input + "/frame_000" + std::to_string(number) + ".ply");
        put_file(folder / "below" + "/f_" + std::to_string(number - 5) + ".ply", bytes);
        put_file(folder / "version" + "/f_" + std::to_string(number) + "_v2.ply", bytes);
    }
    put_file(folder / "version" + "/f_x_v2.ply", "another file");
    for (const char* input : {"below", "version/f_%d_v2.ply"}) {
        CAPTURE(input);
        const Result result = run_rill("cook " + (folder / input) + " --error 0.4e --quiet -o " + (folder / "a.rill") + " --force");
        CAPTURE(result.text);
        CHECK(result.code == 0);
        CHECK(result.text == "");
        const Result info = run_rill("info " + (folder / "a.rill"));
        CHECK(has(info, std::string(input) == "below" ? "3 from -2 by 1" : "3 from 3 by 1"));
        CHECK(run_rill("verify " + (folder / "a.rill") + " " + (folder / input) + " --quiet").code == 0);
    }
}

TEST_CASE("cook: a signal ends it, and nothing is left behind") {
    const TestFolder folder;
    const std::string asset = folder / "a.rill";
    // The signal comes when the asset is under way.
    const Result result = run_rill("cook " + clip().input + " -o " + asset + " --error 0.05e --jobs 1 --quiet & p=$!; while kill -0 $p && ! ls " +
                                   asset + "* >/dev/null 2>&1; do sleep 0.01; done; kill -TERM $p; wait $p");
    CAPTURE(result.text);
    CHECK(result.code == 128 + SIGTERM);
    CHECK(has(result, "interrupted"));
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("cook: a single frame, and frames without liquid") {
    const TestFolder folder;
    put_file(folder / "one/f7.ply", plain_ply(Clip::frame(7)));
    const Result one = run_rill("cook " + (folder / "one") + " -o " + (folder / "one.rill") + " --error 0.75e");
    CAPTURE(one.text);
    CHECK(one.code == 0);
    CHECK(run_rill("verify " + (folder / "one.rill") + " " + (folder / "one")).code == 0);
    put_file(folder / "none/f1.ply", plain_ply(Mesh{}));
    put_file(folder / "none/f2.ply", plain_ply(Mesh{}));
    const Result none = run_rill("cook " + (folder / "none") + " -o " + (folder / "none.rill"));
    CAPTURE(none.text);
    CHECK(none.code == 0);
    CHECK(run_rill("verify " + (folder / "none.rill") + " " + (folder / "none")).code == 0);
    CHECK(run_rill("export " + (folder / "none.rill") + " -o " + (folder / "n%d.glb")).code == 0);
}

TEST_CASE("cook: warnings tell what is wrong and what to do about it") {
    const TestFolder folder;
    const auto check = [&](const char* name, std::vector<int> numbers, const std::function<void(Mesh&)>& change, const std::vector<std::string>& words) {
        CAPTURE(name);
        for (const int number : numbers) {
            Mesh mesh = Clip::frame(number);
            change(mesh);
            put_file(folder / name + "/f" + std::to_string(number) + ".ply", plain_ply(mesh));
        }
        const Result result = run_rill("cook " + (folder / name) + " --quiet --survey " + (folder / "survey"));
        CAPTURE(result.text);
        CHECK(result.code == 0);
        CHECK(std::count(result.text.begin(), result.text.end(), '\n') == (words.empty() ? 0 : 1));
        for (const std::string& word : words) CHECK_MESSAGE(has(result, word), word);
    };
    const std::vector<int> three = {3, 4, 5};
    check("sound", three, [](Mesh&) {}, {});
    check("open", three, [](Mesh& m) { m.triangles.resize(m.triangles.size() - 5); }, {"warning", "f3.ply: the mesh is open (", "export the whole liquid"});
    check("inside_out", three, [](Mesh& m) { for (Triangle& t : m.triangles) std::swap(t[1], t[2]); }, {"f3.ply: triangles face inward"});
    check("uneven", three, [](Mesh& m) { for (size_t i = 0; i < m.triangles.size(); i += 9) std::swap(m.triangles[i][1], m.triangles[i][2]); },
          {"f3.ply (", "otherwise than their neighbours are turned"});
    check("gap", {3, 4, 6}, [](Mesh&) {}, {"frame 5 is missing", "bake what is missing"});
    check("bare", three, [](Mesh& m) { m.velocities.clear(); }, {"f3.ply: no velocity; it is estimated"});
    check("fast", {3, 6, 9}, [](Mesh& m) { for (glm::vec3& v : m.velocities) v *= 24.0f; }, {"multiplied by 0.04167", "by the frame rate"});
}

TEST_CASE("cook: dry run, up to date, depfile, segments and link") {
    const TestFolder folder;
    const std::string asset = folder / "a b.rill", common = "cook " + clip().input + " --error 0.4e --window 3 ";
    Result result = run_rill(common + "--dry-run -o '" + asset + "'");
    CAPTURE(result.text);
    CHECK(result.code == 0);
    for (const char* part : {"PLY sequence, 6 frames from 3 to 8", "carries on to the next frame, times 1", "spans     1 of 12 frames", "would be cooked"})
        CHECK(has(result, part));
    CHECK(fs::is_empty(folder.path));
    CHECK(run_rill(common + "--quiet -o '" + asset + "' --depfile " + (folder / "d")).code == 0);
    const std::string rule = get_file(folder / "d");
    CHECK(rule.find("a\\ b.rill: \\\n  " + clip().input + "/frame_0003.ply \\\n") != std::string::npos);
    CHECK(rule.find("frame_0008.ply") != std::string::npos);
    CHECK(rule.find("  " + clip().input + "\n") != std::string::npos);
    CHECK(has(run_rill(common + "--dry-run -o '" + asset + "'"), "up to date"));
    result = run_rill(common + "-o '" + asset + "'");
    CHECK(result.code == 0);
    CHECK(has(result, "up to date"));
    CHECK(!has(run_rill(common + "--force -o '" + asset + "'"), "up to date"));

    // A single span: the first segment has nothing to do.
    const std::string fine = "cook " + clip().input + " --error 0.4e --window 1 --quiet ";
    const int code = run_rill(fine + "-o " + (folder / "whole.rill")).code;
    CHECK((code == 0 || code == 3));  // windows this short may miss; then linking tells it
    for (const char* segment : {"1", "2"})
        CHECK(run_rill(fine + "--segment " + segment + "/2 --survey " + (folder / "survey") + " -o " + (folder / (std::string("p") + segment))).code == 0);
    const std::string parts = (folder / "p2") + " " + (folder / "p1");
    CHECK(run_rill("link " + parts + " --quiet -o " + (folder / "linked.rill") + " --report " + (folder / "r.json")).code == code);
    CHECK(get_file(folder / "linked.rill") == get_file(folder / "whole.rill"));
    CHECK(json_of(folder / "r.json")["measured"]["frames"] == 6);
    result = run_rill("link " + (folder / "p1") + " -o " + (folder / "x.rill"));
    CHECK(result.code == 2);
    CHECK(has(result, "nothing to link"));
    for (const char* bad : {"0/2", "3/2", "1", "1/2x", "a/b", "1/-2"}) {
        CAPTURE(bad);
        CHECK(run_rill(fine + "-o " + (folder / "x") + " --segment " + bad).code == 1);
    }
}
