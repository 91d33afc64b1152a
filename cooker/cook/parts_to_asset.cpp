// SPDX-License-Identifier: MIT
#include "cook/parts_to_asset.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "common/output_file.h"
#include "cook/rate_search.h"
#include "tracks/pipeline.h"

namespace rill::cooker {
namespace {
using nlohmann::json;

constexpr const char* part_generator = "rill cook, part";

json to_json(const SpanResult& s) {
    return {{"span", s.span}, {"numbers", s.numbers}, {"seconds", s.seconds},
            {"bits", {s.bits.structure, s.bits.births, s.bits.motion, s.bits.normals, s.bits.slip, s.bits.drops}},
            {"layer_bytes", s.layer_bytes}, {"tracks", s.tracks}, {"point_frames", s.point_frames}, {"lives", s.lives}, {"deaths", s.deaths},
            {"tolerance", s.tolerance}, {"attempts", s.attempts}, {"measured", to_json(s.measured)}};
}

SpanResult span_from_json(const json& j) {
    SpanResult s;
    s.span = j.at("span"), s.numbers = j.at("numbers").get<std::vector<int>>(), s.seconds = j.at("seconds").get<std::vector<double>>();
    const json& bits = j.at("bits");
    s.bits = {bits.at(0), bits.at(1), bits.at(2), bits.at(3), bits.at(4), bits.at(5)};
    s.layer_bytes = j.at("layer_bytes").get<std::vector<double>>();
    s.tracks = j.at("tracks"), s.point_frames = j.at("point_frames"), s.tolerance = j.at("tolerance"), s.attempts = j.at("attempts");
    s.lives = j.at("lives").get<std::vector<uint64_t>>(), s.deaths = j.at("deaths").get<std::vector<uint64_t>>();
    s.measured = totals_from_json(j.at("measured"));
    return s;
}

/// Evenly stepping numbers are told by the header.
void add_numbers(json& settings, const std::vector<int>& numbers) {
    for (size_t i = 2; i < numbers.size(); ++i)
        if (numbers[i] - numbers[i - 1] != numbers[1] - numbers[0]) {
            settings["frame_numbers"] = numbers;
            return;
        }
}

template <class T>
void add(std::vector<T>& sum, const std::vector<T>& more) {
    sum.resize(std::max(sum.size(), more.size()));
    for (size_t i = 0; i < more.size(); ++i) sum[i] += more[i];
}

/// Frames that the middle one lives; every life counts once, or once for each of its frames.
size_t median_life(const std::vector<uint64_t>& lives, bool by_frame) {
    const auto weight = [&](size_t n) { return double(lives[n]) * (by_frame ? double(n) : 1); };
    double total = 0, sum = 0;
    for (size_t n = 0; n < lives.size(); ++n) total += weight(n);
    for (size_t n = 0; n < lives.size(); ++n)
        if ((sum += weight(n)) * 2 >= total) return n;
    return 0;
}

json lives_json(const SpanResult& all) {
    json deaths = json::object();
    for (size_t cause = 0; cause < all.deaths.size() && cause < std::size(death_names); ++cause)
        deaths[death_names[cause]] = all.deaths[cause];
    return {{"median_frames", median_life(all.lives, false)}, {"median_frames_by_point", median_life(all.lives, true)}, {"ended_by", deaths}};
}

void add(SpanResult& sum, const SpanResult& more) {
    sum.bits.structure += more.bits.structure, sum.bits.births += more.bits.births, sum.bits.motion += more.bits.motion;
    sum.bits.normals += more.bits.normals, sum.bits.slip += more.bits.slip, sum.bits.drops += more.bits.drops;
    add(sum.layer_bytes, more.layer_bytes), add(sum.lives, more.lives), add(sum.deaths, more.deaths);
    sum.tracks += more.tracks, sum.point_frames += more.point_frames, sum.measured.add(more.measured);
    const size_t shared = sum.numbers.empty() ? 0 : 1;  // the border frame
    sum.numbers.insert(sum.numbers.end(), more.numbers.begin() + long(shared), more.numbers.end());
    sum.seconds.insert(sum.seconds.end(), more.seconds.begin() + long(shared), more.seconds.end());
}

constexpr size_t longest_number = 12;  // as text

/// Every byte of an asset counts: six digits are all that anybody reads.
void shorten_numbers(json& value) {
    if (value.is_structured())
        for (json& part : value) shorten_numbers(part);
    if (!value.is_number_float()) return;
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value.get<double>());
    value = std::strtod(text, nullptr);
}

json asset_settings(const CookFacts& facts, const std::vector<SpanResult>& spans, const SpanResult& all) {
    const auto bytes = [](double bits) { return uint64_t(std::llround(bits / 8)); };
    const double diagonal = glm::distance(facts.lower, facts.upper);
    json settings = facts.cook, list = json::array();
    for (const SpanResult& s : spans)
        list.push_back({{"first_frame", s.numbers.front()}, {"p99_m", s.measured.p99()}, {"tolerance_m", s.tolerance}, {"attempts", s.attempts}});
    settings["spans"] = list;
    settings["bytes"] = {{"structure", bytes(all.bits.structure)}, {"births", bytes(all.bits.births)}, {"motion", bytes(all.bits.motion)},
                         {"normals", bytes(all.bits.normals)}, {"slip", bytes(all.bits.slip)}, {"drops", bytes(all.bits.drops)}};
    settings["layer_bytes"] = json::array();
    for (const double layer : all.layer_bytes) settings["layer_bytes"].push_back(uint64_t(layer));
    settings["tracks"] = all.tracks;
    settings["points_per_frame"] = double(all.point_frames) / double(all.numbers.size());
    settings["lives"] = lives_json(all);
    settings["measured"] = summary_json(all.measured, diagonal);
    for (const char* key : {"spans", "points_per_frame", "measured", "source", "target"})
        if (settings.contains(key)) shorten_numbers(settings[key]);
    add_numbers(settings, all.numbers);
    return settings;
}

/// All parts that hold anything, in the order of their spans; they fit together without gap or overlap.
std::vector<Part> gather(const std::vector<std::string>& paths) {
    std::vector<Part> parts;
    for (const std::string& path : paths) {
        std::error_code error;
        if (std::filesystem::file_size(path, error) == 0 && !error) continue;  // a segment without spans
        parts.push_back(read_part(path));
        if (parts.back().cook != parts.front().cook)
            throw InputError(path + ": is not of the same cook as " + parts.front().directory.path + ": input, settings or tool differ");
    }
    if (parts.empty()) throw InputError((paths.empty() ? std::string("link") : paths.front()) + ": nothing to link" +
                                         (paths.empty() ? "" : ": no part given holds a span, for they are of more segments than there are spans"));
    std::sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.spans.front().span < b.spans.front().span; });
    for (size_t i = 1; i < parts.size(); ++i) {
        const SpanResult &before = parts[i - 1].spans.back(), &after = parts[i].spans.front();
        if (after.span <= before.span)
            throw InputError(parts[i].directory.path + ": holds spans that are also in " + parts[i - 1].directory.path);
        if (after.span != before.span + 1)
            throw InputError(parts[i].directory.path + ": the parts between frames " + std::to_string(before.numbers.back()) + " and " +
                             std::to_string(after.numbers.front()) + " are missing");
    }
    return parts;
}

