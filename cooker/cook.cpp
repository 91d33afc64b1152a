// SPDX-License-Identifier: MIT
#include "cook.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "check_velocity.h"
#include "chunks_to_asset.h"
#include "error_target.h"
#include "frames_to_tracks.h"
#include "parallel.h"
#include "verify.h"

namespace rill::cooker {
namespace {

constexpr uint32_t most_tracks_per_block = 1500;
constexpr int most_attempts = 3;
constexpr size_t judged_frames = 24;  // per attempt, evenly spread
constexpr double met_within = 0.1;  // of the target
constexpr double first_tolerance = 1.15;

/// What must be known of the whole sequence before its first window is cooked.
struct Survey {
    glm::vec3 lower{0}, upper{0};
    float edge = 0;
    double triangles = 0, vertices = 0;
    double diagonal() const { return glm::distance(lower, upper); }
};

Survey survey(const SequenceReader& reader, int jobs, const std::function<void(uint32_t)>& done) {
    struct Facts {
        glm::vec3 lower{1e30f}, upper{-1e30f};
        float edge = 0;
        size_t triangles = 0, vertices = 0;
    };
    std::vector<Facts> facts(reader.info().numbers.size());
    std::atomic<uint32_t> count{0};
    parallel_for(facts.size(), jobs, [&](size_t i) {
        const Mesh mesh = reader.read_surface(i);
        Facts& f = facts[i];
        for (const Triangle& t : mesh.triangles)
            for (uint32_t v : t) f.lower = glm::min(f.lower, mesh.positions[v]), f.upper = glm::max(f.upper, mesh.positions[v]);
        f.edge = median_edge(mesh), f.triangles = mesh.triangles.size(), f.vertices = mesh.positions.size();
        done(++count);
    });
    Survey result;
    std::vector<float> edges;
    glm::vec3 lower(1e30f), upper(-1e30f);
    for (const Facts& f : facts) {
        if (f.triangles == 0) continue;
        lower = glm::min(lower, f.lower), upper = glm::max(upper, f.upper);
        edges.push_back(f.edge);
        result.triangles += double(f.triangles), result.vertices += double(f.vertices);
    }
    if (edges.empty()) {
        result.edge = 1;  // nothing to show, and nothing to measure
        return result;
    }
    std::nth_element(edges.begin(), edges.begin() + long(edges.size() / 2), edges.end());
    result.edge = edges[edges.size() / 2], result.lower = lower, result.upper = upper;
    return result;
}

WindowGoal goal_for(double tolerance, const Survey& facts, int jobs) {
    WindowGoal goal;
    const float t = float(tolerance);
    goal.tolerance = t;
    goal.quantiser = {0.3f * t, 3.f, 0.03f, 0.2f * t, 0.03f};
    goal.origin = facts.lower;
    goal.jobs = jobs;
    return goal;
}

struct Account {
    ChunkBits bits;
    uint64_t tracks = 0, point_frames = 0;
    std::vector<double> layer_bytes;
};

void add(ChunkBits& sum, const ChunkBits& more) {
    sum.structure += more.structure, sum.births += more.births, sum.motion += more.motion;
    sum.normals += more.normals, sum.drops += more.drops;
}

/// Bounds of what the tracks of a chunk carry, over the window: points widened by the reach of their patches.
void bound(ChunkToWrite& chunk, const std::vector<const TrackSamples*>& tracks, float reach) {
    chunk.lower = glm::vec3(1e30f), chunk.upper = glm::vec3(-1e30f);
    for (const TrackSamples* track : tracks)
        for (const glm::vec3& p : track->position)
            chunk.lower = glm::min(chunk.lower, p - reach), chunk.upper = glm::max(chunk.upper, p + reach);
}

struct LayerError {
    float mean = 0, p99 = 0, spacing = 0;
};
/// Error of every prefix of layers, on a few frames of the window.
std::vector<LayerError> layer_errors(const Window& window, const CodedWindow& coded, const std::vector<uint32_t>& layer,
                                     uint32_t layers, int jobs) {
    constexpr int stride = 8;
    std::vector<LayerError> errors(layers);
    const size_t looks = (window.frames.size() + stride - 1) / stride;
    std::vector<std::vector<LayerError>> at(looks, std::vector<LayerError>(layers));
    parallel_for(looks * layers, jobs, [&](size_t task) {
        const int s = int(task / layers) * stride;
        const uint32_t l = uint32_t(task % layers);
        const SurfaceFrame& frame = *window.frames[size_t(s)];
        const auto points = decoded_points(coded.decoded, s, &layer, l);
        const Residual residual = measure_residual(frame, points);
        double area = 0, sum = 0;
        for (size_t v = 0; v < residual.distance.size(); ++v)
            area += frame.area[v], sum += frame.area[v] * std::min(std::fabs(residual.distance[v]), 10 * frame.edge);
        LayerError& error = at[task / layers][l];
        error.mean = area > 0 ? float(sum / area) : 0;
        error.p99 = float(std::min(residual_percentile(frame, residual, 0.99), 10.0 * frame.edge));
        error.spacing = points.empty() ? 0 : float(std::sqrt(area / double(points.size())));
    });
    for (const auto& look : at)
        for (uint32_t l = 0; l < layers; ++l) {
            errors[l].mean += look[l].mean / float(looks), errors[l].p99 += look[l].p99 / float(looks);
            errors[l].spacing = std::max(errors[l].spacing, look[l].spacing);
        }
    return errors;
}

void write_window(AssetWriter& writer, const Window& window, const CodedWindow& coded, const WindowGoal& goal,
                  uint32_t layers, Account& account) {
    const std::vector<uint32_t> layer = assign_layers(window, layers);
    uint32_t block_count = 0;
    const std::vector<uint32_t> block = assign_blocks(window, most_tracks_per_block, block_count);
    const std::vector<LayerError> errors = layer_errors(window, coded, layer, layers, goal.jobs);
    std::vector<ChunkToWrite> chunks(size_t(layers) * block_count);
    parallel_for(chunks.size(), goal.jobs, [&](size_t c) {
        ChunkToWrite& chunk = chunks[c];
        chunk.layer = uint32_t(c) / block_count, chunk.block = uint32_t(c) % block_count;
        std::vector<QuantisedTrack> tracks;
        std::vector<const TrackSamples*> decoded;
        for (size_t i = 0; i < layer.size(); ++i)
            if (layer[i] == chunk.layer && block[i] == chunk.block)
                tracks.push_back(coded.tracks[i]), decoded.push_back(&coded.decoded[i]);
        if (tracks.empty()) return;
        const LayerError& error = errors[chunk.layer];
        chunk.spacing = error.spacing, chunk.error_mean = error.mean, chunk.error_p99 = error.p99;
        bound(chunk, decoded, 1.5f * error.spacing);
        chunk.encoded = encode_chunk(tracks, goal.quantiser, goal.origin, uint32_t(window.samples()), {});
    });
    std::erase_if(chunks, [](const ChunkToWrite& chunk) { return chunk.encoded.bytes.empty(); });
    account.layer_bytes.resize(layers);
    for (const ChunkToWrite& chunk : chunks) {
        add(account.bits, chunk.encoded.bits);
        account.layer_bytes[chunk.layer] += double(chunk.encoded.bytes.size());
    }
    account.tracks += window.paths.size();
    for (const Path& path : window.paths) account.point_frames += uint64_t(path.death - path.birth + 1);
    writer.add_window(uint32_t(window.first), uint32_t(window.samples()), block_count, std::move(chunks));
}

nlohmann::json settings_json(const CookSettings& settings, const SequenceInfo& info, const Survey& facts, double target,
                             const Account& account) {
    const double frames = double(info.numbers.size());
    const auto bytes = [](double bits) { return std::round(bits / 8); };
    return {{"generator", "rill cook"},
            {"settings", {{"error", settings.error}, {"window", settings.window}, {"layers", settings.layers}}},
            {"target", {{"p99_metres", target}}},
            {"source",
             {{"format", info.format}, {"frames", info.numbers.size()}, {"first_frame", info.numbers.front()},
              {"frames_per_second", info.frames_per_second}, {"raw_bytes", info.raw_bytes},
              {"triangles_per_frame", facts.triangles / frames}, {"vertices_per_frame", facts.vertices / frames},
              {"median_edge_metres", facts.edge}}},
            {"bytes",
             {{"structure", bytes(account.bits.structure)}, {"births", bytes(account.bits.births)},
              {"motion", bytes(account.bits.motion)}, {"normals", bytes(account.bits.normals)},
              {"drops", bytes(account.bits.drops)}}},
            {"layer_bytes", account.layer_bytes},
            {"tracks", account.tracks},
            {"points_per_frame", double(account.point_frames) / std::max(1.0, frames)}};
}

class Cook {
public:
    Cook(const SequenceReader& reader, const CookSettings& settings, const Survey& facts, double target,
         const std::function<void(const CookProgress&)>& progress)
        : reader_(reader), settings_(settings), facts_(facts), target_(target), progress_(progress) {
        tables_memory_.resize(format::basis_tables_bytes(uint32_t(settings.window) + 1) / sizeof(double) + 2);
        format::build_basis_tables(tables_, tables_memory_.data(), uint32_t(settings.window) + 1);
    }

