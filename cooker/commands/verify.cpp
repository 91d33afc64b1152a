// SPDX-License-Identifier: MIT
#include "verify.h"

#include <cstdio>

#include "commands/commands.h"
#include "output_file.h"

namespace rill::cooker {
namespace {

struct VerifyOptions {
    InputOptions input;
    std::string asset, frames, json, html;
    int jobs = 0;
    bool quiet = false;
};

void print_table(const Verification& v) {
    const double percent = v.diagonal > 0 ? 100 / v.diagonal : 0, edges = v.edge > 0 ? 1 / v.edge : 0;
    std::printf("%6s  %-24s  %-20s %7s %7s  %-13s  %-13s  %s\n", "", "error, % of diagonal", "in source edges", "normal", "volume",
                "open edges", "non-manifold", "components");
    std::printf("%6s  %7s %8s %7s  %6s %6s %6s  %6s° %7s  %6s %6s  %6s %6s  %6s %6s\n", "frame", "mean", "p99", "max", "mean", "p99", "max",
                "", "ratio", "source", "rill", "source", "rill", "source", "rill");
    for (const FrameMeasure& f : v.frames)
        std::printf("%6d  %7.4f %8.4f %7.4f  %6.3f %6.3f %6.3f  %6.2f° %7.4f  %6u %6u  %6u %6u  %6u %6u\n", f.number, f.distance.mean * percent,
                    f.distance.p99 * percent, f.distance.max * percent, f.distance.mean * edges, f.distance.p99 * edges,
                    f.distance.max * edges, f.distance.normal_degrees, f.volume_ratio(), f.source.open_edges, f.decoded.open_edges,
                    f.source.non_manifold_edges, f.decoded.non_manifold_edges, f.source.components, f.decoded.components);
}

void print_summary(const Verification& v) {
    const double percent = v.diagonal > 0 ? 100 / v.diagonal : 0, edges = v.edge > 0 ? 1 / v.edge : 0;
    const FrameMeasure& worst = v.frames[v.worst];
    std::printf("%zu frames: mean %.4f %%, p99 %.4f %%, max %.4f %% of the diagonal (%.4g m); p99 %.3f edges (of %.4g m); normals %.2f°\n",
                v.frames.size(), v.mean * percent, v.p99 * percent, v.max * percent, v.diagonal, v.p99 * edges, v.edge, v.normal_degrees);
    std::printf("worst frame %d: p99 %.4f %%, max %.4f %%; %s per frame\n", worst.number, worst.distance.p99 * percent,
                worst.distance.max * percent, readable_bytes(v.bytes_per_frame).c_str());
}

int verify_command(const VerifyOptions& options) {
    const FrameRange frames = parse_frames(options.frames);
    ReadOptions read = options.input.checked();
    read.first = frames.first, read.last = frames.last, read.step = frames.step;
    const auto source = open_source_of(options.asset, options.input.path, read);
    Verification result;
    {
        Progress progress("verify", options.quiet);
        result = verify(options.asset, *source, options.jobs, [&](uint32_t done, uint32_t total) { progress("", done, total); });
    }
    if (!options.quiet && options.json != "-") print_table(result), print_summary(result);
    if (!options.json.empty()) write_json(options.json, to_json(result));
    if (!options.html.empty()) write_file(options.html, to_html(result, *source));
    if (result.target_met()) return exit_done;
    std::fprintf(stderr, "rill: %s: target missed: p99 error is %.4g m, %.2f times the %.4g m of --error %s\n", options.asset.c_str(),
                 result.p99, result.p99 / result.target_p99, result.target_p99, result.target.c_str());
    return exit_target_missed;
}

}  // namespace

void add_verify(CLI::App& app, Run& run) {
    auto options = std::make_shared<VerifyOptions>();
    CLI::App* command = app.add_subcommand("verify", "Measure an asset against its source, frame by frame");
    command->add_option("ASSET", options->asset, "The asset, .rill")->required();
    options->input.add_to(*command);
    command->add_option("--frames", options->frames, "A:B[:STEP], source numbers, inclusive");
    command->add_option("--json", options->json, "Write the report as JSON; - is standard output");
    command->add_option("--html", options->html, "Write the report as one web page");
    command->add_option("--jobs", options->jobs, "Threads; 0: all cores")->check(CLI::Range(0, 1024));
    command->add_flag("--quiet", options->quiet, "No table, no progress");
    command->callback([&run, options] { run = [options] { return verify_command(*options); }; });
}

}  // namespace rill::cooker