struct Joined {
    CookFacts facts;
    std::vector<SpanResult> spans;
    SpanResult all;
};
Joined join(const std::vector<Part>& parts, AssetWriter& writer) {
    Joined joined;
    const format::Header& h = parts.front().directory.header;
    joined.facts.cook = parts.front().cook, joined.facts.layers = h.layer_count, joined.facts.edge = h.cell_size;
    joined.facts.frames_per_second = joined.facts.cook.at("source").at("frames_per_second");
    for (int a = 0; a < 3; ++a) joined.facts.lower[a] = h.lower[a], joined.facts.upper[a] = h.upper[a];
    joined.facts.walls = h.walls;
    for (const Part& part : parts) {
        writer.append(part.directory, uint32_t(joined.all.numbers.empty() ? 0 : joined.all.numbers.size() - 1));
        for (const SpanResult& span : part.spans) add(joined.all, span), joined.spans.push_back(span);
    }
    return joined;
}

}  // namespace

Part read_part(const std::string& path) {
    Part part;
    part.directory = read_directory(path);
    const json settings = json::parse(part.directory.settings_json, nullptr, false);
    if (!settings.is_object() || settings.value("generator", json()) != part_generator)
        throw InputError(path + ": is an asset, but no part of one: rill cook --segment makes parts");
    try {
        part.cook = settings.at("cook");
        part.cook.at("key").get<std::string>(), part.cook.at("span_count").get<uint32_t>();
        for (const json& span : settings.at("spans")) part.spans.push_back(span_from_json(span));
    } catch (const json::exception&) {
        throw InputError(path + ": its settings are not those of a part");
    }
    size_t frames = 1;
    for (const SpanResult& span : part.spans) {
        if (span.span != part.spans.front().span + uint32_t(&span - part.spans.data()) || span.numbers.empty() ||
            span.numbers.size() != span.seconds.size())
            throw InputError(path + ": its settings are not those of a part");
        frames += span.numbers.size() - 1;
    }
    if (part.spans.empty() || frames != part.directory.header.frame_count) throw InputError(path + ": its settings are not those of a part");
    check_chunks(part.directory);
    return part;
}