    nlohmann::json run(const std::string& output, double tolerance, const std::string& stage) {
        const WindowGoal goal = goal_for(tolerance, facts_, settings_.jobs);
        const uint32_t frames = uint32_t(reader_.info().numbers.size()), layers = uint32_t(settings_.layers);
        AssetWriter writer(output);
        Account account;
        std::vector<Path> survivors;
        std::shared_ptr<const SurfaceFrame> border;
        for (uint32_t first = 0;; first += uint32_t(settings_.window)) {
            Window window = load(first, std::min(frames - 1, first + uint32_t(settings_.window)), border);
            grow_tracks(window, survivors, goal);
            const CodedWindow coded = code_tracks(window, goal, tables_);
            write_window(writer, window, coded, goal, layers, account);
            survivors = survivors_of(window);
            border = window.frames.back();
            progress_({first + uint32_t(window.samples()), frames, stage});
            if (window.ends_clip) break;
        }
        const nlohmann::json json = settings_json(settings_, reader_.info(), facts_, target_, account);
        writer.finish(asset_facts(json));
        return json;
    }

private:
    Window load(uint32_t first, uint32_t last, const std::shared_ptr<const SurfaceFrame>& border) const {
        Window window;
        window.first = int(first), window.opens_clip = first == 0;
        window.ends_clip = last + 1 == reader_.info().numbers.size();
        window.frames.resize(last - first + 1);
        for (uint32_t i = first; i <= last; ++i) window.seconds.push_back(reader_.info().seconds[i]);
        parallel_for(window.frames.size(), settings_.jobs, [&](size_t s) {
            window.frames[s] = s == 0 && border ? border
                                                : std::make_shared<SurfaceFrame>(reader_.read(first + s), facts_.edge);
        });
        return window;
    }

