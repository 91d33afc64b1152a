// SPDX-License-Identifier: MIT
// Coefficients at a time → points and drops.
#include "chunk_harness.h"
#include "src/coefficients_to_points.h"

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
