// SPDX-License-Identifier: MIT
#include "cook/cook.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>

#include "common/output_file.h"
#include "cook/error_target.h"
#include "cook/input_hash.h"
#include "cook/parts_to_asset.h"
#include "cook/span_to_part.h"
#include "cook/survey.h"
#include "cook/work_folder.h"
#include "frames/open_sequence.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

void check(const CookSettings& settings) {
    if (settings.window < 0 || settings.window > int(SpanPlan::most_window))
        throw UsageError("--window must be 1 to " + std::to_string(SpanPlan::most_window) + " frames");
    if (settings.layers < 1 || settings.layers > int(format::max_layers))
        throw UsageError("layers must be 1 to " + std::to_string(format::max_layers));
    if (settings.segments > 0 && settings.segment >= settings.segments) throw UsageError("--segment I/N needs I from 1 to N");
    aim_of(settings.error, settings.bitrate, 1, 1, 1);
}

/// What decides every byte of the asset, but for the input's content.
nlohmann::json decisive_settings(const CookSettings& settings) {
    nlohmann::json all = {{"layers", settings.layers}, {"read", read_settings(settings.read)}};
    if (settings.window > 0) all["window"] = settings.window;
    if (settings.bitrate > 0) all["bitrate"] = settings.bitrate;
    else all["error"] = settings.error;
    if (!settings.slip) all["slip"] = false;
    return all;
}

std::unique_ptr<SequenceReader> open_input(const std::string& input, const CookSettings& settings) {
    ReadOptions options = settings.read;
    options.require_velocity = true;
    return open_sequence(input, options);
}

/// An opened input with its place in the scheme of spans.
struct Job {
    std::unique_ptr<SequenceReader> reader;
    std::string input_hash, key, folder;  ///< folder: where finished spans are kept
    SpanPlan plan;
    SpanRange share;

    Job(const std::string& input, const std::string& output, const CookSettings& settings) {
        check(settings);
        reader = open_input(input, settings);
        input_hash = known_input(*reader, settings.read, settings.survey, settings.jobs);
        const nlohmann::json all = {{"settings", decisive_settings(settings)}, {"input", input_hash}, {"numbers", reader->info().numbers},
                                    {"windows_per_span", windows_per_span}, {"format", format::current_version}, {"tool", RILL_VERSION}};
        key = hash_text(all.dump());
        folder = output + ".cook-" + key.substr(0, 16);
        const auto count = uint32_t(reader->info().numbers.size());
        plan = settings.window > 0 ? SpanPlan{count, uint32_t(settings.window), 0} : SpanPlan{count, usual_window, usual_calm_window};
        share = settings.segments > 0 ? segment_of(plan, settings.segment, settings.segments) : SpanRange{0, plan.spans()};
    }
    std::string part(uint32_t span) const {
        char name[64];
        std::snprintf(name, sizeof name, "/span_%05u_of_%05u.rill", span + 1, plan.spans());
        return folder + name;
    }
    /// A part of this very span, whole and undamaged.
    bool has(uint32_t span) const {
        try {
            const Part found = read_part(part(span));
            return found.cook.at("key") == key && found.spans.size() == 1 && found.spans[0].span == span;
        } catch (const InputError&) {
            return false;
        }
    }
    /// The output, when it is already what would be made; null otherwise.
    nlohmann::json finished(const std::string& output, bool as_part) const {
        if (!fs::is_regular_file(output)) return nullptr;
        try {
            if (as_part) {
                const Part found = read_part(output);
                const bool same = found.cook.at("key") == key && found.spans.front().span == share.first && found.spans.back().span + 1 == share.end;
                return same ? found.cook : nlohmann::json(nullptr);
            }
            const AssetDirectory directory = read_directory(output);
            nlohmann::json stored = nlohmann::json::parse(directory.settings_json, nullptr, false);
            if (!stored.is_object() || stored.value("key", nlohmann::json()) != key) return nullptr;
            check_chunks(directory);
            return stored;
        } catch (const InputError&) {
            return nullptr;
        }
    }
};

/// n frames last n times their mean distance, in seconds.
double duration(const SequenceInfo& info) {
    const double n = double(info.seconds.size()), between = info.seconds.back() - info.seconds.front();
    return n > 1 && between > 0 ? between * n / (n - 1) : n / info.frames_per_second;
}

/// The aim, if there are numbers for it: squares and cubes of what is much larger leave those of floats.
Aim checked_aim(const std::string& input, const CookSettings& settings, const Survey& survey, double seconds) {
    constexpr double largest = 1e5, finest = 1e-6;  // metres; of the diagonal
    const double diagonal = survey.diagonal();
    char text[200];
    if (diagonal > largest) {
        std::snprintf(text, sizeof text, ": the liquid is %.4g m across, more than %.4g m: what is a unit of it? --scale says how many metres", diagonal, largest);
        throw InputError(input + text);
    }
    const Aim aim = aim_of(settings.error, settings.bitrate, survey.edge, diagonal, seconds);
    if (aim.p99 == 0 || diagonal == 0 || (aim.p99 >= finest * diagonal && aim.p99 <= diagonal)) return aim;
    std::snprintf(text, sizeof text, "' is %.4g m: it must be from %.4g to %.4g m for this liquid", aim.p99, finest * diagonal, diagonal);
    throw UsageError("--error '" + settings.error + text);
}

/// As format::Header::walls.
uint32_t header_walls(const Survey& survey) {
    const uint32_t bevel = uint32_t(std::lround(survey.bevel / survey.edge * float(format::bevel_parts)));
    return survey.walls | survey.sharp << format::sharp_rims_shift | std::min(bevel, format::every_bevel) << format::bevel_shift;
}

