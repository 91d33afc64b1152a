// SPDX-License-Identifier: MIT
#include "tracks/frames_to_tracks.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/parallel.h"
#include "frames/walls.h"
#include "tracks/decoded_frame.h"
#include "tracks/mean_depth.h"
#include "tracks/points_to_mesh.h"

namespace rill::cooker {
namespace {

constexpr int last_mendings = 5;  // README.md, "Spurs"
// Tolerances: what bears points while tracks grow (the field off the source's vertices, the decoded mesh off the source), and mends
// (at 2.5, and drops a sixth looser, all frames of dam_break: bytes at equal p99 +.4 %, the largest distance 2.2 edges for 1.6).
constexpr float missed_by = 1, spur_beyond = 4, repair_beyond = 2.2f;
constexpr float stray_beyond = 1.5f;  // at an end of a life
constexpr int trimmings = 3;
constexpr int most_rounds = 8;    // of births at one frame
constexpr float credible = 3;                      // tolerances a correction may be told to mend
// Cells and points cut off what is convex, and the patches of thin liquid sag: it comes out short of volume, which the distance at
// vertices does not tell. So what is aimed at goes as far outside the source as volume is missing, frame by frame, by so many tolerances
// at most. Mean volume of pour_sphere .9985 → 1.0000, its violent frames .994 … .997 → .996 … 1.0005, a flat ball .96 → 1.00; bytes at equal
// p99 of eight clips from two solvers −3.6 … +.5, on average −.9 %.
constexpr float most_offset = 0.15f, least_most_offset = 0.05f;  // the latter edges: what cells cut off, finer points do not
// How far the aim goes from the source to where the window before left the surface. What changes at the borders of dam_break and
// drop_splash, p99 over that of the error: 1.11 and 1.17 with 0, .99 and 1.00 with .5, .88 and .89 with 1, which makes the frames there
// 5 % worse; bytes the same to .2 %.
constexpr float seam_share = 0.7f;
constexpr float few_points = 200;  // of as many, half is taken for chance: how each is rounded
constexpr float too_near = 0.4f;                   // of the distance to the third neighbour; at .2, and surplus borne for
                                                   // 4 frames, dam_break took 14 % more bytes at equal error

/// What a frame may lose when a point is taken away that its neighbours nearly make up for.
struct Loss {
    float distance;  ///< tolerances
    float angle;     ///< radians
};
constexpr Loss surplus_loss{0.3f, 0.1f};   // a point on its way; .2 and .45 tolerances: 0 and +2.5 %; of points that mend a frame
                                           // .6, born at 3 tolerances: −.9 %, but rims of dam_break 41 were torn
constexpr Loss fleeting_loss{0.9f, 0.4f};  // one that lives for so few frames that its birth is most of its bytes
constexpr size_t fleeting = 4;             // frames

/// Spacing that thinning leaves, metres. What quadratics leave grows with its cube. Wider patches outreach the liquid's depth, and
/// the winding number has too few discs; five edges at every error took 2, 24 and 0 % more bytes at .25, .12 and .5 edges.
float widest_spacing(const WindowGoal& goal, float edge) { return 6 * edge * std::cbrt(goal.tolerance / edge); }

/// The points of one frame while the sweep stands there.
struct Sweep {
    std::vector<uint32_t> ids;  ///< of Window::paths
    std::vector<SurfacePoint> points;
};
Sweep alive_at(const Window& window, int sample) {
    Sweep sweep;
    for (uint32_t i = 0; i < window.paths.size(); ++i)
        if (window.paths[i].alive(sample)) sweep.ids.push_back(i), sweep.points.push_back(window.paths[i].target(sample));
    return sweep;
}

/// Carries every track alive at sample − 1 on to sample; those that cannot be carried have died.
void carry_on(Window& window, int sample, int jobs, size_t first_path = 0) {
    const SurfaceFrame &from = *window.frames[size_t(sample - 1)], &to = *window.frames[size_t(sample)];
    const std::vector<glm::vec3>& motion = window.motion[size_t(sample - 1)];
    parallel_for(window.paths.size() - first_path, jobs, [&](size_t i) {
        Path& path = window.paths[first_path + i];
        if (path.death != sample - 1 || path.cause != Death::none) return;
        if (const auto next = carry_point(from, motion, to, path.at.back(), path.radius)) {
            path.at.push_back(*next);
            path.correction.push_back(path.correction.back()), path.tilt.push_back(path.tilt.back());
            ++path.death;
        } else {
            path.cause = Death::left_surface;
        }
    });
}

/// A track that stands here for the last time: it dies at this sample or, if it only just came, never was.
void end(Path& path, int sample, Death cause) {
    path.cause = cause;
    if (path.death == sample && path.death > path.birth) {
        --path.death;
        path.at.pop_back(), path.correction.pop_back(), path.tilt.pop_back();
    }
}

/// Ends tracks that have run into each other, younger first, and those that their neighbours make needless; from `first` on.
void thin_out(Window& window, int sample, const WindowGoal& goal, const Sweep& sweep, size_t first = 0) {
    const Surplus surplus = measure_surplus(sweep.points, goal.jobs);
    std::vector<glm::vec3> positions;
    for (const SurfacePoint& p : sweep.points) positions.push_back(p.position);
    const VertexTree tree(positions);
    std::vector<VertexTree::Found> found;
    std::vector<uint32_t> order(sweep.ids.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {  // youngest first
        return window.paths[sweep.ids[a]].birth > window.paths[sweep.ids[b]].birth;
    });
    std::vector<bool> gone(order.size(), false);
    for (uint32_t k : order) {
        if (sweep.ids[k] < first) continue;
        Path& path = window.paths[sweep.ids[k]];
        const bool needless = surplus.distance[k] < surplus_loss.distance * goal.tolerance && surplus.angle[k] < surplus_loss.angle;
        tree.nearest(positions[k], 9, found);
        float nearest = 1e30f, third = 1e30f;
        int same = 0;
        bool neighbour_gone = false;
        for (const auto& f : found) {
            if (f.vertex == k || glm::dot(sweep.points[f.vertex].normal, sweep.points[k].normal) < 0.3f) continue;
            neighbour_gone |= gone[f.vertex];
            if (gone[f.vertex]) continue;
            const float d = std::sqrt(f.distance2);
            if (++same == 1) nearest = d;
            if (same == 3) third = d;
        }
        const float edge = window.frames[size_t(sample)]->edge;
        const bool crowded = nearest < 0.4f * edge || (same >= 3 && nearest < too_near * third);
        if (!crowded && (!needless || neighbour_gone || third > widest_spacing(goal, edge))) continue;
        gone[k] = true;
        end(path, sample, crowded ? Death::crowded : Death::surplus);
    }
}

float spacing_at(const std::vector<SurfacePoint>& points, const VertexTree& tree, const SurfacePoint& p, float most) {
    thread_local std::vector<VertexTree::Found> found;
    tree.nearest(p.position, 8, found);
    int same = 0;
    for (const auto& f : found)
        if (glm::dot(points[f.vertex].normal, p.normal) > 0.3f && ++same == 4) return std::min(most, std::sqrt(f.distance2));
    return most;
}

/// Bears tracks where the frame misses the source; returns how many.
size_t bear_tracks(Window& window, int sample, const Residual& residual, const std::vector<SurfacePoint>& points,
                   const WindowGoal& goal) {
    const SurfaceFrame& frame = *window.frames[size_t(sample)];
    const std::vector<SurfacePoint> births = choose_births(frame, residual, points, missed_by * goal.tolerance, goal.tolerance);
    std::vector<SurfacePoint> all = points;
    all.insert(all.end(), births.begin(), births.end());
    std::vector<glm::vec3> positions;
    for (const SurfacePoint& p : all) positions.push_back(p.position);
    const VertexTree tree(positions);
    std::vector<Path> paths(births.size());
    parallel_for(births.size(), goal.jobs, [&](size_t i) {
        SurfacePoint p = births[i];
        const float radius = std::max(1.6f * frame.edge, 0.7f * spacing_at(all, tree, p, 8 * frame.edge));
        if (settle(frame, radius, p)) paths[i] = Path::born(p, radius, sample);
    });
    const size_t before = window.paths.size();
    for (Path& path : paths)
        if (!path.at.empty()) window.paths.push_back(std::move(path));
    return window.paths.size() - before;
}

/// Corrections and births at one frame until little is missed.
void fill_frame(Window& window, int sample, const WindowGoal& goal) {
    const SurfaceFrame& frame = *window.frames[size_t(sample)];
    // What a round leaves is the next frame's to mend, unless there was much.
    const size_t enough = alive_at(window, sample).ids.empty() ? 100 : 6;
    bool last = false;
    for (int round = 0;; ++round) {
        Sweep sweep = alive_at(window, sample);
        Residual residual = measure_residual(frame, sweep.points, goal.jobs);
        correct_paths(frame, residual, sweep.points, sweep.ids, sample, credible * goal.tolerance, window.paths, goal.jobs);
        if (last) break;
        sweep = alive_at(window, sample);
        residual = measure_residual(frame, sweep.points, goal.jobs);
        if (round == 0) mark_spurs(frame, sweep.points, spur_beyond * goal.tolerance, residual, goal.jobs);
        const size_t born = bear_tracks(window, sample, residual, sweep.points, goal);
        last = born * enough <= sweep.points.size() || round + 1 == most_rounds;
        if (born == 0) break;
    }
}

/// The points of a frame as coded, and the tracks from `first` on, which are not coded yet.
Sweep mended_at(const Window& window, const CodedWindow& coded, size_t first, int sample) {
    Sweep sweep;
    sweep.points = decoded_points(coded.decoded, sample, &sweep.ids);
    for (size_t i = first; i < window.paths.size(); ++i)
        if (window.paths[i].alive(sample)) sweep.ids.push_back(uint32_t(i)), sweep.points.push_back(window.paths[i].target(sample));
    return sweep;
}

/// Births where coding has lost what the points meant: rims and thin liquid that a small shift tears.
/// `changed`: the samples to look at (others have been found whole, or beyond mending); afterwards those with a new path.
/// `depth`, where wanted: of the samples looked at, of the surface as it was.
void mend(Window& window, const CodedWindow& coded, const WindowGoal& goal, std::vector<bool>& changed, std::vector<float>* depth = nullptr) {
    const size_t first = window.paths.size();
    const auto grown_at = [&](int s) {
        return std::any_of(window.paths.begin() + ptrdiff_t(first), window.paths.end(), [&](const Path& path) { return path.alive(s); });
    };
    // At a border with the window before, too: births there come at once, where the surface is that window's, mended, anyway.
    for (int s = 0; s < window.samples(); ++s) {
        if (s > 0) {
            carry_on(window, s, goal.jobs, first);
            thin_out(window, s, goal, mended_at(window, coded, first, s), first);
        }
        if (!changed[size_t(s)] && !grown_at(s)) continue;
        const SurfaceFrame& frame = *window.frames[size_t(s)];
        const std::vector<SurfacePoint> points = mended_at(window, coded, first, s).points;
        const Mesh decoded = mesh_points(points, frame.edge, goal.jobs, frame.mesh.positions.size());
        if (depth) (*depth)[size_t(s)] = mean_depth(frame, decoded, goal.container, goal.jobs) * float(points.size()) / (float(points.size()) + few_points);
        for (Path& path : repair_surface(frame, s, points, decoded, repair_beyond * goal.tolerance, goal.jobs))
            window.paths.push_back(std::move(path));
    }
    for (int s = 0; s < window.samples(); ++s) changed[size_t(s)] = grown_at(s);
}

/// Corrections in all frames, against what the tracks decode to.
void correct_window(Window& window, const CodedWindow& coded, const WindowGoal& goal, const SurfaceAim& aim) {
    parallel_for(window.frames.size(), goal.jobs, [&](size_t s) {
        const SurfaceFrame& frame = *window.frames[s];
        std::vector<uint32_t> ids;
        const std::vector<SurfacePoint> points = decoded_points(coded.decoded, int(s), &ids);
        Residual residual = measure_residual(frame, points);
        aim_at(aim, int(s), frame, goal.container, residual.distance);
        correct_paths(frame, residual, points, ids, int(s), credible * goal.tolerance, window.paths);
    });
}

/// Takes out tracks of few frames that their neighbours nearly make up for in each of them: the least missed first, and of
/// neighbours only one. What comes from the window before stays: it would be missed at the border.
void drop_fleeting(Window& window, CodedWindow& coded, const WindowGoal& goal) {
    const size_t count = window.paths.size();
    const auto brief = [&](uint32_t id) { return window.paths[id].at.size() <= fleeting && !window.paths[id].continues; };
    std::vector<float> missed(count, 0.f);  // tolerances
    std::vector<std::vector<uint32_t>> beside(count);
    std::vector<VertexTree::Found> found;
    for (int s = 0; s < window.samples(); ++s) {
        const Sweep sweep = alive_at(window, s);
        const Surplus surplus = measure_surplus(sweep.points, goal.jobs);
        std::vector<glm::vec3> positions;
        for (const SurfacePoint& p : sweep.points) positions.push_back(p.position);
        const VertexTree tree(positions);
        for (size_t k = 0; k < sweep.ids.size(); ++k) {
            const uint32_t id = sweep.ids[k];
            if (!brief(id)) continue;
            tree.nearest(positions[k], 9, found);
            const float reach = widest_spacing(goal, window.frames[size_t(s)]->edge);
            int near = 0;
            for (const auto& f : found) {
                if (f.vertex == k || glm::dot(sweep.points[f.vertex].normal, sweep.points[k].normal) < 0.3f) continue;
                beside[id].push_back(sweep.ids[f.vertex]);
                near += f.distance2 < reach * reach;
            }
            const bool replaceable = near >= 3 && surplus.angle[k] < fleeting_loss.angle;
            missed[id] = std::max(missed[id], replaceable ? surplus.distance[k] / goal.tolerance : missing);
        }
    }
    std::vector<uint32_t> order;
    for (uint32_t i = 0; i < count; ++i)
        if (brief(i) && missed[i] < fleeting_loss.distance) order.push_back(i);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return missed[a] < missed[b]; });
    std::vector<bool> gone(count, false);
    for (uint32_t i : order) gone[i] = std::none_of(beside[i].begin(), beside[i].end(), [&](uint32_t j) { return gone[j]; });
    const auto take_out = [&](auto& of_tracks) {
        size_t kept = 0;
        for (size_t i = 0; i < count; ++i)
            if (!gone[i]) std::swap(of_tracks[kept++], of_tracks[i]);
        of_tracks.resize(kept);
    };
    take_out(window.paths), take_out(coded.tracks), take_out(coded.decoded);
}

