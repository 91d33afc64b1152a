// SPDX-License-Identifier: MIT
// Alembic: files that the Alembic library wrote, archives put together here, and damaged ones.
#include <doctest/doctest.h>

#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "frames/open_sequence.h"
#include "reader_faults.h"
#include "sequence_files.h"
#include "shapes.h"

using namespace rill::cooker;

namespace {

const std::string data_folder = RILL_TEST_DATA "/alembic/";

Mesh frame(int number) {
    char name[32];
    std::snprintf(name, sizeof name, "frame_%04d.ply", number);
    return open_sequence(data_folder + name, {})->read(0);
}

/// Writes the container: children before parents, positions handed upward.
struct Ogawa {
    std::string bytes = std::string("Ogawa\xff\0\1", 8) + std::string(8, '\0');
    static constexpr uint64_t data_bit = uint64_t(1) << 63;

    uint64_t data(const std::string& content) {
        if (content.empty()) return data_bit;
        const uint64_t at = bytes.size();
        put(bytes, uint64_t(content.size()));
        bytes += content;
        return at | data_bit;
    }
    uint64_t sample(const std::string& content) { return data(std::string(16, 'k') + content); }
    uint64_t group(const std::vector<uint64_t>& children) {
        if (children.empty()) return 0;
        const uint64_t at = bytes.size();
        put(bytes, uint64_t(children.size()));
        for (uint64_t child : children) put(bytes, child);
        return at;
    }
    struct Property {
        std::string name;
        uint64_t node;
        uint32_t info;        // type bits; samples and sampling are added where it is no compound
        uint32_t samples = 0, sampling = 0;
    };
    static constexpr uint32_t uint8_pod = 1 << 4, int8_pod = 2 << 4, int32_pod = 6 << 4, float_pod = 10 << 4, double_pod = 11 << 4, boolean_pod = 0;

