// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <thread>

#include "asset/asset_directory.h"
#include "commands/bench_beside.h"
#include "commands/bench_detail.h"
#include "commands/bench_steady.h"
#include "commands/commands.h"

namespace rill::cooker {
namespace {

struct BenchOptions {
    std::string asset, frames, json;
    int jobs = 0;
    bool quiet = false;
};

/// One way through the clip.
struct Pass {
    std::string name;
    int jobs = 1;
    std::vector<BenchFrame> frames;
    uint64_t frame_allocations = 0;
    uint64_t hash = 0;  // over the frames in clip order, so that passes can be compared

    uint32_t percentile(Stage stage, double q) const {
        std::vector<uint32_t> times;
        for (const BenchFrame& f : frames) times.push_back(f.microseconds[stage]);
        std::sort(times.begin(), times.end());
        return times.empty() ? 0 : times[std::min(times.size() - 1, size_t(q * double(times.size())))];
    }
    double mean(Stage stage) const {
        double sum = 0;
        for (const BenchFrame& f : frames) sum += f.microseconds[stage];
        return frames.empty() ? 0 : sum / double(frames.size());
    }
    double triangles_per_second(Stage stage = stage_total) const {
        double triangles = 0, time = 0;
        for (const BenchFrame& f : frames) triangles += f.triangles, time += f.microseconds[stage];
        return time > 0 ? triangles / time * 1e6 : 0;
    }
};

/// `order` holds places in `frames`, which holds frame indices.
Pass run_pass(BenchPlayer& player, const std::string& name, int jobs, const std::vector<uint32_t>& frames,
              const std::vector<size_t>& order, float rate) {
    Pass pass{name, jobs, {}, 0, 14695981039346656037u};
    std::vector<uint64_t> hashes(frames.size());
    const uint64_t before = player.allocations();
    for (size_t i : order) {
        pass.frames.push_back(player.play(player.seconds_of(frames[i]), rate));
        hashes[i] = pass.frames.back().hash;
    }
    pass.frame_allocations = player.allocations() - before;
    for (uint64_t h : hashes) pass.hash = (pass.hash ^ h) * 1099511628211u;
    return pass;
}

std::vector<size_t> forward(size_t count) {
    std::vector<size_t> order(count);
    for (size_t i = 0; i < count; ++i) order[i] = i;
    return order;
}
/// The same shuffle everywhere.
std::vector<size_t> jumps(size_t count) {
    std::vector<size_t> order = forward(count);
    uint64_t state = 88172645463325252u;
    for (size_t i = count; i > 1; --i) {
        state ^= state << 13, state ^= state >> 7, state ^= state << 17;
        std::swap(order[i - 1], order[state % i]);
    }
    return order;
}

nlohmann::json to_json(const Pass& pass) {
    nlohmann::json stages;
    for (int s = 0; s < stage_count; ++s)
        stages[stage_names[s]] = {{"mean_us", pass.mean(Stage(s))},
                                  {"p50_us", pass.percentile(Stage(s), 0.5)},
                                  {"p99_us", pass.percentile(Stage(s), 0.99)},
                                  {"max_us", pass.percentile(Stage(s), 1)}};
    uint64_t triangles = 0, points = 0;
    uint32_t cut = 0;
    for (const BenchFrame& f : pass.frames) triangles += f.triangles, points += f.points, cut |= f.cut;
    char hash[17];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(pass.hash));
    const double frames = std::max<double>(1, double(pass.frames.size()));
    return {{"name", pass.name},
            {"jobs", pass.jobs},
            {"frames", pass.frames.size()},
            {"stages", stages},
            {"triangles_per_second", pass.triangles_per_second()},
            {"triangles_per_frame", double(triangles) / frames},
            {"points_per_frame", double(points) / frames},
            {"allocations_in_frames", pass.frame_allocations},
            {"cut", cut},
            {"output_hash", hash}};
}

/// Frames that did not fit: what they show depends on what was drawn before.
size_t frames_cut(const std::vector<Pass>& passes) {
    constexpr uint32_t room = cut_points | cut_vertices | cut_indices | cut_ranges;
    size_t count = 0;
    for (const Pass& pass : passes)
        for (const BenchFrame& f : pass.frames) count += (f.cut & room) != 0;
    return count;
}

void print(const Pass& pass) {
    std::printf("%-9s %4d ", pass.name.c_str(), pass.jobs);
    for (int s = 0; s < stage_count; ++s) std::printf(s == stage_processor ? " %9.0f" : " %7.0f", pass.mean(Stage(s)));
    std::printf("   %7u %7u %7u  %6.2f  %llu  %016llx\n", pass.percentile(stage_total, 0.5), pass.percentile(stage_total, 0.99),
                pass.percentile(stage_total, 1), pass.triangles_per_second() / 1e6, static_cast<unsigned long long>(pass.frame_allocations),
                static_cast<unsigned long long>(pass.hash));
}

std::vector<uint32_t> frames_asked_for(const AssetDirectory& directory, const BenchOptions& options) {
    const FrameRange range = parse_frames(options.frames);
    std::vector<uint32_t> frames;
    for (uint32_t i = 0; i < directory.header.frame_count; ++i) {
        const int number = directory.frame_number(i);
        if (!range.step || (number >= range.first && number <= range.last && (number - range.first) % range.step == 0)) frames.push_back(i);
    }
    if (frames.empty()) throw InputError(options.asset + ": has none of the frames " + options.frames);
    return frames;
}

/// All that is measured.
struct Report {
    std::vector<Pass> passes;   ///< of the whole at full detail: cold and forward first, then the same with every number of workers
    std::vector<Pass> details;  ///< less of it, or coarser
    uint64_t allocations_until_created = 0, peak_bytes = 0, bytes_read = 0;
    BesideDraco draco;
    BesideCells larger_cells;
    std::vector<SideBySide> scaling;  ///< by workers, from 1
    double two_at_once = 0;
    std::vector<SteadyPlay> steady;   ///< by workers, from 1
    std::vector<ScreenError> far;
    CameraJumps camera;