/// Lives whose first or last samples coding has taken off the surface end sooner: one such point opens a void that no birth
/// beside it closes. Which: their coefficients are those of longer lives.
std::vector<uint32_t> trim_strays(Window& window, const CodedWindow& coded, const WindowGoal& goal) {
    std::vector<uint32_t> trimmed;
    for (uint32_t i = 0; i < window.paths.size(); ++i) {
        Path& path = window.paths[i];
        const int birth = path.birth, death = path.death;
        const auto stray = [&](int s) {
            return !window.frames[size_t(s)]->index.within(coded.decoded[i].position[size_t(s - birth)], stray_beyond * goal.tolerance);
        };
        const bool leaves = death == window.samples() - 1;
        while (!path.continues && path.birth < path.death && stray(path.birth)) ++path.birth;
        while (!leaves && path.birth < path.death && stray(path.death)) --path.death;
        if (path.birth == birth && path.death == death) continue;
        const auto keep = [&](auto& of_samples) {
            of_samples.erase(of_samples.begin() + (path.death + 1 - birth), of_samples.end());
            of_samples.erase(of_samples.begin(), of_samples.begin() + (path.birth - birth));
        };
        keep(path.at), keep(path.correction), keep(path.tilt);
        trimmed.push_back(i);
    }
    return trimmed;
}

