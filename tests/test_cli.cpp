// SPDX-License-Identifier: MIT
// The `rill` tool as scripts see it: exit codes, messages, files left and not left behind.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "readers/reader.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;
namespace fs = std::filesystem;

namespace {

struct Result {
    int code = -1;
    std::string text;  // standard output and error
};
Result run_rill(const std::string& arguments, const std::string& before = "") {
    Result result;
    FILE* pipe = popen(("exec 2>&1; " + before + "'" RILL_TOOL "' " + arguments).c_str(), "r");
    REQUIRE(pipe);
    char part[4096];
    for (size_t size; (size = fread(part, 1, sizeof part, pipe)) > 0;) result.text.append(part, size);
    const int status = pclose(pipe);
    result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    return result;
}
bool has(const Result& result, const std::string& part) { return result.text.find(part) != std::string::npos; }
nlohmann::json json_of(const std::string& path) { return nlohmann::json::parse(get_file(path), nullptr, false); }

/// A bumpy ball on its way along x: six frames, cooked once for all tests.
struct Clip {
    TestFolder folder;
    std::string input = folder / "ball", asset = folder / "ball.rill", report = folder / "report.json";
    Result cooked;
    static Mesh frame(int number) {
        Mesh mesh = bumpy_sphere(32, 0.5f, {0.02f * float(number), 0, 0.5f});
        mesh.velocities.assign(mesh.positions.size(), {0.48f, 0, 0});
        return mesh;
    }
    Clip() {
        for (int number = 3; number <= 8; ++number) put_file(input + "/frame_000" + std::to_string(number) + ".ply", plain_ply(frame(number)));
        cooked = run_rill("cook " + input + " -o " + asset + " --error 0.4e --window 3 --jobs 2 --report " + report);
    }
};
const Clip& clip() {
    static const Clip clip;
    return clip;
}

/// Every byte is accounted for, once, and each layer's are those of its chunks and their records.
void check_bytes(const std::string& asset) {
    const nlohmann::json json = nlohmann::json::parse(run_rill("info --json " + asset).text, nullptr, false);
    REQUIRE(json.is_object());
    const nlohmann::json& bytes = json["bytes"];
    uint64_t all = 0;
    for (const auto& [kind, value] : bytes.items()) all += value.is_number() ? value.get<uint64_t>() : 0;
    REQUIRE(bytes["layers"].size() == json["layers"].size());
    for (size_t l = 0; l < bytes["layers"].size(); ++l) {
        CAPTURE(l);
        const nlohmann::json &kinds = bytes["layers"][l], &layer = json["layers"][l];
        const uint64_t chunks = layer["chunks"];
        uint64_t sum = 0;
        for (const auto& [kind, value] : kinds.items()) sum += value.get<uint64_t>();
        CHECK(sum == layer["bytes"].get<uint64_t>() + 72 * chunks);
        CHECK(kinds["heads"] == 26 * chunks);
        CHECK(kinds["padding"] <= chunks);  // less than a byte each
        all += sum;
    }
    CHECK(all == fs::file_size(asset));
    CHECK(bytes["unused"] == 0);
}

}  // namespace

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

TEST_CASE("info") {
    const Result text = run_rill("info " + clip().asset), as_json = run_rill("info --json " + clip().asset);
    CHECK(text.code == 0);
    CHECK(has(text, "windows"));
    CHECK(has(text, "layers"));
    const nlohmann::json json = nlohmann::json::parse(as_json.text, nullptr, false);
    REQUIRE(json.is_object());
    CHECK(json["frames"] == 6);
    CHECK(json["first_frame"] == 3);
    CHECK(json["file_bytes"] == fs::file_size(clip().asset));
    CHECK(json["windows"].size() >= 2);
    check_bytes(clip().asset);
    for (const char* kind : {"heads", "structure", "births", "first_coefficients", "motion", "normals"}) CHECK(json["bytes"]["layers"][0][kind] > 0);
}

