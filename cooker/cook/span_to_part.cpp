// SPDX-License-Identifier: MIT
#include "cook/span_to_part.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>

#include "common/parallel.h"
#include "cook/error_search.h"
#include "cook/error_target.h"
#include "cook/rate_search.h"
#include "cook/window_to_chunks.h"
#include "frames/split_edges.h"
#include "frames/surface_motion.h"
#include "frames/walls.h"
#include "tracks/frames_to_tracks.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

constexpr uint32_t judged_frames = 24;  // per attempt and span, evenly spread
constexpr double most_miss = 0.3;            // edges, of such liquid from the surface: velocities that carry nothing have more
constexpr double calm_tolerance = 1.1;       // of such liquid: at the same tolerance its error is a tenth below that of other liquid
                                             // (a third at 0.12e: drop_splash takes 6 % more bytes at equal p99)
constexpr double most_stretch = 0.1;         // of liquid that points go with: drop_splash has .05 to .08, dam_break .16 to .2
constexpr float longest_edge = 2.5f;         // times the median
constexpr float through_walls = 0.2f;        // tolerances: how far liquid is cooked to go on beyond them (walls.h)
// Radians. At fine errors smaller steps: normals .5 % nearer for .9 % more bytes at equal p99 (dam_break 40:51, 0.12e, .05), or none (pour_sphere).
constexpr float most_normal_step = 0.058f, coarse_normals = 0.3f, normals_follow = 0.2f;  // from this tolerance on, edges; power of it
constexpr double usual_tolerance = 0.3, coarsest_tolerance = 0.03;  // of a search for a rate: start, edges; limit, of the diagonal

WindowGoal goal_for(double tolerance, const Survey& facts, int jobs) {
    WindowGoal goal;
    const float t = float(tolerance);
    goal.tolerance = t;
    const float normal_step = most_normal_step * std::min(std::pow(t / (coarse_normals * facts.edge), normals_follow), 1.f);
    goal.quantiser = {0.34f * t, 4.f, normal_step, 0.2f * t, normal_step};
    goal.origin = facts.lower;
    goal.jobs = jobs;
    return goal;
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

/// Of a window of more than one frame.
Past past_of(const Window& window) {
    const size_t last = window.frames.size() - 1;
    return {window.frames[last - 1], window.frames[last], window.motion.back(), window.seconds[last] - window.seconds[last - 1]};
}

/// Goes on with the liquid's own motion through the frames that the window has none for, if all of them are calm enough for points to
/// go with it.
bool go_with_liquid(Window& window, int jobs) {
    const size_t known = window.motion.size(), end = window.frames.size() - 1;
    const double steps = double(end - known);
    std::vector<std::vector<glm::vec3>> motion(end - known);
    double stretch = 0, miss = 0;
    for (size_t s = known; s < end; ++s) {
        const SurfaceFrame &from = *window.frames[s], &to = *window.frames[s + 1];
        motion[s - known] = liquid_motion(from.mesh, to.mesh, to.index, window.seconds[s + 1] - window.seconds[s], jobs);
        stretch += mean_stretch(from.mesh, motion[s - known]);
        if (stretch > most_stretch * steps) return false;
    }
    for (size_t s = known; s < end; ++s) {
        const SurfaceFrame &from = *window.frames[s], &to = *window.frames[s + 1];
        miss += mean_miss(from.mesh, motion[s - known], to.index, 2 * to.edge, jobs) / to.edge;
    }
    if (miss > most_miss * steps) return false;
    std::move(motion.begin(), motion.end(), std::back_inserter(window.motion));
    return true;
}

/// How the surface goes from frame to frame.
void go_with_surface(Window& window, Past past, int jobs) {
    for (size_t s = 0; s + 1 < window.frames.size(); ++s) {
        const SurfaceFrame &from = *window.frames[s], &to = *window.frames[s + 1];
        const double seconds = window.seconds[s + 1] - window.seconds[s];
        std::vector<glm::vec3> start;
        if (past.frame) start = motion_goes_on(past.frame->index, past.motion, from.mesh, float(seconds / past.seconds), jobs);
        past = {window.frames[s], window.frames[s + 1], surface_motion(from.index, to.index, jobs, std::move(start)), seconds};
        window.motion.push_back(past.motion);
    }
}

}  // namespace

SpanCook::SpanCook(const SequenceReader& reader, const CookSettings& settings, const Survey& survey, const SpanPlan& plan,
                   const CookFacts& facts, const Aim& aim)
    : reader_(reader), settings_(settings), survey_(survey), plan_(plan), facts_(facts), aim_(aim) {
    const uint32_t samples = std::min(SpanPlan::most_window, std::max(2 * plan.window, plan.calm_window)) + 1;
    tables_memory_.resize(format::basis_tables_bytes(samples) / sizeof(double) + 2);
    format::build_basis_tables(tables_, tables_memory_.data(), samples);
}

void SpanCook::run(uint32_t span, const std::string& output, const std::function<void(uint32_t)>& done) const {
    const TemporaryFile candidate{output + ".cooking"}, best{output + ".best"};
    const SpanResult kept = aim_.bytes > 0 ? within_rate(span, candidate.path, best.path, done) : at_error(span, candidate.path, best.path, done);
    AssetWriter writer(output);
    writer.append(read_directory(best.path), 0);
    write(writer, kept);
}

