// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "asset/asset_directory.h"
#include "asset/byte_account.h"
#include "commands/commands.h"
#include "rill/rill.h"

namespace rill::cooker {
namespace {

struct LayerFacts {
    uint64_t bytes = 0, chunks = 0;
    double spacing = 0, error_p99 = 0;  // means over chunks
};

/// Points that one frame may show, averaged over the clip: each window's tracks weighted by its frames.
double points_per_window(const AssetDirectory& directory, uint64_t& drops) {
    double sum = 0, frames = 0;
    for (const format::WindowRecord& window : directory.windows) {
        uint64_t points = 0;
        for (uint32_t c = 0; c < window.chunk_count; ++c) {
            points += directory.chunks[window.first_chunk + c].point_count;
            drops += directory.chunks[window.first_chunk + c].drop_count;
        }
        sum += double(points) * window.sample_count, frames += window.sample_count;
    }
    return frames > 0 ? sum / frames : 0;
}

nlohmann::json describe(const std::string& path) {
    using nlohmann::json;
    const AssetDirectory directory = read_directory(path);
    const format::Header& h = directory.header;
    std::vector<LayerFacts> layers(h.layer_count);
    uint64_t chunk_bytes = 0, drops = 0, blocks = 0;
    for (const format::ChunkRecord& c : directory.chunks) {
        LayerFacts& layer = layers[c.layer];
        layer.bytes += c.bytes, ++layer.chunks, layer.spacing += c.spacing, layer.error_p99 += c.error_p99;
        chunk_bytes += c.bytes;
    }
    json layer_list = json::array();
    for (const LayerFacts& layer : layers)
        layer_list.push_back({{"bytes", layer.bytes},
                              {"chunks", layer.chunks},
                              {"spacing_m", layer.chunks ? layer.spacing / double(layer.chunks) : 0},
                              {"error_p99_m", layer.chunks ? layer.error_p99 / double(layer.chunks) : 0}});
    json windows = json::array();
    for (const format::WindowRecord& w : directory.windows) {
        uint64_t bytes = 0, points = 0;
        for (uint32_t c = 0; c < w.chunk_count; ++c)
            bytes += directory.chunks[w.first_chunk + c].bytes, points += directory.chunks[w.first_chunk + c].point_count;
        windows.push_back({{"first_frame", directory.frame_number(w.first_sample)},
                           {"frames", w.sample_count},
                           {"blocks", w.block_count},
                           {"chunks", w.chunk_count},
                           {"points", points},
                           {"bytes", bytes}});
        blocks = std::max<uint64_t>(blocks, w.block_count);
    }
    const double points = points_per_window(directory, drops);
    json settings = json::parse(directory.settings_json, nullptr, false);
    if (settings.is_discarded()) settings = nullptr;
    json walls = json::array();
    for (uint32_t side = 0; side < 6; ++side)
        if (h.walls >> side & 1) walls.push_back(std::string{"xyz"[side / 2], "-+"[side % 2]});
    char hash[17];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(h.content_hash));
    return {{"report", "rill info"},
            {"version", 2},
            {"asset", path},
            {"format", h.version},
            {"content_hash", hash},
            {"file_bytes", h.file_bytes},
            {"directory_bytes", h.directory_bytes},
            {"chunk_bytes", chunk_bytes},
            {"bytes", to_json(account_for_bytes(directory))},
            {"bytes_per_frame", double(h.file_bytes) / h.frame_count},
            {"frames", h.frame_count},
            {"first_frame", h.first_frame},
            {"frame_step", h.frame_step},
            {"frames_per_second", h.frames_per_second},
            {"first_seconds", h.first_seconds},
            {"median_edge_m", h.cell_size},
            {"lower", {h.lower[0], h.lower[1], h.lower[2]}},
            {"upper", {h.upper[0], h.upper[1], h.upper[2]}},
            {"walls", walls},
            {"bevel_m", format::bevel_of(h.walls, h.cell_size)},
            {"points_per_window", points},
            {"drop_tracks", drops},
            {"most_blocks", blocks},
            {"layers", layer_list},
            {"windows", windows},
            {"cook", settings}};
}

/// A row per kind, a column per layer; the last row is the file.
void print_bytes(const nlohmann::json& bytes, double file_bytes) {
    const nlohmann::json& layers = bytes["layers"];
    std::printf("bytes               ");
    for (size_t l = 0; l < layers.size(); ++l) std::printf("  layer %zu", l);
    std::printf("       all  share\n");
    const auto row = [&](const std::string& kind, const std::vector<double>& of_layer, double all) {
        std::printf("  %-18s", kind.c_str());
        for (size_t l = 0; l < layers.size(); ++l)
            if (l < of_layer.size()) std::printf("%9.0f", of_layer[l]);
            else std::printf("%9s", "");
        std::printf("%10.0f %5.1f %%\n", all, 100 * all / file_bytes);
    };
    std::vector<double> of_layer(layers.size(), 0);
    double sum = 0;
    for (const auto& [kind, ignored] : layers[0].items()) {
        std::vector<double> values;
        double all = 0;
        for (size_t l = 0; l < layers.size(); ++l) values.push_back(layers[l][kind]), all += values[l], of_layer[l] += values[l];
        row(kind, values, all), sum += all;
    }
    for (const auto& [kind, value] : bytes.items())
        if (value.is_number()) row(kind, {}, value), sum += value.get<double>();
    row("all", of_layer, sum);
}

void print_lives(const nlohmann::json& cook) {
    if (!cook.is_object() || !cook.contains("lives") || !cook["lives"].is_object()) return;
    const nlohmann::json& lives = cook["lives"];
    std::printf("track lives  median %s frames, %s by point; ended by", lives.value("median_frames", nlohmann::json(0)).dump().c_str(),
                lives.value("median_frames_by_point", nlohmann::json(0)).dump().c_str());
    const nlohmann::json causes = lives.value("ended_by", nlohmann::json::object());
    for (const auto& [cause, count] : causes.items()) std::printf(" %s %s", cause.c_str(), count.dump().c_str());
    std::printf("\n");
}

void print(const nlohmann::json& info) {
    auto number = [&](const char* key) { return info[key].get<double>(); };
    std::printf("%s: Rill asset, format %.0f, content %s\n", info["asset"].get<std::string>().c_str(), number("format"),
                info["content_hash"].get<std::string>().c_str());
    std::printf("frames       %.0f from %.0f by %.0f, %g per second\n", number("frames"), number("first_frame"), number("frame_step"),
                number("frames_per_second"));
    std::printf("size         %s, %s per frame; directory %s\n", readable_bytes(number("file_bytes")).c_str(),
                readable_bytes(number("bytes_per_frame")).c_str(), readable_bytes(number("directory_bytes")).c_str());
    std::printf("points       %.0f per window on average, %.0f drop tracks in all\n", number("points_per_window"), number("drop_tracks"));
    std::printf("bounds       %g %g %g to %g %g %g m; source edge %.4g m\n", info["lower"][0].get<double>(), info["lower"][1].get<double>(),
                info["lower"][2].get<double>(), info["upper"][0].get<double>(), info["upper"][1].get<double>(),
                info["upper"][2].get<double>(), number("median_edge_m"));
    std::printf("walls       ");
    for (const nlohmann::json& wall : info["walls"]) std::printf(" %s", wall.get<std::string>().c_str());
    if (info["walls"].empty()) std::printf(" none");
    if (number("bevel_m") > 0) std::printf(", edges between them cut off %.4g m from them", number("bevel_m"));
    std::printf("\n");
    std::printf("layers\n");
    for (size_t i = 0; i < info["layers"].size(); ++i) {
        const nlohmann::json& layer = info["layers"][i];
        std::printf("  %zu  %10s  %5.0f chunks, spacing %.4g m, p99 error up to here %.4g m\n", i,
                    readable_bytes(layer["bytes"].get<double>()).c_str(), layer["chunks"].get<double>(), layer["spacing_m"].get<double>(),
                    layer["error_p99_m"].get<double>());
    }
    std::printf("windows\n");
    for (const nlohmann::json& window : info["windows"])
        std::printf("  from frame %-5.0f %3.0f frames, %3.0f blocks, %4.0f chunks, %7.0f points, %10s\n", window["first_frame"].get<double>(),
                    window["frames"].get<double>(), window["blocks"].get<double>(), window["chunks"].get<double>(),
                    window["points"].get<double>(), readable_bytes(window["bytes"].get<double>()).c_str());
    print_lives(info["cook"]);
    print_bytes(info["bytes"], number("file_bytes"));
    if (!info["cook"].is_null()) std::printf("cook\n%s\n", info["cook"].dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
}

struct InfoOptions {
    std::string asset;
    bool json = false;
};

}  // namespace

void add_info(CLI::App& app, Run& run) {
    auto options = std::make_shared<InfoOptions>();
    CLI::App* command = app.add_subcommand("info", "What is inside an asset");
    command->add_option("ASSET", options->asset, "The asset, .rill")->required();
    command->add_flag("--json", options->json, "As JSON on standard output");
    command->callback([&run, options] {
        run = [options] {
            const nlohmann::json info = describe(options->asset);
            if (options->json) write_json("-", info);
            else print(info);
            return int(exit_done);
        };
    });
}

}  // namespace rill::cooker