/// Of every sample: those taken out of its mesh, what coded points do not show, and the necks and fingers that they do not.
std::vector<std::vector<Drop>> drops_of(const Window& window, const CodedWindow& coded, const WindowGoal& goal) {
    std::vector<std::vector<Drop>> drops(window.frames.size());
    parallel_for(drops.size(), goal.jobs, [&](size_t s) {
        const SurfaceFrame& frame = *window.frames[s];
        const DecodedFrame decoded(frame, decoded_points(coded.decoded, int(s)));
        const auto add = [&](const std::vector<Drop>& more) { drops[s].insert(drops[s].end(), more.begin(), more.end()); };
        add(frame.drops);
        add(lost_drops(frame, decoded, repair_beyond * goal.tolerance, goal.tolerance));
        add(neck_drops(frame, decoded));
        add(spur_drops(frame, decoded, drops[s]));
    });
    return drops;
}

/// Velocity of the liquid past a track, which goes through these positions: its mean, and the straight line over the life that its changes
/// from sample to sample are nearest to.
void measure_slip(const Window& window, const Path& path, const std::vector<glm::vec3>& positions, TrackSamples& out) {
    out.slip = out.slip_change = glm::vec3(0);
    for (const SurfacePoint& p : path.at) out.slip += p.velocity / float(path.at.size());
    if (path.death == path.birth) return;
    const auto seconds = [&](int from, int to) { return float(window.seconds[size_t(to)] - window.seconds[size_t(from)]); };
    out.slip -= (positions.back() - positions.front()) / seconds(path.birth, path.death);
    glm::vec3 changes(0);
    float squares = 0;
    for (size_t k = 0; k + 1 < path.at.size(); ++k) {
        const int sample = path.birth + int(k);
        const glm::vec3 point = (positions[k + 1] - positions[k]) / seconds(sample, sample + 1);
        const float place = float(2 * k + 1) / float(path.at.size() - 1) - 1;
        changes += place * (0.5f * (path.at[k].velocity + path.at[k + 1].velocity) - point), squares += place * place;
    }
    if (squares > 0) out.slip_change = changes / squares;
}

