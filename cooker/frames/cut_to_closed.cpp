// SPDX-License-Identifier: MIT
// In each side, the open edges, turned round, are the outline of what is missing, with the liquid to their left seen from
// outside. Where an outline comes to the border of the side, it goes on along it, counter-clockwise, to where the next comes in:
// the neighbouring side does the same the other way. A side without an outline is all liquid when a neighbour says so of the
// edge they share. Inside of the outlines there is liquid.
#include "frames/cut_to_closed.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "frames/rings_to_triangles.h"

namespace rill::cooker {
namespace {

constexpr float pitch_edges = 1;    // as the source: its median edge stays what it is
constexpr float most_parts = 2048;  // of an edge of the box
constexpr double still_share = 0.98; // of the rim that faces a side: lies in it where it does not move
constexpr float room_edges = 10;    // a patch reaches some six edges down from the waves

/// Of a side, facing outward.
FlatPlane plane_of(const Cut& cut, int side) {
    const int axis = side / 2, next = (axis + 1) % 3, last = (axis + 2) % 3;
    return side & 1 ? FlatPlane{next, last, cut.upper[axis]} : FlatPlane{last, next, cut.lower[axis]};
}

/// The side beyond edge k of a side's border: v lower, u upper, v upper, u lower, as one walks round counter-clockwise.
int beyond(const Cut& cut, int side, int k) {
    const FlatPlane p = plane_of(cut, side);
    return k == 0 ? 2 * p.v : k == 1 ? 2 * p.u + 1 : k == 2 ? 2 * p.v + 1 : 2 * p.u;
}

class Closing {
public:
    Closing(Mesh& mesh, const Cut& cut) : mesh_(mesh), cut_(cut) {
        const std::vector<OpenEdge> open = open_edges(mesh);
        std::vector<OpenEdge> of_side[6];
        for (const OpenEdge& e : open)
            if (const int s = side_cut_at(mesh, e, cut.sides, cut.lower, cut.upper, cut.edge); s >= 0) of_side[s].push_back(e);
        for (int s = 0; s < 6; ++s) gather(s, of_side[s]);
        for (int s = 0; s < 6; ++s) follow_border(s);
        fill_sides();
        for (int s = 0; s < 6; ++s)
            if (!sides_[s].rings.empty()) fill_rings(mesh, sides_[s].rings, plane_of(cut, s), pitch_edges * cut.edge, cut.within());
    }

private:
    struct Side {
        std::vector<Ring> rings;
        std::vector<std::vector<uint32_t>> arcs;  ///< vertices, from border to border
        uint32_t whole = 0;                       ///< edges of the border that are all liquid
    };
    /// Where an arc meets the border.
    struct End {
        double place;
        bool comes;  ///< to the border; else it leaves it
        size_t arc;
    };

    bool lies_in(uint32_t v, int side) const { return std::fabs(mesh_.positions[v][side / 2] - plane_of(cut_, side).place) <= cut_.within(); }

    /// Chains the open edges of a side, each the other way round.
    void gather(int side, const std::vector<OpenEdge>& open) {
        std::vector<std::array<uint32_t, 2>> steps;
        std::vector<uint32_t> entered;
        for (const OpenEdge& e : open)
            steps.push_back({e.to, e.from}), entered.push_back(e.from);
        std::sort(steps.begin(), steps.end()), std::sort(entered.begin(), entered.end());
        std::vector<bool> taken(steps.size(), false);
        const auto chain = [&](uint32_t v) {
            std::vector<uint32_t> line = {v};
            for (bool goes_on = true; goes_on;) {
                size_t i = size_t(std::lower_bound(steps.begin(), steps.end(), std::array{line.back(), 0u}) - steps.begin());
                while (i < steps.size() && steps[i][0] == line.back() && taken[i]) ++i;
                goes_on = i < steps.size() && steps[i][0] == line.back();
                if (goes_on) taken[i] = true, line.push_back(steps[i][1]);
            }
            const bool is_ring = line.front() == line.back();
            if (is_ring) line.pop_back();
            (is_ring ? sides_[side].rings : sides_[side].arcs).push_back(std::move(line));
        };
        // First from where more edges leave than come in: what is left then are rings.
        for (size_t i = 0, until; i < steps.size(); i = until) {
            const uint32_t v = steps[i][0];
            for (until = i; until < steps.size() && steps[until][0] == v;) ++until;
            const auto [first, last] = std::equal_range(entered.begin(), entered.end(), v);
            for (auto n = std::ptrdiff_t(until - i) - (last - first); n > 0; --n) chain(v);
        }
        for (size_t i = 0; i < steps.size(); ++i)
            if (!taken[i]) chain(steps[i][0]);
    }

