// SPDX-License-Identifier: MIT
// Quantised tracks → chunk bytes, losslessly. The model of the bits is runtime/format/chunk_model.h.
//
// Measured on tracks of drop_splash (calm, crown) and dam_break, 25-sample windows, 2400–4200 tracks of all lives,
// step .05 % of the diagonal and 1.7° unless said otherwise; bytes per track, one chunk / eight chunks:
//   first model                                                     14.70 / 16.89
//   mixer starts at .3 instead of .4 an input, learns faster        14.66 / 16.74
//   nine bins a value instead of fourteen (24 kB less state)        14.66 / 16.74
//   statistics learned from other sequences (not used)              14.58 / 16.31
// and at step .08 %, 2.6°, tolerances of one step:
//   as above, coefficient steps .75 · step · √n instead of .5       11.76 / 13.68
//   straight part predicted across lives of different length        11.71 / 13.62
//   128 instead of 64 tracks searched for neighbours                11.66 / 13.56
//   four or five neighbours instead of three (not used)             11.82 / 13.76
// Tolerances of one step instead of four, at equal rms error: −20 % of all position bits; the basis chosen by
// rate + distortion instead of by tolerance alone: −2.5 %.
#include "asset/layers_to_chunks.h"

#include <algorithm>
#include <memory>

#include "asset/entropy_encoder.h"
#include "asset/lattice_tracks.h"
#include "common/mesh.h"
#include "format/chunk_model.h"

namespace rill::cooker {
namespace {

using format::RawTrack;
using Model = format::ChunkModel<RangeEncoder>;

struct Set {
    std::vector<RawTrack> tracks;  ///< in the order of the k-d tree
    int32_t low[3] = {0, 0, 0};
    uint8_t bits[3] = {0, 0, 0};
};

/// All that is stored of a track, in a fixed order: makes the result independent of the order given.
bool stored_before(const RawTrack& a, const RawTrack& b) {
    const auto key = [](const RawTrack& t) {
        std::vector<int32_t> k = {t.birth,        t.death,   t.flags,  t.position_terms,
                                  t.second_terms, t.axis[0], t.axis[1]};
        for (uint32_t i = 0; i < t.position_terms; ++i) k.insert(k.end(), t.position[i], t.position[i] + 3);
        for (uint32_t i = 0; i < t.second_terms; ++i) k.insert(k.end(), t.second[i], t.second[i] + 6);
        k.insert(k.end(), t.slip, t.slip + 2), k.insert(k.end(), t.slip_change, t.slip_change + 2);
        return k;
    };
    return key(a) < key(b);
}

/// Sorts [first, last) as the decoder's tree will walk it: halves along the largest dimension, lower first.
void sort_like_tree(std::vector<RawTrack>& tracks, size_t first, size_t last, const int32_t* low,
                    const uint8_t* bits) {
    if (last - first < 2) return;
    int d = 0;
    for (int c = 1; c < 3; ++c)
        if (bits[c] > bits[d]) d = c;
    const auto begin = tracks.begin() + long(first), end = tracks.begin() + long(last);
    if (bits[d] == 0) {
        std::sort(begin, end, stored_before);
        return;
    }
    int32_t upper[3] = {low[0], low[1], low[2]};
    upper[d] += 1 << (bits[d] - 1);
    uint8_t less[3] = {bits[0], bits[1], bits[2]};
    --less[d];
    const auto middle =
        std::partition(begin, end, [&](const RawTrack& t) { return t.lattice[d] < upper[d]; });
    const size_t split = size_t(middle - tracks.begin());
    sort_like_tree(tracks, first, split, low, less);
    sort_like_tree(tracks, split, last, upper, less);
}

Set make_set(const std::vector<QuantisedTrack>& tracks, bool drops, const format::LatticeSteps& steps) {
    Set set;
    for (const QuantisedTrack& track : tracks)
        if (track.drop == drops) set.tracks.push_back(raw_track(track));
    if (set.tracks.empty()) return set;
    for (int c = 0; c < 3; ++c) {
        int32_t high = set.low[c] = set.tracks[0].lattice[c];
        for (const RawTrack& t : set.tracks) {
            set.low[c] = std::min(set.low[c], t.lattice[c]);
            high = std::max(high, t.lattice[c]);
        }
        while (int64_t(set.low[c]) + (int64_t(1) << set.bits[c]) <= high) ++set.bits[c];
        const int64_t reach = format::max_mean / steps.ratio;
        if (set.low[c] < -reach || set.low[c] + (int64_t(1) << set.bits[c]) > reach)
            throw InputError("chunk: positions are too far from the origin for this quantiser step");
    }
    sort_like_tree(set.tracks, 0, set.tracks.size(), set.low, set.bits);
    return set;
}

}  // namespace

EncodedChunk encode_chunk(const std::vector<QuantisedTrack>& tracks, const Quantiser& quantiser,
                          const glm::vec3& origin, uint32_t window_samples,
                          const std::vector<uint8_t>& model_bytes) {
    if (!model_bytes.empty())
        throw InputError("chunk: this version knows no entropy model but the built-in one");
    const format::LatticeSteps steps = lattice_steps(quantiser, origin);
    const Set sets[2] = {make_set(tracks, false, steps), make_set(tracks, true, steps)};

    EncodedChunk out;
    out.shape.sample_count = window_samples, out.shape.steps = steps;
    out.shape.point_count = uint32_t(sets[0].tracks.size());
    out.shape.drop_count = uint32_t(sets[1].tracks.size());
    for (int s = 0; s < 2; ++s)
        for (const RawTrack& t : sets[s].tracks) {
            if (t.death >= window_samples) throw InputError("chunk: a track outlives its window");
            out.shape.coefficient_count += format::coefficients_of(t, s == 1);
        }
    std::vector<format::Track> records(tracks.size());
    std::vector<float> coefficients(out.shape.coefficient_count);
    format::TrackBlock block{};
    block.point_count = out.shape.point_count, block.drop_count = out.shape.drop_count;
    block.coefficient_count = out.shape.coefficient_count;
    block.tracks = records.data(), block.coefficients = coefficients.data();

    double spent[format::bit_categories] = {};
    RangeEncoder coder(out.bytes, spent);
    const auto learned = std::make_unique<format::Statistics>(format::first_statistics);
    const auto model = std::make_unique<Model>(coder, steps, window_samples, *learned, block);
    for (int s = 0; s < 2; ++s) {
        const Set& set = sets[s];
        if (set.tracks.empty()) continue;
        for (int c = 0; c < 3; ++c) {
            model->number(set.low[c]);
            model->raw(5, set.bits[c]);
        }
        const auto source = [&](uint32_t i) { return &set.tracks[i]; };
        if (!model->code_set(s == 1, s ? block.point_count : 0, uint32_t(set.tracks.size()), set.low,
                             set.bits, source))
            throw InputError(std::string("chunk: cannot be coded: ") + model->reason);
    }
    coder.finish();
    out.bits = {spent[format::bits_structure], spent[format::bits_births] + spent[format::bits_first], spent[format::bits_motion],
                spent[format::bits_normals], spent[format::bits_slip], spent[format::bits_drops]};
    return out;
}

}  // namespace rill::cooker
