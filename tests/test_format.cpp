// SPDX-License-Identifier: MIT
// File bytes are hostile: ladders over every length and every bit of header and directory.
#include "harness.h"

#include <sys/stat.h>

#include <limits>

#include "asset/asset_player.h"
#include "format/check.h"
#include "format/cursor.h"
#include "format/lattice.h"

using namespace harness;
using rill::Status;

namespace {

/// A header and directory, in blocks of exactly their size, straight to the checks.
Status check(const Bytes& bytes, uint64_t file_bytes, const char** reason) {
    using namespace rill::format;
    const Bytes head(bytes.begin(), bytes.begin() + long(std::min<size_t>(bytes.size(), header_bytes)));
    Header header{};
    Status status = check_header(head.data(), head.size(), file_bytes, header, reason);
    if (status != Status::ok || bytes.size() < size_t(header_bytes) + header.directory_bytes) return status;
    const Bytes directory(bytes.begin() + header_bytes, bytes.begin() + header_bytes + header.directory_bytes);
    std::vector<double> times(header.frame_time_count);
    std::vector<WindowRecord> windows(header.window_count);
    std::vector<ChunkRecord> chunks(header.chunk_count);
    DirectoryTables tables{times.data(), windows.data(), chunks.data(), nullptr, nullptr};
    return check_directory(header, directory.data(), tables, reason);
}

bool is_clear_refusal(Status status) {
    return status == Status::not_an_asset || status == Status::unknown_format || status == Status::corrupt;
}

Clip small_clip() {
    Clip clip;
    clip.frames = 9;
    clip.window = 4;
    clip.points = 60;
    clip.layers = 2;
    return clip;
}

/// Expects `status` once the bytes at `at` of the directory or header hold `value` and the checksums are right.
template <class T>
void refused(Bytes bytes, size_t at, T value, const char* why) {
    put(bytes, at, value);
    seal(bytes);
    Opened opened(bytes);
    CHECK(opened.open() == Status::corrupt);
    REQUIRE(opened.log.size() == 1);
    CHECK(opened.log[0] == why);
}

}  // namespace

TEST_CASE("checksums are the well-known ones") {
    CHECK(rill::format::crc32("123456789", 9) == 0xCBF43926u);
    CHECK(rill::format::crc32("6789", 4, rill::format::crc32("12345", 5)) == 0xCBF43926u);
    CHECK(rill::format::fnv1a(rill::format::fnv1a_start, 0x64636261) == 0xfc179f83ee0724ddu);  // "abcd"
}

TEST_CASE("a cursor never leaves its bytes") {
    const uint8_t bytes[] = {1, 2, 3, 4, 5, 6};
    rill::format::Cursor cursor(bytes, 6);
    CHECK(cursor.u32() == 0x04030201u);
    CHECK_FALSE(cursor.overrun);
    CHECK(cursor.u32() == 0);
    CHECK(cursor.overrun);
    CHECK(cursor.left() == 0);
    CHECK(cursor.take(1) == nullptr);
}

TEST_CASE("what was written is what is read") {
    Clip clip;
    clip.uneven = true;
    clip.drop = true;
    const Bytes bytes = make_ball(clip);
    Opened opened(bytes);
    REQUIRE(opened.open() == Status::ok);
    const rill::AssetInfo& info = opened.info;
    CHECK(info.frames == 25);
    CHECK(info.windows == 3);
    CHECK(info.layers == 3);
    CHECK(info.blocks == 2);
    CHECK(info.first_frame == 5);
    CHECK(info.format == rill::format::current_version);
    CHECK(info.most_points == 601);
    CHECK(info.cell_size == 0.08f);
    CHECK(info.upper[1] == 3.3f);
    CHECK(info.seconds == clip.seconds(24));
    CHECK(std::string(info.settings_json) == clip.settings);
    for (uint32_t f = 0; f < 25; ++f) CHECK(rill::frame_seconds(opened.asset, f) == clip.seconds(f));
    CHECK(rill::frame_seconds(opened.asset, 1000) == clip.seconds(24));
    CHECK(make_ball(clip) == bytes);  // the same input gives the same bytes
}

