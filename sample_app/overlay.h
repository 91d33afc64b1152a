// SPDX-License-Identifier: MIT
// Controls and statistics over the window, by Dear ImGui.
#pragma once
#include <array>
#include <string>

#include "engine.h"
#include "options.h"

struct GLFWwindow;

namespace player {

/// Where playback is and how it moves.
struct Clock {
    double seconds = 0.0, length = 0.0;
    float speed = 1.0f;  ///< clip seconds per real second, signed
    bool playing = true, loop = true;
    void advance(double real_seconds);
    float rate() const { return playing ? speed : 0.0f; }
};

/// What a person can change while it runs.
struct Controls {
    Clock clock;
    Look look;
    Detail detail;
    bool force_cell = false;
    bool freeze_culling = false;  ///< the runtime keeps the camera it had; the view may orbit around it
    bool show_source = false;     ///< the source's mesh instead, where --source names it
    bool show_panel = true;
};

/// What there is to tell about the frame on screen.
struct Report {
    const Clip& clip;
    const rill::Stats& stats;
    rill::Status status;
    uint32_t vertices, triangles;
    double frame_ms;         ///< of the whole loop
    double runtime_ms;       ///< begin_frame to the return of end_frame, without what ran between
    uint64_t late_allocations;
    bool has_source;
    const std::string& device;
};

class Overlay {
public:
    /// Takes over the window's callbacks, so that it comes after any others.
    explicit Overlay(GLFWwindow* window, bool es);
    ~Overlay();
    void begin();
    bool wants_mouse() const;
    bool wants_keys() const;
    void build(Controls& controls, const Report& report);
    void draw();  ///< into the window's own framebuffer

private:
    void build_playback(Controls& controls, const Report& report);
    void build_detail(Controls& controls, const Report& report);
    void build_look(Controls& controls, const Report& report);
    void build_statistics(const Report& report);
    std::array<float, 240> history_{};  // milliseconds, a ring
    size_t next_ = 0;
};

}  // namespace player