    Property array(const std::string& name, uint32_t pod, uint32_t extent, const std::vector<std::string>& samples, uint32_t sampling = 0) {
        std::vector<uint64_t> parts;
        for (const std::string& s : samples) parts.push_back(sample(s)), parts.push_back(data(""));
        return {name, group(parts), 2 | pod | extent << 12, uint32_t(samples.size()), sampling};
    }
    Property scalar(const std::string& name, uint32_t pod, uint32_t extent, const std::vector<std::string>& samples, uint32_t sampling = 0) {
        std::vector<uint64_t> parts;
        for (const std::string& s : samples) parts.push_back(sample(s));
        return {name, group(parts), 1 | pod | extent << 12, uint32_t(samples.size()), sampling};
    }
    uint64_t properties(const std::vector<Property>& all) {
        std::vector<uint64_t> parts;
        std::string headers;
        for (const Property& p : all) {
            parts.push_back(p.node);
            const bool value = (p.info & 3) != 0;
            put(headers, p.info | 2 << 2 | (value ? 0x100u : 0u));
            if (value) put(headers, p.samples), put(headers, p.sampling);
            put(headers, uint32_t(p.name.size()));
            headers += p.name;
        }
        parts.push_back(data(headers));
        return group(parts);
    }
    Property compound(const std::string& name, const std::vector<Property>& all) { return {name, properties(all), 0}; }
    struct Object {
        std::string name;
        uint64_t node;
    };
    Object object(const std::string& name, const std::vector<Property>& own, const std::vector<Object>& children = {}) {
        std::vector<uint64_t> parts = {properties(own)};
        std::string headers;
        for (const Object& child : children) {
            parts.push_back(child.node);
            put(headers, uint32_t(child.name.size()));
            headers += child.name + '\0';
        }
        parts.push_back(data(headers + std::string(32, 'h')));
        return {name, group(parts)};
    }
    struct Sampling {
        double cycle;
        std::vector<double> times;
    };
    std::string archive(const std::vector<Object>& top, const std::vector<Sampling>& samplings) {
        const uint64_t root = object("", {}, top).node;
        std::string times;
        for (const Sampling& s : samplings) {
            put(times, uint32_t(1)), put(times, s.cycle), put(times, uint32_t(s.times.size()));
            for (double t : s.times) put(times, t);
        }
        const std::vector<uint64_t> parts = {data(std::string(4, '\0')), data("<*\0\0"), root, data("made=here"), data(times), data("")};
        const uint64_t at = group(parts);
        std::memcpy(bytes.data() + 8, &at, 8);
        return bytes;
    }
};

template <class T>
std::string raw(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}
const double acyclic = std::numeric_limits<double>::max() / 32;

/// A ball that grows from sample to sample, as a mesh object; `change` may alter its properties.
struct Ball {
    int samples = 3;
    uint32_t sampling = 0;
    bool velocity = true;
    std::function<void(Ogawa&, std::vector<Ogawa::Property>&)> change;
    static Mesh at(int sample) { return bumpy_sphere(5 + sample, 0.5f); }
    Ogawa::Object object(Ogawa& out, const std::string& name, std::vector<Ogawa::Property> own = {}) const {
        std::vector<std::string> positions, velocities, corners, counts;
        for (int s = 0; s < samples; ++s) {
            const Mesh mesh = at(s);
            std::vector<int32_t> indices;
            for (const Triangle& t : mesh.triangles)
                for (int k : {2, 1, 0}) indices.push_back(int32_t(t[size_t(k)]));
            positions.push_back(raw(mesh.positions));
            velocities.push_back(raw(std::vector<glm::vec3>(mesh.positions.size(), {1, 2, 3})));
            corners.push_back(raw(indices));
            counts.push_back(raw(std::vector<int32_t>(mesh.triangles.size(), 3)));
        }
        std::vector<Ogawa::Property> parts = {out.array("P", Ogawa::float_pod, 3, positions, sampling),
                                              out.array(".faceIndices", Ogawa::int32_pod, 1, corners, sampling),
                                              out.array(".faceCounts", Ogawa::int32_pod, 1, counts, sampling)};
        if (velocity) parts.push_back(out.array(".velocities", Ogawa::float_pod, 3, velocities, sampling));
        if (change) change(out, parts);
        own.push_back(out.compound(".geom", parts));
        return out.object(name, own);
    }
};
std::string one_ball(const Ball& ball, const std::vector<Ogawa::Sampling>& samplings) {
    Ogawa out;
    return out.archive({ball.object(out, "ball")}, samplings);
}

}  // namespace

TEST_CASE("a file of the Alembic library: uniform sampling, .velocities, changing topology") {
    const auto reader = open_sequence(data_folder + "plain.abc", {});
    const SequenceInfo& info = reader->info();
    CHECK(info.format == "Alembic");
    CHECK(info.numbers == std::vector<int>{8, 9, 10, 11, 12, 13, 14, 15});
    CHECK(info.frames_per_second == 24);
    CHECK(info.seconds[7] == doctest::Approx(15 / 24.0));
    CHECK(info.velocity == VelocityMeaning::unknown);
    for (const int number : {8, 10, 13}) {
        const Mesh expected = frame(number), mesh = reader->read(size_t(number - 8));
        CHECK(mesh.positions == expected.positions);
        CHECK(mesh.velocities == expected.velocities);
        CHECK(mesh.triangles.size() == expected.triangles.size());
        CHECK(signed_volume(mesh) == doctest::Approx(signed_volume(expected)));
        CHECK(signed_volume(mesh) > 0);
    }
}