TEST_CASE("shapes of drops: a step as that of motion, from version 6 on a quarter of it; drops of one sample drift from version 7 on") {
    using namespace rill::format;
    Header header{};
    for (const uint32_t version : {version_4, version_5, version_6, version_7}) {
        CAPTURE(version);
        header.version = version;
        const LatticeSteps steps = steps_of(header, WindowRecord{});
        CHECK(steps.shape_unit == (version < version_6 ? 256 : 64));
        CHECK(steps.lone_drops_drift == (version >= version_7));
        RawTrack raw{};
        raw.position_terms = raw.second_terms = 1, raw.second[0][2] = -3;
        float memory[9];
        Track record;
        TrackBlock block{{}, 0, 0, 1, 9, &record, memory};
        REQUIRE(place_track(raw, steps, true, block, 0, 0));
        CHECK(load(memory + 3 + 2) == -3 * steps.shape_unit);
    }
}

TEST_CASE("room for the mesh: as much surface as there is, however few points it has; no more than three boxes") {
    const auto vertices = [](uint32_t points, float cell) {
        Clip clip;
        clip.points = points, clip.cell = cell;
        Opened opened(make_ball(clip));
        REQUIRE(opened.open() == Status::ok);
        return double(rill::suggest_limits(opened.asset).vertices);
    };
    const double ball = 1.5 * 4 * 3.14159, box = 2 * (3 * 2.2 + 2.2 * 2.2 + 2.2 * 3);  // cells of a mesh; m²
    CHECK(vertices(600, 0.08f) == 200000);
    for (const uint32_t points : {100, 600}) CHECK(vertices(points, 0.004f) * 0.004 * 0.004 == doctest::Approx(ball).epsilon(0.5));
    CHECK(vertices(600, 0.004f) * 0.004 * 0.004 > 0.95 * ball);
    CHECK(vertices(600, 0.004f) * 0.004 * 0.004 < 3 * box);
    CHECK(vertices(600, 1e-6f) == 1 << 24);
}

TEST_CASE("a file cut at any length is refused, and no byte beyond is read") {
    const Bytes whole = make_ball(small_clip());
    for (size_t length = 0; length < whole.size(); ++length) {
        Opened opened(Bytes(whole.begin(), whole.begin() + long(length)));
        const Status status = opened.open();
        INFO(length);
        CHECK(status == (length < 8 ? Status::not_an_asset : Status::corrupt));
        CHECK(opened.log.size() == 1);
        CHECK(opened.memory.largest < 20000);  // nothing sized by what is not there: the Asset itself
    }
    Bytes longer = whole;
    longer.push_back(0);
    CHECK(Opened(longer).open() == Status::corrupt);
}

TEST_CASE("a file that shrinks while it is open fails to be read") {
    const Bytes whole = make_ball(small_clip());
    const size_t needed = rill::format::header_bytes + header_of(whole).directory_bytes;
    for (size_t length = 0; length < needed; length += 7) {
        Opened opened(Bytes(whole.begin(), whole.begin() + long(length)));
        REQUIRE(rill::open(opened.host, opened.io.callbacks(), whole.size(), &opened.asset) == Status::ok);
        CHECK(opened.poll() == Status::read_failed);
    }
}

TEST_CASE("any flipped bit of header or directory is refused") {
    const Bytes whole = make_ball(small_clip());
    const size_t bits = 8 * (rill::format::header_bytes + header_of(whole).directory_bytes);
    for (size_t bit = 0; bit < bits; ++bit) {
        Bytes bytes = whole;
        bytes[bit / 8] ^= uint8_t(1 << bit % 8);
        const char* reason = "";
        INFO(bit);
        CHECK(is_clear_refusal(check(bytes, bytes.size(), &reason)));
        CHECK(std::strlen(reason) > 0);
        if (bit % 8 == 0 || bit / 8 < rill::format::header_bytes) {
            Opened opened(bytes);
            CHECK(is_clear_refusal(opened.open()));
            CHECK(opened.log.size() == 1);
        }
    }
}

