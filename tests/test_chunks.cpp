// SPDX-License-Identifier: MIT
// Quantising, coding and decoding of tracks: what goes in comes out to the bit, within the promised error, and no
// bytes whatever do harm.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "asset/layers_to_chunks.h"
#include "basis_tables.h"
#include "common/mesh.h"
#include "format/chunk_statistics.h"
#include "format/lattice.h"
#include "src/coefficients_to_points.h"

using namespace rill;
using namespace rill::cooker;

namespace {

constexpr uint32_t window = 25;
double scale_of(uint32_t life) { return std::pow(8.0 / life, 0.25); }  // of all steps; the format says so in integers
const Quantiser quantiser{0.002f, 4.f, 0.035f, 0.004f, 0.06f, 0.05f};
const glm::vec3 origin(0.5f, -0.25f, 1.f);

/// A point of a travelling wave, or a drop flying by.
TrackSamples make_track(std::mt19937& random, uint32_t birth, uint32_t death, bool drop, float violence = 1) {
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
std::vector<QuantisedTrack> make_tracks(uint32_t points, uint32_t drops, uint32_t seed = 1) {
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
Decoded decode(const uint8_t* bytes, size_t size, const format::ChunkShape& shape) {
    Decoded d;
    d.tracks.reset(new format::Track[shape.point_count + shape.drop_count]);
    d.coefficients.reset(new float[shape.coefficient_count]);
    d.block.tracks = d.tracks.get(), d.block.coefficients = d.coefficients.get();
    const std::unique_ptr<uint8_t[]> exact(new uint8_t[size]);
    std::copy(bytes, bytes + size, exact.get());
    d.status = format::decode_chunk(exact.get(), size, shape, nullptr, 0, d.block, &d.reason);
    return d;
}
EncodedChunk encode(const std::vector<QuantisedTrack>& tracks) {
    return encode_chunk(tracks, quantiser, origin, window, {});
}

/// A track as its decoded numbers: comparable, sortable.
std::vector<float> numbers(const format::Track& t, const float* coefficients, bool drop) {
    std::vector<float> out = {float(drop),    float(t.birth),          float(t.death),
                              float(t.flags), float(t.position_terms), float(t.second_terms)};
    const float* at = coefficients + t.first_coefficient;
    if (!drop) out.insert(out.end(), t.slip, t.slip + 3), out.insert(out.end(), t.slip_change, t.slip_change + 3);
    out.insert(out.end(), at, at + t.position_terms * 3 + t.second_terms * (drop ? 6 : 3));
    return out;
}
std::vector<std::vector<float>> all_numbers(const format::TrackBlock& block) {
    std::vector<std::vector<float>> out;
    for (uint32_t i = 0; i < block.point_count + block.drop_count; ++i)
        out.push_back(numbers(block.tracks[i], block.coefficients, i >= block.point_count));
    std::sort(out.begin(), out.end());
    return out;
}
/// The same straight from the quantised tracks, without any coding.
std::vector<std::vector<float>> expected_numbers(const std::vector<QuantisedTrack>& tracks) {
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

}  // namespace

TEST_CASE("a chunk decodes to exactly the quantised tracks") {
    const std::pair<uint32_t, uint32_t> sizes[] = {{0, 0},   {1, 0},   {0, 1},     {2, 1},
                                                   {40, 30}, {500, 0}, {5000, 200}};
    for (const auto& size : sizes) {
        const uint32_t points = size.first, drops = size.second;
        INFO(points, " points, ", drops, " drops");
        const auto tracks = make_tracks(points, drops);
        const EncodedChunk chunk = encode(tracks);
        CHECK(chunk.shape.point_count == points);
        CHECK(chunk.shape.drop_count == drops);
        const Decoded d = decode(chunk.bytes.data(), chunk.bytes.size(), chunk.shape);
        INFO((d.reason ? d.reason : ""));
        REQUIRE(d.status == Status::ok);
        CHECK(d.block.coefficient_count == chunk.shape.coefficient_count);
        CHECK(d.block.origin[0] == origin.x);
        CHECK(all_numbers(d.block) == expected_numbers(tracks));
    }
}

TEST_CASE("what nothing was learned of starts at even odds, whatever the compiler makes of constants") {
    struct {
        uint32_t unknown = 0, impossible = 0;
        void operator()(const format::Counter& c) { unknown += c.seen == 0 && c.probability == 32768, impossible += c.probability == 0; }
        void operator()(const format::Mixer& m) {
            for (const uint32_t weight : m.weight) impossible += weight == 0;
        }
        void operator()(const format::Statistics::Trust& t) { impossible += t.square == 0; }
    } seen;
    format::each_part_of(format::first_statistics, [&](const auto& part) { seen(part); });
    CHECK(seen.unknown > 1000);
    CHECK(seen.impossible == 0);
}

TEST_CASE("every life comes back, whatever its ends say of themselves") {
    std::mt19937 random(7);
    for (const bool drops : {false, true})
        for (const uint32_t flags : {0u, 1u, 2u, 3u}) {
            std::vector<QuantisedTrack> tracks;
            for (uint32_t birth = 0; birth < window; birth += 3)
                for (uint32_t death = birth; death < window; death += birth % 2 ? 1 : 4) {
                    tracks.push_back(quantise_track(make_track(random, birth, death, drops), quantiser, origin, tables()));
                    tracks.back().flags = uint8_t((tracks.back().flags & ~3u) | (random() % 4 ? flags : 3 - flags));
                }
            const EncodedChunk chunk = encode(tracks);
            const Decoded d = decode(chunk.bytes.data(), chunk.bytes.size(), chunk.shape);
            CAPTURE(flags);
            REQUIRE(d.status == Status::ok);
            CHECK(all_numbers(d.block) == expected_numbers(tracks));
        }
}

TEST_CASE("tracks that are born and die together cost less than those that do so at any time") {
    const auto life_bits = [](bool together) {
        std::mt19937 random(9);
        std::vector<QuantisedTrack> tracks;
        for (int i = 0; i < 400; ++i) {
            const uint32_t birth = together ? 7 : 1 + random() % 11, death = together ? 15 : 12 + random() % 11;
            tracks.push_back(quantise_track(make_track(random, birth, death, false), quantiser, origin, tables()));
        }
        return encode(tracks).bits.structure / double(tracks.size());
    };
    CHECK(life_bits(true) < 1.5);
    CHECK(life_bits(false) > 5);
}

TEST_CASE("motion is foretold by neighbours of the same time, not by those of another") {
    const auto motion_bits = [](bool two_times) {
        std::mt19937 random(13);
        std::uniform_real_distribution<float> unit(-1, 1);
        std::vector<QuantisedTrack> tracks;
        for (int i = 0; i < 600; ++i) {
            const bool late = two_times && random() % 2;
            TrackSamples track;
            track.birth = late ? 12 : 0, track.death = late ? 23 : 11, track.flags = late ? format::track_born : format::track_dies;
            const glm::vec3 start(unit(random), unit(random), 0), way = late ? glm::vec3(-0.7f, 0.8f, 0) : glm::vec3(1, 0.5f, 0);
            for (int s = 0; s < 12; ++s) track.position.push_back(origin + start + 0.05f * float(s) * way), track.normal.emplace_back(0, 0, 1);
            tracks.push_back(quantise_track(track, quantiser, origin, tables()));
        }
        return encode(tracks).bits.motion / double(tracks.size());
    };
    CHECK(motion_bits(true) < 1.5 * motion_bits(false));
}

TEST_CASE("the bytes do not depend on the order of the tracks, nor on the run") {
    auto tracks = make_tracks(300, 20);
    for (int i = 0; i < 4; ++i) {  // several tracks on one lattice point
        tracks.push_back(tracks[5]);
        tracks.back().axis[0] += i / 2;
    }
    const EncodedChunk chunk = encode(tracks);
    const double bits =
        chunk.bits.structure + chunk.bits.births + chunk.bits.motion + chunk.bits.normals + chunk.bits.slip + chunk.bits.drops;
    CHECK(std::abs(bits / 8 - double(chunk.bytes.size())) < 4);
    std::mt19937 random(3);
    for (int i = 0; i < 3; ++i) {
        std::shuffle(tracks.begin(), tracks.end(), random);
        CHECK(encode(tracks).bytes == chunk.bytes);
    }
}

TEST_CASE("normals in every direction survive, also on the folds of the octahedron") {
    std::vector<QuantisedTrack> tracks;
    for (int x = -4; x <= 4; ++x)
        for (int y = -4; y <= 4; ++y)
            for (int z = -4; z <= 4; ++z) {
                if (x == 0 && y == 0 && z == 0) continue;
                const glm::vec3 n = glm::normalize(glm::vec3(x, y, z));
                const TrackSamples track{0, 0, 0, false, {origin + n}, {n}, {}};
                tracks.push_back(quantise_track(track, quantiser, origin, tables()));
                const glm::vec3 back = dequantise_track(tracks.back(), quantiser, origin, tables()).normal[0];
                CHECK(glm::dot(back, n) > std::cos(1.1 * quantiser.normal_step * scale_of(1)));
            }
    const EncodedChunk chunk = encode(tracks);
    const Decoded d = decode(chunk.bytes.data(), chunk.bytes.size(), chunk.shape);
    REQUIRE(d.status == Status::ok);
    CHECK(all_numbers(d.block) == expected_numbers(tracks));
}

TEST_CASE("lives of every length keep the promised error") {
    std::mt19937 random(7);
    for (uint32_t life = 1; life <= 33; ++life)
        for (int repeat = 0; repeat < 20; ++repeat) {
            const bool drop = repeat % 5 == 4;
            TrackSamples track = make_track(random, 0, life - 1, drop, repeat < 10 ? 1.f : 8.f);
            const QuantisedTrack q = quantise_track(track, quantiser, origin, tables());
            const TrackSamples back = dequantise_track(q, quantiser, origin, tables());
            REQUIRE(back.position.size() == life);
            INFO("life ", life, " repeat ", repeat);
            // Truncation, half a step of the mean, and what rounding takes (.75 of a coefficient step) in every term, which
            // in the norm add up as a root; 1.7 for the ends, where basis functions are larger.
            const double terms = format::most_terms(life, (q.flags & format::track_cosine) != 0);
            const auto noise = [&](double gain) { return float(0.5 + 1.7 * 0.75 * gain * std::sqrt(terms)); };
            const float scale = float(scale_of(life));
            const float bound = quantiser.time_tolerance + scale * quantiser.step * noise(format::position_gain);
            const float normal_bound =
                quantiser.normal_tolerance + scale * quantiser.normal_step * noise(format::normal_gain);
            for (uint32_t s = 0; s < life; ++s) {
                const glm::vec3 offset = back.position[s] - track.position[s];
                if (drop) {
                    CHECK(glm::length(offset) < 1.8f * bound);
                    for (int c = 0; c < 6; ++c)
                        CHECK(std::abs(back.shape[s][c] - track.shape[s][c]) < 1.5f * bound);
                } else {
                    CHECK(std::abs(glm::dot(offset, track.normal[s])) < bound);
                    CHECK(glm::length(offset) < std::sqrt(2.f) * quantiser.tangent_ratio * bound);
                    CHECK(std::acos(std::min(1.f, glm::dot(back.normal[s], track.normal[s]))) <
                          std::sqrt(2.f) * normal_bound);
                }
            }
        }
}

TEST_CASE("a place is as exact as the length of its life is worth") {
    std::mt19937 random(11);
    for (const uint32_t life : {1u, 2u, 8u, 25u, 33u}) {
        // What rounding leaves of a place that stands still, along its normal.
        const double half = 0.5 * quantiser.step * scale_of(life);
        double worst = 0;
        for (int repeat = 0; repeat < 200; ++repeat) {
            TrackSamples track = make_track(random, 0, 0, false);
            track.death = uint8_t(life - 1);
            track.position.resize(life, track.position[0]), track.normal.resize(life, track.normal[0]);
            const QuantisedTrack q = quantise_track(track, quantiser, origin, tables());
            const glm::vec3 offset = dequantise_track(q, quantiser, origin, tables()).position[0] - track.position[0];
            worst = std::max(worst, double(std::abs(glm::dot(offset, track.normal[0]))));
        }
        INFO("life ", life, " half a step ", half);
        CHECK(worst < 1.2 * half);
        CHECK(worst > 0.8 * half);
    }
}

TEST_CASE("a normal that turns far, and one that turns over, stay decodable and near") {
    for (const float turn : {1.2f, 2.5f}) {
        TrackSamples track;
        track.birth = 0, track.death = 24;
        for (int s = 0; s < 25; ++s) {
            const float a = turn * (s / 24.f - 0.5f);
            track.normal.push_back({std::sin(a), 0, std::cos(a)});
            track.position.push_back(origin + 0.3f * track.normal.back());
        }
        const QuantisedTrack q = quantise_track(track, quantiser, origin, tables());
        CHECK(((q.flags & format::track_fine) != 0) == (turn > 2));
        const TrackSamples back = dequantise_track(q, quantiser, origin, tables());
        for (int s = 0; s < 25; ++s) {
            CHECK(glm::dot(back.normal[s], track.normal[s]) > std::cos(0.12f));
            CHECK(std::abs(glm::dot(back.position[s] - track.position[s], track.normal[s])) < 0.008f);
        }
    }
}

TEST_CASE("the projection is asked for every sample and obeyed") {
    std::mt19937 random(5);
    const TrackSamples track = make_track(random, 0, 24, false);
    std::vector<int> asked(25);
    const auto onto_plane = [&](uint32_t sample, const glm::vec3& x, const glm::vec3& axis) {
        ++asked[sample];
        return (origin.z + 0.2f - x.z) / axis.z;  // a surface elsewhere than the samples: the plane z = 0.2
    };
    const QuantisedTrack q = quantise_track(track, quantiser, origin, tables(), onto_plane);
    for (const int count : asked) CHECK(count > 0);
    for (const glm::vec3& x : dequantise_track(q, quantiser, origin, tables()).position)
        CHECK(std::abs(x.z - origin.z - 0.2f) < 0.008f);
}

TEST_CASE("wrong tracks are refused with words, not coded") {
    std::mt19937 random(5);
    TrackSamples track = make_track(random, 0, 24, false);
    track.normal.pop_back();
    CHECK_THROWS_AS(quantise_track(track, quantiser, origin, tables()), InputError);
    track = make_track(random, 0, 24, false);
    track.position[3].x = NAN;
    CHECK_THROWS_AS(quantise_track(track, quantiser, origin, tables()), InputError);
    auto tracks = make_tracks(3, 0);
    tracks[1].position.resize(3 * 30);
    CHECK_THROWS_AS(encode(tracks), InputError);
    tracks = make_tracks(3, 0);
    tracks[1].death = 60;
    CHECK_THROWS_AS(encode(tracks), InputError);
    CHECK_THROWS_AS(encode_chunk({}, Quantiser{0, 4, 0.03f, 1, 1}, origin, window, {}), InputError);
}

TEST_CASE("truncated, lengthened, flipped and random bytes are refused or harmless") {
    const EncodedChunk chunk = encode(make_tracks(60, 6));
    size_t accepted = 0;
    for (size_t size = 0; size < chunk.bytes.size(); ++size) {
        const Decoded d = decode(chunk.bytes.data(), size, chunk.shape);
        CHECK(d.status == Status::corrupt);
        CHECK(d.reason != nullptr);
    }
    for (const uint8_t garbage : {0, 1, 255}) {
        auto longer = chunk.bytes;
        longer.push_back(garbage);
        CHECK(decode(longer.data(), longer.size(), chunk.shape).status == Status::corrupt);
    }
    for (size_t i = 0; i < chunk.bytes.size() * 8; ++i) {
        auto bytes = chunk.bytes;
        bytes[i / 8] ^= uint8_t(1u << (i % 8));
        const Decoded d = decode(bytes.data(), bytes.size(), chunk.shape);
        accepted += d.status == Status::ok;
    }
    CHECK(accepted < chunk.bytes.size() * 8 / 4);
    std::mt19937 random(11);
    for (int i = 0; i < 2000; ++i) {
        std::vector<uint8_t> bytes(random() % 400);
        for (uint8_t& b : bytes) b = uint8_t(random() % 7 ? random() : 0);
        const format::ChunkShape shape{uint32_t(1 + random() % 65), uint32_t(random() % 3000),
                                       uint32_t(random() % 50), uint32_t(random() % 20000), chunk.shape.steps};
        decode(bytes.data(), bytes.size(), shape);
    }
    // Wrong shapes for good bytes.
    for (int field = 0; field < 3; ++field)
        for (const int by : {-1, 1}) {
            format::ChunkShape shape = chunk.shape;
            (field == 0   ? shape.point_count
             : field == 1 ? shape.drop_count
                          : shape.coefficient_count) += uint32_t(by);
            CHECK(decode(chunk.bytes.data(), chunk.bytes.size(), shape).status == Status::corrupt);
        }
    format::ChunkShape shape = chunk.shape;
    shape.steps.step = NAN;
    CHECK(decode(chunk.bytes.data(), chunk.bytes.size(), shape).status == Status::corrupt);
}

TEST_CASE("slip: along the surface, within its step; cheaper where neighbours say the same; none where none is wanted") {
    std::mt19937 random(5);
    std::vector<QuantisedTrack> tracks, noisy, without;
    Quantiser none = quantiser;
    none.slip_step = 0;
    for (int i = 0; i < 400; ++i) {
        TrackSamples track = make_track(random, 0, window - 1, false);
        tracks.push_back(quantise_track(track, quantiser, origin, tables()));
        const TrackSamples back = dequantise_track(tracks.back(), quantiser, origin, tables());
        glm::vec3 n(0);
        for (const glm::vec3& m : track.normal) n += m;
        n = glm::normalize(n);
        const glm::vec3 along = track.slip - n * glm::dot(track.slip, n);
        CHECK(glm::distance(back.slip, along) < quantiser.slip_step);
        const glm::vec3 change = track.slip_change - n * glm::dot(track.slip_change, n);
        CHECK(glm::distance(back.slip_change, change) < quantiser.slip_step);
        CHECK(std::abs(glm::dot(back.slip, n)) < 0.5f * quantiser.slip_step);
        without.push_back(quantise_track(track, none, origin, tables()));
        CHECK(dequantise_track(without.back(), none, origin, tables()).slip == glm::vec3(0));
        track.slip = glm::vec3(float(random() % 1000), float(random() % 1000), 0) / 1000.f - 0.5f;
        noisy.push_back(quantise_track(track, quantiser, origin, tables()));
    }
    const double smooth = encode(tracks).bits.slip;
    CHECK(smooth > 0);
    CHECK(smooth < 0.75 * encode(noisy).bits.slip);
    CHECK(encode_chunk(without, none, origin, window, {}).bits.slip == 0);
    TrackSamples wild = make_track(random, 0, window - 1, false);
    wild.slip = {1e6f, -1e6f, 0};  // as far as a track can hold
    const QuantisedTrack clamped = quantise_track(wild, quantiser, origin, tables());
    CHECK(std::max(std::abs(clamped.slip[0]), std::abs(clamped.slip[1])) == format::max_slip);
    CHECK(encode({clamped}).shape.point_count == 1);
    wild.slip.x = NAN;
    CHECK_THROWS_AS(quantise_track(wild, quantiser, origin, tables()), InputError);
    wild.slip.x = 0, wild.slip_change.y = NAN;
    CHECK_THROWS_AS(quantise_track(wild, quantiser, origin, tables()), InputError);
}

TEST_CASE("change of slip: not of brief lives; cheaper where neighbours say the same, whatever their lives; none before version 8") {
    std::mt19937 random(5);
    std::vector<QuantisedTrack> lines, noisy, steady;
    const auto add = [&](std::vector<QuantisedTrack>& to, const TrackSamples& track) {
        to.push_back(quantise_track(track, quantiser, origin, tables()));
    };
    for (int i = 0; i < 600; ++i) {
        const uint32_t birth = random() % 8, death = window - 1 - random() % 8;
        TrackSamples track = make_track(random, birth, death, false);
        // One acceleration for all: of brief and long lives, at any time.
        const float middle = 0.5f * float(birth + death), half = 0.5f * float(death - birth);
        track.slip = glm::vec3(0.04f * middle, 0, 0), track.slip_change = glm::vec3(0.04f * half, 0, 0);
        add(lines, track);
        track.slip_change = glm::vec3(float(random() % 1000), float(random() % 1000), 0) / 1000.f - 0.5f;
        add(noisy, track);
        track.slip_change = glm::vec3(0);
        add(steady, track);
    }
    const double bits = encode(lines).bits.slip;
    CHECK(bits < 0.5 * encode(noisy).bits.slip);
    CHECK(bits < encode(steady).bits.slip);  // told that they stand, the same slips at different times are no line
    for (const uint32_t life : {1u, format::least_changing_life - 1, format::least_changing_life}) {
        TrackSamples track = make_track(random, 3, 2 + life, false);
        track.slip_change = glm::vec3(1, 1, 0);
        const QuantisedTrack coded = quantise_track(track, quantiser, origin, tables());
        CHECK((coded.slip_change[0] != 0 || coded.slip_change[1] != 0) == (life == format::least_changing_life));
    }
    // What a file of version 7 says, is read as it was meant: the steps tell.
    format::Header header{};
    format::WindowRecord record{};
    header.version = format::version_7;
    CHECK(!steps_of(header, record).slip_changes);
    header.version = format::version_8;
    CHECK(steps_of(header, record).slip_changes);
}

TEST_CASE("slip left to the neighbours: fewer bits, and no more than two steps off") {
    std::mt19937 random(5);
    std::vector<QuantisedTrack> tracks;
    for (int i = 0; i < 800; ++i) {
        TrackSamples track = make_track(random, i % 2 ? 10 : 0, i % 2 ? 12 : window - 1, false);
        const glm::vec3& x = track.position[0];
        track.slip = {0.7f * (x.y - origin.y), -0.7f * (x.x - origin.x), 0};
        if (i % 8 == 1) track.slip.x += 0.5f;  // as nothing beside it
        tracks.push_back(quantise_track(track, quantiser, origin, tables()));
    }
    const double all = encode(tracks).bits.slip;
    for (size_t i = 1; i < tracks.size(); i += 2) tracks[i].flags |= format::track_slips_along;
    const EncodedChunk chunk = encode(tracks);
    CHECK(chunk.bits.slip < 0.9 * all);
    const Decoded d = decode(chunk.bytes.data(), chunk.bytes.size(), chunk.shape);
    REQUIRE(d.status == Status::ok);
    // Nothing but slip has changed: what else a track is, tells which one it was.
    const auto slip_of = [](const std::vector<float>& n) { return glm::vec3(n[6], n[7], n[8]); };
    const auto rest_of = [](std::vector<float> n) { return n.erase(n.begin() + 6, n.begin() + 9), n; };  // their change is told by each
    std::multimap<std::vector<float>, glm::vec3> meant;
    for (const auto& n : expected_numbers(tracks)) meant.emplace(rest_of(n), slip_of(n));
    size_t own = 0;
    float farthest = 0;  // in half steps
    for (const auto& n : all_numbers(d.block)) {
        const auto [first, last] = meant.equal_range(rest_of(n));
        REQUIRE(first != last);
        float off = 1e9f;
        for (auto it = first; it != last; ++it) off = std::min(off, glm::distance(it->second, slip_of(n)));
        own += off == 0, farthest = std::max(farthest, off);
    }
    CHECK(own >= tracks.size() / 2);
    CHECK(own < tracks.size());
    CHECK(farthest <= 4 * std::sqrt(2.f) + std::sqrt(3.f));  // two steps along either axis, and rounding
}

TEST_CASE("slip left to the neighbours is its own where there are none, and never too large") {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(-1, 1);
    TrackSamples wild = make_track(random, 0, window - 1, false);
    wild.slip = {1e6f, -1e6f, 1e6f};
    std::vector<QuantisedTrack> tracks;
    for (int i = 0; i < 200; ++i) {  // frames turn every way: what fits along two axes is too long along one
        const glm::vec3 normal = glm::normalize(glm::vec3(unit(random), unit(random), unit(random)));
        std::fill(wild.normal.begin(), wild.normal.end(), normal);
        wild.slip_change = i % 2 ? glm::vec3(1.5f * quantiser.slip_step) : wild.slip;  // is never left to them, however small
        tracks.push_back(quantise_track(wild, quantiser, origin, tables()));
        if (i % 3) tracks.back().flags |= format::track_slips_along;
    }
    const EncodedChunk chunk = encode(tracks);
    CHECK(decode(chunk.bytes.data(), chunk.bytes.size(), chunk.shape).status == Status::ok);
    tracks.resize(2), tracks.erase(tracks.begin());
    REQUIRE((tracks[0].flags & format::track_slips_along) != 0);
    const EncodedChunk lone = encode(tracks);
    CHECK(all_numbers(decode(lone.bytes.data(), lone.bytes.size(), lone.shape).block) == expected_numbers(tracks));
}

TEST_CASE("evaluation: drops shrink over a whole step, drifting if they have one sample; over half of one where that has no drift") {
    std::mt19937 random(3);
    const glm::vec3 drift(0.2f, -0.05f, -0.3f);
    std::vector<QuantisedTrack> tracks;
    for (const auto& [birth, death] : {std::pair{4u, 9u}, {15u, 15u}, {20u, 20u}}) {
        TrackSamples track = make_track(random, birth, death, true);
        if (birth == 20) track.drift = drift;
        tracks.push_back(quantise_track(track, quantiser, origin, tables()));
    }
    const TrackSamples drifting = dequantise_track(tracks.back(), quantiser, origin, tables());
    // A step of drift is a tangential step of motion.
    CHECK(glm::length(drifting.drift - drift) < 0.5f * std::sqrt(3.f) * quantiser.step * quantiser.tangent_ratio * float(format::position_gain * scale_of(1)));
    CHECK(drifting.drift != glm::vec3(0));
    const EncodedChunk chunk = encode(tracks);
    const Decoded d = decode(chunk.bytes.data(), chunk.bytes.size(), chunk.shape);
    REQUIRE(d.status == Status::ok);
    std::vector<float> memory(13 * 3);
    std::vector<uint64_t> rows_memory(time_rows_bytes(window) / 8 + 1);
    glm::vec3 place, velocity;
    const auto activity = [&](double s) {  // of the only one there
        format::DropSet drops{};
        float** const streams[] = {&drops.x,        &drops.y,        &drops.z,        &drops.shape[0], &drops.shape[1], &drops.shape[2], &drops.shape[3],
                                   &drops.shape[4], &drops.shape[5], &drops.vx,       &drops.vy,       &drops.vz,       &drops.activity};
        for (int i = 0; i < 13; ++i) *streams[i] = memory.data() + 3 * i;
        format::PointSet points{};
        TimeRows* rows = place_time_rows(rows_memory.data(), tables(), window, s, {}, 24);
        const uint32_t counted = count_active(rows, d.block, 0, 3);
        CHECK(evaluate_tracks(rows, d.block, 0, 3, 0, 3, points, drops) == counted);
        CHECK(counted <= 1);
        place = {drops.x[0], drops.y[0], drops.z[0]}, velocity = {drops.vx[0], drops.vy[0], drops.vz[0]};
        return counted ? drops.activity[0] : 0.f;
    };
    CHECK(activity(6.3) == 1);
    CHECK(activity(3.25) == doctest::Approx(0.25));
    CHECK(activity(9.75) == doctest::Approx(0.25));
    CHECK(activity(10) == 0);
    CHECK(activity(15) == 1);
    CHECK(activity(14.75) == doctest::Approx(0.5));
    CHECK(activity(15.5) == 0);
    for (const float away : {-0.75f, -0.25f, 0.f, 0.5f}) {
        CHECK(activity(20 + away) == doctest::Approx(1 - std::abs(away)));
        CHECK(glm::distance(place, drifting.position[0] + away * drifting.drift) < 1e-5f);
        CHECK(glm::distance(velocity, 24.f * drifting.drift) < 1e-4f);
    }
}

TEST_CASE("evaluation gives the decoded samples, activity ramps, and exact velocity") {
    std::mt19937 random(2);
    std::vector<TrackSamples> truth;
    std::vector<QuantisedTrack> tracks;
    for (const auto& [birth, death] : {std::pair{0u, 24u}, {3u, 9u}, {20u, 20u}, {5u, 24u}}) {
        const TrackSamples t = make_track(random, birth, death, false);
        tracks.push_back(quantise_track(t, quantiser, origin, tables()));
        truth.push_back(dequantise_track(tracks.back(), quantiser, origin, tables()));
    }
    const EncodedChunk chunk = encode(tracks);
    const Decoded d = decode(chunk.bytes.data(), chunk.bytes.size(), chunk.shape);
    REQUIRE(d.status == Status::ok);
    std::vector<float> memory(10 * 4);
    std::vector<uint64_t> rows_memory(time_rows_bytes(window) / 8 + 1);
    const auto evaluate = [&](double s, uint32_t capacity, format::PointSet& points) {
        float** const streams[] = {&points.x,  &points.y,  &points.z,  &points.nx, &points.ny,
                                   &points.nz, &points.vx, &points.vy, &points.vz, &points.activity};
        for (int i = 0; i < 10; ++i) *streams[i] = memory.data() + 4 * i;
        points.count = 0;
        format::DropSet drops{};
        TimeRows* rows = place_time_rows(rows_memory.data(), tables(), window, s, {}, 24);
        const uint32_t counted = count_active(rows, d.block, 0, 4);
        const uint32_t active = evaluate_tracks(rows, d.block, 0, 4, capacity, 0, points, drops);
        CHECK(counted == active);
        return active;
    };
    format::PointSet points{};
    for (int s = 0; s < int(window); ++s) {
        uint32_t expected = 0;
        const uint32_t active = evaluate(s, 4, points);
        for (const TrackSamples& t : truth) {
            if (s < t.birth || s > t.death) continue;
            ++expected;
            float nearest = 1e9f;
            for (uint32_t i = 0; i < points.count; ++i)
                nearest = std::min(nearest, glm::length(glm::vec3(points.x[i], points.y[i], points.z[i]) -
                                                        t.position[size_t(s - t.birth)]) +
                                                1 - points.activity[i]);
            CHECK(nearest < 2e-6f);
        }
        CHECK(active == expected);
        CHECK(evaluate(s, 1, points) == expected);  // too small: told how many
        CHECK(points.count == std::min(expected, 1u));
    }
    CHECK(evaluate(2.75, 4, points) == 2);  // the second is on its way in
    CHECK(*std::min_element(points.activity, points.activity + 2) == doctest::Approx(0.5));
    CHECK(evaluate(2.5, 4, points) == 1);  // in the middle between two frames only who lives through both
    CHECK(evaluate(9.125, 4, points) == 3);
    CHECK(*std::min_element(points.activity, points.activity + 3) == doctest::Approx(0.75));
    CHECK(evaluate(9.5, 4, points) == 2);
    // A life of one sample fades on both sides.
    for (const double s : {19.75, 20.25}) {
        CHECK(evaluate(s, 4, points) == 3);
        CHECK(*std::min_element(points.activity, points.activity + 3) == doctest::Approx(0.5));
    }
    CHECK(evaluate(19.5, 4, points) == 2);
    CHECK(evaluate(20.5, 4, points) == 2);
    // The velocity is that of the point, as finite differences tell it, and its slip, which goes as a line over its life.
    for (const uint32_t sample : {2u, 12u, window - 2}) {
        CAPTURE(sample);
        evaluate(sample, 4, points);
        const glm::vec3 x(points.x[0], points.y[0], points.z[0]), v(points.vx[0], points.vy[0], points.vz[0]);
        evaluate(sample + 0.05, 4, points);
        const glm::vec3 later(points.x[0], points.y[0], points.z[0]);
        const TrackSamples& track = glm::distance(truth[0].position[sample], x) < 1e-5f ? truth[0] : truth[3];
        const float place = 2.f * float(sample) / float(window - 1) - 1;
        CHECK(glm::length((later - x) / (0.05f / 24) + track.slip + place * track.slip_change - v) < 0.02f);
        CHECK(glm::length(track.slip) > 0.1f);
        CHECK(glm::length(track.slip_change) > 0.1f);
    }
    CHECK(std::abs(glm::length(glm::vec3(points.nx[0], points.ny[0], points.nz[0])) - 1) < 1e-5f);
}
