// SPDX-License-Identifier: MIT
#include "verify/verify.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>

#include "commands/commands.h"
#include "common/output_file.h"

namespace rill::cooker {
namespace {

struct VerifyOptions {
    InputOptions input;
    std::string asset, frames, json, html;
    int jobs = 0;
    uint32_t substeps = 0;
    bool quiet = false;
};

void print_table(const Verification& v) {
    const double percent = v.diagonal > 0 ? 100 / v.diagonal : 0, edges = v.edge > 0 ? 1 / v.edge : 0;
    std::printf("%6s  %-24s  %-20s %7s %7s  %-13s  %-13s  %s\n", "", "error, % of diagonal", "in source edges", "normal", "volume",
                "open edges", "non-manifold", "components > 8 cells");
    std::printf("%6s  %7s %8s %7s  %6s %6s %6s  %6s° %7s  %6s %6s  %6s %6s  %6s %6s\n", "frame", "mean", "p99", "max", "mean", "p99", "max",
                "", "ratio", "source", "rill", "source", "rill", "source", "rill");
    for (const FrameMeasure& f : v.frames)
        std::printf("%6d  %7.4f %8.4f %7.4f  %6.3f %6.3f %6.3f  %6.2f° %7.4f  %6u %6u  %6u %6u  %6u %6u\n", f.number, f.distance.mean * percent,
                    f.distance.p99 * percent, f.distance.max * percent, f.distance.mean * edges, f.distance.p99 * edges,
                    f.distance.max * edges, f.distance.normal_degrees, f.volume_ratio(), f.source.open_edges, f.decoded.open_edges,
                    f.source.non_manifold_edges, f.decoded.non_manifold_edges, f.source.large_components, f.decoded.large_components);
}

void print_summary(const Verification& v) {
    const double percent = v.diagonal > 0 ? 100 / v.diagonal : 0, edges = v.edge > 0 ? 1 / v.edge : 0;
    const FrameMeasure& worst = v.frames[v.worst];
    std::printf("%zu frames: mean %.4f %%, p99 %.4f %%, max %.4f %% of the diagonal (%.4g m); p99 %.3f edges (of %.4g m); normals %.2f°\n",
                v.frames.size(), v.mean * percent, v.p99 * percent, v.max * percent, v.diagonal, v.p99 * edges, v.edge, v.normal_degrees);
    if (const auto between = std::count_if(v.frames.begin(), v.frames.end(), [](const FrameMeasure& f) { return f.between; }))
        std::printf("%td of them lie between the asset's own frames, of which alone an error was promised\n", between);
    std::printf("worst frame %d: p99 %.4f %%, max %.4f %%; %s per frame\n", worst.number, worst.distance.p99 * percent,
                worst.distance.max * percent, readable_bytes(v.bytes_per_frame).c_str());
}

void print_details(const Verification& v) {
    const double edges = v.edge > 0 ? 1 / v.edge : 0;
    uint64_t pieces[2] = {}, large[2] = {};
    for (const FrameMeasure& f : v.frames) {
        pieces[0] += f.source.components, pieces[1] += f.decoded.components;
        large[0] += f.source.large_components, large[1] += f.decoded.large_components;
    }
    std::printf("components, source and rill: %llu and %llu larger than %g cells, %llu and %llu in all\n", (unsigned long long)large[0],
                (unsigned long long)large[1], large_cells, (unsigned long long)pieces[0], (unsigned long long)pieces[1]);
    for (const CoarseMeasure& m : v.coarse)
        std::printf("with %ux coarser cells: %u open, %u non-manifold edges\n", m.times, m.open_edges, m.non_manifold_edges);
    for (size_t i = 0; i < ThinError::classes; ++i)
        std::printf("liquid thinner than %zu point spacing%s: %.2f %% of the surface; mean %.3f, p99 %.3f, max %.3f edges\n", i + 1,
                    i ? "s" : "", 100 * v.thin.area_share(i), v.thin.below[i].mean() * edges, v.thin.below[i].p99() * edges,
                    v.thin.below[i].max * edges);
    if (v.velocity.degrees.weight > 0)
        std::printf("velocity: direction off by %.2f°, p99 %.1f°; length by %.2f %%, p99 %.1f %%\n", v.velocity.degrees.mean(),
                    v.velocity.degrees.p99(), 100 * v.velocity.length.mean(), 100 * v.velocity.length.p99());
}

void print_motion(const Verification& v) {
    const Motion& m = v.motion;
    const double edges = v.edge > 0 ? 1 / v.edge : 0, cell = v.edge * v.edge * v.edge;
    std::printf("\nmotion in source edges; a step from frame to frame moves the surface by %.3f, a jump is more than %.3f in a substep\n",
                m.frame.mean() * edges, m.most_smooth() * edges);
    std::printf("%6s %6s  %8s %8s %8s  %s\n", "from", "to", "mean", "p99", "max", "jumps: largest of each substep");
    for (const IntervalMotion& interval : m.intervals) {
        Displacement most;
        std::string jumps;
        for (size_t k = 0; k < interval.substeps.size(); ++k) {
            const Displacement& d = interval.substeps[k];
            most = {std::max(most.mean, d.mean), std::max(most.p99, d.p99), std::max(most.max, d.max)};
            char text[48];
            std::snprintf(text, sizeof text, " %zu: %.2f", k + 1, d.max * edges);
            if (d.max > m.most_smooth()) jumps += text;
        }
        std::printf("%6d %6d  %8.3f %8.3f %8.3f %s\n", interval.from, interval.to, most.mean * edges, most.p99 * edges, most.max * edges, jumps.c_str());
    }
    const std::vector<LonePiece> lone = m.lone();
    std::printf("%u substeps a frame: mean %.4f, p99 %.3f, max %.3f edges; %u of %zu jump, %.4f %% of the surface; %zu pieces come or go at "
                "once, the largest of %.2f cells\n", m.substeps, m.substep.mean() * edges, m.substep.p99() * edges, m.substep.max * edges, m.jumps(),
                m.intervals.size() * m.substeps, 100 * m.jump_share(), lone.size(), lone.empty() || cell == 0 ? 0 : lone.front().volume / cell);
    if (!m.borders.empty())
        std::printf("%zu window borders: mean %.3f, p99 %.3f, max %.3f edges; p99 is %.2f times that of the error\n", m.borders.size(),
                    m.border.mean() * edges, m.border.p99() * edges, m.border.max * edges, v.p99 > 0 ? m.border.p99() / v.p99 : 0);
}

int verify_command(const VerifyOptions& options) {
    const FrameRange frames = parse_frames(options.frames);
    ReadOptions read = options.input.checked();
    read.first = frames.first, read.last = frames.last, read.step = frames.step;
    const auto source = open_source_of(options.asset, options.input.path, read);
    for (const std::string& path : {options.json, options.html})
        for (size_t i = 0; i < source->info().numbers.size() && !path.empty(); ++i) spare_inputs(path, source->files(i));
    Verification result;
    {
        Progress progress("verify", options.quiet);
        result = verify(options.asset, *source, options.jobs, [&](uint32_t done, uint32_t total) { progress("", done, total); }, Scrutiny::close);
        if (options.substeps > 0)
            result.motion = measure_motion(options.asset, result.frames.front().number, result.frames.back().number, options.substeps, options.jobs,
                                           [&](uint32_t done, uint32_t total) { progress("motion", done, total); });
    }
    if (!options.quiet && options.json != "-") {
        print_table(result), print_summary(result), print_details(result);
        if (options.substeps > 0) print_motion(result);
    }
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
    command->add_option("--substeps", options->substeps, "Measure how the surface moves between frames, at so many times a frame step")
        ->check(CLI::Range(1, 64));
    command->add_option("--jobs", options->jobs, "Threads; 0: all cores")->check(CLI::Range(0, 1024));
    command->add_flag("--quiet", options->quiet, "No table, no progress");
    command->callback([&run, options] { run = [options] { return verify_command(*options); }; });
}

}  // namespace rill::cooker