TEST_CASE("a file of the Alembic library: acyclic sampling, an animated parent, velocity as a geom param") {
    const auto reader = open_sequence(data_folder + "xform.abc", {});
    CHECK(reader->info().numbers == std::vector<int>{8, 9, 10, 11, 12, 13});
    CHECK(reader->info().frames_per_second == 30);
    for (const int number : {8, 10, 13}) {
        const Mesh expected = frame(number), mesh = reader->read(size_t(number - 8));
        const glm::dmat4 parent = glm::translate(glm::dmat4(1), {0.1 * (number - 8), 2, -1}) *
                                  glm::rotate(glm::dmat4(1), glm::radians(30.0), {0, 1, 0}) * glm::scale(glm::dmat4(1), glm::dvec3(2));
        REQUIRE(mesh.positions.size() == expected.positions.size());
        REQUIRE(mesh.velocities.size() == expected.positions.size());
        CHECK(signed_volume(mesh) == doctest::Approx(8 * signed_volume(expected)));
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            REQUIRE(glm::distance(glm::dvec3(mesh.positions[i]), glm::dvec3(parent * glm::dvec4(expected.positions[i], 1))) < 1e-5);
            const glm::dvec3 carried = glm::dmat3(parent) * glm::dvec3(expected.velocities[i]) + glm::dvec3(3, 0, 0);  // 0.1 m in 1/30 s
            REQUIRE(glm::distance(glm::dvec3(mesh.velocities[i]), carried) < 1e-4);
        }
    }
}

TEST_CASE("rates, gaps and uneven times") {
    const TestFolder folder;
    const std::string file = folder / "a.abc";
    const auto info = [&](const std::vector<double>& times, double cycle, int samples) {
        Ball ball;
        ball.samples = samples;
        put_file(file, one_ball(ball, {{cycle, times}}));
        return open_sequence(file, {})->info();
    };
    SequenceInfo got = info({0.5}, 1 / 120.0, 4);  // uniform, 120 Hz
    CHECK(got.frames_per_second == 120);
    CHECK(got.numbers == std::vector<int>{60, 61, 62, 63});
    CHECK(got.seconds[3] == doctest::Approx(63 / 120.0));
    got = info({0, 0.3 / 24}, 1 / 24.0, 4);  // cyclic: two samples a frame, unevenly
    CHECK(got.frames_per_second == 48);
    CHECK(got.numbers == std::vector<int>{1, 2, 3, 4});
    CHECK(got.seconds[1] * got.frames_per_second / (got.seconds[2] * got.frames_per_second) == doctest::Approx(0.3));
    CHECK(got.seconds[3] - got.seconds[2] == doctest::Approx(got.seconds[1] - got.seconds[0]));
    got = info({1.0}, 1 / 24.0, 1);
    CHECK(got.numbers == std::vector<int>{24});
    CHECK(open_sequence(file, {})->read(0).velocities[0] == glm::vec3(1, 2, 3));
    Ball ball;
    ball.samples = 4;
    put_file(file, one_ball(ball, {{acyclic, {1 / 30.0, 2 / 30.0, 3 / 30.0, 5 / 30.0}}}));
    ReadOptions options;
    std::string said;
    options.warn = [&](const std::string& message) { said = message; };
    const auto gap = open_sequence(file, options);
    CHECK(gap->info().numbers == std::vector<int>{1, 2, 3, 5});
    CHECK(gap->info().seconds[3] - gap->info().seconds[2] == doctest::Approx(2 / 30.0));
    CHECK(said.find("frame 4 is missing") != std::string::npos);
    options.first = 1, options.last = 3, options.step = 1;
    CHECK(open_sequence(file, options)->info().numbers.size() == 3);
    options = {};
    options.frames_per_second = 60, options.velocity_per_frame = true;
    ball.samples = 2;
    put_file(file, one_ball(ball, {{1 / 30.0, {0}}}));
    const auto fast = open_sequence(file, options);
    CHECK(fast->info().seconds[1] == doctest::Approx(1 / 60.0));
    CHECK(fast->read(1).velocities[0].z == doctest::Approx(3 * 60));
}

