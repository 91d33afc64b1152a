// SPDX-License-Identifier: MIT
// rill-player and rill-hello as programs: what they draw without a display, and how they fail.
#include <doctest/doctest.h>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <nlohmann/json.hpp>

#include "cook/cook.h"
#include "rill/rill.h"
#include "shapes.h"

namespace fs = std::filesystem;

namespace {

std::string read_file(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::stringstream out;
    out << in.rdbuf();
    return out.str();
}

void write_file(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

/// A ball that falls one metre per second: frame n of 24 a second, as a PLY with velocities.
void write_frame(const fs::path& path, int number) {
    rill::cooker::Mesh mesh = sphere(48, 0.4f, {0, 0, 2.0f - float(number) / 24.0f});
    std::ostringstream out;
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.positions.size();
    for (const char* name : {"x", "y", "z", "vx", "vy", "vz"}) out << "\nproperty float " << name;
    out << "\nelement face " << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const glm::vec3& position : mesh.positions) {
        const float row[6] = {position.x, position.y, position.z, 0, 0, -1};
        out.write(reinterpret_cast<const char*>(row), sizeof row);
    }
    for (const auto& triangle : mesh.triangles) {
        out.put(3);
        for (int c = 0; c < 3; ++c) out.write(reinterpret_cast<const char*>(&triangle[c]), 4);
    }
    write_file(path, out.str());
}

/// A folder with the frames 15:20 and their asset, cooked once and gone with the process.
struct Bench {
    fs::path folder = fs::temp_directory_path() / ("rill_test_player_" + std::to_string(getpid()));
    std::string asset = (folder / "ball.rill").string();
    Bench() {
        fs::create_directories(folder / "frames");
        for (int frame = 15; frame <= 20; ++frame)
            write_frame(folder / "frames" / ("ball_00" + std::to_string(frame) + ".ply"), frame);
        rill::cooker::CookSettings settings;
        settings.error = "1e";
        rill::cooker::cook((folder / "frames").string(), asset, settings, [](const rill::cooker::CookProgress&) {});
    }
    ~Bench() { fs::remove_all(folder); }
    std::string path(const char* name) const { return (folder / name).string(); }
};

Bench& bench() {
    static Bench made;
    return made;
}

struct Outcome {
    int code;
    std::string errors;
};

/// Runs without a display; `code` is −1 when the program died of a signal.
Outcome run(const std::string& program, const std::string& arguments) {
    const std::string errors = bench().path("stderr.txt");
    const std::string command = "cd '" + bench().folder.string() + "' && env -u DISPLAY -u WAYLAND_DISPLAY '" + program + "' " +
                                arguments + " >/dev/null 2>'" + errors + "'";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(errors)};
}
Outcome play(const std::string& arguments) { return run(RILL_PLAYER, arguments); }

struct Image {
    int width = 0, height = 0;
    std::vector<uint8_t> rgb;
    explicit Image(const std::string& path) {
        int channels = 0;
        if (uint8_t* pixels = stbi_load(path.c_str(), &width, &height, &channels, 3)) {
            rgb.assign(pixels, pixels + size_t(width) * height * 3);
            stbi_image_free(pixels);
        }
    }
};

/// Mean difference of two pictures, 0 to 255.
double difference(const Image& a, const Image& b) {
    REQUIRE(a.rgb.size() == b.rgb.size());
    REQUIRE(!a.rgb.empty());
    double sum = 0;
    for (size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(int(a.rgb[i]) - int(b.rgb[i]));
    return sum / double(a.rgb.size());
}

bool mentions(const Outcome& outcome, const char* text) { return outcome.errors.find(text) != std::string::npos; }

}  // namespace