TEST_CASE("flips behind right checksums: refused or played, never worse") {
    const Bytes whole = make_ball(small_clip());
    const size_t bits = 8 * (rill::format::header_bytes + header_of(whole).directory_bytes);
    size_t accepted = 0;
    for (size_t bit = 64; bit < bits; ++bit) {
        Bytes bytes = whole;
        bytes[bit / 8] ^= uint8_t(1 << bit % 8);
        const size_t directory_end = rill::format::header_bytes + header_of(bytes).directory_bytes;
        if (directory_end <= bytes.size()) seal(bytes);
        const char* reason = "";
        if (check(bytes, bytes.size(), &reason) != Status::ok) continue;
        if (++accepted % 23) continue;  // playing takes longer
        INFO(bit);
        Opened opened(bytes);
        REQUIRE(opened.open() == Status::ok);
        rill::Limits limits = rill::suggest_limits(opened.asset);
        limits.resident_bytes = std::min<uint64_t>(limits.resident_bytes, 1 << 20);
        limits.points = std::min(limits.points, 10000u);
        limits.vertices = 20000;
        limits.indices = 120000;
        Playing playing(opened, limits);
        playing.frame.wait_for_data = true;
        playing.frame.budget.cell_size = 0.2f;
        CHECK(playing.draw(opened.info.seconds / 2) >= Status::ok);
    }
    CHECK(accepted > 1000);
}

TEST_CASE("every rule of the directory is kept") {
    using namespace rill::format;
    Clip clip = small_clip();
    clip.uneven = true;
    const Bytes good = make_ball(clip);
    const size_t w = windows_at(good), w1 = w + window_record_bytes, c = chunks_at(good);
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    refused(good, offsetof(Header, header_bytes), 129u, "header has a wrong size");
    refused(good, offsetof(Header, walls), 2u | 1u << sharp_rims_shift, "walls are none of its bounds' sides");  // sharp, but no wall
    refused(good, offsetof(Header, walls), 1u << bevel_shift, "walls are none of its bounds' sides");  // of no wall
    refused(good, offsetof(Header, walls), 1u | 1u << walls_bits, "walls are none of its bounds' sides");
    Bytes older = good;
    put(older, offsetof(Header, version), uint32_t(version_4));
    refused(older, offsetof(Header, walls), 1u, "walls are none of its bounds' sides");
    refused(good, offsetof(Header, directory_bytes), 0xFFFFFFFFu, "directory does not fit in the file");
    refused(good, offsetof(Header, chunk_count), 0x7FFFFFFFu, "counts do not add up to the directory's size");
    refused(good, offsetof(Header, frame_count), 0u, "frame or window count is out of range");
    refused(good, offsetof(Header, frame_count), 10u, "table of frame times does not match the frame count");
    refused(good, offsetof(Header, frame_step), 0, "frame numbers are out of range");
    refused(good, offsetof(Header, layer_count), 9u, "layer count is out of range");
    refused(good, offsetof(Header, cell_size), nan, "cell size is not a length");
    refused(good, offsetof(Header, cell_size), 0.0f, "cell size is not a length");
    refused(good, offsetof(Header, frames_per_second), -1.0, "frame rate is out of range");
    refused(good, offsetof(Header, first_seconds), double(nan), "first time is out of range");
    refused(good, offsetof(Header, lower), 1e9f, "bounds are not a box");
    refused(good, header_bytes + 8, -1.0, "a frame time is out of range");
    refused(good, header_bytes + 16, clip.seconds(1), "frame times do not ascend");
    refused(good, w + offsetof(WindowRecord, first_sample), 1u, "windows do not follow each other in time");
    refused(good, w + offsetof(WindowRecord, sample_count), 66u, "windows do not follow each other in time");
    refused(good, w + offsetof(WindowRecord, chunk_count), 0xFFFFFFFFu, "windows do not share out the chunks");
    refused(good, w + offsetof(WindowRecord, block_count), uint16_t(257), "a window's block count is out of range");
    refused(good, w + offsetof(WindowRecord, ratio), uint16_t(15), "a window's steps are not sensible");
    refused(good, w + offsetof(WindowRecord, step), 0.0f, "a window's steps are not sensible");
    refused(good, w + offsetof(WindowRecord, normal_step), nan, "a window's steps are not sensible");
    refused(good, w + offsetof(WindowRecord, slip_step), -1.0f, "a window's steps are not sensible");
    refused(good, w + offsetof(WindowRecord, offset), uint64_t(0), "a chunk lies outside the file or over another part of it");
    refused(good, w + offsetof(WindowRecord, offset), ~uint64_t(0), "a chunk lies outside the file or over another part of it");
    refused(good, w1 + offsetof(WindowRecord, offset), window_of(good, 0).offset, "a chunk lies outside the file or over another part of it");
    refused(good, c + field_bytes, 0xFFFFFFFFu, "a chunk lies outside the file or over another part of it");
    refused(good, c + field_bytes, 0u, "a chunk lies outside the file or over another part of it");
    refused(good, c + field_crc, 1u, "content hash does not match the chunks");
    refused(good, c + field_layer, uint8_t(2), "a chunk's layer or block is out of range");
    refused(good, c + field_block, uint8_t(1), "chunks of a window are not in order of layer and block");
    refused(good, c + field_points + 2, uint8_t(0x20), "a chunk claims more tracks than its bytes can hold");
    refused(good, c + field_drops + 2, uint8_t(0x20), "a chunk claims more tracks than its bytes can hold");
    refused(good, c + field_coefficients, 0xFFFFFFFFu, "a chunk claims more coefficients than its bytes can hold");
    refused(good, c + field_lower, int16_t(32767), "a chunk's bounds are not a box");
    refused(good, c + field_spacing, uint16_t(0xBF80), "a chunk's spacing or error is not a length");  // −1
    refused(good, c + field_spacing + 2, uint16_t(0x7F80), "a chunk's spacing or error is not a length");  // infinite
    const size_t settings = header_bytes + header_of(good).directory_bytes - 4;
    refused(good, settings, '\x1b', "settings are not printable text");
    refused(good, settings, '\xff', "settings are not printable text");
    refused(good, settings + 3, '\xc3', "settings are not printable text");

    Bytes newer = good;
    put(newer, offsetof(Header, version), current_version + 1);
    seal(newer);
    CHECK(Opened(newer).open() == Status::unknown_format);
    Bytes utf8 = good;
    std::memcpy(utf8.data() + settings, "\xc3\xa9\xe2", 2);
    seal(utf8);
    CHECK(Opened(utf8).open() == Status::ok);
}