AssetFacts asset_facts(const CookFacts& cook, const std::vector<int>& numbers, const std::vector<double>& seconds) {
    AssetFacts facts;
    facts.frame_count = uint32_t(numbers.size());
    facts.first_frame = numbers.front();
    facts.frame_step = numbers.size() > 1 ? numbers[1] - numbers[0] : 1;
    for (size_t i = 2; i < numbers.size(); ++i) facts.frame_step = std::min(facts.frame_step, numbers[i] - numbers[i - 1]);
    facts.layer_count = cook.layers;
    facts.frames_per_second = cook.frames_per_second, facts.first_seconds = seconds.front();
    facts.cell_size = cook.edge, facts.lower = cook.lower, facts.upper = cook.upper, facts.walls = cook.walls;
    const double step = seconds.size() > 1 ? (seconds.back() - seconds.front()) / double(seconds.size() - 1) : 0;
    const bool even = std::ranges::all_of(seconds, [&, i = 0](double s) mutable {
        return std::abs(s - seconds.front() - step * i++) < 1e-6 * std::max(1.0, step);
    });
    if (even && step > 0) facts.frames_per_second = 1 / step;
    if (!even) for (double s : seconds) facts.frame_seconds.push_back(s - seconds.front());
    return facts;
}

std::string part_settings(const CookFacts& facts, const std::vector<SpanResult>& spans, const std::vector<int>& numbers) {
    json list = json::array();
    for (const SpanResult& span : spans) list.push_back(to_json(span));
    json settings = {{"generator", part_generator}, {"cook", facts.cook}, {"spans", list}};
    add_numbers(settings, numbers);
    return settings.dump();
}

double bytes_in_asset(const CookFacts& facts, const AssetDirectory& part, const SpanResult& span) {
    const json settings = asset_settings(facts, {span}, span);
    double common = double(settings.dump().size());
    // What is measured only when the span is done will have all its digits.
    for (const json& value : settings.at("measured"))
        if (span.measured.area == 0 && !value.is_number_integer()) common += double(longest_number) - double(value.dump().size());
    const double own = double(settings.at("spans").at(0).dump().size()), spans = facts.cook.at("span_count");
    const double tables = double(part.header.directory_bytes - part.header.settings_bytes);
    double chunks = 0;
    for (const format::ChunkRecord& chunk : part.chunks) chunks += chunk.bytes;
    return chunks + tables + own + (format::header_bytes + common - own) / spans;
}

Linked judge(const json& stored, uint64_t file_bytes) {
    Linked linked;
    linked.report = stored;
    const auto number = [&](const char* pointer) {
        const json::json_pointer place(pointer);
        return stored.contains(place) && stored.at(place).is_number() ? stored.at(place).get<double>() : HUGE_VAL;
    };
    linked.target_p99 = number("/target/p99_metres"), linked.measured_p99 = number("/measured/p99_m");
    linked.target_met = linked.measured_p99 <= (1 + met_within) * linked.target_p99;
    if (const double allowed = number("/target/file_bytes"); allowed < HUGE_VAL) {
        const double used = double(file_bytes) / allowed;
        linked.target_p99 = 0, linked.target_kbps = number("/target/kilobits_per_second"), linked.measured_kbps = used * linked.target_kbps;
        const double finest = 1.001 * finest_tolerance * number("/source/median_edge_metres");
        const bool all_finest = std::ranges::all_of(stored.at("spans"), [&](const json& span) { return span.at("tolerance_m") <= finest; });
        linked.target_met = used <= 1 + rate_met_within && (used >= 1 - rate_met_within || all_finest);
    }
    return linked;
}

void check_output(const std::string& path) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) throw InputError(path + ": cannot be written: is a directory");
    if (!std::filesystem::exists(path, error)) return;
    if (!std::filesystem::is_regular_file(path, error)) throw InputError(path + ": cannot be written: is no regular file");
    const auto is_asset = [](std::string_view begins) { return std::memcmp(begins.data(), format::magic, begins.size()) == 0; };
    spare_others(path, sizeof format::magic, is_asset, "no Rill asset");
}

Linked link_asset(const std::vector<std::string>& paths, const std::string& output) {
    check_output(output);
    const std::vector<Part> parts = gather(paths);
    const uint32_t count = parts.front().cook.at("span_count"), first = parts.front().spans.front().span, last = parts.back().spans.back().span;
    if (first != 0)
        throw InputError(parts.front().directory.path + ": the parts before frame " + std::to_string(parts.front().spans.front().numbers.front()) + " are missing");
    if (last + 1 != count)
        throw InputError(parts.back().directory.path + ": the parts after frame " + std::to_string(parts.back().spans.back().numbers.back()) + " are missing (" +
                         std::to_string(last + 1) + " of " + std::to_string(count) + " spans are there)");
    AssetWriter writer(output);
    const Joined joined = join(parts, writer);
    AssetFacts facts = asset_facts(joined.facts, joined.all.numbers, joined.all.seconds);
    const json settings = asset_settings(joined.facts, joined.spans, joined.all);
    facts.settings_json = settings.dump();
    writer.finish(facts);
    return judge(json::parse(facts.settings_json), std::filesystem::file_size(output));
}

void link_part(const std::vector<std::string>& paths, const std::string& output) {
    const std::vector<Part> parts = gather(paths);
    AssetWriter writer(output);
    const Joined joined = join(parts, writer);
    AssetFacts facts = asset_facts(joined.facts, joined.all.numbers, joined.all.seconds);
    facts.settings_json = part_settings(joined.facts, joined.spans, joined.all.numbers);
    writer.finish(facts);
}

}  // namespace rill::cooker
