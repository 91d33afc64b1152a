// SPDX-License-Identifier: MIT
// Streaming: tickets that are late, out of order, failing, refused; residency and eviction; misuse.
#include "harness.h"

#include <atomic>
#include <limits>
#include <set>
#include <thread>

using namespace harness;
using rill::Status;
using Action = ScriptedIo::Action;

namespace {

const Bytes& ball() {
    static const Bytes bytes = make_ball();
    return bytes;
}

/// Which chunk a read is for; header and directory: -1.
int chunk_asked(const Bytes& bytes, const rill::Read& read) {
    for (uint32_t i = 0; i < header_of(bytes).chunk_count; ++i)
        if (chunk_of(bytes, i).offset == read.file_offset) return int(i);
    return -1;
}
std::vector<int> chunks_asked(const Opened& opened) {
    std::vector<int> chunks;
    for (const rill::Read& read : opened.io.asked) chunks.push_back(chunk_asked(opened.io.file, read));
    return chunks;
}
std::vector<int> range(int first, int last) {
    std::vector<int> numbers;
    for (int i = first; i < last; ++i) numbers.push_back(i);
    return numbers;
}

constexpr double window_seconds = 8 / Clip::fps;  // three windows of six chunks each
const auto hold = [](const rill::Read&) { return Action::later; };

/// A view from afar along −z that sees x ≥ `from` only.
rill::View half_view(float from) {
    rill::View view{};
    for (auto& plane : view.planes) plane[3] = 1;  // everything is inside
    view.planes[0][0] = 1;
    view.planes[0][3] = -from;
    view.eye[2] = 5;
    view.pixels_per_radian = 1000;
    return view;
}
void set_identity(float (&m)[12]) {
    for (int i = 0; i < 12; ++i) m[i] = i % 5 == 0 ? 1.0f : 0.0f;
}

}  // namespace

TEST_CASE("opening goes by tickets") {
    Opened opened(ball());
    opened.io.script = hold;
    CHECK(opened.open() == Status::pending);
    REQUIRE(opened.io.pending.size() == 1);
    CHECK(opened.io.pending[0].bytes == rill::format::header_bytes);
    const uint64_t calls = opened.memory.calls;
    opened.io.deliver(0);
    CHECK(opened.memory.calls == calls);  // never on the IO's thread
    CHECK(rill::poll(opened.asset, &opened.info) == Status::pending);
    CHECK(opened.memory.calls == calls + 1);
    REQUIRE(opened.io.pending.size() == 1);
    const uint64_t stale = opened.io.pending[0].ticket;
    opened.io.deliver(0);
    rill::complete_read(opened.asset, stale, false);      // twice: ignored
    rill::complete_read(opened.asset, stale + 77, false); // nobody's: ignored
    CHECK(rill::poll(opened.asset, &opened.info) == Status::ok);
    CHECK(opened.memory.blocks.size() == 2);              // the Asset and its tables; the raw bytes are gone
    CHECK(opened.memory.calls == 3);
}

TEST_CASE("a busy IO is asked again; a failed one is final") {
    Opened opened(ball());
    int refusals = 3;
    opened.io.script = [&](const rill::Read&) { return refusals-- > 0 ? Action::refuse : Action::now; };
    CHECK(opened.open() == Status::ok);

    for (int bad = 0; bad < 2; ++bad) {
        Opened failing(ball());
        failing.io.script = [&](const rill::Read& r) { return (r.file_offset > 0) == (bad > 0) ? Action::fail : Action::now; };
        CHECK(failing.open() == Status::read_failed);
        CHECK(failing.poll() == Status::read_failed);
        CHECK(failing.log.size() == 1);
    }
}

TEST_CASE("closing waits for what is out") {
    Opened opened(ball());
    opened.io.script = hold;
    CHECK(opened.open() == Status::pending);
    CHECK(rill::close(opened.asset) == Status::pending);
    CHECK(opened.io.forgotten.size() == 1);
    CHECK(rill::close(opened.asset) == Status::pending);
    CHECK(opened.io.forgotten.size() == 1);  // told once
    opened.io.deliver(0, false);
    CHECK(rill::close(opened.asset) == Status::ok);
    opened.asset = nullptr;
}

