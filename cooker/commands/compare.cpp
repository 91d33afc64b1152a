// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <optional>

#include "commands/commands.h"
#include "rivals.h"
#include "verify.h"

namespace rill::cooker {
namespace {

struct CompareOptions {
    InputOptions input;
    std::string asset, frames, json;
    int jobs = 0;
    bool quiet = false;
};

struct Measure {
    const char *key, *words;
    double RatePoint::*rival;
    double Verification::*own;
};
const Measure measures[] = {{"mean_m", "equal mean", &RatePoint::mean, &Verification::mean},
                            {"p99_m", "equal p99", &RatePoint::p99, &Verification::p99},
                            {"normal_degrees", "equal normals", &RatePoint::normal_degrees, &Verification::normal_degrees}};

nlohmann::json to_json(const RatePoint& p) {
    return {{"setting", p.setting},   {"bytes_per_frame", p.bytes_per_frame}, {"triangles_per_frame", p.triangles_per_frame},
            {"mean_m", p.mean},       {"p99_m", p.p99},                       {"max_m", p.max},
            {"encode_ms", p.encode_ms}, {"decode_ms", p.decode_ms},           {"normal_degrees", p.normal_degrees}};
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

void print(const std::vector<RateCurve>& curves, const Verification* own, double scale) {
    std::printf("%-28s %-34s %12s %9s %9s %8s %9s\n", "method", "setting", "bytes/frame", "mean %", "p99 %", "normals", "decode ms");
    for (const RateCurve& curve : curves)
        for (const RatePoint& p : curve.points)
            std::printf("%-28s %-34s %12.0f %9.4f %9.4f %7.2f° %9.2f\n", curve.method.c_str(), p.setting.c_str(), p.bytes_per_frame,
                        p.mean * scale, p.p99 * scale, p.normal_degrees, p.decode_ms);
    if (!own) return;
    std::printf("%-28s %-34s %12.0f %9.4f %9.4f %7.2f°\n", "Rill", own->target.c_str(), own->bytes_per_frame, own->mean * scale,
                own->p99 * scale, own->normal_degrees);
    for (const RateCurve& curve : curves)
        for (const Measure& m : measures) {
            const double bytes = curve.bytes_at(m.rival, own->*m.own);
            if (bytes > 0) std::printf("%s at %s: %.2f times Rill's bytes\n", curve.method.c_str(), m.words, bytes / own->bytes_per_frame);
            else std::printf("%s: no setting brackets %s\n", curve.method.c_str(), m.words);
        }
}

int compare_command(const CompareOptions& options) {
    const FrameRange range = parse_frames(options.frames);
    ReadOptions read = options.input.checked();
    read.first = range.first, read.last = range.last, read.step = range.step;
    const auto source = open_sequence(options.input.path, spread(read, options.input.path));
    std::vector<size_t> frames(source->info().numbers.size());
    for (size_t i = 0; i < frames.size(); ++i) frames[i] = i;

    std::optional<Verification> own;
    if (!options.asset.empty()) {
        Progress progress("Rill", options.quiet);
        own = verify(options.asset, *source, options.jobs, [&](uint32_t done, uint32_t total) { progress("", done, total); });
    }
    Progress progress("Draco", options.quiet);
    const std::vector<RateCurve> curves =
        measure_rivals(*source, frames, options.jobs, [&](uint32_t done, uint32_t total) { progress("", done, total); });

    nlohmann::json json = {{"report", "rill compare"}, {"version", 1}, {"input", options.input.path},
                           {"frames", source->info().numbers}, {"velocity", false}, {"rivals", nlohmann::json::array()}};
    for (const RateCurve& curve : curves) {
        nlohmann::json points = nlohmann::json::array(), ratios;
        for (const RatePoint& p : curve.points) points.push_back(to_json(p));
        nlohmann::json entry = {{"method", curve.method}, {"points", points}};
        for (const Measure& m : measures) {
            const double bytes = own ? curve.bytes_at(m.rival, *own.*m.own) : 0;
            ratios[m.key] = bytes > 0 ? nlohmann::json(bytes / own->bytes_per_frame) : nlohmann::json();
        }
        if (own) entry["bytes_over_rill_at_equal"] = ratios;
        json["rivals"].push_back(entry);
    }
    if (own)
        json["rill"] = {{"asset", own->asset}, {"bytes_per_frame", own->bytes_per_frame}, {"mean_m", own->mean}, {"p99_m", own->p99},
                        {"max_m", own->max}, {"normal_degrees", own->normal_degrees}, {"diagonal_m", own->diagonal}};
    if (!options.quiet && options.json != "-") {
        double diagonal = own ? own->diagonal : 0;
        if (!own) {  // of the first frame with liquid: a scale for the eye only; the JSON is in metres
            glm::vec3 lower(0), upper(0);
            for (size_t i = 0; i < frames.size() && lower == upper; ++i) {
                const Mesh mesh = source->read(i);
                if (mesh.positions.empty()) continue;
                lower = upper = mesh.positions[0];
                for (const glm::vec3& x : mesh.positions) lower = glm::min(lower, x), upper = glm::max(upper, x);
            }
            diagonal = glm::distance(lower, upper);
        }
        print(curves, own ? &*own : nullptr, diagonal > 0 ? 100 / diagonal : 0);
    }
    if (!options.json.empty()) write_json(options.json, json);
    return exit_done;
}

}  // namespace

void add_compare(CLI::App& app, Run& run) {
    auto options = std::make_shared<CompareOptions>();
    CLI::App* command = app.add_subcommand("compare", "Size, error and decoding time against meshes coded frame by frame");
    options->input.add_to(*command);
    command->add_option("--asset", options->asset, "An asset cooked from this input");
    command->add_option("--frames", options->frames, "A:B[:STEP], source numbers, inclusive; default: about 12, spread evenly");
    command->add_option("--json", options->json, "Write the report as JSON; - is standard output");
    command->add_option("--jobs", options->jobs, "Threads; 0: all cores")->check(CLI::Range(0, 1024));
    command->add_flag("--quiet", options->quiet, "Errors only");
    command->callback([&run, options] { run = [options] { return compare_command(*options); }; });
}

}  // namespace rill::cooker
