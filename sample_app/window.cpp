// SPDX-License-Identifier: MIT
// The loop of a game: begin_frame, everything else, end_frame, draw.
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <thread>

#include "engine.h"
#include "options.h"
#include "overlay.h"

namespace player {

namespace {

std::string last_glfw_error;

/// GLFW for as long as it lives, and one window.
struct Screen {
    GLFWwindow* window = nullptr;
    bool started = false, es = false;
    bool open(const Options& options, std::string& cause);
    ~Screen() {
        if (window) glfwDestroyWindow(window);
        if (started) glfwTerminate();
    }

private:
    bool open_with(const Options& options, bool with_es, int creation);
};

bool Screen::open_with(const Options& options, bool with_es, int creation) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CLIENT_API, with_es ? GLFW_OPENGL_ES_API : GLFW_OPENGL_API);
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, creation);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, with_es ? 0 : 3);
    if (!with_es) glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window = glfwCreateWindow(options.width, options.height, ("rill-player: " + options.asset).c_str(), nullptr, nullptr);
    es = with_es;
    return window != nullptr;
}

bool Screen::open(const Options& options, std::string& cause) {
    glfwSetErrorCallback([](int, const char* text) { last_glfw_error = text; });
    started = glfwInit();
    const bool opened = started && ((options.api != Api::es && open_with(options, false, GLFW_NATIVE_CONTEXT_API)) ||
                                    (options.api != Api::gl && open_with(options, true, GLFW_NATIVE_CONTEXT_API)) ||
                                    (options.api != Api::gl && open_with(options, true, GLFW_EGL_CONTEXT_API)));
    if (!opened) cause = last_glfw_error.empty() ? "GLFW cannot open a window" : last_glfw_error;
    return opened;
}

struct Window {
    const Options& options;
    Screen& screen;
    Clip& clip;
    Controls controls;
    Bounds bounds;
    Camera camera, culling_camera;
    std::unique_ptr<Renderer> renderer;
    std::unique_ptr<Overlay> overlay;
    uint64_t allocations_at_create = 0;
    rill::Stats stats{};
    rill::Status status = rill::Status::ok;
    uint32_t vertices = 0, triangles = 0;
    double runtime_ms = 0.0, frame_ms = 0.0;
    Mesh source;
    int source_frame = -1;
    bool source_missing = false;
    glm::dvec2 cursor{0.0};

    Window(const Options& o, Screen& s, Clip& c) : options(o), screen(s), clip(c) {}
    int start();
    int loop();
    void step(double seconds, int width, int height);
    void decode(int width, int height);
    void show_source();
    void save_picture(const std::string& path);
    void mouse();
    void wheel(double steps) {
        if (!overlay->wants_mouse()) camera.zoom(static_cast<float>(steps));
    }
    void key(int code);
};

Window& self(GLFWwindow* window) { return *static_cast<Window*>(glfwGetWindowUserPointer(window)); }

int Window::start() {
    glfwMakeContextCurrent(screen.window);
    glfwSwapInterval(1);
    std::string cause;
    renderer = Renderer::create(cause);
    if (!renderer) return complain(exit_usage, "cannot draw", cause);
    if (!options.environment.empty()) {
        const Panorama panorama = read_panorama(options.environment);
        if (panorama.rgb.empty()) return complain(exit_usage, options.environment, "not a readable picture");
        renderer->set_panorama(panorama);
    }
    const rill::AssetInfo& info = clip.info();
    bounds = {{info.lower[0], info.lower[1], info.lower[2]}, {info.upper[0], info.upper[1], info.upper[2]}};
    renderer->set_scene(bounds);
    renderer->reserve(clip.limits().vertices, clip.limits().indices, clip.limits().points);
    camera = culling_camera = make_camera(options, bounds);
    controls.look = options.look;
    controls.detail = options.detail;
    controls.force_cell = options.detail.cell > 0.0f;
    controls.clock.length = info.seconds;
    controls.clock.speed = options.speed;
    if (options.frames.given) {
        const std::vector<int>& numbers = clip.frame_numbers();
        const auto at = std::lower_bound(numbers.begin(), numbers.end() - 1, options.frames.first);
        controls.clock.seconds = clip.frame_seconds(static_cast<uint32_t>(at - numbers.begin()));
    }
    allocations_at_create = clip.heap().allocations();
    glfwSetWindowUserPointer(screen.window, this);
    glfwSetScrollCallback(screen.window, [](GLFWwindow* w, double, double y) { self(w).wheel(y); });
    glfwSetKeyCallback(screen.window, [](GLFWwindow* w, int code, int, int action, int) {
        if (action != GLFW_RELEASE) self(w).key(code);
    });
    overlay = std::make_unique<Overlay>(screen.window, screen.es);
    return exit_ok;
}

/// Left turns, right or middle shifts.
void Window::mouse() {
    glm::dvec2 at;
    int width, height;
    glfwGetCursorPos(screen.window, &at.x, &at.y);
    glfwGetWindowSize(screen.window, &width, &height);
    const glm::vec2 moved = glm::vec2(at - cursor) / static_cast<float>(std::max(height, 1));
    cursor = at;
    if (overlay->wants_mouse()) return;
    const auto held = [&](int button) { return glfwGetMouseButton(screen.window, button) == GLFW_PRESS; };
    if (held(GLFW_MOUSE_BUTTON_LEFT)) camera.orbit(4.0f * moved.x, 4.0f * moved.y);
    if (held(GLFW_MOUSE_BUTTON_RIGHT) || held(GLFW_MOUSE_BUTTON_MIDDLE)) camera.pan(moved.x, -moved.y);
}