TEST_CASE("now before later, coarse before fine, in the direction of play") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.script = hold;
    opened.io.asked.clear();
    Playing playing(opened);
    CHECK(playing.draw(0.1) == Status::clipped);
    CHECK(playing.stats.cut == rill::cut_late);
    CHECK(playing.stats.chunks_late == 6);
    CHECK(playing.stats.reads_in_flight == 16);
    CHECK(playing.target.vertices_used == 0);
    CHECK(chunks_asked(opened) == range(0, 16));  // window 0, then 1, then the beginning of 2
    float last = 0;
    for (const rill::Read& read : opened.io.asked) {
        CHECK(read.seconds_until_needed >= last);
        last = read.seconds_until_needed;
    }
    CHECK(opened.io.asked[6].seconds_until_needed == doctest::Approx(window_seconds - 0.1));
    opened.io.deliver_all();
}

TEST_CASE("played backward the earlier window comes first") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.asked.clear();
    Playing playing(opened);
    playing.frame.rate = -2;
    CHECK(playing.draw(1.5 * window_seconds) == Status::ok);
    std::vector<int> expected = range(6, 12);
    for (const int chunk : range(0, 6)) expected.push_back(chunk);
    for (const int chunk : range(12, 18)) expected.push_back(chunk);
    CHECK(chunks_asked(opened) == expected);
    CHECK(opened.io.asked[6].seconds_until_needed == doctest::Approx(window_seconds / 4));
}

TEST_CASE("late and shuffled reads end in the same picture") {
    uint64_t expected = 0;
    {
        Opened opened(ball());
        REQUIRE(opened.open() == Status::ok);
        Playing playing(opened);
        CHECK(playing.draw(0.4) == Status::ok);
        expected = playing.hash();
    }
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.script = hold;
    Playing playing(opened);
    playing.draw(0.4);
    uint32_t seed = 7, before = 0;
    std::set<uint32_t> drawn;
    for (int step = 0; step < 100 && playing.stats.chunks_late; ++step) {
        seed = seed * 1664525u + 1013904223u;
        if (!opened.io.pending.empty()) opened.io.deliver(seed % opened.io.pending.size());
        CHECK(playing.draw(0.4) >= Status::ok);
        CHECK(playing.stats.points_used >= before);  // never less than was there
        before = playing.stats.points_used;
        drawn.insert(playing.stats.points_used);
    }
    CHECK(playing.draw(0.4) == Status::ok);
    CHECK(playing.hash() == expected);
    CHECK(drawn.size() >= 5);  // it grew chunk by chunk
    opened.io.deliver_all();
}

TEST_CASE("slow motion decodes a window once") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    for (int i = 0; i <= 200; ++i) CHECK(playing.draw(i / 200.0) == Status::ok);
    CHECK(playing.stats.windows_decoded == 3);
    CHECK(playing.stats.bytes_asked == playing.stats.bytes_arrived);
    CHECK(playing.stats.bytes_asked == opened.io.file.size() - rill::format::header_bytes - header_of(ball()).directory_bytes);
}

TEST_CASE("failed reads come back, later; rejected chunks never") {
    Bytes bytes = ball();
    bytes[chunk_of(bytes, 1).offset + 9] ^= 4;
    Opened opened(bytes);
    REQUIRE(opened.open() == Status::ok);
    std::map<uint64_t, int> tries;
    opened.io.script = [&](const rill::Read& r) { return ++tries[r.file_offset] <= 3 ? Action::fail : Action::now; };
    Playing playing(opened);
    int frames = 0;
    do playing.draw(0);
    while (playing.stats.chunks_late && ++frames < 100);
    CHECK(frames >= 6);  // 1 + 2 + 4 … frames apart, not all at once
    CHECK(frames < 40);
    for (int i = 0; i < 20; ++i) playing.draw(0);
    CHECK(playing.stats.reads_failed == 3 * 18);
    CHECK(playing.stats.chunks_rejected == 1);
    CHECK(playing.stats.cut == rill::cut_damaged);
    CHECK(tries[chunk_of(bytes, 1).offset] == 4);
    REQUIRE(opened.log.size() == 1);
    CHECK(opened.log[0].rfind("chunk 1 (window 0, layer 0, block 1) rejected: ", 0) == 0);
}