TEST_CASE("headless playback writes pictures, a sheet and statistics") {
    const Outcome outcome = play("ball.rill --headless --frames 16:19 --size 320x180 --out a%04d.png"
                                 " --contact-sheet sheet.png --stats stats.json --jobs 2");
    CHECK(outcome.code == 0);
    CHECK(outcome.errors == "");
    for (const char* name : {"a0016.png", "a0017.png", "a0018.png", "a0019.png"}) {
        const Image image(bench().path(name));
        CHECK(image.width == 320);
        CHECK(image.height == 180);
    }
    CHECK_FALSE(fs::exists(bench().path("a0015.png")));
    CHECK(difference(Image(bench().path("a0016.png")), Image(bench().path("a0019.png"))) > 0.5);
    CHECK(Image(bench().path("sheet.png")).width >= 320);
    const nlohmann::json stats = nlohmann::json::parse(read_file(bench().path("stats.json")));
    REQUIRE(stats["frames"].size() == 4);
    for (const auto& frame : stats["frames"]) {
        CHECK(frame["triangles"].get<int>() > 500);
        CHECK(frame["cut"].get<int>() == 0);
        CHECK(frame["status"] == rill::text(rill::Status::ok));
    }
    CHECK(stats["frames"][0]["frame"] == 16);
    CHECK(stats["summary"]["allocations_after_create"] == 0);
}

TEST_CASE("slow motion: pictures between frames") {
    const Outcome outcome = play("ball.rill --headless --frames 16:18 --substeps 4 --size 320x180 --out s%02d.png --stats slow.json");
    CHECK(outcome.code == 0);
    for (int picture = 0; picture <= 8; ++picture) CHECK(fs::exists(bench().path(("s0" + std::to_string(picture) + ".png").c_str())));
    CHECK_FALSE(fs::exists(bench().path("s09.png")));
    const nlohmann::json frames = nlohmann::json::parse(read_file(bench().path("slow.json")))["frames"];
    REQUIRE(frames.size() == 9);
    CHECK(frames[3]["frame"] == 16);
    CHECK(frames[3]["seconds"].get<double>() == doctest::Approx(1.75 / 24));
    CHECK(frames[4]["frame"] == 17);
    REQUIRE(play("ball.rill --headless --frames 17:17 --size 320x180 --out s17.png").code == 0);
    CHECK(difference(Image(bench().path("s04.png")), Image(bench().path("s17.png"))) == 0);
    CHECK(difference(Image(bench().path("s04.png")), Image(bench().path("s05.png"))) > 0);
}

TEST_CASE("frame numbers are the source's where they step by two, and where some are missing") {
    for (const bool gap : {false, true}) {
        CAPTURE(gap);
        const fs::path frames = bench().folder / "numbers";
        fs::remove_all(frames);
        fs::create_directories(frames);
        for (int frame = 15; frame <= 20; ++frame)
            if (!gap || frame != 17) write_frame(frames / ("ball_00" + std::to_string(frame) + ".ply"), frame);
        rill::cooker::CookSettings settings;
        settings.error = "1e";
        settings.read.first = 15, settings.read.last = 20, settings.read.step = gap ? 1 : 2;
        rill::cooker::cook(frames.string(), bench().path("numbers.rill"), settings, [](const rill::cooker::CookProgress&) {});
        REQUIRE(play("numbers.rill --headless --frames 19:19 --size 320x180 --out n19.png --stats n.json").code == 0);
        const nlohmann::json stats = nlohmann::json::parse(read_file(bench().path("n.json")));
        CHECK(stats["frames"][0]["seconds"].get<double>() == doctest::Approx(4.0 / 24));
        CHECK(play("numbers.rill --headless --side-by-side --source numbers/ball_00%d.ply --size 160x90 --out both%d.png").code == 0);
        CHECK(fs::exists(bench().path("both19.png")));
        const Outcome none = play(gap ? "numbers.rill --headless --frames 17:17" : "numbers.rill --headless --frames 16:16");
        CHECK(none.code == 1);
        CHECK(mentions(none, gap ? "15:20" : "15:19:2"));
    }
}

