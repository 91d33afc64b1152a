// SPDX-License-Identifier: MIT
// Quantising, coding and decoding of tracks: what goes in comes out to the bit, within the promised error, and no
// bytes whatever do harm.
#include "chunk_harness.h"
#include "common/mesh.h"
#include "format/chunk_statistics.h"

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