TEST_CASE("a refusing IO is asked again next frame") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    int accept = 0;
    opened.io.script = [&](const rill::Read&) { return accept-- > 0 ? Action::now : Action::refuse; };
    Playing playing(opened);
    for (uint32_t frame = 0; frame < 6; ++frame) {
        accept = 1;
        playing.draw(0);
        CHECK(playing.stats.chunks_late == 5 - frame);
        CHECK(playing.stats.reads_refused == frame + 1);
    }
}

TEST_CASE("limits and budgets of reading are kept") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.script = hold;
    rill::Limits limits{};
    limits.reads_in_flight = 4;
    Playing playing(opened, limits);
    playing.draw(0);
    CHECK(opened.io.pending.size() == 4);
    CHECK(playing.stats.reads_in_flight == 4);
    opened.io.deliver_all();
    opened.io.script = [](const rill::Read&) { return Action::now; };
    playing.frame.budget.read_bytes = 1;  // less than any chunk: one a frame, or nothing would ever come
    for (int i = 0; i < 4; ++i) {
        const size_t asked = opened.io.asked.size();
        playing.draw(0);
        CHECK(opened.io.asked.size() == asked + 1);
    }
}

TEST_CASE("blocks outside every frustum are not read") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.asked.clear();
    Playing playing(opened);
    set_identity(playing.frame.asset_to_world);
    rill::View view = half_view(1.45f);  // block 0 ends at 0.5, and reaches a little beyond
    playing.frame.views = &view;
    playing.frame.view_count = 1;
    playing.frame.budget.cell_size = 0.08f;
    CHECK(playing.draw(0) == Status::ok);
    CHECK(playing.stats.blocks_in_view == 1);
    CHECK(playing.stats.blocks_drawn == 1);
    for (const int chunk : chunks_asked(opened)) CHECK(chunk_of(ball(), uint32_t(chunk)).block == 1);
    CHECK(opened.io.asked.size() == 9);
    // The same through a transform: twice as large, turned a quarter about z, moved.
    const float turned[12] = {0, -2, 0, 10, 2, 0, 0, 20, 0, 0, 2, 30};
    std::copy(turned, turned + 12, playing.frame.asset_to_world);
    view = half_view(0);
    view.planes[0][0] = 0;
    view.planes[0][1] = 1;  // asset +x is world +y
    view.planes[0][3] = -(20 + 2 * 1.45f);
    const size_t asked = opened.io.asked.size();
    CHECK(playing.draw(0) == Status::ok);
    CHECK(playing.stats.blocks_in_view == 1);
    CHECK(opened.io.asked.size() == asked);
    view.planes[0][3] = 1000;
    CHECK(playing.draw(0) == Status::ok);
    CHECK(playing.stats.blocks_in_view == 2);
    CHECK(opened.io.asked.size() > asked);
}

TEST_CASE("reads nobody wants any more are forgotten") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.script = hold;
    Playing playing(opened);
    playing.frame.rate = 0.001f;  // the next window only
    playing.draw(0);
    CHECK(opened.io.pending.size() == 12);
    playing.draw(1);
    CHECK(opened.io.forgotten.size() == 12);  // window 2 is now, and nothing behind it is wanted
    CHECK(opened.io.pending.size() == 16);    // no more slots until they come back
    playing.draw(1);
    CHECK(opened.io.forgotten.size() == 12);  // told once
    while (opened.io.pending.size() > 4) opened.io.deliver(0, false);
    playing.draw(1);
    CHECK(opened.io.pending.size() == 6);
    CHECK(playing.stats.reads_failed == 0);   // coming back empty was asked for
    opened.io.deliver_all();
    CHECK(playing.draw(1) == Status::ok);
}