TEST_CASE("swapped and damaged chunks are rejected one by one") {
    Bytes bytes = make_ball(small_clip());
    const rill::format::ChunkRecord a = chunk_of(bytes, 0), b = chunk_of(bytes, 1);
    for (uint32_t i = 0; i < std::min(a.bytes, b.bytes); ++i) std::swap(bytes[a.offset + i], bytes[b.offset + i]);
    Opened opened(bytes);
    REQUIRE(opened.open() == Status::ok);
    Playing playing(opened);
    playing.frame.wait_for_data = true;
    CHECK(playing.draw(0) >= Status::ok);
    CHECK(playing.stats.chunks_rejected == 2);
    CHECK(playing.stats.points_used > 0);  // the finer layer is drawn all the same
}

TEST_CASE("an asset appears whole or not at all") {
    using rill::cooker::AssetWriter;
    using rill::cooker::InputError;
    const Clip clip = small_clip();
    const std::string path = scratch_path("out.rill");
    const auto nothing_left = [](const std::string& target) {
        for (const char* end : {"", ".partial", ".spool"})
            if (std::filesystem::exists(target + end)) return false;
        return true;
    };
    {
        AssetWriter writer(path);
        writer.add_window(0, 5, 2, ball_chunks(clip, 0, 5));
    }
    CHECK(nothing_left(path));
    {
        AssetWriter writer(path);
        writer.add_window(0, 9, 2, ball_chunks(clip, 0, 9));
        rill::cooker::AssetFacts facts = ball_facts(clip);
        facts.cell_size = -1;
        CHECK_THROWS_WITH_AS(writer.finish(facts), (path + ": cannot be stored as an asset: cell size is not a length").c_str(), InputError);
    }
    CHECK(nothing_left(path));
    const std::string nowhere = path + ".missing/out.rill";
    CHECK_THROWS_WITH_AS(AssetWriter{nowhere}, (nowhere + ".spool: cannot be written: No such file or directory").c_str(), InputError);
    std::filesystem::create_directory(path);  // cannot be renamed over
    {
        AssetWriter writer(path);
        writer.add_window(0, 9, 2, ball_chunks(clip, 0, 9));
        CHECK_THROWS_AS(writer.finish(ball_facts(clip)), InputError);
    }
    CHECK_FALSE(std::filesystem::exists(path + ".partial"));
    CHECK_FALSE(std::filesystem::exists(path + ".spool"));
    std::filesystem::remove(path);
    write_ball(clip, path);
    CHECK(std::filesystem::exists(path));
    std::filesystem::remove(path);
    CHECK(nothing_left(path));
}

