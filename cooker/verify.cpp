// SPDX-License-Identifier: MIT
#include "verify.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "asset_directory.h"
#include "asset_player.h"
#include "parallel.h"

namespace rill::cooker {
namespace {

FrameMeasure measure(const Mesh& source, const Mesh& decoded) {
    FrameMeasure frame;
    frame.source_triangles = uint32_t(source.triangles.size()), frame.source_vertices = uint32_t(source.positions.size());
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
    for (size_t i = 0; i < result.frames.size(); ++i) {
        result.totals.add(result.frames[i]);
        if (result.frames[i].distance.p99 > result.frames[result.worst].distance.p99) result.worst = i;
    }
    result.mean = result.totals.mean(), result.p99 = result.totals.p99(), result.max = result.totals.max;
    result.normal_degrees = result.totals.normal_degrees();
}

/// JSON knows no infinity.
nlohmann::json number(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }
double number(const nlohmann::json& json) { return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>(); }

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
    const nlohmann::json stored = nlohmann::json::parse(directory.settings_json, nullptr, false);
    const auto setting = [&](const char* name) {
        const nlohmann::json::json_pointer place(std::string("/settings/read/") + name);
        return stored.is_object() && stored.contains(place) ? stored.at(place) : nlohmann::json();
    };
    if (read.up == 0) read.up = setting("up") == "y" ? 'y' : 'z';
    if (read.handedness == 0) read.handedness = setting("handedness") == "left" ? 'l' : 'r';
    if (const nlohmann::json scale = setting("scale"); read.scale == 0 && scale.is_number()) read.scale = scale;
    if (const nlohmann::json fps = setting("fps"); read.frames_per_second == 0 && fps.is_number()) read.frames_per_second = fps;
    return open_sequence(input, read);
}

Verification verify(const std::string& asset, const SequenceReader& source, int jobs,
                    const std::function<void(uint32_t, uint32_t)>& progress) {
    const AssetDirectory directory = read_directory(asset);
    const std::vector<int>& numbers = source.info().numbers;
    std::vector<uint32_t> index;
    for (int number : numbers) index.push_back(directory.index_of(number));
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
            const double seconds = player.frame_seconds(index[i]);
            FrameMeasure& frame = result.frames[i] = measure(source.read_surface(i), player.mesh(seconds));
            frame.number = numbers[i], frame.seconds = seconds;
            const std::lock_guard lock(mutex);
            if (progress) progress(++done, uint32_t(numbers.size()));
        }
    });
    sum_up(result);
    return result;
}

void ErrorTotals::add(const FrameMeasure& frame) {
    ErrorTotals one;
    const SurfaceDistance& d = frame.distance;
    for (double a : d.histogram.area) one.area += a;
    if (one.area > 0) one.distance_area = one.area * d.mean, one.degrees_area = one.area * d.normal_degrees;
    one.frames = 1, one.max = d.max, one.histogram = d.histogram;
    one.open_edges = frame.decoded.open_edges, one.non_manifold_edges = frame.decoded.non_manifold_edges;
    one.volume_ratio_min = one.volume_ratio_max = frame.volume_ratio();
    one.worst_frame = frame.number, one.worst_p99 = d.p99;
    add(one);
}

void ErrorTotals::add(const ErrorTotals& other) {
    frames += other.frames, area += other.area, distance_area += other.distance_area, degrees_area += other.degrees_area;
    max = std::max(max, other.max), histogram.add(other.histogram);
    open_edges += other.open_edges, non_manifold_edges += other.non_manifold_edges;
    volume_ratio_min = std::min(volume_ratio_min, other.volume_ratio_min);
    volume_ratio_max = std::max(volume_ratio_max, other.volume_ratio_max);
    if (other.worst_p99 > worst_p99) worst_p99 = other.worst_p99, worst_frame = other.worst_frame;
}

nlohmann::json to_json(const ErrorTotals& t) {
    nlohmann::json bins = nlohmann::json::array();
    for (double area : t.histogram.area) bins.push_back(number(area));
    return {{"frames", t.frames}, {"area", number(t.area)}, {"distance_area", number(t.distance_area)},
            {"degrees_area", number(t.degrees_area)}, {"max", number(t.max)}, {"histogram", bins}, {"open_edges", t.open_edges},
            {"non_manifold_edges", t.non_manifold_edges}, {"volume_ratio_min", number(t.volume_ratio_min)},
            {"volume_ratio_max", number(t.volume_ratio_max)}, {"worst_frame", t.worst_frame}, {"worst_p99", number(t.worst_p99)}};
}

ErrorTotals totals_from_json(const nlohmann::json& json) {
    ErrorTotals t;
    t.frames = json.at("frames"), t.area = number(json.at("area")), t.distance_area = number(json.at("distance_area"));
    t.degrees_area = number(json.at("degrees_area")), t.max = number(json.at("max"));
    for (const nlohmann::json& area : json.at("histogram")) t.histogram.area.push_back(number(area));
    t.open_edges = json.at("open_edges"), t.non_manifold_edges = json.at("non_manifold_edges");
    t.volume_ratio_min = number(json.at("volume_ratio_min")), t.volume_ratio_max = number(json.at("volume_ratio_max"));
    t.worst_frame = json.at("worst_frame"), t.worst_p99 = number(json.at("worst_p99"));
    return t;
}

nlohmann::json summary_json(const ErrorTotals& t, double diagonal) {
    const double percent = diagonal > 0 ? 100 / diagonal : 0;
    return {{"frames", t.frames},
            {"mean_m", t.mean()},
            {"p99_m", t.p99()},
            {"max_m", t.max},
            {"mean_percent", t.mean() * percent},
            {"p99_percent", t.p99() * percent},
            {"max_percent", t.max * percent},
            {"normal_degrees", t.normal_degrees()},
            {"open_edges", t.open_edges},
            {"non_manifold_edges", t.non_manifold_edges},
            {"volume_ratio_min", t.volume_ratio_min},
            {"volume_ratio_max", t.volume_ratio_max},
            {"worst_frame", t.worst_frame}};
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
    }
    json target = nullptr;
    if (v.target_p99 > 0) target = {{"error", v.target}, {"p99_m", v.target_p99}, {"met", v.target_met()}};
    return {{"report", "rill verify"},
            {"version", 1},
            {"asset", v.asset},
            {"input", v.input},
            {"diagonal_m", v.diagonal},
            {"median_edge_m", v.edge},
            {"bytes_per_frame", v.bytes_per_frame},
            {"target", target},
            {"summary", summary_json(v.totals, v.diagonal)},
            {"frames", frames}};
}

}  // namespace rill::cooker
