// SPDX-License-Identifier: MIT
#include "verify/verify.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "asset/asset_directory.h"
#include "asset/asset_player.h"
#include "common/parallel.h"
#include "frames/check_velocity.h"
#include "frames/cut_to_closed.h"
#include "frames/open_sequence.h"

namespace rill::cooker {
namespace {

FrameMeasure measure(const Mesh& source, const Mesh& decoded, double cell) {
    FrameMeasure frame;
    frame.source_triangles = uint32_t(source.triangles.size()), frame.source_vertices = uint32_t(source.positions.size());
    frame.decoded_triangles = uint32_t(decoded.triangles.size());
    frame.edge = median_edge(source);
    frame.source = topology(source, cell), frame.decoded = topology(decoded, cell);
    return frame;
}

/// Where the source's velocities stand, and what makes them metres per second.
struct SourceVelocity {
    bool known = false;
    double factor = 1;
};
SourceVelocity velocity_of(const SequenceReader& source) {
    if (source.info().velocity == VelocityMeaning::none) return {};
    return {true, check_velocity(source, [](const std::string&) {}).factor};
}

double area_of(const Mesh& mesh) {
    double area = 0;
    for (float a : vertex_areas(mesh)) area += a;
    return area;
}

/// A third of the samples, unless there are so few that a third is no fair share of them. The same for all frames, for they are weighted by what is
/// measured of them.
size_t stride_of_glance(const SequenceReader& source) {
    constexpr size_t few_triangles = 2000;
    const size_t count = source.info().numbers.size();
    for (const size_t frame : {size_t(0), count / 2, count - 1})
        if (source.read_surface(frame).triangles.size() >= few_triangles) return 3;
    return 1;
}

FrameMeasure measure_plainly(const Mesh& source, AssetPlayer& player, double seconds, double cell, size_t stride) {
    const Mesh decoded = player.mesh(seconds);
    FrameMeasure frame = measure(source, decoded, cell);
    frame.distance = surface_distance(source, SurfaceIndex(source), decoded, SurfaceIndex(decoded), false, stride);
    return frame;
}

FrameMeasure measure_closely(const Mesh& source, const SourceVelocity& velocity, AssetPlayer& player, double seconds, double cell) {
    Stats stats;
    const Mesh decoded = player.mesh(seconds, 0, 0, &stats);
    FrameMeasure frame = measure(source, decoded, cell);
    const SurfaceIndex source_index(source), decoded_index(decoded);
    frame.distance = surface_distance(source, source_index, decoded, decoded_index, true);
    frame.points = stats.points_used;
    if (stats.points_used > 0) frame.spacing = std::sqrt(area_of(decoded) / stats.points_used);
    frame.thin = thin_error(source, source_index, frame.distance.per_source_vertex, float(frame.spacing));
    if (velocity.known) frame.velocity = velocity_error(source, velocity.factor, decoded, decoded_index);
    frame.distance.per_source_vertex = {}, frame.distance.per_decoded_vertex = {};
    for (size_t i = 0; i < frame.coarse.size(); ++i) {
        const Topology shape = topology(player.mesh(seconds, float(cell) * float(coarser[i])));
        frame.coarse[i] = {coarser[i], shape.open_edges, shape.non_manifold_edges, shape.components};
    }
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

/// Takes in the next frame.
void take(Verification& result, size_t index, FrameMeasure&& frame) {
    result.totals.add(frame);
    result.velocity.add(frame.velocity), result.thin.add(frame.thin);
    for (size_t i = 0; i < frame.coarse.size(); ++i) {
        CoarseMeasure& all = result.coarse[i];
        all.times = coarser[i];
        all.open_edges += frame.coarse[i].open_edges, all.non_manifold_edges += frame.coarse[i].non_manifold_edges;
        all.components += frame.coarse[i].components;
    }
    result.frames.push_back(std::move(frame));
    result.frames.back().forget_histograms();
    if (result.frames.back().distance.p99 > result.frames[result.worst].distance.p99) result.worst = index;
}

/// `stored`: the asset's settings.
std::unique_ptr<SequenceReader> closed_as_told(const nlohmann::json& stored, const std::string& asset, std::unique_ptr<SequenceReader> source) {
    const nlohmann::json::json_pointer place("/source/cut");
    if (!stored.is_object() || !stored.contains(place)) return source;
    try {
        return cut_to_closed(std::move(source), cut_from_json(stored.at(place)));
    } catch (const nlohmann::json::exception&) {
        throw InputError(asset + ": its settings do not say where the source was cut off");
    }
}

bool is_between(double place) { return place != std::floor(place); }
double seconds_at(const AssetPlayer& player, double place) {
    const uint32_t before = uint32_t(place);
    const double seconds = player.frame_seconds(before);
    return is_between(place) ? seconds + (place - before) * (player.frame_seconds(before + 1) - seconds) : seconds;
}

/// JSON knows no infinity.
nlohmann::json number(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }
double number(const nlohmann::json& json) { return json.is_null() ? std::numeric_limits<double>::infinity() : json.get<double>(); }

}  // namespace

double FrameMeasure::volume_ratio() const {
    if (source.volume == 0) return decoded.volume == 0 ? 1 : std::numeric_limits<double>::infinity();
    return decoded.volume / source.volume;
}

void FrameMeasure::forget_histograms() {
    distance.histogram = {};
    velocity.degrees.forget(), velocity.length.forget();
    for (Spread& spread : thin.below) spread.forget();
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
    if (const nlohmann::json name = setting("velocity"); read.velocity_name.empty() && name.is_string() && name != "estimate") {
        read.velocity_name = name;
        read.velocity_per_frame = setting("velocity_unit") == "frame";
    }
    return closed_as_told(stored, asset, open_sequence(input, read));
}

std::unique_ptr<SequenceReader> closed_as_in(const std::string& asset, std::unique_ptr<SequenceReader> source) {
    return closed_as_told(nlohmann::json::parse(read_directory(asset).settings_json, nullptr, false), asset, std::move(source));
}

Verification verify(const std::string& asset, const SequenceReader& source, int jobs,
                    const std::function<void(uint32_t, uint32_t)>& progress, Scrutiny scrutiny) {
    const AssetDirectory directory = read_directory(asset);
    const std::vector<int>& numbers = source.info().numbers;
    std::vector<double> places;
    for (int number : numbers) places.push_back(directory.place_of(number));
    Verification result;
    result.asset = asset, result.input = source.info().path;
    result.diagonal = directory.diagonal();
    result.edge = directory.header.cell_size;
    result.bytes_per_frame = double(directory.header.file_bytes) / directory.header.frame_count;
    const bool details = result.details = scrutiny == Scrutiny::close;
    const size_t stride = scrutiny == Scrutiny::glance ? stride_of_glance(source) : 1;
    if (std::none_of(places.begin(), places.end(), is_between)) read_target(result, directory.settings_json);
    const SourceVelocity velocity = details ? velocity_of(source) : SourceVelocity{};
    // A run of neighbouring frames per task, one player each: its windows are decoded about once.
    const size_t run = run_length(numbers.size(), jobs);
    std::mutex mutex;
    size_t next = 0;
    uint32_t done = 0;
    InOrder<FrameMeasure> frames([&](FrameMeasure&& frame) { take(result, next++, std::move(frame)); });
    parallel_for((numbers.size() + run - 1) / run, jobs, [&](size_t part) {
        AssetPlayer player(asset);
        for (size_t i = part * run; i < std::min((part + 1) * run, numbers.size()); ++i) {
            const double seconds = seconds_at(player, places[i]);
            FrameMeasure frame = details ? measure_closely(velocity.known ? source.read(i) : source.read_surface(i), velocity, player, seconds, result.edge)
                                         : measure_plainly(source.read_surface(i), player, seconds, result.edge, stride);
            frame.number = numbers[i], frame.seconds = seconds, frame.between = is_between(places[i]);
            const std::lock_guard lock(mutex);
            frames.put(i, std::move(frame));
            if (progress) progress(++done, uint32_t(numbers.size()));
        }
    });
    result.mean = result.totals.mean(), result.p99 = result.totals.p99(), result.max = result.totals.max;
    result.normal_degrees = result.totals.normal_degrees();
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

}  // namespace rill::cooker