TrackSamples samples_of(const Window& window, const Path& path) {
    TrackSamples samples;
    samples.birth = uint8_t(path.birth), samples.death = uint8_t(path.death);
    const bool enters = path.birth == 0 && (path.continues || window.opens_span);
    const bool leaves = path.death == window.samples() - 1;
    samples.flags = uint8_t((enters ? 0 : format::track_born) | (leaves ? 0 : format::track_dies));
    for (int s = path.birth; s <= path.death; ++s) {
        const SurfacePoint p = path.target(s);
        samples.position.push_back(p.position), samples.normal.push_back(p.normal);
    }
    measure_slip(window, path, samples.position, samples);
    return samples;
}

/// Step of slip: fine against how fast the liquid is.
float slip_step_of(const Window& window) {
    constexpr double share = 0.35;  // of the mean speed
    double sum = 0, count = 0;
    for (const Path& path : window.paths)
        for (const SurfacePoint& p : path.at) sum += glm::length(p.velocity), ++count;
    return count > 0 ? float(share * sum / count) : 0;
}

/// Points that go with the liquid need no slip, unless coding took much of their way along the surface, which no error tells of: of slow
/// waves nearly all. Then slip makes up for it: the velocity of rolling waves (tests/test_cut.cpp) is 23° off, not 67. Where slip is kept in
/// any case, the same past coded as past true motion to .2°.
void make_up_by_slip(const Window& window, CodedWindow& coded, const WindowGoal& goal, const format::BasisTables& tables) {
    constexpr double much = 0.35;  // of the mean speed, as slip's step
    std::vector<TrackSamples> slips(window.paths.size());
    double sum = 0, speeds = 0;
    for (size_t i = 0; i < slips.size(); ++i) {
        const Path& path = window.paths[i];
        const glm::vec3 normal = coded.decoded[i].normal[coded.decoded[i].normal.size() / 2];
        measure_slip(window, path, coded.decoded[i].position, slips[i]);
        const glm::vec3 slip = slips[i].slip;
        sum += double(path.at.size()) * glm::length(slip - glm::dot(slip, normal) * normal);
        for (const SurfacePoint& p : path.at) speeds += glm::length(p.velocity);
    }
    if (!(sum > much * speeds)) return;
    coded.quantiser.slip_step = slip_step_of(window);
    parallel_for(slips.size(), goal.jobs, [&](size_t i) {
        set_slip(coded.tracks[i], slips[i], coded.quantiser, goal.origin);
        coded.decoded[i] = dequantise_track(coded.tracks[i], coded.quantiser, goal.origin, tables);
    });
}