TEST_CASE("the same frame gives the same picture at any number of jobs, and in OpenGL ES") {
    for (const char* more : {"--jobs 1 --out one.png", "--jobs 4 --out four.png", "--api es --out es.png"})
        REQUIRE(play(std::string("ball.rill --headless --frames 17 --size 320x180 ") + more).code == 0);
    CHECK(read_file(bench().path("one.png")) == read_file(bench().path("four.png")));
    CHECK(difference(Image(bench().path("one.png")), Image(bench().path("es.png"))) < 1.0);
}

TEST_CASE("decoded and source pictures are of the same thing") {
    const std::string common = "ball.rill --headless --frames 18 --size 320x180 --shading clay --source frames/ball_%04d.ply ";
    REQUIRE(play(common + "--side-by-side --out both.png").code == 0);
    REQUIRE(play(common + "--out source.png").code == 0);
    REQUIRE(play("ball.rill --headless --frames 15 --size 320x180 --shading clay --out early.png").code == 0);
    const Image both(bench().path("both.png")), source(bench().path("source.png")), early(bench().path("early.png"));
    REQUIRE(both.width == 640);
    Image left = source;
    for (int y = 0; y < 180; ++y)
        std::copy_n(both.rgb.begin() + y * 640 * 3, 320 * 3, left.rgb.begin() + y * 320 * 3);
    CHECK(difference(left, source) < 1.5);
    CHECK(difference(early, source) > 2.0 * difference(left, source));
}

TEST_CASE("liquid out of sight casts its shadow into the picture") {
    const std::string camera = "ball.rill --headless --size 320x180 --eye 0.44,-0.8,1.1 --target 0.44,-0.4,0.77 ";
    REQUIRE(play(camera + "--frames 15 --out shadow.png").code == 0);
    REQUIRE(play(camera + "--frames 15 --source frames/ball_%04d.ply --out wanted.png").code == 0);
    REQUIRE(play(camera + "--frames 20 --source frames/ball_%04d.ply --out other.png").code == 0);
    const Image wanted(bench().path("wanted.png"));
    CHECK(difference(Image(bench().path("shadow.png")), wanted) < 1.5);
    CHECK(difference(Image(bench().path("other.png")), wanted) > 3.0);  // there is a shadow, and it moves
}

TEST_CASE("every look draws something of its own") {
    std::vector<Image> images;
    for (const char* look : {"--shading water", "--shading clay", "--shading normals", "--shading velocity", "--wireframe",
                             "--points", "--shading clay --show-backfaces --eye 0,0,1.3 --target 0.1,1,1.3"}) {
        REQUIRE(play(std::string("ball.rill --headless --frames 16 --size 320x180 --out look.png ") + look).code == 0);
        images.emplace_back(bench().path("look.png"));
        for (size_t i = 0; i + 1 < images.size(); ++i) CHECK(difference(images[i], images.back()) > 0.1);
    }
}

TEST_CASE("without a display a contact sheet is drawn instead") {
    const Outcome outcome = play("ball.rill --size 320x180");
    CHECK(outcome.code == 0);
    CHECK(mentions(outcome, "no display"));
    CHECK(mentions(outcome, "ball_contact_sheet.png"));
    CHECK(Image(bench().path("ball_contact_sheet.png")).width >= 320);
}

