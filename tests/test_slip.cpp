// SPDX-License-Identifier: MIT
// How liquid slides along its surface, as tracks keep it: quantised, foretold by neighbours, coded.
#include <map>

#include "chunk_harness.h"
#include "common/mesh.h"

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
