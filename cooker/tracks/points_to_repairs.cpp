// SPDX-License-Identifier: MIT
// Births where coding has torn the surface or opened a void. A point more changes the patches of all its neighbours, so that
// births by a rule tear a rim elsewhere as they mend it. Here the decoder is asked: of the points that could be born at such a
// place, the one is taken that leaves least liquid and air confused; then the next. A strand takes several at once. What else was
// tried: README.md, "Spurs".
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "common/parallel.h"
#include "tracks/pipeline.h"
#include "tracks/torn_necks.h"
#include "tracks/trial_field.h"

namespace rill::cooker {
namespace {

// Edges.
constexpr float least_radius = 2.5f;      // of a place, around the vertex that is farthest off
constexpr float around_void = 1.5f;       // what a place's radius is more than that vertex is off
constexpr float farthest = 6;             // how far off is told
constexpr float thin = 2;                 // liquid, or air, that is lost no wider than a least place
constexpr float least_depth = 0.2f;       // of a probe: nearer to the surface its side is in doubt
constexpr float point_radius = 1.6f;      // of the fit that places a point
constexpr float point_reach = 2;          // as far round it the patches of others change
constexpr float near_by = 24;             // from a place on points count for less and less,
constexpr float least_near = 6;           // from nearer on where `enough_near` are,
constexpr float wide = 4;                 // but all of them where it is that wide: their winding number decides there
// Radii of a place.
constexpr float probe_spacing = 0.25f;    // .2: twice as many probes, bytes at equal p99 +.1 to +1.2 %
constexpr float most_depth = 0.8f;        // of a probe
constexpr float candidates_apart = 0.32f; // unless they face apart
constexpr float cleared = 0.8f;           // places begin no nearer to an earlier one
// A neck is thin: it takes more probes to see it, mending it mends few of them, and it must be so thick that corners of cells lie in it,
// whatever the source's is.
constexpr float neck_spacing = 0.125f, neck_depth = 0.1f;
constexpr double least_neck_gain = 0.2;
constexpr float neck_thicker = 0.15f;          // of liquid, or of the air that is to be there
constexpr double torn_counts = 2;            // as so much of confusion()

// A trial's time is that of its points: without this limit cooks of violent liquid take 12 to 26 % more of it, for the same figures.
constexpr size_t enough_near = 100;
constexpr size_t most_candidates = 12;
constexpr size_t most_repairs = 4;           // of a place; 6: splashes no better, +.9 to +3 %
constexpr double least_share = 0.1, least_gain = 1, most_gain = 4;  // of confusion(): what a point must mend; a wide void is closed by small parts
constexpr float same_side = 0.3f;         // cosine
// Of a frame, the worst: where all is torn, points for all would not mend it. Frames of pours and of sprays have up to 140 places; meshes of
// bare particles, bumps of an edge everywhere, 800 of 12 000 points.
constexpr size_t most_places = 160, points_per_place = 32;

struct OffSurface {
    glm::vec3 position;
    float distance;
};

/// Whether x is on the source where two of its sides are close together. What is lost there is no wider than that, however far off
/// all else is.
bool is_thin(const SurfaceFrame& frame, const glm::vec3& x) {
    const SurfaceIndex::Hit hit = frame.index.closest(x, thin * frame.edge);
    if (!(hit.distance < 0.01f * frame.edge)) return false;
    const glm::vec3 normal = value_at(hit, frame.mesh.triangles[hit.triangle], frame.mesh.normals);
    std::vector<VertexTree::Found> found;
    frame.tree.within(x, thin * frame.edge, found);
    return std::any_of(found.begin(), found.end(), [&](const auto& f) { return glm::dot(frame.mesh.normals[f.vertex], normal) < -same_side; });
}
/// Vertices of either surface that are farther than `beyond` from the other, worst first.
std::vector<OffSurface> find_off(const SurfaceFrame& frame, const Mesh& decoded, const SurfaceIndex& on_decoded, float beyond, int jobs) {
    std::vector<OffSurface> off;
    const auto look = [&](const std::vector<glm::vec3>& positions, const SurfaceIndex& other) {
        const std::vector<uint32_t> found = find_beyond(other, positions, beyond, jobs);
        const size_t before = off.size();
        off.resize(before + found.size());
        parallel_for(found.size(), jobs, [&](size_t i) {
            const glm::vec3& x = positions[found[i]];
            const float most = farthest * frame.edge;
            off[before + i] = {x, std::min(other.closest(x, most).distance, most)};
        });
    };
    look(frame.mesh.positions, on_decoded), look(decoded.positions, frame.index);
    std::stable_sort(off.begin(), off.end(), [](const OffSurface& a, const OffSurface& b) { return a.distance > b.distance; });
    return off;
}

/// A torn place: probes in it whose side is known, and points that could be born there.
struct Place {
    glm::vec3 centre;
    float radius;
    std::optional<NeckCorners> neck;
    bool is_liquid = true;        ///< the neck is, and is torn
    std::vector<float> torn;      ///< values at the neck's corners as it was found
    std::vector<float> x, y, z, depth;
    std::vector<SurfacePoint> candidates;
};

void find_probes(const SurfaceFrame& frame, Place& place) {
    const float spacing = place.neck ? neck_spacing : probe_spacing, least = place.neck ? neck_depth : least_depth;
    const int reach = int(std::lround(1 / spacing));
    SurfaceIndex::Near near;
    for (int k = -reach; k <= reach; ++k)
        for (int j = -reach; j <= reach; ++j)
            for (int i = -reach; i <= reach; ++i) {
                if (i * i + j * j + k * k > reach * reach) continue;
                const glm::vec3 x = place.centre + spacing * place.radius * glm::vec3(i, j, k);
                const float depth = depth_at(frame, x, most_depth * place.radius, &near);
                if (std::fabs(depth) < least * frame.edge) continue;
                place.x.push_back(x.x), place.y.push_back(x.y), place.z.push_back(x.z), place.depth.push_back(depth);
            }
}

void find_candidates(const SurfaceFrame& frame, Place& place) {
    std::vector<VertexTree::Found> found;
    frame.tree.within(place.centre, place.radius, found);
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.distance2 < b.distance2; });
    for (const auto& f : found) {
        SurfacePoint p{frame.mesh.positions[f.vertex], frame.mesh.normals[f.vertex], {}};
        const bool taken = std::any_of(place.candidates.begin(), place.candidates.end(), [&](const SurfacePoint& q) {
            return glm::distance(p.position, q.position) < candidates_apart * place.radius && glm::dot(p.normal, q.normal) > same_side;
        });
        if (taken || !settle(frame, point_radius * frame.edge, p)) continue;
        if (place.neck) p.position += (place.is_liquid ? neck_thicker : -neck_thicker) * frame.edge * p.normal;
        place.candidates.push_back(p);
        if (place.candidates.size() == most_candidates) return;
    }
}