TEST_CASE("a small residency holds the coarse and gives up the rest") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    const uint64_t whole = rill::suggest_limits(opened.asset).resident_bytes;
    for (uint64_t bytes = 1; bytes < whole; bytes += whole / 37) {
        rill::Limits limits{};
        limits.resident_bytes = bytes;
        Playing playing(opened, limits);
        for (const double t : {0.0, 0.1, 0.4, 0.5, 0.9, 0.2, 0.0}) {
            const Status status = playing.stream(t);
            CHECK(status >= Status::ok);
            CHECK(playing.stats.bytes_resident <= bytes);
            if (playing.stats.chunks_late) CHECK(playing.stats.cut == rill::cut_residency);
            else CHECK(status == Status::ok);
        }
        const uint64_t asked = playing.stats.bytes_asked;
        for (int i = 0; i < 5; ++i) playing.stream(0.0);
        const uint64_t settled = playing.stats.bytes_asked;
        for (int i = 0; i < 5; ++i) playing.stream(0.0);
        CHECK(playing.stats.bytes_asked == settled);  // standing still nothing is thrown out and read again
        if (bytes > whole / 8) CHECK(asked > 0);
    }
}

TEST_CASE("waiting for data ends, whatever the IO does") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    playing.frame.wait_for_data = true;
    int refusals = 5, failures = 4;
    opened.io.script = [&](const rill::Read&) {
        return refusals-- > 0 ? Action::refuse : failures-- > 0 ? Action::fail : Action::now;
    };
    CHECK(playing.draw(0) == Status::ok);
    CHECK(playing.stats.points_used == 600);
    opened.io.script = [](const rill::Read&) { return Action::fail; };
    Playing hopeless(opened);
    hopeless.frame.wait_for_data = true;
    CHECK(hopeless.draw(0) == Status::clipped);
    CHECK(hopeless.stats.chunks_late == 6);
}

TEST_CASE("of threads that wait at once, one at a time helps as worker 0" * doctest::test_suite("threads")) {
    rill::ThreadPool* pool = rill::start_threads(2);
    const rill::Jobs jobs = rill::thread_jobs(pool);
    struct Shared {
        std::atomic<uint32_t> busy[3]{}, clashes{0}, left{4000};
    } shared;
    const rill::Task task = [](void* user, uint32_t, uint32_t worker) {
        Shared& s = *static_cast<Shared*>(user);
        if (s.busy[worker].fetch_add(1)) ++s.clashes;
        std::this_thread::yield();
        s.busy[worker].fetch_sub(1);
        --s.left;
    };
    jobs.submit(jobs.user, task, &shared, 4000, true);
    std::vector<std::thread> drivers;
    for (int i = 0; i < 3; ++i)
        drivers.emplace_back([&] { while (shared.left) jobs.help(jobs.user); });
    for (std::thread& driver : drivers) driver.join();
    CHECK(shared.clashes == 0);
    rill::stop_threads(pool);
}

