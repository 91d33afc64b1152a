// SPDX-License-Identifier: MIT
// Tracks to code, and what is decoded of them as numbers that compare.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "asset/layers_to_chunks.h"
#include "basis_tables.h"
#include "format/lattice.h"

using namespace rill;
using namespace rill::cooker;


inline constexpr uint32_t window = 25;
inline double scale_of(uint32_t life) { return std::pow(8.0 / life, 0.25); }  // of all steps; the format says so in integers
inline const Quantiser quantiser{0.002f, 4.f, 0.035f, 0.004f, 0.06f, 0.05f};
inline const glm::vec3 origin(0.5f, -0.25f, 1.f);

/// A point of a travelling wave, or a drop flying by.
inline TrackSamples make_track(std::mt19937& random, uint32_t birth, uint32_t death, bool drop, float violence = 1) {
    std::uniform_real_distribution<float> unit(-1, 1);
    TrackSamples track;
    track.birth = uint8_t(birth), track.death = uint8_t(death), track.drop = drop;
    if (birth > 0) track.flags |= format::track_born;
    if (death < window - 1) track.flags |= format::track_dies;
    const glm::vec2 start(unit(random), unit(random));
    track.slip = {0.4f * start.y + 0.1f * unit(random), -0.4f * start.x, 0.1f * unit(random)};  // a vortex
    track.slip_change = {0.3f * start.x, 0.2f * start.y + 0.1f * unit(random), 0};  // that speeds up here, slows down there
    const float flip = random() % 4 == 0 ? -1.f : 1.f;  // floors face down
    for (uint32_t s = birth; s <= death; ++s) {
        const float t = s / 24.f * violence;
        const glm::vec2 x = start + 0.1f * t * glm::vec2(1, -0.5f);
        const float phase = 5 * x.x + 3 * x.y + 4 * t;
        const float height = 0.05f * std::sin(phase);
        track.position.push_back(glm::vec3(x, height) + origin);
        const glm::vec2 slope = 0.05f * std::cos(phase) * glm::vec2(5, 3);
        if (drop)
            track.shape.push_back({0.02f, 0.021f, 0.019f, 0.001f * std::sin(9 * t), 0.f, 0.002f});
        else
            track.normal.push_back(flip * glm::normalize(glm::vec3(-slope, 1)));
    }
    return track;
}
inline std::vector<QuantisedTrack> make_tracks(uint32_t points, uint32_t drops, uint32_t seed = 1) {
    std::mt19937 random(seed);
    std::vector<QuantisedTrack> out;
    for (uint32_t i = 0; i < points + drops; ++i) {
        uint32_t birth = random() % 3 ? 0 : random() % window,
                 death = random() % 3 ? window - 1 : random() % window;
        if (birth > death) std::swap(birth, death);
        out.push_back(
            quantise_track(make_track(random, birth, death, i >= points), quantiser, origin, tables()));
    }
    return out;
}

struct Decoded {
    Status status;
    const char* reason = nullptr;
    std::unique_ptr<format::Track[]> tracks;  // exactly sized: a write past the end is seen by the sanitizer
    std::unique_ptr<float[]> coefficients;
    format::TrackBlock block{};
};
inline Decoded decode(const uint8_t* bytes, size_t size, const format::ChunkShape& shape) {
    Decoded d;
    d.tracks.reset(new format::Track[shape.point_count + shape.drop_count]);
    d.coefficients.reset(new float[shape.coefficient_count]);
    d.block.tracks = d.tracks.get(), d.block.coefficients = d.coefficients.get();
    const std::unique_ptr<uint8_t[]> exact(new uint8_t[size]);
    std::copy(bytes, bytes + size, exact.get());
    d.status = format::decode_chunk(exact.get(), size, shape, nullptr, 0, d.block, &d.reason);
    return d;
}
inline EncodedChunk encode(const std::vector<QuantisedTrack>& tracks) {
    return encode_chunk(tracks, quantiser, origin, window, {});
}

/// A track as its decoded numbers: comparable, sortable.
inline std::vector<float> numbers(const format::Track& t, const float* coefficients, bool drop) {
    std::vector<float> out = {float(drop),    float(t.birth),          float(t.death),
                              float(t.flags), float(t.position_terms), float(t.second_terms)};
    const float* at = coefficients + t.first_coefficient;
    if (!drop) out.insert(out.end(), t.slip, t.slip + 3), out.insert(out.end(), t.slip_change, t.slip_change + 3);
    out.insert(out.end(), at, at + t.position_terms * 3 + t.second_terms * (drop ? 6 : 3));
    return out;
}
inline std::vector<std::vector<float>> all_numbers(const format::TrackBlock& block) {
    std::vector<std::vector<float>> out;
    for (uint32_t i = 0; i < block.point_count + block.drop_count; ++i)
        out.push_back(numbers(block.tracks[i], block.coefficients, i >= block.point_count));
    std::sort(out.begin(), out.end());
    return out;
}
/// The same straight from the quantised tracks, without any coding.
inline std::vector<std::vector<float>> expected_numbers(const std::vector<QuantisedTrack>& tracks) {
    const format::LatticeSteps steps{quantiser.step,
                                     quantiser.normal_step,
                                     {origin.x, origin.y, origin.z},
                                     uint16_t(quantiser.tangent_ratio * 16),
                                     quantiser.slip_step};
    std::vector<std::vector<float>> out;
    for (const QuantisedTrack& q : tracks) {
        format::RawTrack raw{};
        const uint32_t channels = q.drop ? 6 : 3;
        raw.birth = q.birth, raw.death = q.death, raw.flags = q.flags;
        raw.position_terms = uint8_t(q.position.size() / 3),
        raw.second_terms = uint8_t(q.second.size() / channels);
        std::copy(q.lattice, q.lattice + 3, raw.lattice);
        std::copy(q.axis, q.axis + 2, raw.axis);
        std::copy(q.slip, q.slip + 2, raw.slip), std::copy(q.slip_change, q.slip_change + 2, raw.slip_change);
        for (size_t i = 0; i < q.position.size(); ++i) raw.position[i / 3][i % 3] = q.position[i];
        for (size_t i = 0; i < q.second.size(); ++i) raw.second[i / channels][i % channels] = q.second[i];
        std::vector<float> memory(q.position.size() + q.second.size());
        format::Track record;
        format::TrackBlock block{{}, 0, !q.drop, q.drop, uint32_t(memory.size()), &record, memory.data()};
        REQUIRE(format::place_track(raw, steps, q.drop, block, 0, 0));
        format::finish_block(steps, block);
        out.push_back(numbers(record, memory.data(), q.drop));
    }
    std::sort(out.begin(), out.end());
    return out;
}
