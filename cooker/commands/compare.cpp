// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>

#include "asset/asset_player.h"
#include "asset/byte_account.h"
#include "commands/commands.h"
#include "common/scratch_folder.h"
#include "cook/cook.h"
#include "frames/open_sequence.h"
#include "rivals/rivals.h"
#include "verify/verify.h"

namespace rill::cooker {
namespace {

struct CompareOptions {
    InputOptions input;
    std::string asset, frames, json, decimator, error = "0.25e";
    int jobs = 0;
    bool quiet = false;
};

struct Measure {
    const char *key, *words;
    double RatePoint::*rival;
    double Verification::*own;
};
const Measure measures[] = {{"mean_m", "mean", &RatePoint::mean, &Verification::mean},
                            {"p99_m", "p99", &RatePoint::p99, &Verification::p99},
                            {"normal_degrees", "normals", &RatePoint::normal_degrees, &Verification::normal_degrees}};

/// What Rill makes of the same frames.
struct Own {
    Verification error;
    double decode_ms = 0;      ///< a frame, one core: reading, decoding, field and mesh, played in order
    double raw_bytes = 0;      ///< a frame of the source: 12 bytes a vertex and a triangle
    double still_bytes = 0;    ///< a frame, without slip: that is velocity alone, which rivals are counted with and without
};

nlohmann::json to_json(const RatePoint& p, double raw_bytes) {
    return {{"setting", p.setting},   {"bytes_per_frame", p.bytes_per_frame}, {"triangles_per_frame", p.triangles_per_frame},
            {"mean_m", p.mean},       {"p99_m", p.p99},                       {"max_m", p.max},
            {"encode_ms", p.encode_ms}, {"decode_ms", p.decode_ms},           {"normal_degrees", p.normal_degrees},
            {"bytes_with_velocity_per_frame", p.bytes_with_velocity},
            {"raw_over_bytes", p.bytes_per_frame > 0 ? raw_bytes / p.bytes_per_frame : 0}};
}

/// A sequence is sampled so that a look at it takes a minute; --frames asks for more.
ReadOptions spread(ReadOptions options, const std::string& path) {
    constexpr int most = 12;
    if (options.step) return options;
    const std::vector<int> numbers = open_sequence(path, options)->info().numbers;
    if (numbers.size() <= most) return options;
    const int source_step = numbers[1] - numbers[0], every = int((numbers.size() + most - 1) / most);
    options.first = numbers.front(), options.last = numbers.back(), options.step = source_step * every;
    return options;
}

double decode_time(const Verification& own) {
    using clock = std::chrono::steady_clock;
    AssetPlayer player(own.asset, 1);
    double total = 0;
    for (const FrameMeasure& frame : own.frames) {
        const auto start = clock::now();
        player.mesh(frame.seconds);
        total += std::chrono::duration<double, std::milli>(clock::now() - start).count();
    }
    return own.frames.empty() ? 0 : total / double(own.frames.size());
}

double raw_bytes_of(const Verification& own) {
    double sum = 0;
    for (const FrameMeasure& frame : own.frames) sum += 12.0 * (frame.source_vertices + frame.source_triangles);
    return own.frames.empty() ? 0 : sum / double(own.frames.size());
}

double still_bytes_of(const Verification& own) {
    const ByteAccount account = account_for_bytes(read_directory(own.asset));
    uint64_t slip = 0;
    for (const LayerBytes& layer : account.layers) slip += layer.slip;
    return own.bytes_per_frame * (1 - double(slip) / double(account.sum()));
}

/// A rival's bytes with and without velocity, and Rill's beside them.
struct Count {
    double RatePoint::*rival;
    double own;
};
std::array<Count, 2> counts(const Own& own) {
    return {{{&RatePoint::bytes_per_frame, own.still_bytes}, {&RatePoint::bytes_with_velocity, own.error.bytes_per_frame}}};
}

void print(const std::vector<RateCurve>& curves, const Own& own) {
    const double scale = own.error.diagonal > 0 ? 100 / own.error.diagonal : 0;
    std::printf("%-41s %-18s %11s %11s %8s %8s %8s %9s %8s\n", "method", "setting", "bytes/frame", "+ velocity", "raw : 1", "mean %", "p99 %",
                "normals", "decode");
    const auto line = [&](const std::string& method, const std::string& setting, double bytes, double with_velocity, double mean, double p99,
                          double degrees, double ms) {
        std::printf("%-41s %-18s %11.0f %11.0f %8.1f %8.4f %8.4f %8.2f° %6.1fms\n", method.c_str(), setting.c_str(), bytes, with_velocity,
                    bytes > 0 ? own.raw_bytes / bytes : 0, mean * scale, p99 * scale, degrees, ms);
    };
    for (const RateCurve& curve : curves)
        for (const RatePoint& p : curve.points)
            line(curve.method, p.setting, p.bytes_per_frame, p.bytes_with_velocity, p.mean, p.p99, p.normal_degrees, p.decode_ms);
    line("Rill", own.error.target, own.still_bytes, own.error.bytes_per_frame, own.error.mean, own.error.p99, own.error.normal_degrees, own.decode_ms);
    std::printf("\n%-41s %27s   %27s\n%-41s %8s %8s %9s   %8s %8s %9s\n", "bytes over Rill's at equal …", "positions", "with velocity", "",
                "mean", "p99", "normals", "mean", "p99", "normals");
    for (const RateCurve& curve : curves) {
        std::printf("%-41s", curve.method.c_str());
        for (const Count& count : counts(own)) {
            for (const Measure& m : measures) {
                const double rival = curve.bytes_at(count.rival, m.rival, own.error.*m.own);
                if (rival > 0) std::printf(" %8.2f", rival / count.own);
                else std::printf(" %8s", "-");
            }
            std::printf("    ");
        }
        std::printf("\n");
    }
}

nlohmann::json report_json(const std::vector<RateCurve>& curves, const Own& own, const SequenceReader& source) {
    const Verification& e = own.error;
    nlohmann::json json = {{"report", "rill compare"}, {"version", 3}, {"input", e.input}, {"frames", source.info().numbers},
                           {"raw_bytes_per_frame", own.raw_bytes}, {"rivals", nlohmann::json::array()}};
    for (const RateCurve& curve : curves) {
        nlohmann::json points = nlohmann::json::array(), still, moving;
        for (const RatePoint& p : curve.points) points.push_back(to_json(p, own.raw_bytes));
        for (const Measure& m : measures) {
            const auto ratio = [&](const Count& count) {
                const double rival = curve.bytes_at(count.rival, m.rival, e.*m.own);
                return rival > 0 ? nlohmann::json(rival / count.own) : nlohmann::json();
            };
            const auto [without, with] = counts(own);
            still[m.key] = ratio(without), moving[m.key] = ratio(with);
        }
        json["rivals"].push_back({{"method", curve.method}, {"points", points}, {"bytes_over_rill_at_equal", still},
                                  {"bytes_over_rill_at_equal_with_velocity", moving}});
    }
    json["rill"] = {{"asset", e.asset}, {"bytes_per_frame", e.bytes_per_frame}, {"bytes_without_slip_per_frame", own.still_bytes}, {"mean_m", e.mean}, {"p99_m", e.p99}, {"max_m", e.max},
                    {"normal_degrees", e.normal_degrees}, {"diagonal_m", e.diagonal}, {"decode_ms", own.decode_ms},
                    {"raw_over_bytes", e.bytes_per_frame > 0 ? own.raw_bytes / e.bytes_per_frame : 0}};
    return json;
}

/// For when --asset named none.
std::string cook_one(const CompareOptions& options, const ScratchFolder& folder) {
    const std::string asset = (folder.path / "cooked.rill").string();
    CookSettings settings;
    settings.error = options.error, settings.jobs = options.jobs, settings.read = options.input.checked();
    Progress progress("cook", options.quiet);
    cook(options.input.path, asset, settings, [&](const CookProgress& p) { progress(p.stage, p.frames_done, p.frames_total); });
    return asset;
}

int compare_command(const CompareOptions& options) {
    const FrameRange range = parse_frames(options.frames);
    ReadOptions read = options.input.checked();
    read.first = range.first, read.last = range.last, read.step = range.step;
    auto opened = open_sequence(options.input.path, spread(read, options.input.path));
    const ScratchFolder folder;
    const std::string asset = options.asset.empty() ? cook_one(options, folder) : options.asset;
    const auto source = closed_as_in(asset, std::move(opened));
    std::vector<size_t> frames(source->info().numbers.size());
    for (size_t i = 0; i < frames.size(); ++i) frames[i] = i;
    Own own;
    {
        Progress progress("Rill", options.quiet);
        own.error = verify(asset, *source, options.jobs, [&](uint32_t done, uint32_t total) { progress("", done, total); });
    }
    own.decode_ms = decode_time(own.error), own.raw_bytes = raw_bytes_of(own.error), own.still_bytes = still_bytes_of(own.error);
    std::vector<RateCurve> curves;
    {
        Progress progress("rivals", options.quiet);
        curves = measure_rivals(*source, frames, {options.decimator, options.jobs},
                                [&](uint32_t done, uint32_t total) { progress("", done, total); });
    }
    if (!options.quiet && options.json != "-") print(curves, own);
    if (!options.json.empty()) write_json(options.json, report_json(curves, own, *source));
    return exit_done;
}

}  // namespace

void add_compare(CLI::App& app, Run& run) {
    auto options = std::make_shared<CompareOptions>();
    CLI::App* command = app.add_subcommand("compare", "Size, error and decoding time against meshes coded frame by frame");
    options->input.add_to(*command);
    command->add_option("--asset", options->asset, "An asset cooked from this input; default: one is cooked for the occasion");
    command->add_option("--error", options->error, "What is asked of the asset cooked here");
    command->add_option("--decimator", options->decimator, "Program that simplifies, as another rival: PROGRAM IN.ply KEEP OUT.ply ...");
    command->add_option("--frames", options->frames, "A:B[:STEP], source numbers, inclusive; default: about 12, spread evenly");
    command->add_option("--json", options->json, "Write the report as JSON; - is standard output");
    command->add_option("--jobs", options->jobs, "Threads; 0: all cores")->check(CLI::Range(0, 1024));
    command->add_flag("--quiet", options->quiet, "Errors only");
    command->callback([&run, options] { run = [options] { return compare_command(*options); }; });
}

}  // namespace rill::cooker