/// Where the corrected surface is under x, along the axis.
float project(const Window& window, const Path& path, int sample, const glm::vec3& x, const glm::vec3& axis) {
    const size_t k = size_t(sample - path.birth);
    SurfacePoint p{x, path.at[k].normal, {}};
    // The slack may have lifted x off the surface: come back first, then fit.
    p.position -= p.normal * glm::dot(x - path.at[k].position, p.normal);
    if (!settle(*window.frames[size_t(sample)], path.radius, p)) return NAN;
    const float along = glm::dot(p.normal, axis);
    return along < 0.3f ? NAN : (glm::dot(p.normal, p.position - x) + path.correction[k]) / along;
}

}  // namespace

std::vector<float> seam_of(const Window& window, const WindowGoal& goal) {
    if (window.before.empty()) return {};
    std::vector<float> seam = measure_residual(*window.frames[0], window.before, goal.jobs).distance;
    for (float& distance : seam) distance = std::abs(distance) < credible * goal.tolerance ? -seam_share * distance : 0;
    return seam;
}

void aim_at(const SurfaceAim& aim, int sample, const SurfaceFrame& frame, const surface::Container& container, std::vector<float>& distance) {
    const float offset = aim.offset[size_t(sample)];
    const bool at_seam = sample == 0 && !aim.seam.empty();
    for (size_t v = 0; v < distance.size(); ++v)
        if (is_inside(frame.mesh.positions[v], container)) distance[v] += at_seam ? offset + aim.seam[v] : offset;
}

