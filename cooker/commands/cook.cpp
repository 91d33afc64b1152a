// SPDX-License-Identifier: MIT
#include "cook.h"

#include <cstdio>
#include <filesystem>

#include "commands/commands.h"
#include "error_target.h"
#include "readers/file_bytes.h"

namespace rill::cooker {
namespace {

struct CookOptions {
    InputOptions input;
    std::string output, frames, recipe, report;
    CookSettings settings;
    bool quiet = false;
};

/// A recipe holds the long options of this command by name; the command line goes before it.
void apply_recipe(const std::string& path, CLI::App& command) {
    const nlohmann::json json = nlohmann::json::parse(read_file(path), nullptr, false);
    if (!json.is_object()) throw InputError(path + ": not a JSON object");
    for (const auto& [key, value] : json.items()) {
        CLI::Option* option = command.get_option_no_throw("--" + key);
        if (!option || key == "recipe" || key == "output" || key == "help" || key == "quiet")
            throw UsageError(path + ": '" + key + "' is no setting of a recipe");
        if (!value.is_string() && !value.is_number()) throw UsageError(path + ": '" + key + "' must be a text or a number");
        if (option->count() > 0) continue;
        option->add_result(value.is_string() ? value.get<std::string>() : value.dump());
        try {
            option->run_callback();
        } catch (const CLI::ParseError& error) {
            throw UsageError(path + ": " + error.what());
        }
    }
}

int cook_command(CookOptions& options, CLI::App& command) {
    if (!options.recipe.empty()) apply_recipe(options.recipe, command);
    CookSettings& settings = options.settings;
    settings.read = options.input.checked();
    settings.read.require_velocity = true;
    const FrameRange frames = parse_frames(options.frames);
    settings.read.first = frames.first, settings.read.last = frames.last, settings.read.step = frames.step;
    error_target(settings.error, 1, 1);  // a misspelt one is a usage error before any work
    Progress progress("cook", options.quiet);
    const CookReport report = cook(options.input.path, options.output, settings, [&](const CookProgress& p) {
        progress(p.stage, p.frames_done, p.frames_total);
    });
    if (!options.report.empty()) write_json(options.report, report.json);
    if (!options.quiet)
        std::printf("%s: %s; p99 error %.4g m, aimed at %.4g m\n", options.output.c_str(),
                    readable_bytes(double(std::filesystem::file_size(options.output))).c_str(), report.measured_p99, report.target_p99);
    if (report.target_met) return exit_done;
    std::fprintf(stderr, "rill: %s: target missed: p99 error is %.4g m, %.2f times the %.4g m aimed at\n", options.output.c_str(),
                 report.measured_p99, report.measured_p99 / report.target_p99, report.target_p99);
    return exit_target_missed;
}

}  // namespace

void add_cook(CLI::App& app, Run& run) {
    auto options = std::make_shared<CookOptions>();
    CLI::App* command = app.add_subcommand("cook", "Cook a fluid mesh sequence into an asset");
    options->input.add_to(*command);
    command->add_option("-o,--output", options->output, "The asset, .rill")->required();
    command->add_option("--error", options->settings.error, "p99 error aimed at: 0.25e (edges), 0.1% (of the diagonal), 2mm")->capture_default_str();
    command->add_option("--frames", options->frames, "A:B[:STEP], source numbers, inclusive");
    command->add_option("--window", options->settings.window, "Frames per window")->check(CLI::Range(1, 64))->capture_default_str();
    command->add_option("--layers", options->settings.layers, "Layers of detail")->check(CLI::Range(1, 8))->capture_default_str();
    command->add_option("--jobs", options->settings.jobs, "Threads; 0: all cores")->check(CLI::Range(0, 1024));
    command->add_option("--recipe", options->recipe, "JSON file of these settings; the command line goes before it");
    command->add_option("--report", options->report, "Write the report as JSON; - is standard output");
    command->add_flag("--quiet", options->quiet, "Errors only");
    command->callback([&run, options, command] { run = [options, command] { return cook_command(*options, *command); }; });
}

}  // namespace rill::cooker