TEST_CASE("assets that are none: 2, whatever the command") {
    const TestFolder folder;
    const std::string bytes = get_file(clip().asset);
    REQUIRE(bytes.size() > 200);
    put_file(folder / "short.rill", bytes.substr(0, bytes.size() / 2));
    put_file(folder / "empty.rill", "");
    put_file(folder / "other.rill", plain_ply(Clip::frame(1)));
    std::string flipped = bytes;
    flipped[60] = char(flipped[60] ^ 1);
    put_file(folder / "flipped.rill", flipped);
    for (const char* name : {"short.rill", "empty.rill", "other.rill", "flipped.rill", "missing.rill"})
        for (const std::string& command : {"info " + (folder / name), "verify " + (folder / name) + " " + clip().input,
                                           "export " + (folder / name) + " -o " + (folder / "x%d.ply"), "bench " + (folder / name)}) {
            CAPTURE(command);
            const Result result = run_rill(command);
            CAPTURE(result.text);
            CHECK(result.code == 2);
            CHECK(has(result, name));
        }
}

TEST_CASE("verify: meets its target, and says so in JSON and HTML") {
    const TestFolder folder;
    const Result result = run_rill("verify " + clip().asset + " " + clip().input + " --substeps 2 --json " + (folder / "v.json") + " --html " + (folder / "v.html"));
    CAPTURE(result.text);
    CHECK(result.code == 0);
    CHECK(has(result, "worst frame"));
    CHECK(has(result, "thinner than 1 point spacing:"));
    CHECK(has(result, "2 substeps a frame"));
    const nlohmann::json json = json_of(folder / "v.json");
    REQUIRE(json.is_object());
    CHECK(json["frames"].size() == 6);
    CHECK(json["frames"][0]["frame"] == 3);
    CHECK(json["target"]["met"] == true);
    CHECK(json["summary"]["p99_m"].get<double>() <= 1.1 * json["target"]["p99_m"].get<double>());
    CHECK(json["frames"][2]["source"]["components"] == 1);
    CHECK(json["frames"][2]["source"]["large_components"] == 1);
    CHECK(json["frames"][2]["points"].get<int>() > 10);
    CHECK(json["thin"].size() == 3);
    CHECK(json["thin"][0]["area_share"] < json["thin"][2]["area_share"]);
    CHECK(json["coarser"][1]["times"] == 4);
    CHECK(json["coarser"][1]["open_edges"] == 0);
    CHECK(json["motion"]["intervals"].size() == 5);
    CHECK(json["motion"]["intervals"][4]["substeps"].size() == 2);
    CHECK(json["motion"]["lone_pieces"] == 0);
    CHECK(json["velocity"]["length_p99"] > 0);
    const std::string page = get_file(folder / "v.html");
    CHECK(page.find("<svg") != std::string::npos);
    CHECK(page.find("data:image/png;base64,") != std::string::npos);
    CHECK(page.find("http") == std::string::npos);  // fetches nothing

    const Result part = run_rill("verify " + clip().asset + " " + clip().input + " --frames 4:8:2 --json -");
    const nlohmann::json some = nlohmann::json::parse(part.text.substr(std::min(part.text.size(), part.text.find('{'))), nullptr, false);
    REQUIRE(some.is_object());
    CHECK(some["frames"].size() == 3);
    CHECK(run_rill("verify " + clip().asset + " " + clip().input + " --frames 4:9").code == 2);
}

TEST_CASE("verify: another surface than the one cooked misses the target: 3") {
    const TestFolder folder;
    for (int number = 3; number <= 8; ++number) {
        Mesh mesh = Clip::frame(number);
        for (glm::vec3& x : mesh.positions) x.z += 0.2f;
        put_file(folder / ("in/f" + std::to_string(number) + ".ply"), plain_ply(mesh));
    }
    const Result result = run_rill("verify " + clip().asset + " " + (folder / "in"));
    CHECK(result.code == 3);
    CHECK(has(result, "target missed"));
    fs::remove(folder / "in/f8.ply");
    CHECK(run_rill("verify " + clip().asset + " " + (folder / "in")).code == 2);
}