TEST_CASE("waiting gets along with files and threads" * doctest::test_suite("threads")) {
    const std::string path = scratch_path("threads.rill");
    write_ball({}, path);
    uint64_t bytes = 0;
    rill::FileReader* file = rill::open_file(path.c_str(), &bytes);
    REQUIRE(file);
    rill::ThreadPool* pool = rill::start_threads(3);
    rill::Host host;
    host.memory = rill::heap_memory();
    host.jobs = rill::thread_jobs(pool);
    rill::Asset* asset = nullptr;
    REQUIRE(rill::open(host, rill::file_io(file), bytes, &asset) == Status::ok);
    Status status;
    rill::AssetInfo info{};
    while ((status = rill::poll(asset, &info)) == Status::pending) {}
    REQUIRE(status == Status::ok);
    rill::Player *one = nullptr, *two = nullptr;
    REQUIRE(rill::create(asset, {}, &one) == Status::ok);
    REQUIRE(rill::create(asset, {}, &two) == Status::ok);
    rill::Target target{};
    for (int i = 0; i < 40; ++i) {
        rill::Frame frame{};
        frame.seconds = (i * 7 % 40) / 40.0;
        frame.rate = i % 2 ? 1.0f : -3.0f;
        frame.target = &target;
        frame.wait_for_data = i % 4 == 0;
        rill::Stats stats{};
        CHECK(rill::begin_frame(one, frame) == Status::ok);
        rill::Target other{};
        frame.target = &other;
        CHECK(rill::begin_frame(two, frame) == Status::ok);  // both at once, over the same threads
        CHECK(rill::end_frame(one, &stats) >= Status::ok);
        CHECK(rill::end_frame(two, nullptr) >= Status::ok);
        if (frame.wait_for_data) CHECK(stats.chunks_late == 0);
    }
    CHECK(rill::close(asset) == Status::bad_argument);  // players live
    for (rill::Player* player : {one, two})
        while (rill::destroy(player) == Status::pending) {}
    while (rill::close(asset) == Status::pending) {}
    rill::close_file(file);
    rill::stop_threads(pool);
    std::filesystem::remove(path);
}

TEST_CASE("destroying waits for reads that point at its memory") {
    Opened opened(ball());
    REQUIRE(opened.open() == Status::ok);
    opened.io.script = hold;
    rill::Player* player = nullptr;
    REQUIRE(rill::create(opened.asset, {}, &player) == Status::ok);
    rill::Frame frame{};
    CHECK(rill::begin_frame(player, frame) == Status::ok);
    CHECK(rill::destroy(player) == Status::bad_argument);  // in the middle of a frame
    CHECK(rill::end_frame(player, nullptr) == Status::clipped);
    CHECK(rill::destroy(player) == Status::pending);
    CHECK(opened.io.forgotten.size() == opened.io.pending.size());
    CHECK(rill::close(opened.asset) == Status::bad_argument);
    const uint64_t ticket = opened.io.pending[0].ticket;
    while (opened.io.pending.size() > 1) opened.io.deliver(opened.io.pending.size() - 1);
    CHECK(rill::destroy(player) == Status::pending);
    opened.io.deliver(0, false);
    CHECK(rill::destroy(player) == Status::ok);
    rill::complete_read(opened.asset, ticket, true);  // too late: nobody is there, nothing happens
}

TEST_CASE("every allocation fails once") {
    for (uint64_t nth = 1; nth <= 4; ++nth) {
        Opened opened(ball());
        opened.memory.fail_at = nth;
        const Status status = opened.open();
        CHECK(status == (nth <= 3 ? Status::out_of_memory : Status::ok));
        if (status != Status::ok) continue;
        rill::Player* player = nullptr;
        CHECK(rill::create(opened.asset, {}, &player) == Status::out_of_memory);
        CHECK(player == nullptr);
        CHECK(rill::create(opened.asset, {}, &player) == Status::ok);  // the fifth
        CHECK(rill::destroy(player) == Status::ok);
    }
}

