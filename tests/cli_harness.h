// SPDX-License-Identifier: MIT
// The `rill` tool run as scripts run it, and a clip for it to work on.
#pragma once
#include <doctest/doctest.h>
#include <sys/wait.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "readers/reader.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;
namespace fs = std::filesystem;

struct Result {
    int code = -1;
    std::string text;  // standard output and error
};
inline Result run_rill(const std::string& arguments, const std::string& before = "") {
    Result result;
    FILE* pipe = popen(("exec 2>&1; " + before + "'" RILL_TOOL "' " + arguments).c_str(), "r");
    REQUIRE(pipe);
    char part[4096];
    for (size_t size; (size = fread(part, 1, sizeof part, pipe)) > 0;) result.text.append(part, size);
    const int status = pclose(pipe);
    result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    return result;
}
inline bool has(const Result& result, const std::string& part) { return result.text.find(part) != std::string::npos; }
inline nlohmann::json json_of(const std::string& path) { return nlohmann::json::parse(get_file(path), nullptr, false); }

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
inline const Clip& clip() {
    static const Clip clip;
    return clip;
}

/// Every byte is accounted for, once, and each layer's are those of its chunks and their records.
inline void check_bytes(const std::string& asset) {
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
        CHECK(sum == layer["bytes"].get<uint64_t>() + 38 * chunks);
        CHECK(kinds["directory"] == 38 * chunks);
        CHECK(kinds["padding"] <= chunks);  // less than a byte each
        all += sum;
    }
    CHECK(all == fs::file_size(asset));
    CHECK(bytes["unused"] == 0);
}