TEST_CASE("export: meshes that lie on the source, with normals and velocity") {
    const TestFolder folder;
    const Result result = run_rill("export " + clip().asset + " -o " + (folder / "out_%03d.ply") + " --frames 3:7:2");
    CAPTURE(result.text);
    REQUIRE(result.code == 0);
    const auto reader = open_sequence(folder.path.string(), {});
    CHECK(reader->info().numbers == std::vector<int>{3, 5, 7});
    const Mesh mesh = reader->read(1);
    REQUIRE(!mesh.triangles.empty());
    CHECK(signed_volume(mesh) == doctest::Approx(signed_volume(Clip::frame(5))).epsilon(0.05));
    CHECK(get_file(folder / "out_003.ply").find("property float nx") != std::string::npos);
    double speed = 0;
    for (const glm::vec3& v : mesh.velocities) speed += v.x;
    CHECK(speed / double(mesh.velocities.size()) == doctest::Approx(0.48).epsilon(0.3));

    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "mid.glb") + " --time 0.0625").code == 0);
    CHECK(get_file(folder / "mid.glb").substr(0, 4) == "glTF");
    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "coarse.obj") + " --frames 4 --cell 0.2 --layers 1").code == 0);
    CHECK(fs::file_size(folder / "coarse.obj") < fs::file_size(folder / "mid.glb"));

    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "all.ply")).code == 1);
    CHECK(run_rill("export " + clip().asset + " --cell 0.1 -o " + (folder / "all.glb")).code == 0);
    const std::string glb = get_file(folder / "all.glb");
    uint32_t json_bytes;
    std::memcpy(&json_bytes, glb.data() + 12, 4);
    const nlohmann::json scene = nlohmann::json::parse(glb.substr(20, json_bytes));
    CHECK(scene["meshes"].size() == 6);
    CHECK(scene["nodes"].size() == 7);
    REQUIRE(scene["animations"][0]["channels"].size() == 6);
    for (const char* attribute : {"POSITION", "NORMAL", "_VELOCITY"}) CHECK(scene["meshes"][3]["primitives"][0]["attributes"].contains(attribute));
    // At every frame exactly its own mesh has a size.
    const auto floats = [&](const nlohmann::json& accessor) {
        const nlohmann::json& view = scene["bufferViews"][accessor["bufferView"].get<size_t>()];
        std::vector<float> values(view["byteLength"].get<size_t>() / 4);
        std::memcpy(values.data(), glb.data() + 28 + json_bytes + view["byteOffset"].get<size_t>(), values.size() * 4);
        return values;
    };
    for (int frame = 0; frame < 6; ++frame)
        for (int node = 0; node < 6; ++node) {
            const nlohmann::json& sampler = scene["animations"][0]["samplers"][size_t(node)];
            CHECK(sampler["interpolation"] == "STEP");
            const std::vector<float> times = floats(scene["accessors"][sampler["input"].get<size_t>()]);
            const std::vector<float> scales = floats(scene["accessors"][sampler["output"].get<size_t>()]);
            REQUIRE(scales.size() == 3 * times.size());
            size_t key = 0;
            while (key + 1 < times.size() && times[key + 1] <= (float(frame) + 0.5f) / 24) ++key;
            CHECK(scales[3 * key] == (frame == node ? 1 : 0));
        }
    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "a%d.stl")).code == 1);
    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "b.ply") + " --time 99").code == 1);
    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "c%d.ply") + " --frames 1:4").code == 2);
    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "no/d%d.ply") + " --frames 4").code == 2);
    for (const auto& entry : fs::directory_iterator(folder.path)) CHECK(entry.path().extension() != ".partial");
}

TEST_CASE("bench: no allocation in frames, one output whatever the order and the workers") {
    const TestFolder folder;
    const Result result = run_rill("bench " + clip().asset + " --jobs 2 --json " + (folder / "b.json"));
    CAPTURE(result.text);
    REQUIRE(result.code == 0);
    const nlohmann::json json = json_of(folder / "b.json");
    CHECK(json["allocations_in_frames"] == 0);
    CHECK(json["output_identical"] == true);
    CHECK(json["passes"].size() == 10);
    CHECK(json["scaling"].size() == 2);
    CHECK(json["draco"]["triangles_per_second"].get<double>() > 0);
}

TEST_CASE("compare: Draco's size falls and its error grows with fewer bits") {
    const TestFolder folder;
    const Result result = run_rill("compare " + clip().input + " --asset " + clip().asset + " --frames 3:7:4 --json " + (folder / "c.json"));
    CAPTURE(result.text);
    REQUIRE(result.code == 0);
    const nlohmann::json json = json_of(folder / "c.json");
    REQUIRE(json["rivals"].size() == 3);
    for (const nlohmann::json& rival : json["rivals"])
        for (const nlohmann::json& point : rival["points"]) {
            CHECK(point["bytes_with_velocity_per_frame"].get<double>() > point["bytes_per_frame"].get<double>());
            CHECK(point["decode_ms"].get<double>() > 0);
        }
    const nlohmann::json& points = json["rivals"][0]["points"];
    REQUIRE(points.size() == 7);
    for (size_t i = 1; i < points.size(); ++i) {
        CHECK(points[i]["bytes_per_frame"].get<double>() > points[i - 1]["bytes_per_frame"].get<double>());
        CHECK(points[i]["mean_m"].get<double>() < points[i - 1]["mean_m"].get<double>());
    }
    CHECK(json["rill"]["bytes_per_frame"].get<double>() > 0);
    const Result missing = run_rill("compare " + clip().input + " --asset " + clip().asset + " --frames 3:3 --decimator /nonexistent/tool");
    CHECK(missing.code == 2);
    CHECK(missing.text.find("/nonexistent/tool: ") != std::string::npos);
}