    /// How far round the border a vertex stands, 0 to 4 counter-clockwise from the lower corner; none: not on it.
    std::optional<double> border_place(int side, uint32_t v) const {
        const FlatPlane p = plane_of(cut_, side);
        const glm::dvec3 share = (glm::dvec3(mesh_.positions[v]) - glm::dvec3(cut_.lower)) / glm::dvec3(cut_.upper - cut_.lower);
        const double place[4] = {share[p.u], 1 + share[p.v], 3 - share[p.u], 4 - share[p.v]};
        for (int k = 0; k < 4; ++k)
            if (lies_in(v, beyond(cut_, side, k))) return std::clamp(place[k], double(k), k + 1 - 1e-9);
        return std::nullopt;
    }

    /// In order along the border, who comes and who leaves in turn; none: the surface is torn there.
    std::optional<std::vector<End>> ends_of(int side) const {
        std::vector<End> ends;
        const auto& arcs = sides_[side].arcs;
        for (size_t i = 0; i < arcs.size(); ++i) {
            const auto from = border_place(side, arcs[i].front()), to = border_place(side, arcs[i].back());
            if (!from || !to) return std::nullopt;
            ends.push_back({*from, false, i}), ends.push_back({*to, true, i});
        }
        // At one place, who comes goes on with who leaves.
        std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) { return std::tuple(a.place, !a.comes, a.arc) < std::tuple(b.place, !b.comes, b.arc); });
        for (size_t i = 1; i < ends.size(); ++i)
            if (ends[i].comes == ends[i - 1].comes) return std::nullopt;
        return ends;
    }

    /// Makes rings of the arcs of a side.
    void follow_border(int side) {
        auto arcs = sides_[side].arcs;
        const auto ends = ends_of(side);
        if (!ends) return;
        std::vector<size_t> after(arcs.size());
        for (size_t i = 0; i < ends->size(); ++i) {
            const End &end = (*ends)[i], &next = (*ends)[(i + 1) % ends->size()];
            if (!end.comes) continue;
            walk(side, end.place, next.place + (i + 1 == ends->size() ? 4 : 0), arcs[end.arc]);
            go_straight(arcs[end.arc], arcs[next.arc].front());
            after[end.arc] = next.arc;
        }
        std::vector<bool> done(arcs.size(), false);
        for (size_t i = 0; i < arcs.size(); ++i) {
            Ring ring;
            for (size_t arc = i; !done[arc]; arc = after[arc]) {
                done[arc] = true;
                ring.insert(ring.end(), arcs[arc].begin(), arcs[arc].end());
            }
            ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
            if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
            if (ring.size() > 2) sides_[side].rings.push_back(std::move(ring));
        }
    }

    /// Appends the corners from one place of the border to another, counter-clockwise; remembers the edges that are walked whole.
    void walk(int side, double from, double to, std::vector<uint32_t>& line) {
        for (int k = int(std::floor(from)) + 1; k <= to; ++k) {
            go_straight(line, corner(side, k % 4));
            if (k + 1 <= to) sides_[side].whole |= 1u << k % 4;
        }
    }

    /// Appends a vertex of the same edge of the box and, before it, some between: the same ones from both sides.
    void go_straight(std::vector<uint32_t>& line, uint32_t to) {
        const uint32_t from = line.back();
        const auto [at, is_new] = between_.try_emplace(std::minmax(from, to));
        std::vector<uint32_t>& between = at->second;
        if (is_new && from != to) {
            const glm::vec3 a = mesh_.positions[at->first.first], b = mesh_.positions[at->first.second];
            const int parts = int(std::clamp(std::ceil(glm::distance(a, b) / (pitch_edges * cut_.edge)), 1.f, most_parts));
            for (int i = 1; i < parts; ++i) between.push_back(add(glm::mix(a, b, float(i) / float(parts))));
        }
        if (from < to) line.insert(line.end(), between.begin(), between.end());
        else line.insert(line.end(), between.rbegin(), between.rend());
        line.push_back(to);
    }

    /// Sides without arcs, beside a border that is all liquid, are all liquid themselves, but for the rings in them.
    void fill_sides() {
        for (bool more = true; more;) {
            more = false;
            for (int s = 0; s < 6; ++s) {
                if (!sides_[s].arcs.empty() || sides_[s].whole || !has_whole_edge(s)) continue;
                sides_[s].whole = 15, more = true;
                Ring ring = {corner(s, 0)};
                for (int k = 1; k <= 4; ++k) go_straight(ring, corner(s, k % 4));
                ring.pop_back();
                sides_[s].rings.push_back(std::move(ring));
            }
        }
    }
    /// Whether a neighbour has walked along all of the edge it shares with a side.
    bool has_whole_edge(int side) const {
        for (int other = 0; other < 6; ++other)
            for (int k = 0; k < 4; ++k)
                if (beyond(cut_, other, k) == side && sides_[other].whole >> k & 1) return true;
        return false;
    }