/// What every part and the asset say of the cook.
nlohmann::json cook_json(const Job& job, const CookSettings& settings, const Survey& survey, const Aim& aim) {
    const SequenceInfo& info = job.reader->info();
    const double frames = double(info.numbers.size());
    nlohmann::json target = {{"p99_metres", aim.p99}};
    nlohmann::json source = {{"format", info.format}, {"frames", info.numbers.size()}, {"first_frame", info.numbers.front()},
                             {"frames_per_second", info.frames_per_second}, {"raw_bytes", info.raw_bytes},
                             {"triangles_per_frame", survey.triangles / frames}, {"vertices_per_frame", survey.vertices / frames},
                             {"median_edge_metres", survey.edge}};
    if (survey.cut.sides) source["cut"] = cut_json(survey.cut);
    if (aim.bytes > 0) target = {{"kilobits_per_second", settings.bitrate}, {"file_bytes", aim.bytes}};
    return {{"generator", "rill cook"},
            {"tool", RILL_VERSION},
            {"key", job.key},
            {"span_count", job.plan.spans()},
            {"settings", decisive_settings(settings)},
            {"target", target},
            {"source", source}};
}

CookReport report_of(const Linked& linked, bool up_to_date) {
    CookReport report;
    static_cast<Verdict&>(report) = linked;
    report.json = linked.report, report.up_to_date = up_to_date;
    return report;
}

}  // namespace

CookReport cook(const std::string& input, const std::string& output, const CookSettings& settings,
                const std::function<void(const CookProgress&)>& progress) {
    Job job(input, output, settings);
    const bool as_part = settings.segments > 0;
    CookReport report;
    report.is_part = as_part;
    if (const nlohmann::json stored = settings.force ? nlohmann::json() : job.finished(output, as_part); !stored.is_null()) {
        if (!as_part) return report_of(judge(stored, fs::file_size(output)), true);
        report.json = stored, report.up_to_date = report.target_met = true;
        return report;
    }
    check_output(output);
    if (job.share.first == job.share.end) {  // fewer spans than segments
        write_file(output, "");
        report.target_met = true;
        return report;
    }
    WorkFolder folder(output, job.folder, settings.read.warn);
    const uint32_t frames = job.plan.frames;
    const Survey survey = survey_input(*job.reader, settings.read, settings.survey, job.input_hash, settings.jobs,
                                       [&](uint32_t done) { progress({done, frames, "surveying"}); });
    const Aim aim = checked_aim(input, settings, survey, duration(job.reader->info()));
    const CookFacts facts = {cook_json(job, settings, survey, aim), job.reader->info().frames_per_second, uint32_t(settings.layers),
                             survey.edge, survey.lower, survey.upper, header_walls(survey)};
    const auto reader = apply_fit(cut_to_closed(std::move(job.reader), survey.cut), survey.fit);
    const SpanCook spans(*reader, settings, survey, job.plan, facts, aim);
    const uint32_t begin = job.plan.first(job.share.first), end = job.plan.last(job.share.end - 1);
    std::vector<std::string> parts;
    for (uint32_t span = job.share.first; span < job.share.end; ++span) {
        const uint32_t first = job.plan.first(span), last = job.plan.last(span);
        parts.push_back(job.part(span));
        // A first attempt is about half the work: measuring it, and others, is the rest.
        if (settings.force || !job.has(span))
            spans.run(span, parts.back(), [&](uint32_t done) { progress({first - begin + done / 2, end - begin + 1, "cooking"}); });
        progress({last - begin + (last == end ? 1 : 0), end - begin + 1, "cooking"});
    }
    if (as_part) {
        link_part(parts, output);
        report.json = facts.cook, report.target_met = true;
    } else {
        report = report_of(link_asset(parts, output), false);
    }
    folder.remove_all();
    return report;
}

void survey(const std::string& input, const CookSettings& settings, const std::function<void(const CookProgress&)>& progress) {
    check(settings);
    const auto reader = open_input(input, settings);
    const uint32_t frames = uint32_t(reader->info().numbers.size());
    survey_input(*reader, settings.read, settings.survey, known_input(*reader, settings.read, settings.survey, settings.jobs), settings.jobs,
                 [&](uint32_t done) { progress({done, frames, "surveying"}); });
}

CookPlan plan_cook(const std::string& input, const std::string& output, const CookSettings& settings) {
    const Job job(input, output, settings);
    CookPlan plan;
    plan.key = job.key, plan.info = job.reader->info(), plan.spans = job.plan, plan.share = job.share;
    plan.up_to_date = !settings.force && !job.finished(output, settings.segments > 0).is_null();
    check_output(output);
    for (uint32_t span = job.share.first; span < job.share.end && !settings.force; ++span) plan.finished += job.has(span) ? 1 : 0;
    plan.fit = check_velocity(*job.reader, settings.read.warn);
    return plan;
}

std::vector<std::string> dependencies(const std::string& input, const CookSettings& settings) {
    std::vector<std::string> all;
    std::set<std::string> folders;  // frames that come and go change their folder
    if (fs::is_directory(input)) folders.insert(input);
    for (const fs::path& path : input_files(*open_input(input, settings))) {
        all.push_back(path.string());
        if (path.has_parent_path()) folders.insert(path.parent_path().string());
    }
    all.insert(all.end(), folders.begin(), folders.end());
    return all;
}

}  // namespace rill::cooker