    AssetFacts asset_facts(const nlohmann::json& json) const {
        const SequenceInfo& info = reader_.info();
        AssetFacts facts;
        facts.frame_count = uint32_t(info.numbers.size());
        facts.first_frame = info.numbers.front();
        facts.frame_step = info.numbers.size() > 1 ? info.numbers[1] - info.numbers[0] : 1;
        facts.layer_count = uint32_t(settings_.layers);
        facts.frames_per_second = info.frames_per_second, facts.first_seconds = info.seconds.front();
        facts.cell_size = facts_.edge, facts.lower = facts_.lower, facts.upper = facts_.upper;
        facts.settings_json = json.dump();
        const double step = info.seconds.size() > 1
                                ? (info.seconds.back() - info.seconds.front()) / double(info.seconds.size() - 1) : 0;
        const bool even = std::ranges::all_of(info.seconds, [&, i = 0](double s) mutable {
            return std::abs(s - info.seconds.front() - step * i++) < 1e-6 * std::max(1.0, step);
        });
        if (even && step > 0) facts.frames_per_second = 1 / step;
        if (!even) for (double s : info.seconds) facts.frame_seconds.push_back(s - info.seconds.front());
        return facts;
    }

    const SequenceReader& reader_;
    const CookSettings& settings_;
    const Survey& facts_;
    double target_;
    const std::function<void(const CookProgress&)>& progress_;
    format::BasisTables tables_{};
    std::vector<double> tables_memory_;
};

/// The frames an attempt is judged by.
std::unique_ptr<SequenceReader> spread_frames(const std::string& input, ReadOptions options, const SequenceInfo& info) {
    const int count = int(info.numbers.size()), own = count > 1 ? info.numbers[1] - info.numbers[0] : 1;
    const int stride = std::max(1, (count + int(judged_frames) - 1) / int(judged_frames));
    options.first = info.numbers.front(), options.last = info.numbers.back(), options.step = own * stride;
    options.last = options.first + (options.last - options.first) / options.step * options.step;
    return open_sequence(input, options);
}

/// The attempt under measurement; gone when the cook fails or ends.
struct PartialFile {
    std::string path;
    ~PartialFile() {
        std::error_code ignored;
        std::filesystem::remove(path, ignored);
    }
};

void move_file(const std::string& from, const std::string& to) {
    std::error_code failed;
    std::filesystem::rename(from, to, failed);
    if (failed) throw InputError(to + ": cannot be written: " + failed.message());
}

void check(const CookSettings& settings) {
    if (settings.window < 1 || settings.window + 1 > int(format::max_window_samples))
        throw UsageError("--window must be 1 to " + std::to_string(format::max_window_samples - 1) + " frames");
    if (settings.layers < 1 || settings.layers > int(format::max_layers))
        throw UsageError("layers must be 1 to " + std::to_string(format::max_layers));
}

}  // namespace

CookReport cook(const std::string& input, const std::string& output, const CookSettings& settings,
                const std::function<void(const CookProgress&)>& progress) {
    check(settings);
    ReadOptions options = settings.read;
    options.require_velocity = true;
    auto reader = open_sequence(input, options);
    const VelocityFit fit = check_velocity(*reader, options.warn);
    reader = apply_fit(std::move(reader), fit);
    const uint32_t frames = uint32_t(reader->info().numbers.size());
    const Survey facts = survey(*reader, settings.jobs, [&](uint32_t done) { progress({done, frames, "surveying"}); });
    CookReport report;
    report.target_p99 = error_target(settings.error, facts.edge, facts.diagonal());
    const auto judged = spread_frames(input, options, reader->info());
    const uint32_t looks = uint32_t(judged->info().numbers.size());
    // Closed loop: the finished file is decoded by the runtime and measured; the tolerance follows.
    const PartialFile candidate{output + ".cooking"}, best{output + ".best"};
    double tolerance = first_tolerance * report.target_p99, best_miss = HUGE_VAL;
    for (int attempt = 1;; ++attempt) {
        Cook cook(*reader, settings, facts, report.target_p99, progress);
        nlohmann::json json = cook.run(candidate.path, tolerance, attempt == 1 ? "cooking" : "cooking again");
        const VerifySummary measured = verify_asset(candidate.path, *judged, settings.jobs, [&](uint32_t done) {
            progress({done, looks, "measuring"});
        });
        json["measured"] = measured.json;
        const double ratio = measured.p99 / report.target_p99, miss = facts.triangles == 0 ? 0 : std::abs(std::log(ratio));
        if (miss < best_miss) {
            best_miss = miss, report.json = std::move(json), report.measured_p99 = measured.p99;
            report.target_met = facts.triangles == 0 || ratio <= 1 + met_within;
            move_file(candidate.path, best.path);
        }
        if (best_miss <= std::log(1 + met_within) || attempt == most_attempts) break;
        tolerance *= std::clamp(std::pow(1 / ratio, 0.9), 0.3, 2.0);
    }
    move_file(best.path, output);
    return report;
}

}  // namespace rill::cooker