/// Of squared distances from a place: as far as all points count, metres.
float near_of(const SurfaceFrame& frame, std::vector<float> away2) {
    if (away2.size() <= enough_near) return near_by * frame.edge;
    std::nth_element(away2.begin(), away2.begin() + enough_near, away2.end());
    return std::clamp(std::sqrt(away2[enough_near]), least_near * frame.edge, near_by * frame.edge);
}

/// All points near x, and ever fewer of those farther away: enough for the winding number, in a time that does not grow with
/// the frame.
std::vector<SurfacePoint> points_around(const SurfaceFrame& frame, const std::vector<SurfacePoint>& points, const glm::vec3& x) {
    std::vector<float> away2(points.size());
    for (size_t i = 0; i < away2.size(); ++i) {
        const glm::vec3 r = points[i].position - x;
        away2[i] = glm::dot(r, r);
    }
    const float near = near_of(frame, away2);
    std::vector<SurfacePoint> around;
    for (size_t i = 0; i < points.size(); ++i) {
        const float away = std::sqrt(away2[i]) / near;
        const uint32_t stride = away < 1 ? 1 : 1u << std::min(20, 3 * (std::ilogb(away) + 1));  // as many at any distance: by 2; the same figures
        if (uint32_t(i * 2654435761u) >> 12 & (stride - 1)) continue;
        around.push_back(points[i]);
    }
    return around;
}

/// Integral, over the place's liquid and air that is decoded as the other, of its depth: edges, per probe of a least place.
double confusion(const SurfaceFrame& frame, const Place& place, const PointField& decoded) {
    if (place.x.empty()) return 0;
    const std::vector<float> value = decoded.values_at(place.x, place.y, place.z);
    double sum = 0, torn = 0;
    for (size_t i = 0; i < value.size(); ++i)
        if ((value[i] < 0) != (place.depth[i] > 0)) sum += std::fabs(place.depth[i]) / frame.edge;
    if (place.neck && place.neck->is_amiss(decoded.values_at(place.neck->x, place.neck->y, place.neck->z), place.torn)) torn = torn_counts;
    const double apart = place.neck ? neck_spacing / probe_spacing : 1;
    return torn + sum * std::pow(apart * place.radius / (least_radius * frame.edge), 3);
}

