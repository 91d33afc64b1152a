// SPDX-License-Identifier: MIT
#include "cook.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>

#include "error_target.h"
#include "frames_to_tracks.h"
#include "input_hash.h"
#include "output_file.h"
#include "parallel.h"
#include "parts_to_asset.h"
#include "rate_search.h"
#include "survey.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

constexpr uint32_t most_tracks_per_block = 1500;
constexpr int most_attempts = 3;
constexpr uint32_t judged_frames = 24;  // per attempt and span, evenly spread
constexpr double first_tolerance = 1.15;     // of the error aimed at
constexpr double usual_tolerance = 0.3, coarsest_tolerance = 0.03;  // of a search for a rate: start, edges; limit, of the diagonal

WindowGoal goal_for(double tolerance, const Survey& facts, int jobs) {
    WindowGoal goal;
    const float t = float(tolerance);
    goal.tolerance = t;
    goal.quantiser = {0.3f * t, 3.f, 0.045f, 0.2f * t, 0.045f};
    goal.origin = facts.lower;
    goal.jobs = jobs;
    return goal;
}

void add(ChunkBits& sum, const ChunkBits& more) {
    sum.structure += more.structure, sum.births += more.births, sum.motion += more.motion;
    sum.normals += more.normals, sum.drops += more.drops;
}