TEST_CASE("missing and damaged assets are named with their cause") {
    const std::string whole = read_file(bench().asset);
    REQUIRE(whole.size() > 500);
    std::string flipped = whole;
    for (size_t at = whole.size() / 2; at < whole.size(); at += 64) flipped[at] = char(flipped[at] ^ 0x10);
    write_file(bench().path("empty.rill"), "");
    write_file(bench().path("text.rill"), "this is not an asset, and it is longer than a header would be ............");
    write_file(bench().path("short.rill"), whole.substr(0, whole.size() / 2));
    write_file(bench().path("flipped.rill"), flipped);
    for (const char* name : {"missing.rill", "frames", "empty.rill", "text.rill", "short.rill", "flipped.rill"}) {
        CAPTURE(name);
        for (const char* mode : {" --headless --size 64x64", ""}) {
            if (*mode == 0 && std::string(name) == "flipped.rill") continue;  // opens: chunks are checked when they come
            const Outcome outcome = play(name + std::string(mode));
            CHECK(outcome.code == 2);
            CHECK(mentions(outcome, name));
        }
        if (std::string(name) != "flipped.rill") CHECK(run(RILL_HELLO, name).code == 2);
    }
}

TEST_CASE("bad usage exits 1 and says what was wanted") {
    for (const char* arguments : {"", "--headless", "ball.rill --bogus", "ball.rill --headless --frames 9:3",
                                  "ball.rill --headless --frames 16:x", "ball.rill --headless --frames 1:5",
                                  "ball.rill --size 0x100", "ball.rill --out a%s.png", "ball.rill --headless --out a.png",
                                  "ball.rill --substeps 4", "ball.rill --shading glitter", "ball.rill --eye 1,2", "ball.rill --side-by-side"}) {
        CAPTURE(arguments);
        const Outcome outcome = play(arguments);
        CHECK(outcome.code == 1);
        CHECK(outcome.errors.size() > 10);
    }
    CHECK(mentions(play("ball.rill --headless --frames 1:5"), "15:20"));
    CHECK(run(RILL_HELLO, "").code == 1);
}

TEST_CASE("a source of polygons looks like its triangles") {
    const auto write_plate = [](const fs::path& path, const std::vector<std::vector<uint32_t>>& faces) {
        std::ostringstream out;
        out << "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face "
            << faces.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
        const float corner[4][3] = {{-0.5f, -0.5f, 1}, {0.5f, -0.5f, 1}, {0.5f, 0.5f, 1}, {-0.5f, 0.5f, 1}};
        out.write(reinterpret_cast<const char*>(corner), sizeof corner);
        for (const auto& face : faces) {
            out.put(char(face.size()));
            out.write(reinterpret_cast<const char*>(face.data()), std::streamsize(4 * face.size()));
        }
        write_file(path, out.str());
    };
    write_plate(bench().path("quad.ply"), {{0, 1, 2, 3}});
    write_plate(bench().path("triangles.ply"), {{0, 1, 2}, {0, 2, 3}});
    write_plate(bench().path("half.ply"), {{0, 1, 2}});
    for (const char* name : {"quad", "triangles", "half"})
        REQUIRE(play("ball.rill --headless --frames 18 --size 320x180 --shading clay --source " + std::string(name) + ".ply --out " + name + ".png").code == 0);
    CHECK(read_file(bench().path("quad.png")) == read_file(bench().path("triangles.png")));
    CHECK(read_file(bench().path("quad.png")) != read_file(bench().path("half.png")));
}

TEST_CASE("bad source meshes are named with their cause") {
    const std::string whole = read_file(bench().folder / "frames/ball_0016.ply");
    write_file(bench().path("s0001.ply"), whole.substr(0, whole.size() - 5));
    write_file(bench().path("s0002.ply"), "ply\nformat ascii 1.0\nend_header\n");
    std::string wild = whole;
    wild[wild.size() - 1] = 0x7f;
    write_file(bench().path("s0003.ply"), wild);
    for (int frame = 0; frame <= 3; ++frame) {
        const Outcome outcome = play("--headless --source s%04d.ply --frames " + std::to_string(frame));
        CHECK(outcome.code == 2);
        CHECK(mentions(outcome, ("s000" + std::to_string(frame) + ".ply").c_str()));
    }
}

TEST_CASE("rill-hello plays") {
    const Outcome outcome = run(RILL_HELLO, "ball.rill");
    CHECK(outcome.code == 0);
    CHECK(outcome.errors == "");
}