/// Candidates that are tried together, and the place's confusion with them among the points.
struct Trial {
    std::vector<size_t> taken;
    double confusion = INFINITY;
};
/// The trial with each further candidate.
std::vector<Trial> with_one_more(const Place& place, const Trial& trial) {
    std::vector<Trial> more;
    for (size_t i = 0; i < place.candidates.size(); ++i) {
        if (std::find(trial.taken.begin(), trial.taken.end(), i) != trial.taken.end()) continue;
        more.push_back(trial);
        more.back().taken.push_back(i);
    }
    return more;
}
/// Every candidate with the nearest one that faces the other way: of thin liquid, each alone opens what the other closes.
std::vector<Trial> pairs(const std::vector<SurfacePoint>& candidates) {
    std::vector<Trial> trials;
    for (size_t i = 0; i < candidates.size(); ++i) {
        size_t opposite = i;
        float nearest = INFINITY;
        for (size_t j = 0; j < candidates.size(); ++j) {
            const float away = glm::distance(candidates[i].position, candidates[j].position);
            if (glm::dot(candidates[i].normal, candidates[j].normal) < -same_side && away < nearest) nearest = away, opposite = j;
        }
        if (opposite != i) trials.push_back({{i, opposite}});
    }
    return trials;
}

/// Fills in the trials' confusion; the least, or none.
Trial best_of(std::vector<Trial>& trials, const SurfaceFrame& frame, const Place& place, TrialFields& fields, int jobs) {
    parallel_for(trials.size(), jobs, [&](size_t k) {
        std::vector<SurfacePoint> added;
        for (size_t i : trials[k].taken) added.push_back(place.candidates[i]);
        fields.with(added, [&](const PointField& decoded) { trials[k].confusion = confusion(frame, place, decoded); });
    });
    const auto less = [](const Trial& a, const Trial& b) { return a.confusion < b.confusion; };
    const auto best = std::min_element(trials.begin(), trials.end(), less);
    return best == trials.end() ? Trial{} : *best;
}

/// The first trial that pays of a pair and more candidates, best first; or the last one.
template <typename Pays>
Trial best_together(const SurfaceFrame& frame, const Place& place, TrialFields& fields, size_t most, Pays pays, int jobs) {
    std::vector<Trial> trials = pairs(place.candidates);
    Trial best = best_of(trials, frame, place, fields, jobs);
    while (!best.taken.empty() && !pays(best) && best.taken.size() < most) {
        trials = with_one_more(place, best);
        best = best_of(trials, frame, place, fields, jobs);
    }
    return best;
}

/// Candidates that mend the place, best first, as points that join `points`; several at once where no single one does.
std::vector<SurfacePoint> repair(const SurfaceFrame& frame, Place& place, const std::vector<SurfacePoint>& points, int jobs) {
    std::vector<SurfacePoint> repairs;
    const bool all = place.radius > wide * frame.edge;
    TrialFields fields(all ? points : points_around(frame, points, place.centre), most_repairs);
    double now = 0;
    fields.with({}, [&](const PointField& decoded) {
        if (place.neck) place.torn = decoded.values_at(place.neck->x, place.neck->y, place.neck->z);
        now = confusion(frame, place, decoded);
    });
    const double gain = place.neck ? least_neck_gain : least_gain;
    if (now >= gain) find_candidates(frame, place);  // else no trial could pay: three places of four at fine errors
    for (size_t taken = 0; taken < most_repairs && !place.candidates.empty();) {
        const double least = place.neck ? gain : std::clamp(least_share * now, gain, most_gain);
        const size_t most = std::min(most_repairs - taken, size_t(now / least));  // more could not pay
        if (most == 0) break;
        const auto pays = [&](const Trial& trial) { return now - trial.confusion >= double(trial.taken.size()) * least; };
        std::vector<Trial> alone = with_one_more(place, {});
        Trial best = best_of(alone, frame, place, fields, jobs);
        if (!pays(best) && most > 1) best = best_together(frame, place, fields, most, pays, jobs);
        if (!pays(best)) break;
        std::vector<SurfacePoint> left, born;
        for (size_t i = 0; i < place.candidates.size(); ++i) {
            const SurfacePoint& p = place.candidates[i];
            if (std::find(best.taken.begin(), best.taken.end(), i) != best.taken.end()) born.push_back(p);
            else if (best.taken.size() > 1 || alone[i].confusion < now) left.push_back(p);  // who would have mended nothing will not later
        }
        fields.keep(born), repairs.insert(repairs.end(), born.begin(), born.end());
        taken += best.taken.size(), now = best.confusion, place.candidates = std::move(left);
    }
    return repairs;
}

