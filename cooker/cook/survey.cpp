// SPDX-License-Identifier: MIT
#include "cook/survey.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>

#include "common/output_file.h"
#include "common/parallel.h"
#include "cook/input_hash.h"
#include "frames/walls.h"
#include "measure/overlap.h"
#include "readers/file_bytes.h"

namespace rill::cooker {
namespace {
using nlohmann::json;

constexpr size_t looked_at = 6;  // frames whose topology is looked at
constexpr double much_inside = 0.03;  // of a surface, inside other liquid: noise of solvers and meshers has less
constexpr size_t measured = 16;  // and whose edges between walls are

struct FrameFacts {
    WallFacts walls;
    RimOfPatch rim;
    float edge = 0;
    size_t triangles = 0, vertices = 0;
};

FrameFacts facts_of(const Mesh& mesh) {
    const float edge = median_edge(mesh);
    const WallFacts walls = wall_facts(mesh, edge);
    return {walls, rim_of_patch(mesh, walls.lower, walls.upper), edge, mesh.triangles.size(), mesh.positions.size()};
}

/// Frames that the liquid is in, evenly spread.
std::vector<size_t> samples_of(const std::vector<FrameFacts>& facts, size_t most) {
    std::vector<size_t> full, samples;
    for (size_t i = 0; i < facts.size(); ++i)
        if (facts[i].triangles > 0) full.push_back(i);
    for (size_t k = 0; k < std::min(most, full.size()); ++k) samples.push_back(full[full.size() * k / std::min(most, full.size())]);
    return samples;
}

/// How surface leaves the walls: those that the liquid was cut off at are sharp, of the others it is measured, like the bevel between them.
void measure_rims(const SequenceReader& reader, const std::vector<FrameFacts>& facts, Survey& survey, int jobs) {
    survey.sharp = survey.walls & closed_sides(survey.cut, survey.lower, survey.upper);
    const uint32_t walls = survey.walls & ~survey.sharp;
    const surface::Container container = surface::container_of(&survey.lower.x, &survey.upper.x, walls, survey.edge);
    const std::vector<size_t> samples = samples_of(facts, measured);
    std::vector<std::vector<BevelFacet>> found(samples.size());
    std::vector<RimFacts> rims(samples.size());
    if (walls) parallel_for(samples.size(), jobs, [&](size_t k) {
        Mesh mesh = reader.read_surface(samples[k]);
        close_at_sides(mesh, survey.cut);
        found[k] = bevel_facets(mesh, container, survey.edge), rims[k] = rim_facts(mesh, container, survey.edge);
    });
    for (size_t k = 1; k < rims.size(); ++k) rims[0].add(rims[k]);
    if (!rims.empty()) survey.sharp |= rims[0].sharp_walls();
    std::vector<BevelFacet> all;
    for (const auto& facets : found) all.insert(all.end(), facets.begin(), facets.end());
    survey.bevel = bevel_legs(all, survey.edge);
}

/// What will disappoint, and what to do about it.
void inspect(const SequenceReader& reader, const std::vector<FrameFacts>& facts, const Cut& cut, int jobs,
             const std::function<void(const std::string&)>& warn) {
    if (!warn) return;
    const std::vector<size_t> samples = samples_of(facts, looked_at);
    const size_t looks = samples.size();
    std::vector<size_t> added(looks, 0), open(looks, 0);
    std::vector<double> inside(looks, 0);
    parallel_for(looks, jobs, [&](size_t k) {
        Mesh mesh = reader.read_surface(samples[k]);
        const size_t before = mesh.triangles.size();
        close_at_sides(mesh, cut);
        added[k] = mesh.triangles.size() - before;
        open[k] = open_edges(mesh).size();
        if (open[k] == 0) inside[k] = share_inside(mesh, median_edge(mesh));
    });
    if (std::any_of(added.begin(), added.end(), [](size_t n) { return n > 0; }))
        warn(reader.info().path + (cut.moving ? ": the rim of the liquid moves sideways: it is carried on to its bounds, and closed there, flat"
                                              : ": the liquid is cut off at sides of its bounds: closed there, flat"));
    char text[300];
    for (size_t k = 0; k < looks; ++k) {
        if (open[k] == 0) continue;
        std::snprintf(text, sizeof text, ": the mesh is open (%zu open edges): the decoded surface is closed, so holes are covered; "
                      "export the whole liquid, with the sides of the domain capped", open[k]);
        warn(reader.name(samples[k]) + text);
        break;
    }
    for (size_t k = 0; k < looks; ++k) {
        if (inside[k] < much_inside) continue;
        std::snprintf(text, sizeof text, ": %.0f %% of the surface lies inside other liquid: shells that overlap decode badly; unite them before the export",
                      100 * inside[k]);
        warn(reader.name(samples[k]) + text);
        break;
    }
}

json vector_json(const glm::vec3& v) { return {v.x, v.y, v.z}; }

json to_json(const Survey& s) {
    return {{"lower", vector_json(s.lower)}, {"upper", vector_json(s.upper)}, {"edge", s.edge}, {"walls", s.walls}, {"wall_share", s.wall_share}, {"sharp", s.sharp}, {"bevel", s.bevel},
            {"cut", cut_json(s.cut)}, {"triangles", s.triangles}, {"vertices", s.vertices},
            {"velocity", {{"meaning", int(s.fit.meaning)}, {"factor", s.fit.factor}, {"still", s.fit.still},
                          {"as_stored", s.fit.as_stored}, {"carried", s.fit.carried}, {"conclusive", s.fit.conclusive}}}};
}

Survey from_json(const json& j) {
    Survey s;
    for (int a = 0; a < 3; ++a) s.lower[a] = j.at("lower").at(size_t(a)), s.upper[a] = j.at("upper").at(size_t(a));
    s.edge = j.at("edge"), s.walls = j.at("walls"), s.wall_share = j.at("wall_share"), s.sharp = j.at("sharp"), s.bevel = j.at("bevel"), s.cut = cut_from_json(j.at("cut")), s.triangles = j.at("triangles"), s.vertices = j.at("vertices");
    const json& v = j.at("velocity");
    s.fit.meaning = VelocityMeaning(v.at("meaning").get<int>()), s.fit.factor = v.at("factor"), s.fit.still = v.at("still");
    s.fit.as_stored = v.at("as_stored"), s.fit.carried = v.at("carried"), s.fit.conclusive = v.at("conclusive");
    return s;
}

/// The file's JSON if it is a survey of this very input, untouched since; null otherwise.
json kept_survey(const std::string& file, const std::string& states, const ReadOptions& options) {
    if (file.empty() || !std::filesystem::exists(file)) return nullptr;
    json kept = json::parse(read_file(file), nullptr, false);
    if (!kept.is_object() || kept.value("report", json()) != "rill survey" || kept.value("version", json()) != 7) return nullptr;
    const bool same = kept.value("tool", json()) == RILL_VERSION && kept.value("states", json()) == states && kept.value("read", json()) == read_settings(options);
    return same ? kept : json(nullptr);
}

/// Of all frames, closed where they are cut off.
std::vector<FrameFacts> look_at_frames(const SequenceReader& reader, const Cut& cut, int jobs, const std::function<void(uint32_t)>& progress) {
    std::vector<FrameFacts> facts(reader.info().numbers.size());
    uint32_t count = 0;
    std::mutex counting;
    parallel_for(facts.size(), jobs, [&](size_t i) {
        Mesh mesh = reader.read_surface(i);
        close_at_sides(mesh, cut);
        facts[i] = facts_of(mesh);
        const std::lock_guard lock(counting);
        progress(++count);
    });
    return facts;
}

/// 0: there is nothing to show, and nothing to measure.
float median_of_edges(const std::vector<FrameFacts>& facts) {
    std::vector<float> edges;
    for (const FrameFacts& f : facts)
        if (f.triangles > 0) edges.push_back(f.edge);
    if (edges.empty()) return 0;
    std::nth_element(edges.begin(), edges.begin() + long(edges.size() / 2), edges.end());
    return edges[edges.size() / 2];
}

WallFacts walls_of(const std::vector<FrameFacts>& facts, float edge) {
    WallFacts walls;
    for (const FrameFacts& f : facts)
        if (f.triangles > 0) walls.add(f.walls, edge);
    return walls;
}

Survey look_at_all(const SequenceReader& reader, int jobs, const std::function<void(const std::string&)>& warn,
                   const std::function<void(uint32_t)>& progress) {
    Survey result;
    std::vector<FrameFacts> facts = look_at_frames(reader, result.cut, jobs, progress);
    float edge = median_of_edges(facts);
    if (edge == 0) return result;
    RimOfPatch rim;
    for (const FrameFacts& f : facts) rim.add(f.rim);
    result.cut = find_cut(walls_of(facts, edge), rim, edge);
    if (result.cut.sides) facts = look_at_frames(reader, result.cut, jobs, progress), edge = median_of_edges(facts);
    for (const FrameFacts& f : facts) result.triangles += double(f.triangles), result.vertices += double(f.vertices);
    const WallFacts walls = walls_of(facts, edge);
    result.edge = edge, result.lower = walls.lower, result.upper = walls.upper, result.walls = walls.walls(edge);
    result.wall_share = walls.share(result.walls);
    measure_rims(reader, facts, result, jobs);
    inspect(reader, facts, result.cut, jobs, warn);
    return result;
}

}  // namespace

json read_settings(const ReadOptions& options) {
    json asked = json::object();
    if (options.frames_per_second > 0) asked["fps"] = options.frames_per_second;
    if (options.step != 0) asked["frames"] = {options.first, options.last, options.step};
    if (!options.velocity_name.empty()) asked["velocity"] = options.velocity_name;
    if (options.velocity_per_frame) asked["velocity_unit"] = "frame";
    if (options.up == 'y') asked["up"] = "y";
    if (options.handedness == 'l') asked["handedness"] = "left";
    if (options.scale > 0 && options.scale != 1) asked["scale"] = options.scale;
    return asked;
}

std::string known_input(const SequenceReader& reader, const ReadOptions& options, const std::string& file, int jobs) {
    const std::vector<std::filesystem::path> files = input_files(reader);
    if (const json kept = kept_survey(file, hash_states(files), options); kept.is_object() && kept.value("input", json()).is_string())
        return kept["input"];
    return hash_contents(files, jobs);
}

Survey survey_input(const SequenceReader& reader, const ReadOptions& options, const std::string& file, const std::string& input, int jobs,
                    const std::function<void(uint32_t done)>& progress) {
    const std::vector<std::filesystem::path> files = input_files(reader);
    const std::string states = hash_states(files);
    if (const json kept = kept_survey(file, states, options); kept.is_object() && kept.value("input", json()) == input) try {
        Survey result = from_json(kept.at("facts"));
        result.input = input;
        return result;
    } catch (const json::exception&) {}  // damaged: looked at anew
    const VelocityFit fit = check_velocity(reader, options.warn);
    Survey result = look_at_all(reader, jobs, options.warn, progress);
    result.fit = fit, result.input = input;
    if (!file.empty()) {
        const json kept = {{"report", "rill survey"}, {"version", 7}, {"tool", RILL_VERSION}, {"states", states}, {"read", read_settings(options)},
                           {"input", input}, {"facts", to_json(result)}};
        write_file(file, kept.dump(2) + "\n");
    }
    return result;
}

}  // namespace rill::cooker