TEST_CASE("several objects, one hidden at times, one that does not inherit, an indexed parameter, a polygon") {
    const TestFolder folder;
    Ogawa out;
    Ball ball;
    const std::vector<double> away = {0, 0, 10};
    const auto move = [&](bool inherits) {
        return out.compound(".xform", {out.scalar(".inherits", Ogawa::boolean_pod, 1, {std::string(1, char(inherits))}),
                                       out.scalar(".ops", Ogawa::uint8_pod, 1, {std::string(1, char(0x10))}),
                                       out.scalar(".vals", Ogawa::double_pod, 3, {raw(away)})});
    };
    const auto first = ball.object(out, "first");
    const auto second = ball.object(out, "second", {out.scalar("visible", Ogawa::int8_pod, 1, {"\1", std::string(1, '\0'), "\1"})});
    const auto group = out.object("group", {move(true)}, {out.object("free", {move(false)}, {first}), second});
    put_file(folder / "m.abc", out.archive({group}, {{1 / 24.0, {0}}}));
    const auto reader = open_sequence(folder / "m.abc", {});
    const size_t n = Ball::at(0).positions.size();
    const Mesh mesh = reader->read(0);
    REQUIRE(mesh.positions.size() == 2 * n);
    CHECK(mesh.positions[0] == Ball::at(0).positions[0] + glm::vec3(0, 0, 10));
    CHECK(mesh.positions[n] == Ball::at(0).positions[0] + glm::vec3(0, 0, 10));
    CHECK(reader->read(1).positions.size() == Ball::at(1).positions.size());
    CHECK(reader->read(2).positions.size() == 2 * Ball::at(2).positions.size());

    Ogawa other;
    const Mesh cube = Ball::at(0);
    const std::vector<glm::vec3> square = {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}}, speeds = {{9, 0, 0}, {0, 9, 0}};
    const std::vector<Ogawa::Property> params = {
        other.compound("Vel", {other.array(".vals", Ogawa::float_pod, 3, {raw(speeds)}),
                               other.array(".indices", Ogawa::int32_pod, 1, {raw(std::vector<int32_t>{0, 1, 1, 0})})})};
    const auto quad = other.object("quad", {other.compound(".geom", {other.array("P", Ogawa::float_pod, 3, {raw(square)}),
                                                                     other.array(".faceIndices", Ogawa::int32_pod, 1, {raw(std::vector<int32_t>{0, 1, 2, 3})}),
                                                                     other.array(".faceCounts", Ogawa::int32_pod, 1, {raw(std::vector<int32_t>{4})}),
                                                                     other.compound(".arbGeomParams", params)})});
    put_file(folder / "q.abc", other.archive({quad}, {{1, {0}}}));
    const Mesh flat = open_sequence(folder / "q.abc", {})->read(0);
    CHECK(flat.triangles == std::vector<Triangle>{{0, 2, 1}, {0, 3, 2}});
    CHECK(flat.velocities == std::vector<glm::vec3>{{9, 0, 0}, {0, 9, 0}, {0, 9, 0}, {9, 0, 0}});
    ReadOptions options;
    options.velocity_name = "flow";
    CHECK_FAULT(fault(folder / "q.abc", options), "q.abc", "flow");
}

TEST_CASE("a file per frame") {
    const TestFolder folder;
    Ball ball;
    ball.samples = 1;
    for (int number : {4, 5}) put_file(folder / ("s_000" + std::to_string(number) + ".abc"), one_ball(ball, {{1 / 24.0, {0}}}));
    const auto reader = open_sequence(folder.path.string(), {});
    CHECK(reader->info().numbers == std::vector<int>{4, 5});
    CHECK(reader->read(1).positions == Ball::at(0).positions);
}

