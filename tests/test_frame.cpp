// SPDX-License-Identifier: MIT
// A frame from chunks to buffers: right place, right time, any capacity, any number of workers, no allocation.
#include "harness.h"

#include <memory>

#include "asset/asset_player.h"
#include "measure/surface_distance.h"

using namespace harness;
using rill::Status;

namespace {

const Bytes& ball() {
    static const Bytes bytes = make_ball();
    return bytes;
}

void set_identity(float (&m)[12]) {
    for (int i = 0; i < 12; ++i) m[i] = i % 5 == 0 ? 1.0f : 0.0f;
}

/// Every vertex of every triangle lies on the ball of that moment, faces out, and moves with it.
void check_ball(const Playing& playing, double seconds, bool uneven) {
    INFO(uneven);
    REQUIRE(playing.target.indices_used > 3000);
    float off = 0, turned = 1, slow = 0;
    for (uint32_t i = 0; i < playing.target.indices_used; ++i) {
        const uint32_t v = playing.indices[i];
        REQUIRE(v < playing.target.vertices_used);
        const glm::vec3 arm = playing.positions[v] - Clip::centre(seconds);
        off = std::max(off, std::abs(glm::length(arm) - Clip::radius));
        turned = std::min(turned, glm::dot(playing.normals[v], glm::normalize(arm)));
        slow = std::max(slow, glm::length(playing.velocities[v] - Clip::velocity(seconds)));
    }
    CHECK(off < 0.01f);
    CHECK(turned > 0.98f);
    CHECK(slow < 0.12f);  // at the ends of a window, where half a step of the ball's turning is not known
}

rill::cooker::Mesh mesh_of(const Playing& playing) {
    rill::cooker::Mesh mesh;
    mesh.positions.assign(playing.positions.begin(), playing.positions.begin() + playing.target.vertices_used);
    for (uint32_t i = 0; i < playing.target.indices_used; i += 3)
        mesh.triangles.push_back({playing.indices[i], playing.indices[i + 1], playing.indices[i + 2]});
    return mesh;
}

}  // namespace

TEST_CASE("the ball is where it should be at any moment") {
    for (const bool uneven : {false, true}) {
        Clip clip;
        clip.uneven = uneven;
        Opened opened(make_ball(clip));
        REQUIRE(opened.open() == Status::ok);
        Playing playing(opened);
        for (const double t : {0.0, 0.013, 8 / 24.0, 0.5, 0.77, 1.0}) {
            INFO(t);
            CHECK(playing.draw(t) == Status::ok);
            CHECK(playing.stats.points_used == 600);
            CHECK(playing.stats.layers_drawn == 3);
            CHECK(playing.stats.blocks_drawn == 2);
            CHECK(playing.stats.cell_size == 0.08f);
            check_ball(playing, t, uneven);
            const rill::cooker::Topology topology = rill::cooker::topology(mesh_of(playing));
            CHECK(topology.open_edges == 0);
            CHECK(topology.non_manifold_edges == 0);
            CHECK(topology.components == 1);
        }
        CHECK(playing.draw(-5) == Status::ok);  // before the clip is its beginning
        check_ball(playing, 0, uneven);
        CHECK(playing.draw(500) == Status::ok);
        check_ball(playing, opened.info.seconds, uneven);
    }
}

