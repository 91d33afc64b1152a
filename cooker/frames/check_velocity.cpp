// SPDX-License-Identifier: MIT
#include "frames/check_velocity.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "measure/surface_distance.h"

namespace rill::cooker {
namespace {

constexpr double clearly = 0.7, clearly_far = 0.4;
constexpr size_t most_pairs = 4, most_samples = 400, fewest_samples = 50, most_apart = 16;  // apart: frames

/// Vertices that moved across the surface of the neighbouring frame, from where and how fast.
struct Moved {
    std::vector<glm::vec3> position, velocity;
    double seconds = 0;       ///< to the neighbour; negative: it lies before
    float cap = 0;            ///< distances count no more than this
    double still = 0;
    size_t resting = 0;       ///< others whose surface moved, and their velocity is 0
    const SurfaceIndex* neighbour = nullptr;

    double miss(double factor) const {
        double sum = 0;
        for (size_t i = 0; i < position.size(); ++i) {
            const glm::vec3 x = position[i] + float(factor * seconds) * velocity[i];
            sum += std::min(neighbour->closest(x, cap).distance, cap);
        }
        return sum;
    }
};

Moved moved(const Mesh& mesh, const SurfaceIndex& neighbour, double seconds) {
    Moved result;
    result.seconds = seconds, result.neighbour = &neighbour;
    const float edge = median_edge(mesh);
    const size_t tried = std::min<size_t>(mesh.velocities.size(), 20 * most_samples);
    struct Candidate {
        size_t vertex;
        float distance;
    };
    std::vector<Candidate> candidates;  // what stays where it is tells nothing
    for (size_t i = 0; i < tried; ++i) {
        const size_t v = mesh.velocities.size() * i / tried;
        const float distance = neighbour.closest(mesh.positions[v], 50 * edge).distance;
        if (!(distance > 0.25f * edge && distance < 50 * edge)) continue;
        if (mesh.velocities[v] != glm::vec3(0)) candidates.push_back({v, distance});
        else ++result.resting;
    }
    const size_t kept = std::min(candidates.size(), most_samples);
    for (size_t i = 0; i < kept; ++i) {
        const Candidate& c = candidates[candidates.size() * i / kept];
        result.position.push_back(mesh.positions[c.vertex]), result.velocity.push_back(mesh.velocities[c.vertex]);
        result.still += c.distance;
    }
    result.cap = kept > 0 ? float(3 * result.still / double(kept)) : 0;
    result.still = result.miss(0);
    return result;
}

/// Mean distance over the mean distance without motion, over all pairs; below 1: the velocity helps.
double share(const std::vector<Moved>& all, double factor) {
    double miss = 0, still = 0;
    for (const Moved& m : all) miss += m.miss(factor), still += m.still;
    return still > 0 ? miss / still : 1;
}

struct Best {
    double factor = 1, share = 1;
};
Best best_factor(const std::vector<Moved>& all) {
    Best best;
    best.share = 2;
    const auto attempt = [&](double factor) {
        if (const double s = share(all, factor); s < best.share) best = {factor, s};
    };
    for (int half_octave = -24; half_octave <= 24; ++half_octave) attempt(std::exp2(0.5 * half_octave));
    for (double sign : {-1.0, -0.5, -2.0}) attempt(sign);
    for (double step : {0.25, 0.125, 0.0625, 0.03, 0.015, 0.0075}) {
        const double middle = best.factor;
        attempt(middle * std::exp2(step)), attempt(middle * std::exp2(-step));
    }
    return best;
}

bool near(double a, double b) { return a / b > 0.72 && a / b < 1.39; }

std::string text(const char* format, double value) {
    char buffer[200];
    std::snprintf(buffer, sizeof buffer, format, value);
    return buffer;
}

/// How many frames long each pair seems to be: 1, unless another length fits it clearly better.
double length_of(const Moved& pair, double factor) {
    const std::vector<Moved> one = {pair};
    const double plain = share(one, factor);
    double best = plain, length = 1;
    for (double tried = 0.25; tried <= 2.5; tried += 0.125)
        if (const double s = share(one, factor * tried); s < best) best = s, length = tried;
    const bool clear = pair.position.size() >= fewest_samples / 2 && best < 0.4 && best < 0.6 * plain && !near(length, 1);
    return clear ? length : 1;
}

/// The factor that somebody could have meant, and the words for it.
double likely(double factor, double rate, double longest, std::string& words) {
    if (near(factor, rate)) {
        words = "it is per frame: --velocity-unit frame";
        return rate;
    }
    if (near(factor, 1 / rate)) {
        words = "it was multiplied by the frame rate";
        return 1 / rate;
    }
    if (near(factor, -1)) {
        words = "its sign is turned round";
        return -1;
    }
    if (const double blender = 6.25 * longest / rate; near(factor, blender))
        words = "it may be Blender's fluid attribute, to be multiplied by 6.25·S/fps; this makes S, the longest side of the domain, " +
                text("%.3g m", factor * rate / 6.25);
    else
        words = "no unit that is known; was the mesh scaled without its velocity?";
    return factor;
}

/// Pairs of frames, evenly spread, with what moved between them.
struct Pairs {
    std::vector<std::unique_ptr<Mesh>> meshes;
    std::vector<std::unique_ptr<SurfaceIndex>> indices;
    std::vector<Moved> forward, backward;
    std::vector<size_t> first;  ///< frame of each
    size_t apart = 1;           ///< frames
    glm::vec3 lower{1e30f}, upper{-1e30f};
    size_t samples = 0, resting = 0;
    double still = 0;  ///< sum over the samples
};
Pairs look_at(const SequenceReader& reader, size_t apart) {
    const SequenceInfo& info = reader.info();
    const size_t starts = info.numbers.size() - apart, count = std::min(most_pairs, starts);
    Pairs pairs;
    pairs.apart = apart;
    for (size_t p = 0; p < count; ++p) {
        const size_t k = starts * (2 * p + 1) / (2 * count);
        for (size_t i : {k, k + apart}) {
            pairs.meshes.push_back(std::make_unique<Mesh>(reader.read(i)));
            pairs.indices.push_back(std::make_unique<SurfaceIndex>(*pairs.meshes.back()));
            for (const glm::vec3& x : pairs.meshes.back()->positions)
                pairs.lower = glm::min(pairs.lower, x), pairs.upper = glm::max(pairs.upper, x);
        }
        const Mesh &a = *pairs.meshes[2 * p], &b = *pairs.meshes[2 * p + 1];
        if (a.triangles.empty() || b.triangles.empty()) continue;
        const double seconds = info.seconds[k + apart] - info.seconds[k];
        pairs.first.push_back(k);
        pairs.forward.push_back(moved(a, *pairs.indices[2 * p + 1], seconds));
        pairs.backward.push_back(moved(b, *pairs.indices[2 * p], -seconds));
    }
    for (const auto* all : {&pairs.forward, &pairs.backward})
        for (const Moved& m : *all) pairs.samples += m.position.size(), pairs.resting += m.resting, pairs.still += m.still;
    return pairs;
}
/// Frames as far apart as it takes for enough to move: at 120 Hz little does from one to the next.
Pairs telling_pairs(const SequenceReader& reader) {
    Pairs pairs = look_at(reader, 1);
    for (size_t apart = 2; pairs.samples < fewest_samples && apart <= most_apart && apart < reader.info().numbers.size(); apart *= 2)
        pairs = look_at(reader, apart);
    return pairs;
}

void warn_of_uneven_times(const SequenceInfo& info, const Pairs& pairs, const std::vector<Moved>& moved, double factor,
                          const std::function<void(const std::string&)>& warn) {
    for (size_t p = 0; p < moved.size(); ++p)
        if (const double length = length_of(moved[p], factor); length != 1) {
            warn(info.path + ": frames are unevenly spaced in time: from frame " + std::to_string(info.numbers[pairs.first[p]]) + " to " +
                 std::to_string(info.numbers[pairs.first[p] + pairs.apart]) + text(" the surface moves as in %.3g of the time stated", length) +
                 (info.format == "FLIP Fluids cache" ? "; keep the cache's logs/ folder, which tells the times" : ""));
            return;
        }
}

}  // namespace

VelocityFit check_velocity(const SequenceReader& reader, const std::function<void(const std::string&)>& warn) {
    const SequenceInfo& info = reader.info();
    VelocityFit fit;
    fit.meaning = info.velocity;
    if (info.velocity == VelocityMeaning::none || info.numbers.size() < 2) return fit;
    const Pairs pairs = telling_pairs(reader);
    if (pairs.samples < fewest_samples) {  // still water: nothing to learn, and nothing to lose
        if (warn && pairs.resting >= 4 * fewest_samples)
            warn(info.path + ": velocities are 0 where the surface moves; wrong attribute? try --velocity NAME or --velocity estimate");
        return fit;
    }
    const Best ahead = best_factor(pairs.forward), back = best_factor(pairs.backward);
    // What the source states is right unless the frames say clearly otherwise; a long way hardly tells directions apart.
    const bool forward = info.velocity == VelocityMeaning::forward || (info.velocity == VelocityMeaning::unknown && pairs.apart > 1);
    const double ahead_share = ahead.share * (forward ? clearly : 1);
    const double back_share = back.share * (info.velocity == VelocityMeaning::backward ? clearly : 1);
    const bool is_back = back_share < ahead_share;
    const Best best = is_back ? back : ahead;
    const VelocityMeaning measured = is_back ? VelocityMeaning::backward : VelocityMeaning::forward;
    const std::vector<Moved>& moved = is_back ? pairs.backward : pairs.forward;
    const double plain = share(moved, 1);
    fit.still = pairs.still / double(pairs.samples), fit.as_stored = plain * fit.still;
    fit.carried = fit.as_stored;
    const bool doubtful = pairs.apart > 1 && best.share > clearly_far;  // slow ripples turn about on so long a way
    if (doubtful) return fit;
    fit.conclusive = best.share < 0.8;
    if (!fit.conclusive) {
        if (warn)
            warn(info.path + ": the velocity does not carry the surface to the next frame (" + text("%.3g", fit.still * 1000) +
                 " mm off without it, at best " + text("%.3g mm with any factor); wrong attribute? try --velocity NAME or --velocity estimate", best.share * fit.still * 1000));
        if (fit.meaning == VelocityMeaning::unknown) fit.meaning = VelocityMeaning::forward;
        return fit;
    }
    fit.meaning = measured;
    // A factor that is nearly 1 is 1: free fall between frames, solver walls and noise bend the fit.
    const bool fits = near(best.factor, 1) || plain < best.share + 0.1;
    std::string words;
    const glm::vec3 size = pairs.upper - pairs.lower;
    if (!fits) fit.factor = likely(best.factor, info.frames_per_second, std::max({size.x, size.y, size.z}), words);
    if (!fits) fit.carried = best.share * fit.still;
    if (!fits && warn)
        warn(info.path + ": the velocity fits when multiplied by " + text("%.4g", fit.factor) + " (" + text("%.3g mm", fit.carried * 1000) +
             " off instead of " + text("%.3g", fit.as_stored * 1000) + "): " + words);
    if (warn) warn_of_uneven_times(info, pairs, moved, fit.factor, warn);
    return fit;
}

namespace {
class Fitted : public SequenceReader {
public:
    Fitted(std::unique_ptr<SequenceReader> source, const VelocityFit& fit) : source_(std::move(source)), info_(source_->info()), factor_(float(fit.factor)) {
        info_.velocity = fit.meaning;
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return source_->name(index); }
    std::vector<std::filesystem::path> files(size_t index) const override { return source_->files(index); }
    Mesh read_surface(size_t index) const override { return source_->read_surface(index); }
    Mesh read(size_t index) const override {
        Mesh mesh = source_->read(index);
        if (factor_ != 1)
            for (glm::vec3& v : mesh.velocities) v *= factor_;
        return mesh;
    }

private:
    std::unique_ptr<SequenceReader> source_;
    SequenceInfo info_;
    float factor_;
};
}  // namespace

std::unique_ptr<SequenceReader> apply_fit(std::unique_ptr<SequenceReader> reader, const VelocityFit& fit) {
    return std::make_unique<Fitted>(std::move(reader), fit);
}

}  // namespace rill::cooker
