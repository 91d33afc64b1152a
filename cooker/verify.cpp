// SPDX-License-Identifier: MIT
#include "verify.h"

#include <algorithm>
#include <limits>
#include <mutex>

#include "asset_directory.h"
#include "asset_player.h"
#include "parallel.h"

namespace rill::cooker {
namespace {

FrameMeasure measure(const Mesh& source, const Mesh& decoded) {
    FrameMeasure frame;
    frame.source_triangles = uint32_t(source.triangles.size());
    frame.decoded_triangles = uint32_t(decoded.triangles.size());
    frame.edge = median_edge(source);
    frame.distance = surface_distance(source, SurfaceIndex(source), decoded, SurfaceIndex(decoded));
    frame.source = topology(source), frame.decoded = topology(decoded);
    return frame;
}

/// What the asset promises, in the words of the cook's settings_json.
void read_target(Verification& result, const std::string& settings_json) {
    const nlohmann::json json = nlohmann::json::parse(settings_json, nullptr, false);
    auto find = [&](const char* group, const char* key) {
        const bool there = json.is_object() && json.contains(group) && json[group].is_object() && json[group].contains(key);
        return there ? json[group][key] : nlohmann::json();
    };
    if (const nlohmann::json error = find("settings", "error"); error.is_string()) result.target = error.get<std::string>();
    if (const nlohmann::json metres = find("target", "p99_metres"); metres.is_number()) result.target_p99 = metres.get<double>();
}

void sum_up(Verification& result) {
    DistanceHistogram all;
    double area = 0, mean = 0, degrees = 0;
    for (size_t i = 0; i < result.frames.size(); ++i) {
        const SurfaceDistance& d = result.frames[i].distance;
        double frame_area = 0;
        for (double a : d.histogram.area) frame_area += a;
        all.add(d.histogram);
        area += frame_area;
        if (frame_area > 0) mean += frame_area * d.mean, degrees += frame_area * d.normal_degrees;
        result.max = std::max(result.max, d.max);
        if (d.p99 > result.frames[result.worst].distance.p99) result.worst = i;
    }
    if (area > 0) result.mean = mean / area, result.normal_degrees = degrees / area;
    result.p99 = all.quantile(0.99);
}

}  // namespace

double FrameMeasure::volume_ratio() const {
    if (source.volume == 0) return decoded.volume == 0 ? 1 : std::numeric_limits<double>::infinity();
    return decoded.volume / source.volume;
}

std::unique_ptr<SequenceReader> open_source_of(const std::string& asset, const std::string& input, ReadOptions read) {
    const AssetDirectory directory = read_directory(asset);
    if (read.step == 0) {
        read.first = directory.frame_number(0);
        read.last = directory.frame_number(directory.header.frame_count - 1);
    }
    read.step = std::max(read.step, directory.header.frame_step);
    return open_sequence(input, read);
}

Verification verify(const std::string& asset, const SequenceReader& source, int jobs,
                    const std::function<void(uint32_t, uint32_t)>& progress) {
    const AssetDirectory directory = read_directory(asset);
    const std::vector<int>& numbers = source.info().numbers;
    const int first = directory.frame_number(0), last = directory.frame_number(directory.header.frame_count - 1);
    for (int number : numbers)
        if (number < first || number > last || (number - first) % directory.header.frame_step != 0)
            throw InputError(asset + ": has no frame " + std::to_string(number) + ": it holds " + std::to_string(first) + " to " +
                             std::to_string(last) + " by " + std::to_string(directory.header.frame_step));
    Verification result;
    result.asset = asset, result.input = source.info().path;
    result.diagonal = directory.diagonal();
    result.edge = directory.header.cell_size;
    result.bytes_per_frame = double(directory.header.file_bytes) / directory.header.frame_count;
    read_target(result, directory.settings_json);
    result.frames.resize(numbers.size());
    // One player and one run of neighbouring frames per thread: each window is decoded about once.
    size_t threads = jobs > 0 ? size_t(jobs) : std::max(1u, std::thread::hardware_concurrency());
    threads = std::min(threads, numbers.size());
    std::mutex mutex;
    uint32_t done = 0;
    parallel_for(threads, int(threads), [&](size_t part) {
        AssetPlayer player(asset);
        for (size_t i = numbers.size() * part / threads; i < numbers.size() * (part + 1) / threads; ++i) {
            const double seconds = player.frame_seconds(uint32_t((numbers[i] - first) / directory.header.frame_step));
            FrameMeasure& frame = result.frames[i] = measure(source.read_surface(i), player.mesh(seconds));
            frame.number = numbers[i], frame.seconds = seconds;
            const std::lock_guard lock(mutex);
            if (progress) progress(++done, uint32_t(numbers.size()));
        }
    });
    sum_up(result);
    return result;
}

VerifySummary verify_asset(const std::string& asset, const SequenceReader& source, int jobs,
                           const std::function<void(uint32_t)>& progress) {
    const Verification result = verify(asset, source, jobs, [&](uint32_t done, uint32_t) { progress(done); });
    VerifySummary summary{result.p99, to_json(result)};
    summary.json.erase("frames");
    return summary;
}

nlohmann::json to_json(const Verification& v) {
    using nlohmann::json;
    auto topology_json = [](const Topology& t) {
        return json{{"components", t.components}, {"non_manifold_edges", t.non_manifold_edges}, {"open_edges", t.open_edges},
                    {"volume_m3", t.volume}};
    };
    auto direction = [](const DirectedDistance& d) {
        return json{{"max_m", d.max}, {"mean_m", d.mean}, {"normal_degrees", d.normal_degrees}, {"p99_m", d.p99}};
    };
    json frames = json::array();
    uint64_t open = 0, non_manifold = 0;
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (const FrameMeasure& f : v.frames) {
        frames.push_back({{"frame", f.number},
                          {"seconds", f.seconds},
                          {"mean_m", f.distance.mean},
                          {"p99_m", f.distance.p99},
                          {"max_m", f.distance.max},
                          {"normal_degrees", f.distance.normal_degrees},
                          {"source_to_decoded", direction(f.distance.forward)},
                          {"decoded_to_source", direction(f.distance.backward)},
                          {"median_edge_m", f.edge},
                          {"volume_ratio", f.volume_ratio()},
                          {"source_triangles", f.source_triangles},
                          {"decoded_triangles", f.decoded_triangles},
                          {"source", topology_json(f.source)},
                          {"decoded", topology_json(f.decoded)}});
        open += f.decoded.open_edges, non_manifold += f.decoded.non_manifold_edges;
        least = std::min(least, f.volume_ratio()), most = std::max(most, f.volume_ratio());
    }
    json target = nullptr;
    if (v.target_p99 > 0) target = {{"error", v.target}, {"p99_m", v.target_p99}, {"met", v.target_met()}};
    const double percent = v.diagonal > 0 ? 100 / v.diagonal : 0;
    return {{"report", "rill verify"},
            {"version", 1},
            {"asset", v.asset},
            {"input", v.input},
            {"diagonal_m", v.diagonal},
            {"median_edge_m", v.edge},
            {"bytes_per_frame", v.bytes_per_frame},
            {"target", target},
            {"summary",
             {{"frames", v.frames.size()},
              {"mean_m", v.mean},
              {"p99_m", v.p99},
              {"max_m", v.max},
              {"mean_percent", v.mean * percent},
              {"p99_percent", v.p99 * percent},
              {"max_percent", v.max * percent},
              {"normal_degrees", v.normal_degrees},
              {"open_edges", open},
              {"non_manifold_edges", non_manifold},
              {"volume_ratio_min", least},
              {"volume_ratio_max", most},
              {"worst_frame", v.frames.empty() ? 0 : v.frames[v.worst].number}}},
            {"frames", frames}};
}

}  // namespace rill::cooker