TEST_CASE("points are handed out, and a drop is drawn beside them") {
    Clip clip;
    clip.drop = true;
    Opened opened(make_ball(clip));
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    std::vector<glm::vec3> points(600), normals(600);
    playing.target.point_position = {points.data(), sizeof(glm::vec3)};
    playing.target.point_normal = {normals.data(), sizeof(glm::vec3)};
    playing.target.point_capacity = 500;
    CHECK(playing.draw(0.25) == Status::clipped);
    CHECK(playing.stats.cut == rill::cut_points);
    CHECK(playing.stats.points_used == 601);
    CHECK(playing.target.points_used == 500);
    for (uint32_t i = 0; i < 500; ++i) {
        CHECK(std::abs(glm::length(points[i] - Clip::centre(0.25)) - 1) < 2e-3f);
        CHECK(glm::dot(normals[i], points[i] - Clip::centre(0.25)) > 0.99f);
    }
    for (uint32_t i = 500; i < 600; ++i) CHECK(points[i] == glm::vec3(0));
    CHECK(rill::cooker::topology(mesh_of(playing)).components == 2);
    std::vector<uint8_t> packed(1 + 13 * 500);  // of any stride, anywhere
    playing.target.point_position = {packed.data() + 1, 13};
    playing.target.point_normal = {};
    CHECK(playing.draw(0.25) == Status::clipped);
    for (uint32_t i = 0; i < 500; ++i) CHECK(std::memcmp(packed.data() + 1 + 13 * i, &points[i], sizeof points[i]) == 0);
    playing.target.point_position = {points.data(), sizeof(glm::vec3)};
    playing.target.point_capacity = 600;
    CHECK(playing.draw(0.25) == Status::ok);
    CHECK(playing.target.points_used == 600);
}

TEST_CASE("a time on a window's border belongs to the later window, the clip's end to the last") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.script = [](const rill::Read&) { return ScriptedIo::later; };
    const auto first_chunk_asked = [&](double seconds, float rate) {
        opened.io.asked.clear();
        Playing playing(opened);
        playing.frame.rate = rate;
        playing.draw(seconds);
        for (uint32_t i = 0; i < 18; ++i)
            if (chunk_of(ball(), i).offset == opened.io.asked.at(0).file_offset) return i;
        return 99u;
    };
    for (const float rate : {1.0f, 0.0f, -1.0f}) {
        CHECK(first_chunk_asked(0, rate) == 0);
        CHECK(first_chunk_asked(rill::frame_seconds(opened.asset, 8) - 1e-9, rate) == 0);
        CHECK(first_chunk_asked(rill::frame_seconds(opened.asset, 8), rate) == 6);
        CHECK(first_chunk_asked(rill::frame_seconds(opened.asset, 16), rate) == 12);
        CHECK(first_chunk_asked(opened.info.seconds, rate) == 12);
    }
}

TEST_CASE("the surface does not jump where windows meet") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    const double border = rill::frame_seconds(opened.asset, 8);
    playing.draw(border - 1e-7);
    const rill::cooker::Mesh before = mesh_of(playing);
    playing.draw(border);
    const rill::cooker::Mesh after = mesh_of(playing);
    const rill::cooker::SurfaceIndex a(before), b(after);
    CHECK(rill::cooker::surface_distance(before, a, after, b).max < 0.002);
}

TEST_CASE("the same bytes at any number of workers, and in any order of tasks" * doctest::test_suite("threads")) {
    std::vector<uint64_t> hashes;
    const auto play = [&](const rill::Jobs& jobs) {
        Opened opened(ball());
        opened.host.jobs = jobs;
        REQUIRE(opened.open() == Status::ok);
        Playing playing(opened);
        uint64_t hash = rill::format::fnv1a_start;
        for (const double t : {0.0, 0.31, 0.95, 0.4}) {
            CHECK(playing.draw(t) == Status::ok);
            hash = rill::format::fnv1a(rill::format::fnv1a(hash, uint32_t(playing.hash())), uint32_t(playing.hash() >> 32));
        }
        hashes.push_back(hash);
    };
    play({});
    for (const uint32_t workers : {1u, 2u, 8u}) {
        rill::ThreadPool* pool = rill::start_threads(workers);
        play(rill::thread_jobs(pool));
        rill::stop_threads(pool);
    }
    for (const uint32_t seed : {1u, 99u}) {
        ShuffledJobs jobs;
        jobs.seed = seed;
        play(jobs.callbacks());
        CHECK(jobs.queue.empty());
    }
    for (const uint64_t hash : hashes) CHECK(hash == hashes[0]);
}

