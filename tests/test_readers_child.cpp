// SPDX-License-Identifier: MIT
// What happens to a library in a child process happens to nobody else.
#include <doctest/doctest.h>

#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "reader_faults.h"
#include "readers/mesh_in_child.h"
#include "shapes.h"

using namespace rill::cooker;

namespace {

constexpr ChildLimits usual = {uint64_t(1) << 30, 60, 600};

std::string cause_of(const std::function<Mesh()>& work, const ChildLimits& limits = usual) {
    try {
        mesh_in_child("f1.vdb", limits, work);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("a mesh comes back as it is, larger than a pipe holds") {
    Mesh sent = bumpy_sphere(160, 1);
    sent.velocities.assign(sent.positions.size(), {1, 2, 3});
    REQUIRE(sent.triangles.size() * sizeof(Triangle) > 65536);
    const Mesh mesh = mesh_in_child("f1.vdb", usual, [&] { return sent; });
    CHECK(mesh.positions == sent.positions);
    CHECK(mesh.normals == sent.normals);
    CHECK(mesh.velocities == sent.velocities);
    CHECK(mesh.triangles == sent.triangles);
    CHECK(mesh_in_child("f1.vdb", usual, [] { return Mesh(); }).positions.empty());
}

TEST_CASE("failures are told in one short line") {
    CHECK(cause_of([]() -> Mesh { throw InputError("no level set"); }) == "f1.vdb: not usable: no level set");
    CHECK(cause_of([]() -> Mesh { throw std::runtime_error("two\nlines"); }) == "f1.vdb: not usable: two lines");
    CHECK(cause_of([]() -> Mesh { throw std::runtime_error(std::string(1 << 20, 'x')); }).size() < 400);
}

TEST_CASE("a crash, an endless loop, an endless wait and a hunger for memory end there") {
    const auto forever = []() -> Mesh {
        for (volatile bool go = true; go;) {}
        return {};
    };
    CHECK(cause_of([]() -> Mesh { std::_Exit(3); }) == "f1.vdb: not usable: reading it crashes");
    CHECK(cause_of([] { return std::raise(SIGKILL) ? Mesh() : Mesh(); }) == "f1.vdb: not usable: reading it crashes");
    CHECK(cause_of(forever, {usual.memory, 1, 600}) == "f1.vdb: not usable: reading takes too long");
    const auto stuck = []() -> Mesh {
        for (;;) pause();
    };
    CHECK(cause_of(stuck, {usual.memory, 60, 1}) == "f1.vdb: not usable: reading takes too long");
    const auto eat = [] {
        Mesh mesh;
        mesh.positions.resize((size_t(1) << 31) / sizeof(glm::vec3));
        return mesh;
    };
    CHECK(cause_of(eat).find("f1.vdb: not usable: ") == 0);  // the words are the allocator's, or it crashes
}