TEST_CASE("slip: kept unless told otherwise, and no part of what is compared without velocity") {
    const TestFolder folder;
    for (int number = 1; number <= 5; ++number) {  // a ball at rest whose liquid runs up its sides
        Mesh ball = sphere(32, 0.5f);
        for (const glm::vec3& x : ball.positions) ball.velocities.push_back(4.f * (glm::vec3(0, 0, 1) - 4 * x.z * x));
        put_file(folder / "ball/f" + std::to_string(number) + ".ply", plain_ply(ball));
    }
    const auto compared = [&](const std::string& more) {
        const std::string asset = folder / "ball.rill";
        REQUIRE(run_rill("cook " + (folder / "ball") + " --quiet --force -o " + asset + more).code == 0);
        REQUIRE(run_rill("compare " + (folder / "ball") + " --asset " + asset + " --frames 2:2 --quiet --json " + (folder / "c.json")).code == 0);
        return json_of(folder / "c.json")["rill"];
    };
    const nlohmann::json kept = compared(""), left_out = compared(" --slip false");
    CHECK(kept["bytes_without_slip_per_frame"].get<double>() < kept["bytes_per_frame"].get<double>());
    CHECK(left_out["bytes_without_slip_per_frame"] == left_out["bytes_per_frame"]);
    CHECK(left_out["p99_m"].get<double>() == doctest::Approx(kept["p99_m"].get<double>()).epsilon(0.1));
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
    check("gap", {3, 4, 6}, [](Mesh&) {}, {"frame 5 is missing", "bake what is missing"});
    check("bare", three, [](Mesh& m) { m.velocities.clear(); }, {"f3.ply: no velocity; it is estimated"});
    check("fast", {3, 6, 9}, [](Mesh& m) { for (glm::vec3& v : m.velocities) v *= 24.0f; }, {"multiplied by 0.04167", "by the frame rate"});
    const auto box = [](Mesh& m) { for (glm::vec3& x : m.positions) x = glm::clamp(4.0f * x, glm::vec3(-1), glm::vec3(1)); };
    check("tank", three, [&](Mesh& m) { m = bumpy_sphere(32, 0.5f), m.velocities.assign(m.positions.size(), {}), box(m); }, {"touches its bounds: 100 %", "leave out sides"});
}

TEST_CASE("every key of every report stands in REPORTS.md") {
    const TestFolder folder;
    const std::string manual = get_file(RILL_CONTENT "/../cooker/REPORTS.md"), part = " --frames 3:4 --jobs 1 --json ";
    std::set<std::string> told;  // the words between backticks
    bool ticked = false;
    std::string word;
    for (const char c : manual) {
        const bool letter = std::isalnum(static_cast<unsigned char>(c)) || c == '_';
        if (letter) word += c;
        if (!letter && ticked) told.insert(word);
        if (!letter) word.clear();
        ticked ^= c == '`';
    }
    CHECK(run_rill("verify " + clip().asset + " " + clip().input + " --substeps 2" + part + (folder / "verify")).code == 0);
    CHECK(run_rill("compare " + clip().input + " --asset " + clip().asset + part + (folder / "compare")).code == 0);
    CHECK(run_rill("bench " + clip().asset + part + (folder / "bench")).code == 0);
    put_file(folder / "info", run_rill("info --json " + clip().asset).text);
    put_file(folder / "cook", get_file(clip().report));
    for (const std::string report : {"cook", "info", "verify", "compare", "bench"}) {
        CAPTURE(report);
        std::set<std::string> keys;
        const std::function<void(const nlohmann::json&)> collect = [&](const nlohmann::json& json) {
            for (const auto& [key, value] : json.items()) {
                if (json.is_object()) keys.insert(key);
                if (value.is_structured()) collect(value);
            }
        };
        collect(json_of(folder / report));
        CHECK(keys.size() > 10);
        for (const std::string& key : keys) CHECK_MESSAGE(told.count(key) == 1, key);
    }
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