TEST_CASE("where one plays from does not matter: seek, backward, forward") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    std::map<double, uint64_t> hashes;
    for (const float rate : {1.0f, -1.0f, 0.0f}) {
        Playing playing(opened);
        playing.frame.rate = rate;
        for (int i = 0; i <= 12; ++i) {
            const double t = (rate > 0 ? i : rate < 0 ? 12 - i : i * 5 % 13) / 12.0;
            CHECK(playing.draw(t) == Status::ok);
            if (rate > 0) hashes[t] = playing.hash();
            else CHECK(playing.hash() == hashes[t]);
        }
    }
}

TEST_CASE("one allocation of the size told, and none after") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    for (const uint32_t scale : {0u, 1u, 7u}) {
        rill::Limits limits{};
        limits.points = 100 * scale;
        limits.vertices = 1000 * scale;
        limits.resident_bytes = 12345 * scale;
        const uint64_t calls = opened.memory.calls, told = rill::footprint(opened.asset, limits);
        Playing playing(opened, limits);
        CHECK(opened.memory.calls == calls + 1);
        CHECK(opened.memory.last == told);
        for (int i = 0; i < 20; ++i) CHECK(playing.draw(i / 20.0) >= Status::ok);
        CHECK(opened.memory.calls == calls + 1);
    }
}

TEST_CASE("every capacity from nothing up: whole pieces, nothing beyond, and the demand is told") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    playing.frame.budget.cell_size = 0.16f;
    REQUIRE(playing.draw(0.2) == Status::ok);
    const uint32_t vertices = playing.target.vertices_used, indices = playing.target.indices_used,
                   ranges = playing.target.ranges_used;
    CHECK(playing.stats.vertices_wanted == vertices);
    CHECK(playing.stats.indices_wanted == indices);
    const auto check_at = [&](uint32_t v, uint32_t i, uint32_t r) {
        playing.resize(v, i, r);  // blocks of exactly that size: the address sanitizer sees one element over
        const bool enough = v >= vertices && i >= indices && r >= ranges;
        CHECK(playing.draw(0.2) == (enough ? Status::ok : Status::clipped));
        const rill::Target& t = playing.target;
        CHECK(t.vertices_used <= v);
        CHECK(t.indices_used <= i);
        CHECK(t.ranges_used <= r);
        CHECK(((playing.stats.cut & rill::cut_vertices) != 0) == (v < vertices));
        CHECK(((playing.stats.cut & rill::cut_indices) != 0) == (i < indices));
        CHECK(((playing.stats.cut & rill::cut_ranges) != 0) == (r < ranges));
        CHECK(playing.stats.vertices_wanted == vertices);
        CHECK(playing.stats.indices_wanted == indices);
        CHECK(playing.stats.ranges_wanted == ranges);
        uint32_t in_ranges = 0;
        for (uint32_t k = 0; k < t.ranges_used; ++k) in_ranges += playing.ranges[k].index_count;
        if (i) CHECK(in_ranges == t.indices_used);
        for (uint32_t k = 0; k < t.indices_used; ++k) CHECK(playing.indices[k] < t.vertices_used);
    };
    for (uint32_t step = 0; step <= 12; ++step) {
        check_at(vertices * step / 12, indices, ranges);
        check_at(vertices, indices * step / 12, ranges);
    }
    for (uint32_t r = 0; r <= ranges; ++r) check_at(vertices, indices, r);
    for (const uint32_t v : {1u, 2u, vertices - 1, vertices + 1}) check_at(v, indices, ranges);
    for (const uint32_t i : {1u, 5u, 6u, indices - 1, indices + 1}) check_at(vertices, i, ranges);
}