TEST_CASE("stored bounds hold what a chunk does, and stay what they are when windows are copied") {
    using namespace rill::cooker;
    Clip clip = small_clip();
    clip.across = 3, clip.points = 300;  // many boxes
    const std::string path = scratch_path("bounds.rill"), copy = scratch_path("copy.rill");
    write_ball(clip, path);
    const AssetDirectory directory = read_directory(path);
    const double unit = rill::format::bounds_unit(directory.header);
    CHECK(unit < 0.1 * clip.cell);
    const std::vector<ChunkToWrite> given = ball_chunks(clip, 0, 5);
    REQUIRE(directory.windows[0].chunk_count == given.size());
    for (size_t i = 0; i < given.size(); ++i)
        for (int a = 0; a < 3; ++a) {
            const rill::format::ChunkRecord& stored = directory.chunks[i];
            CHECK(stored.lower[a] <= given[i].lower[a]);
            CHECK(stored.lower[a] > given[i].lower[a] - 1.01 * unit);
            CHECK(stored.upper[a] >= given[i].upper[a]);
            CHECK(stored.upper[a] < given[i].upper[a] + 1.01 * unit);
            CHECK(stored.spacing == doctest::Approx(given[i].spacing).epsilon(0.004));
        }
    AssetWriter writer(copy);
    writer.append(directory, 0);
    writer.finish(ball_facts(clip));
    CHECK(read_file(copy) == read_file(path));
    std::filesystem::remove(path), std::filesystem::remove(copy);
}

TEST_CASE("what the directory cannot say is not written") {
    using namespace rill::cooker;
    const Clip clip = small_clip();
    const std::string path = scratch_path("none.rill"), sorry = path + ": cannot be stored as an asset: ";
    const auto written = [&](const std::function<void(ChunkToWrite&, AssetFacts&)>& spoil) {
        AssetWriter writer(path);
        std::vector<ChunkToWrite> chunks = ball_chunks(clip, 0, clip.frames);
        AssetFacts facts = ball_facts(clip);
        spoil(chunks[1], facts);
        writer.add_window(0, clip.frames, 2, std::move(chunks));
        writer.finish(facts);
    };
    CHECK_THROWS_WITH_AS(written([](ChunkToWrite& c, AssetFacts&) { c.upper.y = 1000; }), (sorry + "a chunk reaches far out of the bounds").c_str(), InputError);
    CHECK_THROWS_WITH_AS(written([](ChunkToWrite& c, AssetFacts&) { c.encoded.shape.steps.step *= 2; }),
                         (sorry + "the chunks of a window have different steps").c_str(), InputError);
    CHECK_THROWS_WITH_AS(written([](ChunkToWrite&, AssetFacts& facts) { facts.lower.x -= 1; }),
                         (sorry + "its positions are told from different places").c_str(), InputError);
    CHECK_FALSE(std::filesystem::exists(path));
    CHECK_FALSE(std::filesystem::exists(path + ".spool"));
    written([](ChunkToWrite&, AssetFacts&) {});
    CHECK(std::filesystem::exists(path));
    std::filesystem::remove(path);
}

TEST_CASE("a full disk is reported") {
    if (!std::filesystem::exists("/dev/full")) return;
    const std::string path = scratch_path("full.rill");
    std::filesystem::create_symlink("/dev/full", path + ".spool");
    const Clip clip = small_clip();
    {
        rill::cooker::AssetWriter writer(path);
        CHECK_THROWS_WITH_AS(writer.add_window(0, 9, 2, ball_chunks(clip, 0, 9)),
                             (path + ".spool: cannot be written: No space left on device").c_str(), rill::cooker::InputError);
    }
    CHECK_FALSE(std::filesystem::exists(std::filesystem::symlink_status(path + ".spool")));
}

TEST_CASE("the cooker's player names file and cause") {
    using rill::cooker::AssetPlayer;
    using rill::cooker::InputError;
    const std::string path = scratch_path("bad.rill");
    CHECK_THROWS_WITH_AS(AssetPlayer{path}, (path + ": cannot be opened: No such file or directory").c_str(), InputError);
    std::ofstream(path) << "solid teapot";
    CHECK_THROWS_WITH_AS(AssetPlayer{path}, (path + ": not a .rill file (file does not begin as a .rill file)").c_str(), InputError);
    Bytes bytes = make_ball(small_clip());
    bytes[chunk_of(bytes, 0).offset] ^= 1;
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), long(bytes.size()));
    AssetPlayer player(path);
    CHECK_THROWS_AS(player.mesh(0), InputError);
    std::filesystem::remove(path);
}
