// SPDX-License-Identifier: MIT
// rill-player: plays an asset in a window, or draws it into files where there is none.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>

#include "options.h"

namespace player {

int complain(Exit code, const std::string& what, const std::string& cause) {
    std::fprintf(stderr, "rill-player: %s: %s\n", what.c_str(), cause.c_str());
    return code;
}

rill::Budget make_budget(const Detail& detail, const rill::AssetInfo& info) {
    rill::Budget out{};
    out.pixel_error = detail.follow_view ? detail.pixel_error : 0.0f;
    out.cell_size = detail.cell > 0.0f ? detail.cell : detail.follow_view ? 0.0f : info.cell_size;
    out.layers = static_cast<uint32_t>(detail.layers);
    out.microseconds = ~0u;  // never reached, but asks for the stages' times
    return out;
}

Camera make_camera(const Options& options, const Bounds& bounds) {
    Camera out;
    out.field_of_view = glm::radians(options.fov_degrees);
    out.yaw = glm::radians(options.yaw_degrees);
    out.pitch = glm::radians(glm::clamp(options.pitch_degrees, -88.0f, 88.0f));
    out.frame(bounds, static_cast<float>(options.width) / static_cast<float>(options.height));
    if (options.distance > 0.0f) out.distance = options.distance * bounds.diagonal();
    const auto vector = [](const std::vector<float>& v) { return glm::vec3(v[0], v[1], v[2]); };
    if (!options.target.empty()) out.target = vector(options.target);
    if (!options.eye.empty()) out.look(vector(options.eye), out.target);
    return out;
}

static std::string parse_frames(const std::string& text, FrameRange& out) {
    char rest = 0;
    const int fields = std::sscanf(text.c_str(), "%d:%d:%d%c", &out.first, &out.last, &out.step, &rest);
    if (fields == 1 && text.find(':') == std::string::npos) out.last = out.first;
    const size_t colons = static_cast<size_t>(std::count(text.begin(), text.end(), ':'));
    out.given = true;
    if (fields < 1 || fields > 3 || colons != static_cast<size_t>(fields - 1)) return "wanted A, A:B or A:B:STEP, not " + text;
    if (out.last < out.first || out.step < 1) return "wanted A <= B and STEP >= 1, not " + text;
    return "";
}

static std::string parse_size(const std::string& text, Options& out) {
    char rest = 0;
    if (std::sscanf(text.c_str(), "%dx%d%c", &out.width, &out.height, &rest) != 2) return "wanted WxH, not " + text;
    if (out.width < 16 || out.height < 16 || out.width > 8192 || out.height > 8192) return "wanted 16 to 8192 pixels a side";
    return "";
}

/// An option that parse() reads from text, answering what is wrong with it.
static CLI::Validator parsed(std::function<std::string(const std::string&)> parse) {
    return CLI::Validator([parse](std::string& text) { return parse(text); }, "");
}

static void declare(CLI::App& app, Options& o) {
    app.add_option("ASSET", o.asset, "a .rill file");
    app.add_flag("--headless", o.headless, "no window: draw into files");
    app.add_option("--frames", "the source's frame numbers, B included (default: all)")
        ->check(parsed([&o](const std::string& text) { return parse_frames(text, o.frames); }))
        ->option_text("A:B[:STEP]");
    app.add_option("--substeps", o.substeps, "so many pictures a frame, evenly spaced: slow motion; numbered from 0")
        ->check(CLI::Range(1, 1000))->option_text("N");
    app.add_option("--size", "picture size (default 1280x720)")
        ->check(parsed([&o](const std::string& text) { return parse_size(text, o); }))
        ->option_text("WxH");
    app.add_option("--out", o.out, "picture per frame, such as frame_%04d.png")->option_text("PATTERN");
    app.add_option("--contact-sheet", o.contact_sheet, "one PNG with small pictures of the frames")->option_text("FILE");
    app.add_option("--stats", o.stats, "statistics of every frame as JSON")->option_text("FILE");
    app.add_option("--jobs", o.jobs, "worker threads in all (default: one per core)")->check(CLI::Range(1, 256))->option_text("N");
    app.add_option("--source", o.source, "source meshes to draw with the same camera, such as frame_%04d.ply")->option_text("PATTERN");
    app.add_flag("--side-by-side", o.side_by_side, "decoded on the left, source on the right, in one picture");

    auto* view = app.add_option_group("Camera (z is up)");
    view->add_option("--yaw", o.yaw_degrees, "around the vertical (default 32)")->option_text("DEGREES");
    view->add_option("--pitch", o.pitch_degrees, "above the horizon (default 24)")->option_text("DEGREES");
    view->add_option("--distance", o.distance, "in diagonals of the bounds (default: all in sight)")->option_text("X");
    view->add_option("--fov", o.fov_degrees, "vertical field of view (default 40)")->check(CLI::Range(5, 120))
        ->option_text("DEGREES");
    view->add_option("--eye", o.eye, "in metres, instead of yaw, pitch and distance")->option_text("X,Y,Z")->delimiter(',')->expected(3);
    view->add_option("--target", o.target, "in metres (default: middle of the bounds)")->option_text("X,Y,Z")->delimiter(',')->expected(3);

    auto* look = app.add_option_group("Look");
    const std::map<std::string, Shading> shadings{{"water", Shading::water}, {"clay", Shading::clay},
                                                  {"normals", Shading::normals}, {"velocity", Shading::velocity}};
    look->add_option("--shading", o.look.shading, "water, clay, normals or velocity")
        ->transform(CLI::CheckedTransformer(shadings))
        ->option_text("NAME");
    look->add_flag("--wireframe", o.look.wireframe, "triangle edges over the surface");
    look->add_flag("--points", o.look.points, "decoded points instead of the surface");
    look->add_flag("--show-backfaces", o.look.show_backfaces, "inside of the surface in dark red: shows holes");
    look->add_option("--environment", o.environment, "equirectangular .hdr or .png to reflect")->option_text("FILE");

    auto* detail = app.add_option_group("Detail (default: cells of the source's size; in a window 2 pixels)");
    auto* pixels = detail->add_option("--pixel-error", o.detail.pixel_error, "level of detail: cells of so many pixels")->option_text("PIXELS");
    pixels->each([&o](const std::string&) { o.detail.follow_view = true; })->check(CLI::PositiveNumber);
    detail->add_option("--cell", o.detail.cell, "cells of one size")->option_text("METRES")->check(CLI::PositiveNumber);
    detail->add_option("--layers", o.detail.layers, "use at most so many layers")->option_text("N")->check(CLI::PositiveNumber);

    const std::map<std::string, Api> apis{{"any", Api::any}, {"gl", Api::gl}, {"es", Api::es}};
    app.add_option("--api", o.api, "gl (3.3 core), es (3.0) or any")->transform(CLI::CheckedTransformer(apis))
        ->option_text("NAME");
    app.add_option("--speed", o.speed, "of a window's playback, -4 to 4")->check(CLI::Range(-4.0, 4.0))->option_text("X");
    app.add_option("--quit-after", o.quit_after, "close the window after so many pictures, saving the last to --out")->option_text("N");
}

/// What CLI11 cannot see. Empty: all is well.
static std::string contradiction(const Options& o) {
    if (o.asset.empty() && o.source.empty()) return "an ASSET is needed (or --source); see --help";
    if (o.asset.empty() && !o.headless) return "--source without an ASSET is for --headless";
    if (o.asset.empty() && !o.frames.given) return "--source without an ASSET needs --frames";
    if (o.side_by_side && (o.asset.empty() || o.source.empty())) return "--side-by-side needs an ASSET and --source";
    for (const std::string* pattern : {&o.out, &o.source})
        if (!pattern_is_good(*pattern)) return *pattern + ": one %d or %04d is all a pattern may hold";
    if (o.substeps > 1 && (o.asset.empty() || !o.headless)) return "--substeps needs an ASSET and --headless";
    if (!o.asset.empty() && !std::filesystem::exists(o.asset)) return "";  // whoever opens it says so better
    if (o.headless && !o.out.empty() && !pattern_has_number(o.out) && (!o.frames.given || o.frames.first != o.frames.last))
        return "--out needs a %04d: there is more than one frame";
    return "";
}

static int run(Options options) {
    if (options.headless) return run_headless(options);
    if (options.detail.cell <= 0.0f) options.detail.follow_view = true;
    int code = exit_ok;
    std::string cause;
    if (run_window(options, code, cause)) return code;
    // Somebody typed the two commands of the README on a machine without a screen: show what there is to see.
    Options sheet = options;
    sheet.headless = true;
    sheet.detail.follow_view = false;
    sheet.out.clear();
    if (sheet.contact_sheet.empty())
        sheet.contact_sheet = std::filesystem::path(options.asset).stem().string() + "_contact_sheet.png";
    std::fprintf(stderr, "rill-player: no display (%s); drawing %s instead. See --headless.\n", cause.c_str(),
                 sheet.contact_sheet.c_str());
    return run_headless(sheet);
}

}  // namespace player

int main(int count, char** values) {
    player::Options options;
    CLI::App app("Plays a .rill asset.", "rill-player");
    declare(app, options);
    try {
        app.parse(count, values);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? player::exit_ok : player::exit_usage;
    }
    if (const std::string wrong = player::contradiction(options); !wrong.empty())
        return player::complain(player::exit_usage, "usage", wrong);
    return player::run(options);
}
