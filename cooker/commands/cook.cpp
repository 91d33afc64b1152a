// SPDX-License-Identifier: MIT
#include "cook/cook.h"

#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>

#include "commands/commands.h"
#include "common/output_file.h"

namespace rill::cooker {
namespace {

struct CookOptions {
    InputOptions input;
    std::string output, frames, recipe, report, depfile, segment;
    CookSettings settings;
    bool quiet = false, dry_run = false;
};

/// "I/N", I from 1.
void parse_segment(const std::string& text, CookSettings& settings) {
    int index = 0, count = 0, read = 0;
    if (std::sscanf(text.c_str(), "%d/%d%n", &index, &count, &read) != 2 || size_t(read) != text.size() || index < 1 || count < index || count > 100000)
        throw UsageError("--segment '" + text + "' is not I/N with I from 1 to N");
    settings.segment = uint32_t(index - 1), settings.segments = uint32_t(count);
}

/// A rule as make and ninja read it.
std::string make_rule(const std::string& target, const std::vector<std::string>& needed) {
    const auto escaped = [](const std::string& path) {
        std::string text;
        for (char c : path) {
            if (c == ' ' || c == '#' || c == '\\') text += '\\';
            if (c == '$') text += '$';
            text += c;
        }
        return text;
    };
    std::string rule = escaped(target) + ":";
    for (const std::string& path : needed) rule += " \\\n  " + escaped(path);
    return rule + "\n";
}

std::string in_words(const VelocityFit& fit) {
    if (fit.meaning == VelocityMeaning::none) return "none";
    char text[160];
    std::snprintf(text, sizeof text, "%s, times %.4g%s", fit.meaning == VelocityMeaning::backward ? "brought the liquid to its frame" : "carries on to the next frame",
                  fit.factor, fit.conclusive ? "" : " (too little moves to tell)");
    return text;
}

int dry_run(const CookOptions& options) {
    const CookPlan plan = plan_cook(options.input.path, options.output, options.settings);
    std::printf("input     %s: %s, %zu frames from %d to %d, %g per second\n", options.input.path.c_str(), plan.info.format.c_str(),
                plan.info.numbers.size(), plan.info.numbers.front(), plan.info.numbers.back(), plan.info.frames_per_second);
    std::printf("velocity  %s\n", in_words(plan.fit).c_str());
    std::printf("spans     %u of %u frames", plan.spans.spans(), plan.spans.length());
    if (options.settings.segments > 0) std::printf("; segment %s: %u of them", options.segment.c_str(), plan.share.end - plan.share.first);
    std::printf(plan.finished > 0 ? "; %u are finished already\n" : "\n", plan.finished);
    std::printf("key       %s\n", plan.key.c_str());
    std::printf("output    %s: %s\n", options.output.c_str(), plan.up_to_date ? "up to date" : "would be cooked");
    return exit_done;
}

/// Before hours of work, not after.
void spare_inputs_of(const CookOptions& options) {
    CookSettings settings = options.settings;
    settings.read.warn = {};  // the cook will
    std::vector<std::filesystem::path> inputs;
    for (const std::string& path : {options.report, options.depfile, settings.survey}) {
        std::error_code error;
        if (!std::filesystem::is_regular_file(path, error)) continue;
        if (inputs.empty())
            for (const std::string& input : dependencies(options.input.path, settings)) inputs.emplace_back(input);
        spare_inputs(path, inputs);
    }
}

int cook_command(CookOptions& options, CLI::App& command) {
    std::map<std::string, double> targets;
    if (!options.recipe.empty()) targets = apply_recipe(options.recipe, command);
    if (options.input.path.empty()) throw UsageError("INPUT is required, on the command line or in a recipe");
    const bool only_survey = options.output.empty() && !options.settings.survey.empty();
    if (options.output.empty() && !only_survey) throw UsageError("--output is required, on the command line or in a recipe");
    CookSettings& settings = options.settings;
    settings.read = options.input.checked();
    const FrameRange frames = parse_frames(options.frames);
    settings.read.first = frames.first, settings.read.last = frames.last, settings.read.step = frames.step;
    if (!options.segment.empty()) parse_segment(options.segment, settings);
    if (options.dry_run) return dry_run(options);
    spare_inputs_of(options);
    CookReport report;
    {
        Progress progress("cook", options.quiet);
        if (only_survey) {
            survey(options.input.path, settings, [&](const CookProgress& p) { progress(p.stage, p.frames_done, p.frames_total); });
            return exit_done;
        }
        report = cook(options.input.path, options.output, settings, [&](const CookProgress& p) { progress(p.stage, p.frames_done, p.frames_total); });
    }
    if (!options.report.empty()) write_json(options.report, report.json);
    if (!options.depfile.empty()) {
        std::vector<std::string> needed = dependencies(options.input.path, settings);
        if (!options.recipe.empty()) needed.push_back(options.recipe);
        write_file(options.depfile, make_rule(options.output, needed));
        // A build compares times: what is up to date must not look older than what it depends on.
        if (report.up_to_date) std::filesystem::last_write_time(options.output, std::filesystem::file_time_type::clock::now());
    }
    if (!options.quiet && report.up_to_date)
        std::printf("%s: up to date: the same input, settings and tool; --force cooks anew\n", options.output.c_str());
    if (report.is_part) return exit_done;  // judged when all parts are linked
    const int code = tell_target(options.output, report, options.quiet);
    return std::max(code, judge_targets(targets, options.output, report.json));
}

}  // namespace

int tell_target(const std::string& asset, const Verdict& v, bool quiet) {
    const bool rate = v.target_kbps > 0;
    if (!quiet) {
        std::printf("%s: %s; p99 error %.4g m", asset.c_str(), readable_bytes(double(std::filesystem::file_size(asset))).c_str(), v.measured_p99);
        if (rate) std::printf("; %.4g kbit/s, aimed at %.4g kbit/s\n", v.measured_kbps, v.target_kbps);
        else std::printf(", aimed at %.4g m\n", v.target_p99);
    }
    if (v.target_met) return exit_done;
    const double measured = rate ? v.measured_kbps : v.measured_p99, target = rate ? v.target_kbps : v.target_p99;
    const char* unit = rate ? "kbit/s" : "m";
    std::fprintf(stderr, "rill: %s: target missed: %s is %.4g %s, %.2f times the %.4g %s aimed at\n", asset.c_str(), rate ? "the rate" : "p99 error",
                 measured, unit, measured / target, target, unit);
    return exit_target_missed;
}

void add_cook(CLI::App& app, Run& run) {
    auto options = std::make_shared<CookOptions>();
    CLI::App* command = app.add_subcommand("cook", "Cook a fluid mesh sequence into an asset");
    options->input.add_to(*command)->required(false);
    command->add_option("-o,--output", options->output, "The asset, .rill");
    CLI::Option* error = command->add_option("--error", options->settings.error, "p99 error aimed at: 0.25e (edges), 0.1% (of the diagonal), 2mm")->capture_default_str();
    command->add_option("--bitrate", options->settings.bitrate, "Kilobits per second: the best error within this rate, instead of --error")->check(CLI::PositiveNumber)->excludes(error);
    command->add_option("--frames", options->frames, "A:B[:STEP], source numbers, inclusive");
    command->add_option("--window", options->settings.window, "Frames per window, about, for they are of even length [24; where the liquid is calm up to 48]")->check(CLI::Range(1, 64));
    command->add_option("--layers", options->settings.layers, "Layers of detail")->check(CLI::Range(1, 8))->capture_default_str();
    command->add_option("--slip", options->settings.slip, "Keep how the liquid slides along the surface, for velocity; false: a few per cent smaller")->capture_default_str();
    command->add_option("--jobs", options->settings.jobs, "Threads; 0: all cores")->check(CLI::Range(0, 1024));
    command->add_option("--recipe", options->recipe, "JSON file of these settings (see RECIPES.md); the command line goes before it");
    command->add_option("--report", options->report, "Write the report as JSON; - is standard output");
    command->add_option("--depfile", options->depfile, "Write what the asset depends on, as a rule for make and ninja");
    command->add_option("--segment", options->segment, "I/N: cook this share only, into a part for rill link");
    command->add_option("--survey", options->settings.survey, "Keep what all segments must know of the input in this file; without -o that is all");
    command->add_flag("--force", options->settings.force, "Cook although the output is up to date");
    command->add_flag("--dry-run", options->dry_run, "Say what would be done");
    command->add_flag("--quiet", options->quiet, "Errors only");
    command->callback([&run, options, command] { run = [options, command] { return cook_command(*options, *command); }; });
}

}  // namespace rill::cooker