TEST_CASE("damage") {
    const TestFolder folder;
    const std::string file = folder / "a.abc";
    Ball ball;
    ball.samples = 2;
    const std::string good = one_ball(ball, {{1 / 24.0, {0}}});
    put_file(file, good);
    CHECK(fault(file) == "");
    CHECK(damage_everywhere(file, file, "a.abc", 5) > 500);
    const std::string real = get_file(data_folder + "xform.abc");
    put_file(file, real);
    CHECK(damage_everywhere(file, file, "a.abc", 9973) > 30);
    for (size_t at = real.size() - 4000; at < real.size(); at += 3) {  // where the headers are
        std::string bytes = real;
        bytes[at] = char(bytes[at] ^ 0x55);
        put_file(file, bytes);
        if (const std::string text = fault(file); !text.empty()) REQUIRE(text.find("a.abc") != std::string::npos);
    }
    const auto with = [&](std::function<void(Ogawa&, std::vector<Ogawa::Property>&)> change, std::vector<Ogawa::Sampling> times = {{1, {0}}}) {
        Ball bad = ball;
        bad.change = std::move(change);
        put_file(file, one_ball(bad, times));
        return fault(file);
    };
    using Parts = std::vector<Ogawa::Property>;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    CHECK_FAULT(with([](Ogawa&, Parts& p) { p[0].samples = 4000000000u; }), "a.abc", "'P'", "samples");
    CHECK_FAULT(with([](Ogawa&, Parts& p) { p[0].samples = 9; }), "a.abc", "'P'", "lacks sample");
    CHECK_FAULT(with([](Ogawa&, Parts& p) { p[0].sampling = 7; }), "a.abc", "time sampling 7");
    CHECK_FAULT(with([](Ogawa& o, Parts& p) { p[0] = o.array("P", Ogawa::int32_pod, 3, {"123"}); }), "a.abc", "'P'", "floats");
    CHECK_FAULT(with([](Ogawa& o, Parts& p) { p[0] = o.array("P", Ogawa::float_pod, 3, {std::string(13, 'x')}); }), "a.abc", "'P'", "middle");
    CHECK_FAULT(with([&](Ogawa& o, Parts& p) { p[0] = o.array("P", Ogawa::float_pod, 3, {raw(std::vector<float>(3 * Ball::at(0).positions.size(), nan))}); }),
                "a.abc", "not finite");
    CHECK_FAULT(with([](Ogawa& o, Parts& p) { p[1] = o.array(".faceIndices", Ogawa::int32_pod, 1, {raw(std::vector<int32_t>(300, -1))}); }), "a.abc", "4294967295");
    CHECK_FAULT(with([](Ogawa& o, Parts& p) { p[2] = o.array(".faceCounts", Ogawa::int32_pod, 1, {raw(std::vector<int32_t>{-5})}); }), "a.abc", "counts more corners");
    CHECK_FAULT(with([](Ogawa& o, Parts& p) { p[2] = o.array(".faceCounts", Ogawa::int32_pod, 1, {raw(std::vector<int32_t>{3})}); }), "a.abc", "belong to no face");
    CHECK_FAULT(with([](Ogawa& o, Parts& p) { p[3] = o.array(".velocities", Ogawa::float_pod, 3, {std::string(24, '\0')}); }), "a.abc", ".velocities", "has 2 values");
    CHECK_FAULT(with([](Ogawa&, Parts& p) { p.erase(p.begin()); }), "a.abc", "no polygon mesh");
    CHECK_FAULT(with({}, {{1, {nan}}}), "a.abc", "ascend");
    CHECK_FAULT(with({}, {{acyclic, {1, 1}}}), "a.abc", "ascend");
    CHECK_FAULT(with({}, {{acyclic, {1}}}), "a.abc", "samples");
    CHECK_FAULT(with({}, {{-1, {0}}}), "a.abc", "ascend");

    std::string loop = good;  // the group of all objects holds itself
    uint64_t root = 0, top = 0;
    std::memcpy(&root, loop.data() + 8, 8);
    std::memcpy(&top, loop.data() + root + 8 + 16, 8);
    std::memcpy(loop.data() + top + 8 + 8, &top, 8);
    put_file(file, loop);
    CHECK_FAULT(fault(file), "a.abc", "without end");
    put_file(file, "");
    CHECK_FAULT(fault(file), "a.abc", "empty");
    put_file(file, std::string("\x89HDF\r\n\x1a\n", 8) + std::string(100, 'x'));
    CHECK_FAULT(fault(file), "a.abc", "HDF5");
    std::string open = good;
    open[5] = '\0';
    put_file(file, open);
    CHECK_FAULT(fault(file), "a.abc", "not finished");
    CHECK_FAULT(fault(folder / "gone.abc"), "gone.abc");
}
