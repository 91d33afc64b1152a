// SPDX-License-Identifier: MIT
// Goldens: one asset of every format version there was, made by golden/make.sh and kept for ever, with what it was
// and decoded to then. Each must load and decode to the same water, or be refused as unknown_format.
#include <nlohmann/json.hpp>

#include "asset/asset_directory.h"
#include "asset/asset_player.h"
#include "harness.h"
#include "measure/surface_distance.h"

using namespace harness;
namespace cooker = rill::cooker;

namespace {

constexpr uint32_t versions[] = {rill::format::version_4, rill::format::version_5, rill::format::version_6, rill::format::version_7,
                                 rill::format::version_8};
constexpr uint32_t refused[] = {rill::format::version_1, rill::format::version_2, rill::format::version_3};

std::string golden(uint32_t version, const char* ending) {
    return std::string(RILL_GOLDEN "/v") + std::to_string(version) + ending;
}
nlohmann::json json_of(const std::string& path) {
    std::ifstream file(path);
    const nlohmann::json json = nlohmann::json::parse(file, nullptr, false);
    REQUIRE(json.is_object());
    return json;
}

}  // namespace

TEST_CASE("every golden is the file it was") {
    for (uint32_t version : versions) {
        CAPTURE(version);
        const std::string path = golden(version, ".rill");
        const nlohmann::json info = json_of(golden(version, ".info.json"));
        const rill::format::Header header = cooker::read_directory(path).header;
        CHECK(header.version == version);
        char hash[17];
        std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(header.content_hash));
        CHECK(info["content_hash"] == hash);
        CHECK(info["file_bytes"] == header.file_bytes);
        CHECK(info["file_bytes"] == std::filesystem::file_size(path));
        CHECK(std::filesystem::file_size(path) < 100000);
    }
}

TEST_CASE("every golden loads and decodes to the water it held") {
    for (uint32_t version : versions) {
        CAPTURE(version);
        const nlohmann::json info = json_of(golden(version, ".info.json"));
        const nlohmann::json frame = json_of(golden(version, ".verify.json"))["frames"][0];
        cooker::AssetPlayer player(golden(version, ".rill"));
        CHECK(player.info().format == version);
        CHECK(info["frames"] == player.info().frames);
        CHECK(info["first_frame"] == player.info().first_frame);
        CHECK(info["windows"].size() == player.info().windows);
        CHECK(info["layers"].size() == player.info().layers);
        const cooker::Mesh mesh = player.mesh(frame["seconds"].get<double>());
        // Compilers may differ in the last bits, not in the water.
        CHECK(double(mesh.triangles.size()) == doctest::Approx(frame["decoded_triangles"].get<double>()).epsilon(0.02));
        const cooker::Topology shape = cooker::topology(mesh);
        CHECK(shape.volume == doctest::Approx(frame["decoded"]["volume_m3"].get<double>()).epsilon(0.01));
        CHECK(shape.open_edges == 0);
        CHECK(shape.non_manifold_edges == 0);
    }
}

TEST_CASE("a version that is read no more is refused by its number") {
    for (uint32_t version : refused) {
        CAPTURE(version);
        Opened opened(read_file(golden(version, ".rill")));
        CHECK(opened.open() == rill::Status::unknown_format);
    }
}

TEST_CASE("a version of the future is refused by its number, not taken for damage") {
    Bytes bytes = read_file(golden(rill::format::current_version, ".rill"));
    for (uint32_t version : {0u, rill::format::current_version + 1, 0xF0u, 0xFFFFFFFFu}) {
        CAPTURE(version);
        put(bytes, offsetof(rill::format::Header, version), version);
        seal(bytes);
        Opened opened(bytes);
        CHECK(opened.open() == rill::Status::unknown_format);
    }
}