/// Bounds of what the tracks of a chunk carry, over the window: points widened by the reach of their patches, drops by themselves.
void bound(ChunkToWrite& chunk, const std::vector<const TrackSamples*>& tracks, float reach) {
    chunk.lower = glm::vec3(1e30f), chunk.upper = glm::vec3(-1e30f);
    for (const TrackSamples* track : tracks)
        for (size_t k = 0; k < track->position.size(); ++k) {
            const glm::vec3& p = track->position[k];
            float wide = reach;
            if (track->drop) {
                const auto& s = track->shape[k];
                wide = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
            }
            chunk.lower = glm::min(chunk.lower, p - wide), chunk.upper = glm::max(chunk.upper, p + wide);
        }
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

/// Tracks that end here, by how long they lived and why.
void count_lives(SpanResult& account, const Window& window, bool ends_span) {
    account.deaths.resize(std::size(death_names));
    for (const Path& path : window.paths) {
        if (path.cause == Death::none && !ends_span) continue;
        const size_t life = size_t(path.age + path.death - path.birth + 1);
        if (account.lives.size() <= life) account.lives.resize(life + 1);
        ++account.lives[life], ++account.deaths[size_t(path.cause)];
    }
}

void write_window(AssetWriter& writer, uint32_t first_sample, const Window& window, const CodedWindow& coded, const WindowGoal& goal,
                  uint32_t layers, bool ends_span, SpanResult& account) {
    std::vector<float> cost;
    for (const QuantisedTrack& track : coded.tracks) cost.push_back(rough_bits(track));
    const std::vector<uint32_t> layer = assign_layers(coded.decoded, cost, window.samples(), layers, goal.jobs);
    uint32_t block_count = 0;
    const std::vector<uint32_t> block = assign_blocks(coded.decoded, most_tracks_per_block, block_count);
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
    count_lives(account, window, ends_span);
    writer.add_window(first_sample, uint32_t(window.samples()), block_count, std::move(chunks));
}

/// Some frames of a sequence.
class ChosenFrames : public SequenceReader {
public:
    ChosenFrames(const SequenceReader& source, std::vector<size_t> chosen) : source_(source), info_(source.info()), chosen_(std::move(chosen)) {
        info_.numbers.clear(), info_.seconds.clear();
        for (size_t i : chosen_) info_.numbers.push_back(source.info().numbers[i]), info_.seconds.push_back(source.info().seconds[i]);
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return source_.name(chosen_.at(index)); }
    std::vector<fs::path> files(size_t index) const override { return source_.files(chosen_.at(index)); }
    Mesh read(size_t index) const override { return source_.read(chosen_.at(index)); }
    Mesh read_surface(size_t index) const override { return source_.read_surface(chosen_.at(index)); }

private:
    const SequenceReader& source_;
    SequenceInfo info_;
    std::vector<size_t> chosen_;
};

/// Gone when the work fails or ends.
struct TemporaryFile {
    std::string path;
    ~TemporaryFile() {
        std::error_code ignored;
        fs::remove(path, ignored);
    }
};

void move_file(const std::string& from, const std::string& to) {
    std::error_code failed;
    fs::rename(from, to, failed);
    if (failed) throw InputError(to + ": cannot be written: " + failed.message());
}

/// Cooks spans, each into a part of its own.
class SpanCook {
public:
    SpanCook(const SequenceReader& reader, const CookSettings& settings, const Survey& survey, const SpanPlan& plan, const CookFacts& facts, const Aim& aim)
        : reader_(reader), settings_(settings), survey_(survey), plan_(plan), facts_(facts), aim_(aim) {
        tables_memory_.resize(format::basis_tables_bytes(uint32_t(settings.window) + 1) / sizeof(double) + 2);
        format::build_basis_tables(tables_, tables_memory_.data(), uint32_t(settings.window) + 1);
    }

    /// Closed loop: the tolerance follows what came of it. `done`: frames of the first attempt.
    void run(uint32_t span, const std::string& output, const std::function<void(uint32_t)>& done) const {
        const TemporaryFile candidate{output + ".cooking"}, best{output + ".best"};
        const SpanResult kept = aim_.bytes > 0 ? within_rate(span, candidate.path, best.path, done) : at_error(span, candidate.path, best.path, done);
        AssetWriter writer(output);
        writer.append(read_directory(best.path), 0);
        write(writer, kept);
    }

private:
    /// Decoded by the runtime and measured after every attempt.
    SpanResult at_error(uint32_t span, const std::string& candidate, const std::string& best, const std::function<void(uint32_t)>& done) const {
        const ChosenFrames judged(reader_, judged_frames_of(span));
        SpanResult kept;
        double tolerance = first_tolerance * aim_.p99, best_miss = HUGE_VAL;
        for (int attempt = 1;; ++attempt) {
            SpanResult result = cook(span, candidate, tolerance, [&](uint32_t frames) { if (attempt == 1) done(frames); });
            result.measured = verify(candidate, judged, settings_.jobs).totals;
            const double ratio = result.measured.p99() / aim_.p99, miss = result.measured.area == 0 ? 0 : std::abs(std::log(ratio));
            if (attempt == 1 || miss < best_miss) best_miss = miss, kept = std::move(result), move_file(candidate, best);
            kept.attempts = attempt;
            if (best_miss <= std::log(1 + met_within) || attempt == most_attempts) return kept;
            tolerance *= std::clamp(std::pow(1 / ratio, 0.9), 0.3, 2.0);
        }
    }
    /// Every span may have the bytes of its time: what bytes there are tells at once, so only the last is measured.
    SpanResult within_rate(uint32_t span, const std::string& candidate, const std::string& best, const std::function<void(uint32_t)>& done) const {
        const std::vector<double>& seconds = reader_.info().seconds;
        const double all = seconds.back() - seconds.front(), own = seconds[plan_.last(span)] - seconds[plan_.first(span)];
        const double allowed = aim_.bytes * (all > 0 ? own / all : 1);
        RateSearch search(usual_tolerance * survey_.edge, finest_tolerance * survey_.edge, coarsest_tolerance * survey_.diagonal());
        SpanResult kept;
        int attempts = 0;
        while (const std::optional<double> tolerance = search.next()) {
            SpanResult result = cook(span, candidate, *tolerance, [&](uint32_t frames) { if (attempts == 0) done(frames); });
            if (search.add(*tolerance, bytes_in_asset(facts_, read_directory(candidate), result) / allowed))
                kept = std::move(result), move_file(candidate, best);
            kept.attempts = ++attempts;
        }
        kept.measured = verify(best, ChosenFrames(reader_, judged_frames_of(span)), settings_.jobs).totals;
        return kept;
    }

    /// Evenly spread, as many of every span, so that spans weigh what they are; the border frame is the next span's.
    std::vector<size_t> judged_frames_of(uint32_t span) const {
        const uint32_t nominal = std::min(plan_.length(), plan_.frames), stride = (nominal + judged_frames - 1) / judged_frames;
        const uint32_t end = plan_.last(span) + (span + 1 == plan_.spans() ? 1 : 0);
        std::vector<size_t> chosen;
        for (uint32_t i = plan_.first(span); i < end; i += stride) chosen.push_back(i);
        return chosen;
    }

    SpanResult cook(uint32_t span, const std::string& output, double tolerance, const std::function<void(uint32_t)>& done) const {
        const WindowGoal goal = goal_for(tolerance, survey_, settings_.jobs);
        AssetWriter writer(output);
        const SequenceInfo& info = reader_.info();
        const uint32_t begin = plan_.first(span), end = plan_.last(span);
        SpanResult result;
        result.span = span, result.tolerance = tolerance;
        result.numbers.assign(info.numbers.begin() + begin, info.numbers.begin() + end + 1);
        result.seconds.assign(info.seconds.begin() + begin, info.seconds.begin() + end + 1);
        std::vector<Path> survivors;
        std::shared_ptr<const SurfaceFrame> border;
        for (uint32_t first = begin;; first += plan_.window) {
            Window window = load(first, std::min(end, first + plan_.window), border, float(tolerance));
            window.opens_span = first == begin;
            const uint32_t last = first + uint32_t(window.samples()) - 1;
            grow_tracks(window, survivors, goal);
            const CodedWindow coded = code_tracks(window, goal, tables_);
            write_window(writer, first - begin, window, coded, goal, uint32_t(settings_.layers), last == end, result);
            survivors = survivors_of(window);
            border = window.frames.back();
            done(last - begin);
            if (last == end) break;
        }
        write(writer, result);
        return result;
    }

    void write(AssetWriter& writer, const SpanResult& result) const {
        AssetFacts facts = asset_facts(facts_, result.numbers, result.seconds);
        facts.settings_json = part_settings(facts_, {result}, result.numbers);
        writer.finish(facts);
    }

    Window load(uint32_t first, uint32_t last, const std::shared_ptr<const SurfaceFrame>& border, float tolerance) const {
        Window window;
        window.first = int(first);
        window.frames.resize(last - first + 1);
        for (uint32_t i = first; i <= last; ++i) window.seconds.push_back(reader_.info().seconds[i]);
        parallel_for(window.frames.size(), settings_.jobs, [&](size_t s) {
            if (s == 0 && border) {
                window.frames[s] = border;
                return;
            }
            Mesh mesh = reader_.read(first + s);
            std::vector<Drop> drops = take_drops(mesh, survey_.edge, tolerance);
            window.frames[s] = std::make_shared<SurfaceFrame>(std::move(mesh), survey_.edge, std::move(drops));
        });
        return window;
    }

    const SequenceReader& reader_;
    const CookSettings& settings_;
    const Survey& survey_;
    const SpanPlan& plan_;
    const CookFacts& facts_;
    Aim aim_;
    format::BasisTables tables_{};
    std::vector<double> tables_memory_;
};

void check(const CookSettings& settings) {
    if (settings.window < 1 || settings.window + 1 > int(format::max_window_samples))
        throw UsageError("--window must be 1 to " + std::to_string(format::max_window_samples - 1) + " frames");
    if (settings.layers < 1 || settings.layers > int(format::max_layers))
        throw UsageError("layers must be 1 to " + std::to_string(format::max_layers));
    if (settings.segments > 0 && settings.segment >= settings.segments) throw UsageError("--segment I/N needs I from 1 to N");
    aim_of(settings.error, settings.bitrate, 1, 1, 1);
}

/// What decides every byte of the asset, but for the input's content.
nlohmann::json decisive_settings(const CookSettings& settings) {
    nlohmann::json all = {{"window", settings.window}, {"layers", settings.layers}, {"read", read_settings(settings.read)}};
    if (settings.bitrate > 0) all["bitrate"] = settings.bitrate;
    else all["error"] = settings.error;
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
        plan = {uint32_t(reader->info().numbers.size()), uint32_t(settings.window)};
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

/// The folder of finished spans: gone when the cook is done, kept if there is anything in it when not.
class WorkFolder {
public:
    WorkFolder(const std::string& output, std::string path, const std::function<void(const std::string&)>& warn)
        : path_(std::move(path)), warn_(warn) {
        std::error_code error;
        fs::create_directory(path_, error);
        if (error) throw InputError(output + ": cannot be written: " + error.message());
    }
    ~WorkFolder() {
        std::error_code ignored;
        fs::remove(path_, ignored);  // if it is empty
        if (warn_ && fs::exists(path_, ignored)) warn_(path_ + ": keeps the finished spans; the same cook goes on from them");
    }
    /// Also what earlier cooks of this output have left, of other input or settings.
    void remove_all(const std::string& output) const {
        std::error_code ignored;
        const fs::path target = fs::absolute(output, ignored);
        const std::string prefix = target.filename().string() + ".cook-";
        std::vector<fs::path> old;
        for (fs::directory_iterator at(target.parent_path(), ignored), end; !ignored && at != end; at.increment(ignored)) {
            const std::string name = at->path().filename().string();
            if (name.size() == prefix.size() + 16 && name.compare(0, prefix.size(), prefix) == 0 &&
                name.find_first_not_of("0123456789abcdef", prefix.size()) == std::string::npos)
                old.push_back(at->path());
        }
        for (const fs::path& path : old) fs::remove_all(path, ignored);
    }

private:
    std::string path_;
    const std::function<void(const std::string&)>& warn_;
};

/// n frames last n times their mean distance, in seconds.
double duration(const SequenceInfo& info) {
    const double n = double(info.seconds.size()), between = info.seconds.back() - info.seconds.front();
    return n > 1 && between > 0 ? between * n / (n - 1) : n / info.frames_per_second;
}

/// What every part and the asset say of the cook.
nlohmann::json cook_json(const Job& job, const CookSettings& settings, const Survey& survey, const Aim& aim) {
    const SequenceInfo& info = job.reader->info();
    const double frames = double(info.numbers.size());
    nlohmann::json target = {{"p99_metres", aim.p99}};
    if (aim.bytes > 0) target = {{"kilobits_per_second", settings.bitrate}, {"file_bytes", aim.bytes}};
    return {{"generator", "rill cook"},
            {"tool", RILL_VERSION},
            {"key", job.key},
            {"span_count", job.plan.spans()},
            {"settings", decisive_settings(settings)},
            {"target", target},
            {"source",
             {{"format", info.format}, {"frames", info.numbers.size()}, {"first_frame", info.numbers.front()},
              {"frames_per_second", info.frames_per_second}, {"raw_bytes", info.raw_bytes},
              {"triangles_per_frame", survey.triangles / frames}, {"vertices_per_frame", survey.vertices / frames},
              {"median_edge_metres", survey.edge}}}};
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
    if (fs::is_directory(output)) throw InputError(output + ": cannot be written: is a directory");
    if (job.share.first == job.share.end) {  // fewer spans than segments
        write_file(output, "");
        report.target_met = true;
        return report;
    }
    const WorkFolder folder(output, job.folder, settings.read.warn);
    const uint32_t frames = job.plan.frames;
    const Survey survey = survey_input(*job.reader, settings.read, settings.survey, job.input_hash, settings.jobs,
                                       [&](uint32_t done) { progress({done, frames, "surveying"}); });
    const Aim aim = aim_of(settings.error, settings.bitrate, survey.edge, survey.diagonal(), duration(job.reader->info()));
    const CookFacts facts = {cook_json(job, settings, survey, aim), job.reader->info().frames_per_second, uint32_t(settings.layers),
                             survey.edge, survey.lower, survey.upper};
    const auto reader = apply_fit(std::move(job.reader), survey.fit);
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
    folder.remove_all(output);
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