SpanResult SpanCook::at_error(uint32_t span, const std::string& candidate, const std::string& best, const std::function<void(uint32_t)>& done) const {
    const ChosenFrames judged(reader_, judged_frames_of(span));
    ErrorSearch search(aim_.p99 / survey_.edge, survey_.wall_share, survey_.triangles / reader_.info().numbers.size());
    SpanResult kept;
    while (const std::optional<double> tolerance = search.next()) {
        const bool is_first = search.attempts() == 0;
        SpanResult result = cook(span, candidate, *tolerance * aim_.p99, [&](uint32_t frames) { if (is_first) done(frames); });
        result.measured = verify(candidate, judged, settings_.jobs, {}, Scrutiny::glance).totals;
        const double ratio = result.measured.area == 0 ? 1 : result.measured.p99() / aim_.p99;
        if (search.add(*tolerance, ratio, double(fs::file_size(candidate)))) kept = std::move(result), move_file(candidate, best);
    }
    kept.attempts = search.attempts();
    return kept;
}
SpanResult SpanCook::within_rate(uint32_t span, const std::string& candidate, const std::string& best, const std::function<void(uint32_t)>& done) const {
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
    kept.measured = verify(best, ChosenFrames(reader_, judged_frames_of(span)), settings_.jobs, {}, Scrutiny::glance).totals;
    return kept;
}

std::vector<size_t> SpanCook::judged_frames_of(uint32_t span) const {
    const uint32_t nominal = std::min(plan_.length(), plan_.frames), stride = (nominal + judged_frames - 1) / judged_frames;
    const uint32_t end = plan_.last(span) + (span + 1 == plan_.spans() ? 1 : 0);
    std::vector<size_t> chosen;
    for (uint32_t i = plan_.first(span); i < end; i += stride) chosen.push_back(i);
    return chosen;
}

SpanResult SpanCook::cook(uint32_t span, const std::string& output, double tolerance, const std::function<void(uint32_t)>& done) const {
    AssetWriter writer(output);
    const SequenceInfo& info = reader_.info();
    const uint32_t begin = plan_.first(span), end = plan_.last(span);
    SpanResult result;
    result.span = span, result.tolerance = tolerance;
    result.numbers.assign(info.numbers.begin() + begin, info.numbers.begin() + end + 1);
    result.seconds.assign(info.seconds.begin() + begin, info.seconds.begin() + end + 1);
    std::vector<Path> survivors;
    std::vector<SurfacePoint> before;
    Past past;
    for (uint32_t first = begin;;) {
        Window window = next_window(first, end, past, float(tolerance));
        window.opens_span = first == begin;
        window.before = std::move(before);
        const uint32_t last = first + uint32_t(window.samples()) - 1;
        WindowGoal goal = goal_for(tolerance * (window.calm ? calm_tolerance : 1), survey_, settings_.jobs);
        goal.container = container();
        grow_tracks(window, survivors, goal);
        const CodedWindow coded = code_tracks(window, goal, tables_);
        write_window(writer, first - begin, window, coded, goal, uint32_t(settings_.layers), last == end, result);
        done(last - begin);
        if (last == end) break;
        survivors = survivors_of(window);
        before = decoded_points(coded.decoded, window.samples() - 1);
        past = past_of(window);
        first = last;
    }
    write(writer, result);
    return result;
}

void SpanCook::write(AssetWriter& writer, const SpanResult& result) const {
    AssetFacts facts = asset_facts(facts_, result.numbers, result.seconds);
    facts.settings_json = part_settings(facts_, {result}, result.numbers);
    writer.finish(facts);
}

void SpanCook::load(Window& window, uint32_t last, const Past& past, float tolerance) const {
    const size_t known = window.frames.size(), count = last - uint32_t(window.first) + 1;
    window.frames.resize(count);
    for (size_t s = known; s < count; ++s) window.seconds.push_back(reader_.info().seconds[size_t(window.first) + s]);
    parallel_for(count - known, settings_.jobs, [&](size_t k) {
        const size_t s = known + k;
        if (s == 0 && past.border) {
            window.frames[s] = past.border;
            return;
        }
        Mesh mesh = reader_.read(size_t(window.first) + s);
        std::vector<Drop> drops = take_drops(mesh, survey_.edge, tolerance);
        push_through_walls(mesh, container(), survey_.edge, through_walls * tolerance);
        split_long_edges(mesh, longest_edge * survey_.edge);
        window.frames[s] = std::make_shared<SurfaceFrame>(std::move(mesh), survey_.edge, std::move(drops));
    });
}

Window SpanCook::next_window(uint32_t first, uint32_t span_end, const Past& past, float tolerance) const {
    const bool velocity_known = !reader_.info().velocity_estimated;
    Window window;
    window.first = int(first);
    load(window, plan_.window_end(first, span_end), past, tolerance);
    window.slips = velocity_known && settings_.slip;
    window.calm = velocity_known && go_with_liquid(window, settings_.jobs);
    if (!window.calm) {
        go_with_surface(window, past, settings_.jobs);
        return window;
    }
    const uint32_t later = plan_.calm_window_end(first, span_end);
    if (later == plan_.window_end(first, span_end)) return window;
    Window longer = window;
    load(longer, later, past, tolerance);
    return go_with_liquid(longer, settings_.jobs) ? longer : window;
}

}  // namespace rill::cooker