TEST_CASE("too few points or too little scratch: the coarse is drawn, and the cut is named") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    for (const uint32_t points : {1u, 2u, 10u, 149u, 150u, 300u, 599u}) {
        rill::Limits limits{};
        limits.points = points;
        Playing playing(opened, limits);
        CHECK(playing.draw(0.1) == Status::clipped);
        CHECK((playing.stats.cut & rill::cut_points) != 0);
        if (points > 2) CHECK(playing.stats.cut == rill::cut_points);  // so few make a sheet without end
        CHECK(playing.stats.points_used == points);
        CHECK(playing.stats.points_wanted == 600);
    }
    Playing capped(opened);
    capped.frame.budget.points = 300;
    CHECK(capped.draw(0.1) == Status::clipped);
    CHECK(capped.stats.points_used == 300);
    capped.frame.budget = {};
    capped.frame.budget.layers = 2;
    CHECK(capped.draw(0.1) == Status::ok);  // asked for so: nothing is held back
    CHECK(capped.stats.points_used == 300);
    CHECK(capped.stats.layers_wanted == 2);
    for (const uint32_t vertices : {1u, 100u, 1000u}) {
        rill::Limits limits{};
        limits.vertices = vertices;
        Playing playing(opened, limits);
        CHECK(playing.draw(0.1) == Status::clipped);
        CHECK((playing.stats.cut & rill::cut_vertices) != 0);
        CHECK(playing.stats.vertices_wanted > vertices);
        CHECK(playing.target.vertices_used <= vertices);
    }
}

TEST_CASE("cells follow the size on the screen, layers with a grace against flicker") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    rill::View view{};
    for (auto& plane : view.planes) plane[3] = 1e6f;
    view.pixels_per_radian = 1000;
    set_identity(playing.frame.asset_to_world);
    playing.frame.views = &view;
    playing.frame.view_count = 1;
    playing.frame.budget.pixel_error = 4;
    const auto cell_at = [&](float distance) {
        view.eye[2] = 1.01f + distance;
        CHECK(playing.draw(0.1) == Status::ok);
        CHECK(playing.stats.pixel_error == doctest::Approx(playing.stats.cell_size * 1000 / distance).epsilon(0.001));  // bounds are in whole units
        return playing.stats.cell_size / 0.08f;
    };
    CHECK(cell_at(1) == 1);
    CHECK(playing.stats.layers_wanted == 3);
    CHECK(cell_at(39) == 1);      // 4 px are one cell at 20 m: two cells at 40
    CHECK(cell_at(43) == 2);      // exactly, for vertices are there before
    CHECK(cell_at(39) == 1);
    CHECK(cell_at(200) == 8);
    const uint32_t far_layers = playing.stats.layers_wanted;
    CHECK(far_layers < 3);
    // Coming nearer, the first place with another number of layers; from there back by less than an eighth they stay.
    float distance = 200;
    while (distance > 20 && playing.stats.layers_wanted == far_layers) cell_at(distance *= 0.97f);
    const uint32_t near_layers = playing.stats.layers_wanted;
    REQUIRE(near_layers > far_layers);
    cell_at(distance * 1.1f);
    CHECK(playing.stats.layers_wanted == near_layers);
    cell_at(200);
    CHECK(playing.stats.layers_wanted == far_layers);
    CHECK(playing.target.indices_used > 0);
    // The same through a transform that makes everything twice as large and twice as far.
    for (int i = 0; i < 12; i += 5) playing.frame.asset_to_world[i] = 2;
    view.eye[2] = 2 * (1.01f + 200);
    CHECK(playing.draw(0.1) == Status::ok);
    CHECK(playing.stats.cell_size / 0.08f == 8);
}

TEST_CASE("a time cap makes frames coarser, and says so") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    playing.frame.budget.microseconds = 1;
    for (int i = 0; i < 12; ++i) {  // chunk by chunk
        CHECK(playing.draw(0) == Status::clipped);
        CHECK((playing.stats.cut & rill::cut_time) != 0);
        CHECK(playing.stats.cell_size > 0.16f);
        CHECK(playing.target.indices_used > 0);  // however little time there is
    }
    CHECK(playing.stats.cut == rill::cut_time);
    playing.frame.budget.microseconds = 0;
    playing.draw(0);
    CHECK(playing.draw(0) == Status::ok);
    CHECK(playing.stats.cell_size == 0.08f);
    CHECK(playing.stats.mesh_us == 0);  // no clock is read
}