    /// The vertex in a corner of a side: k as border_place().
    uint32_t corner(int side, int k) {
        const FlatPlane p = plane_of(cut_, side);
        uint32_t id = uint32_t(side & 1) << side / 2;
        if (k == 1 || k == 2) id |= 1u << p.u;
        if (k == 2 || k == 3) id |= 1u << p.v;
        if (!corners_[id]) corners_[id] = add({id & 1 ? cut_.upper.x : cut_.lower.x, id & 2 ? cut_.upper.y : cut_.lower.y, id & 4 ? cut_.upper.z : cut_.lower.z});
        return *corners_[id];
    }
    uint32_t add(const glm::vec3& x) {
        mesh_.positions.push_back(x);
        if (!mesh_.velocities.empty()) mesh_.velocities.emplace_back(0);
        return uint32_t(mesh_.positions.size() - 1);
    }

    Mesh& mesh_;
    const Cut& cut_;
    Side sides_[6];
    std::array<std::optional<uint32_t>, 8> corners_;
    std::map<std::pair<uint32_t, uint32_t>, std::vector<uint32_t>> between_;  ///< two vertices of an edge of the box, from the lower to the higher
};

class Closed : public SequenceReader {
public:
    Closed(std::unique_ptr<SequenceReader> source, const Cut& cut) : source_(std::move(source)), cut_(cut) {}
    const SequenceInfo& info() const override { return source_->info(); }
    std::string name(size_t index) const override { return source_->name(index); }
    std::vector<std::filesystem::path> files(size_t index) const override { return source_->files(index); }
    Mesh read_surface(size_t index) const override { return closed(source_->read_surface(index)); }
    Mesh read(size_t index) const override { return closed(source_->read(index)); }

private:
    Mesh closed(Mesh mesh) const {
        close_at_sides(mesh, cut_);
        return mesh;
    }
    std::unique_ptr<SequenceReader> source_;
    Cut cut_;
};

}  // namespace

Cut find_cut(const WallFacts& facts, const RimOfPatch& rim, float edge) {
    Cut cut;
    for (int s = 0; s < 6; ++s) cut.sides |= uint32_t(facts.open[s] > 0) << s;
    for (int s = 0; s < 4; ++s) cut.moving |= rim.sides() & uint32_t(facts.open[s] < still_share * rim.facing[s]) << s;
    if (cut.moving) cut.sides = rim.sides();  // whatever of its crests and troughs lies in other bounds
    cut.lower = facts.lower, cut.upper = facts.upper, cut.edge = edge;
    for (int a = 0; a < 3; ++a) {
        if (!(cut.sides >> 2 * a & 1)) cut.lower[a] -= room_edges * edge;
        if (!(cut.sides >> (2 * a + 1) & 1)) cut.upper[a] += room_edges * edge;
    }
    return cut;
}

uint32_t closed_sides(const Cut& cut, const glm::vec3& lower, const glm::vec3& upper) {
    uint32_t sides = 0;
    for (int s = 0; s < 6; ++s) {
        const float off = s & 1 ? upper[s / 2] - cut.upper[s / 2] : lower[s / 2] - cut.lower[s / 2];
        sides |= uint32_t(cut.sides && std::fabs(off) <= cut.within()) << s;
    }
    return sides;
}

void close_at_sides(Mesh& mesh, const Cut& cut) {
    if (!cut.sides || mesh.triangles.empty()) return;
    mesh.normals.clear();
    if (cut.moving) widen_to_sides(mesh, cut.moving, cut.lower, cut.upper, cut.within());
    Closing(mesh, cut);
}

nlohmann::json cut_json(const Cut& cut) {
    nlohmann::json json = {{"sides", cut.sides}, {"lower", {cut.lower.x, cut.lower.y, cut.lower.z}}, {"upper", {cut.upper.x, cut.upper.y, cut.upper.z}}, {"edge", cut.edge}};
    if (cut.moving) json["moving"] = cut.moving;
    return json;
}

Cut cut_from_json(const nlohmann::json& json) {
    Cut cut;
    cut.sides = json.at("sides"), cut.edge = json.at("edge"), cut.moving = json.value("moving", 0u);
    bool is_box = cut.edge > 0;
    for (int a = 0; a < 3; ++a) {
        cut.lower[a] = json.at("lower").at(size_t(a)), cut.upper[a] = json.at("upper").at(size_t(a));
        is_box &= std::isfinite(cut.lower[a]) && std::isfinite(cut.upper[a]) && cut.lower[a] < cut.upper[a];
    }
    if (!is_box) throw nlohmann::json::other_error::create(500, "no box", &json);
    return cut;
}

std::unique_ptr<SequenceReader> cut_to_closed(std::unique_ptr<SequenceReader> reader, const Cut& cut) {
    return cut.sides ? std::make_unique<Closed>(std::move(reader), cut) : std::move(reader);
}

}  // namespace rill::cooker