/// Takes out of `left`, places in the order of their turn, those that meet none whose turn is before theirs: what is born in one does not
/// show in the others. `around`: of two, metres between them.
std::vector<size_t> take_apart(const std::vector<Place>& places, float around, std::vector<size_t>& left) {
    const auto meet = [&](size_t i, size_t j) {
        return glm::distance(places[i].centre, places[j].centre) < places[i].radius + places[j].radius + around;
    };
    std::vector<size_t> apart, later;
    for (size_t k = 0; k < left.size(); ++k) {
        const bool waits = std::any_of(left.begin(), left.begin() + ptrdiff_t(k), [&](size_t before) { return meet(before, left[k]); });
        (waits ? later : apart).push_back(left[k]);
    }
    left = std::move(later);
    return apart;
}

/// Torn and false necks, then what is farthest off, worst first.
std::vector<Place> find_places(const SurfaceFrame& frame, const Mesh& decoded, size_t most, float beyond, int jobs) {
    std::optional<MeshPieces> of_source, of_decoded;
    parallel_for(2, jobs, [&](size_t k) { k == 0 ? of_decoded.emplace(decoded, jobs) : of_source.emplace(frame); });
    const MeshPieces &source = *of_source, &pieces = *of_decoded;
    std::vector<TornNeck> torn, joined;
    parallel_for(2, jobs, [&](size_t k) { (k == 0 ? torn : joined) = (k == 0 ? find_torn_necks : find_false_necks)(source, pieces, frame.edge); });
    std::vector<Place> places;
    const auto add_necks = [&](const std::vector<TornNeck>& necks, const MeshPieces& of) {
        for (const TornNeck& neck : necks) {
            Place& place = places.emplace_back();
            place.centre = neck.middle, place.radius = least_radius * frame.edge, place.is_liquid = neck.of == TornNeck::Of::liquid;
            place.neck.emplace(neck, frame.edge, place.radius, of);
        }
    };
    add_necks(torn, pieces), add_necks(joined, source);
    for (const OffSurface& off : find_off(frame, decoded, pieces.index, beyond, jobs)) {
        const auto near = [&](const Place& p) { return !p.neck && glm::distance(p.centre, off.position) < cleared * p.radius; };
        if (std::any_of(places.begin(), places.end(), near)) continue;
        if (places.size() >= most) break;
        Place& place = places.emplace_back();
        const float wide_as = is_thin(frame, off.position) ? 0 : off.distance + around_void * frame.edge;
        place.centre = off.position, place.radius = std::max(least_radius * frame.edge, wide_as);
    }
    parallel_for(places.size(), jobs, [&](size_t i) { find_probes(frame, places[i]); });
    return places;
}

}  // namespace

std::vector<Path> repair_surface(const SurfaceFrame& frame, int sample, const std::vector<SurfacePoint>& points, const Mesh& decoded,
                                 float beyond, int jobs) {
    if (points.empty() || frame.mesh.triangles.empty()) return {};
    std::vector<Place> places = find_places(frame, decoded, std::max(most_places, points.size() / points_per_place), beyond, jobs);
    std::vector<SurfacePoint> all = points;
    std::vector<size_t> left(places.size());
    std::iota(left.begin(), left.end(), size_t(0));
    while (!left.empty()) {
        const std::vector<size_t> apart = take_apart(places, point_reach * frame.edge, left);
        const int jobs_each = int(std::max<size_t>(1, threads_of(jobs) / apart.size()));
        std::vector<std::vector<SurfacePoint>> repairs(apart.size());
        parallel_for(apart.size(), jobs, [&](size_t k) { repairs[k] = repair(frame, places[apart[k]], all, jobs_each); });
        for (const std::vector<SurfacePoint>& r : repairs) all.insert(all.end(), r.begin(), r.end());
    }
    std::vector<Path> born;
    for (size_t i = points.size(); i < all.size(); ++i) born.push_back(Path::born(all[i], point_radius * frame.edge, sample));
    return born;
}

}  // namespace rill::cooker
