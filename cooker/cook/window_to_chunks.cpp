// SPDX-License-Identifier: MIT
#include "cook/window_to_chunks.h"

#include <algorithm>
#include <cmath>

#include "common/parallel.h"
#include "format/lattice.h"

namespace rill::cooker {
namespace {

constexpr uint32_t most_tracks_per_block = 3000;
// Samples of a life whose slip may be its neighbours', as long as such lives carry no more than this share of the surface, over time:
// where most are that brief, each copies what the one before copied. Bytes of dam_break and pour_sphere −1.2 %, the direction of
// velocities .7 and .8° worse. However far the neighbours are off: −1.8 %, 1°. Up to eight samples: −1.6 and −1.8 %.
constexpr int most_brief = 5;
constexpr double most_brief_share = 0.25;

void add(ChunkBits& sum, const ChunkBits& more) {
    sum.structure += more.structure, sum.births += more.births, sum.motion += more.motion;
    sum.normals += more.normals, sum.slip += more.slip, sum.drops += more.drops;
}

bool is_brief(const QuantisedTrack& track) { return track.death - track.birth < most_brief; }
bool few_are_brief(const std::vector<QuantisedTrack>& tracks) {
    double brief = 0, all = 0;  // samples
    for (const QuantisedTrack& track : tracks) {
        const int life = track.death - track.birth + 1;
        all += life, brief += is_brief(track) ? life : 0;
    }
    return brief <= most_brief_share * all;
}

/// How far a track still goes where its life ends, until it has faded: a step at most.
glm::vec3 beyond_end(const TrackSamples& track, size_t k) {
    const std::vector<glm::vec3>& at = track.position;
    if (at.size() == 1) return track.drift;
    const float steps = track.drop ? 1.f : 0.5f;
    if (k == 0) return steps * (at[0] - at[1]);
    return k + 1 == at.size() ? steps * (at[k] - at[k - 1]) : glm::vec3(0);
}

/// Bounds of what the tracks of a chunk carry, over the window: points widened by the reach of their patches, drops by themselves.
void bound(ChunkToWrite& chunk, const std::vector<const TrackSamples*>& tracks, float around) {
    chunk.lower = glm::vec3(1e30f), chunk.upper = glm::vec3(-1e30f);
    for (const TrackSamples* track : tracks)
        for (size_t k = 0; k < track->position.size(); ++k) {
            const glm::vec3& p = track->position[k];
            float wide = around;
            if (track->drop) {
                const auto& s = track->shape[k];
                wide = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
            }
            const glm::vec3 reach = wide + glm::abs(beyond_end(*track, k));
            chunk.lower = glm::min(chunk.lower, p - reach), chunk.upper = glm::max(chunk.upper, p + reach);
        }
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

}  // namespace

void write_window(AssetWriter& writer, uint32_t first_sample, const Window& window, const CodedWindow& coded, const WindowGoal& goal,
                  uint32_t layers, bool ends_span, SpanResult& account) {
    std::vector<float> cost;
    for (const QuantisedTrack& track : coded.tracks) cost.push_back(rough_bits(track));
    const Layers layered = assign_layers(window, coded.decoded, cost, layers, goal.jobs);
    uint32_t block_count = 0;
    const std::vector<uint32_t> block = assign_blocks(coded.decoded, most_tracks_per_block, block_count);
    const bool leave_slip = few_are_brief(coded.tracks);
    std::vector<ChunkToWrite> chunks(size_t(layers) * block_count);
    parallel_for(chunks.size(), goal.jobs, [&](size_t c) {
        ChunkToWrite& chunk = chunks[c];
        chunk.layer = uint32_t(c) / block_count, chunk.block = uint32_t(c) % block_count;
        std::vector<QuantisedTrack> tracks;
        std::vector<const TrackSamples*> decoded;
        for (size_t i = 0; i < block.size(); ++i)
            if (layered.layer[i] == chunk.layer && block[i] == chunk.block)
                tracks.push_back(coded.tracks[i]), decoded.push_back(&coded.decoded[i]);
        if (tracks.empty()) return;
        for (QuantisedTrack& track : tracks)
            if (leave_slip && is_brief(track)) track.flags |= format::track_slips_along;
        const LayerError& error = layered.error[chunk.layer];
        chunk.spacing = error.spacing, chunk.error_mean = error.mean, chunk.error_p99 = error.p99;
        bound(chunk, decoded, 1.5f * error.spacing);
        chunk.encoded = encode_chunk(tracks, coded.quantiser, goal.origin, uint32_t(window.samples()), {});
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
}  // namespace rill::cooker