void grow_tracks(Window& window, const std::vector<Path>& survivors, const WindowGoal& goal) {
    window.paths = survivors;
    for (int s = 0; s < window.samples(); ++s) {
        if (s > 0) {
            carry_on(window, s, goal.jobs);
            thin_out(window, s, goal, alive_at(window, s));
        }
        if (s > 0 || survivors.empty()) fill_frame(window, s, goal);
    }
    std::erase_if(window.paths, [](const Path& path) { return path.at.empty(); });
}

CodedWindow code_tracks(Window& window, const WindowGoal& goal, const format::BasisTables& tables) {
    CodedWindow coded;
    coded.quantiser = goal.quantiser;
    if (window.slips && !window.calm) coded.quantiser.slip_step = slip_step_of(window);
    const auto code = [&](const std::vector<uint32_t>& ids) {
        coded.tracks.resize(window.paths.size()), coded.decoded.resize(window.paths.size());
        parallel_for(ids.size(), goal.jobs, [&](size_t k) {
            const size_t i = ids[k];
            const Path& path = window.paths[i];
            coded.tracks[i] = quantise_track(samples_of(window, path), coded.quantiser, goal.origin, tables,
                                             [&](uint32_t sample, const glm::vec3& x, const glm::vec3& axis) {
                                                 return project(window, path, path.birth + int(sample), x, axis);
                                             });
            coded.decoded[i] = dequantise_track(coded.tracks[i], coded.quantiser, goal.origin, tables);
        });
    };
    const auto code_from = [&](size_t first) {
        std::vector<uint32_t> ids(window.paths.size() - first);
        std::iota(ids.begin(), ids.end(), uint32_t(first));
        code(ids);
    };
    code_from(0);
    const size_t grown = window.paths.size();
    std::vector<bool> changed(window.frames.size(), true);
    std::vector<float> depth(window.frames.size(), 0.f);
    SurfaceAim aim{depth, seam_of(window, goal)};
    // What is aimed at goes as far outside the source as the surface came to lie inside it.
    const auto lift = [&] {
        for (size_t s = 0; s < depth.size(); ++s) {
            const float most = std::max(most_offset * goal.tolerance, least_most_offset * window.frames[s]->edge);
            aim.offset[s] = std::clamp(aim.offset[s] + depth[s], -most, most);
        }
    };
    mend(window, coded, goal, changed, &depth);
    lift();
    code_from(grown);
    drop_fleeting(window, coded, goal);
    correct_window(window, coded, goal, aim);
    code_from(0);
    refit_tracks(window, coded, goal, tables, aim);
    for (int round = 0; round < trimmings; ++round) code(trim_strays(window, coded, goal));
    // What was left out may have torn a tip or a rim, and now and then a correction spoils a frame; and births tear, too.
    changed.assign(window.frames.size(), true);
    for (int round = 0; round < last_mendings; ++round) {
        const size_t mended = window.paths.size();
        mend(window, coded, goal, changed, round == 0 ? &depth : nullptr);
        code_from(mended);
        if (round > 0) continue;
        lift();
        // Births change what is around them; and whatever this tears is mended by the next round.
        refit_tracks(window, coded, goal, tables, aim);
        changed.assign(window.frames.size(), true);
    }
    refit_volume(window, coded, goal, tables);
    if (window.slips && window.calm) make_up_by_slip(window, coded, goal, tables);
    for (const TrackSamples& drop : track_drops(window, drops_of(window, coded, goal))) {
        coded.tracks.push_back(quantise_track(drop, coded.quantiser, goal.origin, tables));
        coded.decoded.push_back(dequantise_track(coded.tracks.back(), coded.quantiser, goal.origin, tables));
    }
    return coded;
}

std::vector<Path> survivors_of(const Window& window) {
    std::vector<Path> survivors;
    for (const Path& path : window.paths) {
        if (path.death != window.samples() - 1) continue;
        Path last;
        last.radius = path.radius, last.continues = true;
        last.age = path.age + path.death - path.birth;
        last.at = {path.at.back()}, last.correction = {path.correction.back()}, last.tilt = {path.tilt.back()};
        survivors.push_back(std::move(last));
    }
    return survivors;
}

std::vector<SurfacePoint> decoded_points(const std::vector<TrackSamples>& decoded, int sample, std::vector<uint32_t>* ids,
                                         const std::vector<bool>* only) {
    std::vector<SurfacePoint> points;
    for (uint32_t i = 0; i < decoded.size(); ++i) {
        const TrackSamples& track = decoded[i];
        if (sample < track.birth || sample > track.death || track.drop || (only && !(*only)[i])) continue;
        const size_t k = size_t(sample - track.birth);
        points.push_back({track.position[k], track.normal[k], {}});
        if (ids) ids->push_back(i);
    }
    return points;
}

}  // namespace rill::cooker