    bool same() const {
        return std::all_of(passes.begin(), passes.end(), [&](const Pass& pass) { return pass.hash == passes.front().hash; });
    }
    uint64_t allocations_in_frames() const {
        uint64_t sum = 0;
        for (const auto* list : {&passes, &details})
            for (const Pass& pass : *list) sum += pass.frame_allocations;
        return sum;
    }
};

/// With one worker, who does everything.
void measure_single(Report& report, BenchPlayer& player, const std::string& asset, const std::vector<uint32_t>& frames) {
    const std::vector<size_t> ahead = forward(frames.size()), back(ahead.rbegin(), ahead.rend());
    report.allocations_until_created = player.allocations();
    report.passes.push_back(run_pass(player, "cold", 1, frames, ahead, 1));
    report.bytes_read = player.bytes_read();
    report.passes.push_back(run_pass(player, "forward", 1, frames, ahead, 1));
    const double alone = report.passes.back().mean(stage_total);
    report.scaling.push_back({alone, alone});
    report.passes.push_back(run_pass(player, "backward", 1, frames, back, -1));
    report.passes.push_back(run_pass(player, "jumps", 1, frames, jumps(frames.size()), 0));
    for (int level = 1; level <= 3; ++level) {
        player.look(player.info().cell_size * float(1 << level), false);
        report.details.push_back(run_pass(player, "cells x" + std::to_string(1 << level), 1, frames, ahead, 1));
    }
    player.look(0, true);
    report.details.push_back(run_pass(player, "an eighth", 1, frames, ahead, 1));
    player.look(0, false);
    report.peak_bytes = player.peak_bytes();
    report.steady.push_back(steady_play(asset, 1, frames));
    report.draco = beside_draco(player, frames);
    report.larger_cells = beside_larger_cells(player, frames);
    report.far = screen_errors(player, frames);
    report.camera = camera_jumps(player, frames);
    player.look(0, false);
}

void measure_several(Report& report, BenchPlayer& single, const std::string& asset, int jobs, const std::vector<uint32_t>& frames) {
    BenchPlayer player(asset, jobs);
    const std::vector<size_t> ahead = forward(frames.size());
    report.passes.push_back(run_pass(player, "cold", jobs, frames, ahead, 1));
    report.passes.push_back(run_pass(player, "forward", jobs, frames, ahead, 1));
    report.scaling.push_back(beside_one_worker(single, player, frames));
    report.steady.push_back(steady_play(asset, jobs, frames));
    if (jobs == 2) report.two_at_once = two_at_once(single, asset, frames);
}

nlohmann::json to_json(const Report& report, const AssetDirectory& directory, const std::string& asset, size_t frames) {
    nlohmann::json passes = nlohmann::json::array(), scaling = nlohmann::json::array(), steady = nlohmann::json::array(), screen = nlohmann::json::array(), cells = nlohmann::json::array();
    for (size_t k = 0; k < BesideCells::sizes; ++k)
        cells.push_back({{"times_as_large", 1 << k}, {"mean_us", report.larger_cells.times[k]}, {"share", report.larger_cells.share(k)}});
    for (const auto* list : {&report.passes, &report.details})
        for (const Pass& pass : *list) passes.push_back(to_json(pass));
    for (size_t i = 0; i < report.scaling.size(); ++i)
        scaling.push_back({{"jobs", i + 1}, {"mean_us", report.scaling[i].other}, {"speedup", report.scaling[i].ratio()}});
    if (report.two_at_once > 0) scaling[1]["two_players_at_once"] = report.two_at_once;
    for (size_t i = 0; i < report.steady.size(); ++i) {
        const SteadyPlay& s = report.steady[i];
        steady.push_back({{"jobs", i + 1},
                          {"pictures", s.pictures},
                          {"p50_us", s.median_us},
                          {"max_us", s.worst_us},
                          {"max_decode_us", s.worst_decode_us},
                          {"max_decode_share", s.worst_share}});
    }
    for (const ScreenError& e : report.far)
        screen.push_back({{"diagonals", e.diagonals},
                          {"triangles_share", e.triangles},
                          {"mean_pixels", e.mean},
                          {"p99_pixels", e.p99},
                          {"max_pixels", e.max},
                          {"processor_us", e.microseconds}});
    const CameraJumps& camera = report.camera;
    const BesideDraco& draco = report.draco;
    return {{"report", "rill bench"},
            {"version", 1},
            {"asset", asset},
            {"frames", frames},
            {"file_bytes", directory.header.file_bytes},
            {"bytes_read_cold", report.bytes_read},
            {"memory", {{"allocations_until_created", report.allocations_until_created}, {"peak_bytes", report.peak_bytes}}},
            {"allocations_in_frames", report.allocations_in_frames()},
            {"output_identical", report.same()},
            {"passes", passes},
            {"scaling", scaling},
            {"at_60_a_second", steady},
            {"larger_cells", cells},
            {"screen_error", {{"cell_pixels", pixel_error_asked}, {"pixels_per_radian", pixels_per_radian}, {"from", screen}}},
            {"camera_jumps",
             {{"moves", camera.moves},
              {"changes", camera.changes},
              {"above_cell", camera.above_cell},
              {"mean_pixels", camera.mean},
              {"p99_pixels", camera.p99},
              {"max_pixels", camera.max},
              {"above_share", camera.share_above}}},
            {"draco",
             {{"bits", 10},
              {"speed", 0},
              {"frames", frames},
              {"triangles_per_second", draco.triangles_per_second()},
              {"bytes_per_frame", draco.bytes},
              {"mean_us", draco.times.other},
              {"rill_mean_us", draco.times.one},
              {"rill_over_draco", draco.rill_over_draco()}}}};
}

void print(const Report& report) {
    std::printf("               mean microseconds per frame                                   total\n");
    std::printf("pass      jobs     plan  decode   field    mesh    wait   total processor       p50     p99     max  Mtri/s  allocations, output hash\n");
    for (const Pass& pass : report.passes) print(pass);
    for (const Pass& pass : report.details) print(pass);
    std::printf("output %s; %llu allocations in frames; %s read cold; peak memory %s\n", report.same() ? "identical in all passes" : "DIFFERS between passes",
                static_cast<unsigned long long>(report.allocations_in_frames()), readable_bytes(double(report.bytes_read)).c_str(),
                readable_bytes(double(report.peak_bytes)).c_str());
    if (const size_t narrow = frames_cut(report.passes); narrow > 0)
        std::printf("%zu frames did not fit into the buffers that are suggested: their cells are larger, and depend on the frames before\n", narrow);
    for (const ScreenError& e : report.far)
        std::printf("seen from %g diagonals, cells of %g pixels: %5.1f %% of the triangles in %.1f ms, off by %.2f pixels on average, p99 %.2f, max %.1f\n",
                    double(e.diagonals), double(pixel_error_asked), 100 * e.triangles, e.microseconds / 1000, e.mean, e.p99, e.max);
    const CameraJumps& camera = report.camera;
    std::printf("moving away from 1 to 8 diagonals: %u of %u moves change the surface, the worst by %.2f pixels on average, p99 %.2f, max %.1f; "
                "%u move something of it by more than %g, the worst %.3f %%\n",
                camera.changes, camera.moves, camera.mean, camera.p99, camera.max, camera.above_cell, double(pixel_error_asked), 100 * camera.share_above);
    for (size_t i = 1; i < report.scaling.size(); ++i)
        std::printf("%zu workers beside one, frame by frame: %.1f ms for %.1f, %.2f times as fast\n", i + 1, report.scaling[i].other / 1000,
                    report.scaling[i].one / 1000, report.scaling[i].ratio());
    for (size_t i = 0; i < report.steady.size(); ++i) {
        const SteadyPlay& s = report.steady[i];
        std::printf("60 pictures a second, %zu worker%s: median %.1f ms, worst %.1f; decoding takes %.1f ms at most, and %.0f %% of a picture\n", i + 1,
                    i ? "s" : "", s.median_us / 1000.0, s.worst_us / 1000.0, s.worst_decode_us / 1000.0, 100 * s.worst_share);
    }
    const BesideCells& cells = report.larger_cells;
    std::printf("cells twice, four and eight times as large, frame by frame: %.1f, %.1f and %.1f %% of a frame\n", 100 * cells.share(1), 100 * cells.share(2),
                100 * cells.share(3));
    if (report.two_at_once > 0) std::printf("two players of one worker each, at once: %.2f times the frames of one alone\n", report.two_at_once);
    const BesideDraco& draco = report.draco;
    if (draco.triangles > 0)
        std::printf("Draco beside one worker, frame by frame, on the same meshes (10 bits): %.1f ms for %.1f, %.2f Mtri/s, of processor time; "
                    "Rill runs at %.2f times that\n",
                    draco.times.other / 1000, draco.times.one / 1000, draco.triangles_per_second() / 1e6, draco.rill_over_draco());
}

int bench_command(const BenchOptions& options) {
    const AssetDirectory directory = read_directory(options.asset);
    const std::vector<uint32_t> frames = frames_asked_for(directory, options);
    const int most_jobs = options.jobs > 0 ? options.jobs : int(std::max(1u, std::thread::hardware_concurrency()));
    Report report;
    BenchPlayer single(options.asset, 1);
    measure_single(report, single, options.asset, frames);
    for (int jobs = 2; jobs <= most_jobs; ++jobs) measure_several(report, single, options.asset, jobs, frames);
    if (!options.quiet && options.json != "-") print(report);
    if (!options.json.empty()) write_json(options.json, to_json(report, directory, options.asset, frames.size()));
    return exit_done;
}

}  // namespace

void add_bench(CLI::App& app, Run& run) {
    auto options = std::make_shared<BenchOptions>();
    CLI::App* command = app.add_subcommand("bench", "Time the runtime on an asset");
    command->add_option("ASSET", options->asset, "The asset, .rill")->required();
    command->add_option("--jobs", options->jobs, "Measure with 1 to N threads; 0: all cores")->check(CLI::Range(0, 256));
    command->add_option("--frames", options->frames, "A:B[:STEP], source numbers, inclusive");
    command->add_option("--json", options->json, "Write the report as JSON; - is standard output");
    command->add_flag("--quiet", options->quiet, "Errors only");
    command->callback([&run, options] { run = [options] { return bench_command(*options); }; });
}

}  // namespace rill::cooker