TEST_CASE("mistakes of the caller are named") {
    Opened opened(ball());
    rill::Asset* asset = nullptr;
    const rill::Io io = opened.io.callbacks();
    rill::Host bad = opened.host;
    bad.api = rill::api_version + 1;
    CHECK(rill::open(bad, io, 1000, &asset) == Status::api_mismatch);
    bad = opened.host;
    bad.memory.allocate = nullptr;
    CHECK(rill::open(bad, io, 1000, &asset) == Status::bad_argument);
    bad = opened.host;
    bad.jobs.submit = [](void*, rill::Task, void*, uint32_t, bool) {};
    CHECK(rill::open(bad, io, 1000, &asset) == Status::bad_argument);  // no help, no workers
    CHECK(rill::open(opened.host, {}, 1000, &asset) == Status::bad_argument);
    CHECK(rill::open(opened.host, io, 1000, nullptr) == Status::bad_argument);
    CHECK(rill::poll(nullptr, nullptr) == Status::bad_argument);
    CHECK(rill::close(nullptr) == Status::bad_argument);
    rill::complete_read(nullptr, 1, true);

    opened.io.script = hold;
    REQUIRE(opened.open() == Status::pending);
    rill::Player* player = nullptr;
    CHECK(rill::create(opened.asset, {}, &player) == Status::bad_argument);  // not open yet
    CHECK(rill::footprint(opened.asset, {}) == 0);
    opened.io.script = [](const rill::Read&) { return Action::now; };
    opened.io.deliver_all();
    REQUIRE(opened.poll() == Status::ok);
    CHECK(rill::create(nullptr, {}, &player) == Status::bad_argument);
    CHECK(rill::create(opened.asset, {}, nullptr) == Status::bad_argument);
    rill::Limits absurd{};
    absurd.resident_bytes = UINT64_MAX;
    CHECK(rill::create(opened.asset, absurd, &player) == Status::out_of_memory);

    Playing playing(opened);
    const auto refused = [&](auto change) {
        rill::Frame frame{};
        set_identity(frame.asset_to_world);
        rill::View view = half_view(0);
        rill::Target target{};
        frame.views = &view;
        frame.view_count = 1;
        frame.target = &target;
        CHECK(rill::begin_frame(playing.player, frame) == Status::ok);
        CHECK(rill::end_frame(playing.player, nullptr) >= Status::ok);
        change(frame, view, target);
        CHECK(rill::begin_frame(playing.player, frame) == Status::bad_argument);
    };
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    using F = rill::Frame;
    using V = rill::View;
    using T = rill::Target;
    refused([&](F& f, V&, T&) { f.seconds = nan; });
    refused([&](F& f, V&, T&) { f.seconds = inf; });
    refused([&](F& f, V&, T&) { f.rate = nan; });
    refused([&](F& f, V&, T&) { f.asset_to_world[3] = nan; });
    refused([&](F& f, V&, T&) { f.asset_to_world[0] = 2; });  // not one scale
    refused([&](F& f, V&, T&) { f.asset_to_world[1] = 1; });  // sheared
    refused([&](F& f, V&, T&) { std::fill(f.asset_to_world, f.asset_to_world + 12, 0.0f); });
    refused([&](F& f, V&, T&) { f.views = nullptr; });
    refused([&](F& f, V&, T&) { f.view_count = 17; });
    refused([&](F& f, V&, T&) { f.budget.pixel_error = -1; });
    refused([&](F& f, V&, T&) { f.budget.cell_size = nan; });
    refused([&](F&, V& v, T&) { v.planes[2][1] = inf; });
    refused([&](F&, V& v, T&) { v.pixels_per_radian = 0; });
    refused([&](F&, V&, T& t) { t.index_capacity = 3; });
    refused([&](F&, V&, T& t) { t.range_capacity = 3; });
    refused([&](F&, V&, T& t) { t.position = {&t, 8}; });

    rill::Frame frame{};
    CHECK(rill::begin_frame(nullptr, frame) == Status::bad_argument);
    CHECK(rill::end_frame(nullptr, nullptr) == Status::bad_argument);
    CHECK(rill::end_frame(playing.player, nullptr) == Status::bad_argument);  // none was begun
    CHECK(rill::begin_frame(playing.player, frame) == Status::ok);
    CHECK(rill::begin_frame(playing.player, frame) == Status::bad_argument);
    CHECK(rill::end_frame(playing.player, nullptr) >= Status::ok);
    CHECK(rill::destroy(nullptr) == Status::bad_argument);
    for (int s = -20; s < 20; ++s) CHECK(std::strlen(rill::text(Status(s))) > 0);
}
