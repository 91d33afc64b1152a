// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "asset/asset_directory.h"
#include "asset/asset_player.h"
#include "commands/commands.h"
#include "common/output_file.h"
#include "writers/frame_writer.h"

namespace rill::cooker {
namespace {

struct ExportOptions {
    std::string asset, output, frames;
    double time = 0;
    float cell = 0;
    uint32_t layers = 0;
    int jobs = 1;
    bool at_time = false, quiet = false;
};

/// Indices of the asset's frames that were asked for.
std::vector<uint32_t> chosen_frames(const AssetDirectory& directory, const ExportOptions& options) {
    const FrameRange range = parse_frames(options.frames);
    const int first = directory.frame_number(0), last = directory.frame_number(directory.header.frame_count - 1);
    if (range.step && (range.first < first || range.last > last))
        throw InputError(options.asset + ": holds frames " + std::to_string(first) + " to " + std::to_string(last) +
                         " only, not all of " + options.frames);
    std::vector<uint32_t> chosen;
    for (uint32_t i = 0; i < directory.header.frame_count; ++i) {
        const int number = directory.frame_number(i);
        if (!range.step || (number >= range.first && number <= range.last && (number - range.first) % range.step == 0))
            chosen.push_back(i);
    }
    if (chosen.empty()) throw InputError(options.asset + ": has none of the frames " + options.frames);
    return chosen;
}

/// All frames in one GLB.
void export_animation(AssetPlayer& player, const std::vector<uint32_t>& frames, const ExportOptions& options, Progress& progress) {
    AnimatedGlb glb;
    try {
        for (size_t i = 0; i < frames.size(); ++i) {
            const double seconds = player.frame_seconds(frames[i]);
            glb.add(player.mesh(seconds, options.cell, options.layers), seconds);
            progress("", double(i + 1), double(frames.size()));
        }
    } catch (const InputError& error) {
        throw InputError(options.output + ": " + error.what());
    }
    const double span = player.frame_seconds(frames.back()) - player.frame_seconds(frames.front());
    write_file(options.output, glb.bytes(span / double(frames.size() - 1)));
}

/// A cell a sixteenth as large has 256 times the triangles: what is asked for by mistake would take all memory.
constexpr float least_cell = 1 / 16.f;  // of the source's

int export_command(const ExportOptions& options) {
    check_frame_extension(options.output);
    if (options.at_time && !options.frames.empty()) throw UsageError("--time and --frames exclude each other");
    if (options.at_time && has_number_place(options.output)) throw UsageError("--time writes one mesh: name a file without %d");
    const AssetDirectory directory = read_directory(options.asset);
    AssetPlayer player(options.asset, options.jobs);
    if (options.cell > 0 && options.cell < least_cell * player.info().cell_size) {
        char text[160];
        std::snprintf(text, sizeof text, "--cell %g: the source's own resolution is %g m; a sixteenth of that is the least", double(options.cell),
                      double(player.info().cell_size));
        throw UsageError(text);
    }
    if (options.at_time) {
        if (!(options.time >= 0 && options.time <= player.info().seconds))
            throw UsageError("--time lies outside 0 to " + std::to_string(player.info().seconds) + " seconds after the first frame");
        check_frame_output(options.output);
        write_frame(options.output, player.mesh(options.time, options.cell, options.layers));
        return exit_done;
    }
    const std::vector<uint32_t> frames = chosen_frames(directory, options);
    const bool animated = frames.size() > 1 && !has_number_place(options.output);
    if (animated && std::filesystem::path(options.output).extension() != ".glb")
        throw UsageError("-o '" + options.output + "' needs a place for the frame number, such as %04d; only .glb holds many frames in one file");
    number_pattern(options.output, 0);
    for (const uint32_t frame : frames) check_frame_output(number_pattern(options.output, directory.frame_number(frame)));
    Progress progress("export", options.quiet);
    if (animated) {
        export_animation(player, frames, options, progress);
        return exit_done;
    }
    for (size_t i = 0; i < frames.size(); ++i) {
        const Mesh mesh = player.mesh(player.frame_seconds(frames[i]), options.cell, options.layers);
        write_frame(number_pattern(options.output, directory.frame_number(frames[i])), mesh);
        progress("", double(i + 1), double(frames.size()));
    }
    return exit_done;
}

}  // namespace

void add_export(CLI::App& app, Run& run) {
    auto options = std::make_shared<ExportOptions>();
    CLI::App* command = app.add_subcommand("export", "Write meshes back out");
    command->add_option("ASSET", options->asset, "The asset, .rill")->required();
    command->add_option("-o,--output", options->output, "Where to: pattern with %04d, .ply, .obj or .glb; one .glb without %04d is animated")->required();
    command->add_option("--frames", options->frames, "A:B[:STEP], source numbers, inclusive");
    CLI::Option* time = command->add_option("--time", options->time, "One mesh, so many seconds after the first frame");
    command->add_option("--cell", options->cell, "Cell size, metres; default: the source's own resolution")->check(CLI::PositiveNumber);
    command->add_option("--layers", options->layers, "Use at most so many layers")->check(CLI::Range(1, 8));
    command->add_option("--jobs", options->jobs, "Threads")->check(CLI::Range(1, 1024));
    command->add_flag("--quiet", options->quiet, "Errors only");
    command->callback([&run, options, time] {
        options->at_time = time->count() > 0;
        run = [options] { return export_command(*options); };
    });
}

}  // namespace rill::cooker
