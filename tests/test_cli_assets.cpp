// SPDX-License-Identifier: MIT
// The `rill` tool looks at assets, measures and exports them: exit codes, messages, reports.
#include <functional>
#include <set>

#include "cli_harness.h"
#include "frames/open_sequence.h"

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
    CHECK(json["walls"].empty());
    CHECK(has(text, "walls        none"));
    const std::string tank = RILL_GOLDEN "/v5.rill";
    CHECK(has(run_rill("info " + tank), "walls        x- x+ y- y+ z-\n"));
    CHECK(nlohmann::json::parse(run_rill("info --json " + tank).text)["walls"] == nlohmann::json({"x-", "x+", "y-", "y+", "z-"}));
    check_bytes(clip().asset);
    for (const char* kind : {"structure", "births", "first_coefficients", "motion", "normals"}) CHECK(json["bytes"]["layers"][0][kind] > 0);
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
    CHECK(has(run_rill("info " + (folder / "empty.rill")), "it is empty, as the parts of segments are"));
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

TEST_CASE("verify: frames between the asset's are held against the moment between, without a target") {
    const TestFolder folder;
    const std::string input = folder / "in", asset = folder / "half.rill";
    for (int number = 3; number <= 8; ++number) {
        Mesh mesh = bumpy_sphere(32, 0.5f, {0.1f * float(number), 0, 0.5f});
        mesh.velocities.assign(mesh.positions.size(), {2.4f, 0, 0});
        put_file(input + "/f" + std::to_string(number) + ".ply", plain_ply(mesh));
    }
    REQUIRE(run_rill("cook " + input + " -o " + asset + " --error 0.4e --frames 3:7:2").code == 0);
    const Result result = run_rill("verify " + asset + " " + input + " --frames 4:6:2 --json " + (folder / "v.json"));
    CAPTURE(result.text);
    CHECK(result.code == 0);
    CHECK(has(result, "2 of them lie between"));
    const nlohmann::json json = json_of(folder / "v.json");
    REQUIRE(json.is_object());
    REQUIRE(json["frames"].size() == 2);
    CHECK(json["frames"][1]["frame"] == 6);
    CHECK(json["frames"][1]["between"] == true);
    CHECK(json["frames"][1]["seconds"].get<double>() == doctest::Approx(3 / 24.0));
    CHECK(json["target"].is_null());
    CHECK(json["summary"]["p99_m"].get<double>() < 0.06);  // a frame off, where the ball goes straight on, would be .1
    const Result own = run_rill("verify " + asset + " " + input + " --json -");
    CHECK(has(own, "\"between\": false"));
    CHECK_FALSE(has(own, "\"between\": true"));
    CHECK(has(own, "\"met\": true"));
    CHECK(run_rill("verify " + asset + " " + input + " --frames 4:8:2").code == 2);  // 8 is after its last
    CHECK(run_rill("verify " + asset + " " + input + " --frames 4:6:2 --substeps 2").code == 2);
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
    const Result back = run_rill("cook " + (folder / "all.glb") + " -o " + (folder / "back.rill"));
    CHECK(back.code == 2);
    CHECK(has(back, "all.glb: is an animation of many meshes, which is not read"));
    const Result tiny = run_rill("export " + clip().asset + " --cell 1e-6 -o " + (folder / "tiny.ply") + " --time 0");
    CHECK(tiny.code == 1);
    CHECK(has(tiny, "--cell 1e-06: the source's own resolution is"));
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

TEST_CASE("export leaves alone what it has not written, before it writes anything") {
    for (const std::string ending : {".ply", ".obj", ".glb"}) {
        CAPTURE(ending);
        const TestFolder folder;
        const std::string command = "export " + clip().asset + " -o " + (folder / "f%d") + ending + " --frames 3:4";
        const std::string first = folder / "f3" + ending, second = folder / "f4" + ending;
        put_file(second, "somebody's own");
        const Result refused = run_rill(command);
        CHECK(refused.code == 2);
        CHECK(has(refused, "f4" + ending + ": is there already and no export of Rill's"));
        CHECK(get_file(second) == "somebody's own");
        CHECK(!fs::exists(first));
        put_file(second, "");  // nothing is lost
        CHECK(run_rill(command).code == 0);
        const std::string written = get_file(second);
        CHECK(run_rill(command).code == 0);  // its own, again
        CHECK(get_file(second) == written);
        CHECK(run_rill("export " + clip().asset + " -o " + second + " --time 0").code == 0);
        CHECK(get_file(second) != written);
    }
    const TestFolder folder;
    put_file(folder / "all.glb", "glTF of another");
    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "all.glb")).code == 2);
    CHECK(get_file(folder / "all.glb") == "glTF of another");
    put_file(folder / "source.ply", plain_ply(Clip::frame(3)));
    CHECK(run_rill("export " + clip().asset + " -o " + (folder / "source.ply") + " --time 0").code == 2);
    CHECK(get_file(folder / "source.ply") == plain_ply(Clip::frame(3)));
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
    REQUIRE(json["scaling"].size() == 2);
    CHECK(json["scaling"][0]["speedup"] == 1);
    CHECK(json["scaling"][1]["speedup"].get<double>() > 0);
    CHECK(json["scaling"][1]["two_players_at_once"].get<double>() > 0);
    REQUIRE(json["larger_cells"].size() == 4);
    CHECK(json["larger_cells"][0]["share"] == 1);
    for (const nlohmann::json& cells : json["larger_cells"]) CHECK(cells["mean_us"].get<double>() > 0);
    const nlohmann::json& draco = json["draco"];
    CHECK(draco["triangles_per_second"].get<double>() > 0);
    CHECK(draco["rill_over_draco"].get<double>() == doctest::Approx(draco["mean_us"].get<double>() / draco["rill_mean_us"].get<double>()));
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