void Window::key(int code) {
    if (overlay->wants_keys()) return;
    Clock& clock = controls.clock;
    const double one_frame = 1.0 / std::max(clip.info().frames_per_second, 1e-6);
    if (code == GLFW_KEY_SPACE) clock.playing = !clock.playing;
    if (code == GLFW_KEY_LEFT) clock.seconds = std::max(clock.seconds - one_frame, 0.0);
    if (code == GLFW_KEY_RIGHT) clock.seconds = std::min(clock.seconds + one_frame, clock.length);
    if (code == GLFW_KEY_HOME) camera = make_camera(options, bounds);
    if (code == GLFW_KEY_W) controls.look.wireframe = !controls.look.wireframe;
    if (code == GLFW_KEY_P) controls.look.points = !controls.look.points;
    if (code == GLFW_KEY_B) controls.look.show_backfaces = !controls.look.show_backfaces;
    if (code == GLFW_KEY_F) controls.freeze_culling = !controls.freeze_culling;
    if (code == GLFW_KEY_S) controls.show_source = !controls.show_source;
    if (code == GLFW_KEY_TAB) controls.show_panel = !controls.show_panel;
    if (code == GLFW_KEY_F12) save_picture("rill-player.png");
    if (code == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(screen.window, GLFW_TRUE);
}

void Window::save_picture(const std::string& path) {
    if (!write_png(path, renderer->read_picture())) complain(exit_usage, path, std::strerror(errno));
    else std::printf("rill-player: wrote %s\n", path.c_str());
}

void Window::decode(int width, int height) {
    if (!controls.freeze_culling) culling_camera = camera;
    const auto views = culling_camera.with_casters(width, height, bounds, renderer->to_sun());
    rill::Frame frame{};
    frame.seconds = controls.clock.seconds;
    frame.rate = controls.clock.rate();
    for (int i = 0; i < 3; ++i) frame.asset_to_world[5 * i] = 1.0f;
    frame.views = views.data();
    frame.view_count = uint32_t(views.size());
    frame.budget = make_budget(controls.detail, clip.info());
    rill::Target* target = renderer->map(controls.look);
    frame.target = target;
    const double begun = now_seconds();
    status = clip.begin_frame(frame);
    const double submitted = now_seconds();
    // The jobs run; a game would simulate and draw now. Here the panel is built, from the last frame's figures.
    overlay->build(controls, {clip, stats, status, vertices, triangles, frame_ms, runtime_ms,
                              clip.heap().allocations() - allocations_at_create, !options.source.empty(),
                              renderer->description()});
    const double waited = now_seconds();
    if (status >= rill::Status::ok) status = clip.end_frame(&stats);
    runtime_ms = 1000.0 * (now_seconds() - waited + submitted - begun);
    vertices = target->vertices_used;
    triangles = target->indices_used / 3;
    renderer->unmap();
    renderer->grow(stats);
}

/// The source's frame nearest in time, read when it changes.
void Window::show_source() {
    const int frame = clip.frame_numbers()[clip.nearest_frame(controls.clock.seconds)];
    if (frame != source_frame) {
        std::string cause;
        const std::string path = fill_pattern(options.source, frame);
        source_missing = !read_ply(path, source, cause);
        if (source_missing) complain(exit_bad_asset, path, cause);
        source_frame = frame;
    }
    if (!source_missing) renderer->upload(source);
}

void Window::step(double seconds, int width, int height) {
    frame_ms = 1000.0 * seconds;
    overlay->begin();
    mouse();
    controls.clock.advance(seconds);
    decode(width, height);
    if (controls.show_source && !options.source.empty()) show_source();
    renderer->draw(camera, controls.look, width, height);
    renderer->present(width, height);
    overlay->draw();
    glfwSwapBuffers(screen.window);
}

int Window::loop() {
    double last = now_seconds();
    int pictures = 0;
    while (!glfwWindowShouldClose(screen.window)) {
        glfwPollEvents();
        int width = 0, height = 0;
        glfwGetFramebufferSize(screen.window, &width, &height);
        if (width < 1 || height < 1) {  // minimised
            glfwWaitEvents();
            last = now_seconds();
            continue;
        }
        const double now = now_seconds();
        step(now - last, width, height);
        last = now;
        if (status < rill::Status::ok) return complain(exit_bad_asset, options.asset, rill::text(status));
        if (options.quit_after > 0 && ++pictures >= options.quit_after) break;
    }
    if (options.quit_after > 0 && !options.out.empty()) save_picture(fill_pattern(options.out, pictures));
    return exit_ok;
}

}  // namespace

bool run_window(const Options& options, int& code, std::string& cause) {
    Screen screen;
    Clip clip(options.jobs ? options.jobs : std::max(1u, std::thread::hardware_concurrency()));
    std::string bad;
    // First the asset: a window that opens only to close again helps nobody.
    if (!clip.open(options.asset, bad)) {
        code = complain(exit_bad_asset, options.asset, bad);
        return true;
    }
    if (!screen.open(options, cause)) return false;
    Window window(options, screen, clip);
    code = window.start();
    if (code == exit_ok) code = window.loop();
    return true;
}

}  // namespace player