TEST_CASE("without a target only data moves") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    rill::Frame frame{};
    frame.rate = 1;
    rill::Stats stats{};
    CHECK(rill::begin_frame(playing.player, frame) == Status::ok);
    CHECK(rill::end_frame(playing.player, &stats) == Status::ok);
    CHECK(stats.chunks_resident >= 6);
    CHECK(stats.points_used == 0);
    CHECK(stats.vertices_wanted == 0);
}

TEST_CASE("clips of one frame, and of nothing at all") {
    Clip one;
    one.frames = 1;
    Opened opened(make_ball(one));
    REQUIRE(opened.open() == Status::ok);
    CHECK(opened.info.seconds == 0);
    Playing playing(opened);
    CHECK(playing.draw(0) == Status::ok);
    CHECK(playing.stats.points_used == 600);
    CHECK(playing.target.indices_used > 0);

    const std::string path = scratch_path("empty.rill");
    {
        rill::cooker::AssetWriter writer(path);
        writer.add_window(0, 25, 0, {});
        writer.finish(ball_facts({}));
    }
    Opened empty(read_file(path));
    std::filesystem::remove(path);
    REQUIRE(empty.open() == Status::ok);
    CHECK(empty.info.most_points == 0);
    Playing nothing(empty);
    nothing.frame.wait_for_data = true;
    CHECK(nothing.draw(0.5) == Status::ok);
    CHECK(nothing.target.vertices_used == 0);
    CHECK(nothing.target.ranges_used == 0);
}

TEST_CASE("frames uneven in time: velocity is the ball's, at frames and between them") {
    const std::string path = scratch_path("uneven.rill");
    Clip clip;
    clip.uneven = true;
    write_ball(clip, path);
    rill::cooker::AssetPlayer player(path, 2);
    for (uint32_t frame = 1; frame + 2 < clip.frames; ++frame)
        for (const double f : {0., 0.5}) {
            // At its window's first and last frame a track knows the step on one side alone.
            if (frame % clip.window == 0 || (frame + 1) % clip.window == 0) continue;
            const double seconds = clip.seconds(frame) + f * (clip.seconds(frame + 1) - clip.seconds(frame));
            const rill::cooker::Mesh mesh = player.mesh(seconds);
            glm::vec3 sum{};
            for (const glm::vec3& v : mesh.velocities) sum += v;
            CAPTURE(frame);
            CAPTURE(f);
            CHECK(glm::distance(sum / float(mesh.velocities.size()), Clip::velocity(seconds)) < 0.02f);
        }
    std::filesystem::remove(path);
}

TEST_CASE("the cooker's player grows its buffers until everything fits") {
    const std::string path = scratch_path("grow.rill");
    write_ball({}, path);
    rill::cooker::AssetPlayer player(path, 2);
    CHECK(player.info().frames == 25);
    CHECK(player.frame_seconds(24) == 1);
    rill::Stats stats{};
    const rill::cooker::Mesh mesh = player.mesh(0.5, 0, 0, &stats);
    CHECK(stats.cut == 0);
    CHECK(rill::cooker::topology(mesh).open_edges == 0);
    CHECK(mesh.normals.size() == mesh.positions.size());
    CHECK(mesh.velocities.size() == mesh.positions.size());
    const rill::cooker::Mesh fine = player.mesh(0.5, 0.006f, 0, &stats);
    CHECK(stats.cut == 0);
    CHECK(fine.positions.size() > 200000);  // more than the first buffers held
    CHECK(rill::cooker::topology(fine).volume == doctest::Approx(4.18879).epsilon(0.005));
    CHECK(player.mesh(0.5).positions == mesh.positions);
    std::filesystem::remove(path);
}
