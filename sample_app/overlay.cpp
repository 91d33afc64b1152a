// SPDX-License-Identifier: MIT
#include "overlay.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "statistics.h"

namespace player {

void Clock::advance(double real_seconds) {
    if (!playing) return;
    seconds += real_seconds * speed;
    if (seconds >= 0.0 && seconds <= length) return;
    if (loop && length > 0.0) {
        seconds -= length * std::floor(seconds / length);
    } else {
        seconds = std::clamp(seconds, 0.0, length);
        playing = false;
    }
}

Overlay::Overlay(GLFWwindow* window, bool es) {
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // leaves no file behind
    ImGui::StyleColorsDark();
    ImGui::GetStyle().WindowRounding = 4.0f;
    ImGui_ImplGlfw_InitForOpenGL(window, true);
    ImGui_ImplOpenGL3_Init(es ? "#version 300 es" : "#version 330 core");
}

Overlay::~Overlay() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

void Overlay::begin() {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
}

bool Overlay::wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }
bool Overlay::wants_keys() const { return ImGui::GetIO().WantTextInput; }

void Overlay::draw() {
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Overlay::build(Controls& controls, const Report& report) {
    history_[next_++ % history_.size()] = static_cast<float>(report.frame_ms);
    if (!controls.show_panel) return;
    ImGui::SetNextWindowPos({10, 10}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({330, 0}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowBgAlpha(0.8f);
    if (ImGui::Begin("rill-player")) {
        ImGui::PushItemWidth(-110.0f);
        build_playback(controls, report);
        if (ImGui::CollapsingHeader("Detail", ImGuiTreeNodeFlags_DefaultOpen)) build_detail(controls, report);
        if (ImGui::CollapsingHeader("Look", ImGuiTreeNodeFlags_DefaultOpen)) build_look(controls, report);
        if (ImGui::CollapsingHeader("Statistics", ImGuiTreeNodeFlags_DefaultOpen)) build_statistics(report);
        ImGui::PopItemWidth();
    }
    ImGui::End();
}

void Overlay::build_playback(Controls& controls, const Report& report) {
    Clock& clock = controls.clock;
    if (ImGui::Button(clock.playing ? "Pause" : "Play ")) clock.playing = !clock.playing;
    ImGui::SameLine();
    ImGui::Checkbox("Loop", &clock.loop);
    ImGui::SameLine();
    const std::vector<int>& numbers = report.clip.frame_numbers();
    ImGui::Text("frame %d of %d-%d", numbers[report.clip.nearest_frame(clock.seconds)], numbers.front(), numbers.back());
    const double start = 0.0;
    ImGui::SliderScalar("seconds", ImGuiDataType_Double, &clock.seconds, &start, &clock.length, "%.3f");
    ImGui::SliderFloat("speed", &clock.speed, -4.0f, 4.0f, "%.2f x");
    static const struct { const char* label; float speed; } presets[] = {
        {"-1", -1.0f}, {"0.05", 0.05f}, {"0.25", 0.25f}, {"1", 1.0f}, {"4", 4.0f}};
    for (const auto& preset : presets) {
        if (ImGui::SmallButton(preset.label)) clock.speed = preset.speed;
        ImGui::SameLine();
    }
    ImGui::NewLine();
}

void Overlay::build_detail(Controls& controls, const Report& report) {
    Detail& detail = controls.detail;
    const rill::AssetInfo& info = report.clip.info();
    ImGui::Checkbox("Level of detail", &detail.follow_view);
    if (detail.follow_view)
        ImGui::SliderFloat("pixel error", &detail.pixel_error, 0.5f, 16.0f, "%.1f", ImGuiSliderFlags_Logarithmic);
    if (ImGui::Checkbox("Force the cell size", &controls.force_cell)) detail.cell = controls.force_cell ? info.cell_size : 0.0f;
    if (controls.force_cell)
        ImGui::SliderFloat("cell (m)", &detail.cell, 0.5f * info.cell_size, 8.0f * info.cell_size, "%.5f",
                           ImGuiSliderFlags_Logarithmic);
    ImGui::SliderInt("layers", &detail.layers, 0, static_cast<int>(info.layers), detail.layers ? "%d" : "all");
    ImGui::Checkbox("Freeze culling (F)", &controls.freeze_culling);
}

void Overlay::build_look(Controls& controls, const Report& report) {
    int shading = static_cast<int>(controls.look.shading);
    if (ImGui::Combo("shading", &shading, "water\0clay\0normals\0velocity\0"))
        controls.look.shading = static_cast<Shading>(shading);
    if (controls.look.shading == Shading::velocity)
        ImGui::SliderFloat("red at (m/s)", &controls.look.full_speed, 0.1f, 20.0f, "%.1f", ImGuiSliderFlags_Logarithmic);
    ImGui::Checkbox("Wireframe (W)", &controls.look.wireframe);
    ImGui::SameLine();
    ImGui::Checkbox("Points (P)", &controls.look.points);
    ImGui::Checkbox("Back faces (B)", &controls.look.show_backfaces);
    if (report.has_source) ImGui::Checkbox("Source mesh (S)", &controls.show_source);
}

void Overlay::build_statistics(const Report& report) {
    const float slowest = *std::max_element(history_.begin(), history_.end());
    char label[64];
    std::snprintf(label, sizeof label, "%.1f ms, at most %.1f", report.frame_ms, static_cast<double>(slowest));
    ImGui::PlotLines("frame", history_.data(), static_cast<int>(history_.size()),
                     static_cast<int>(next_ % history_.size()), label, 0.0f, std::max(slowest, 20.0f), {0, 50});
    ImGui::Text("runtime %.2f ms, %u vertices, %u triangles", report.runtime_ms, report.vertices, report.triangles);
    const CountingHeap& heap = report.clip.heap();
    ImGui::Text("memory %.2f MB, at most %.2f MB", heap.bytes_now() / 1e6, heap.bytes_peak() / 1e6);
    ImGui::Text("allocations since create: %llu", static_cast<unsigned long long>(report.late_allocations));
    ImGui::Text("status: %s, cut: %s", rill::text(report.status), cut_names(report.stats.cut).c_str());
    for_each_stat(report.stats, [](const char* name, auto value) {
        if constexpr (std::is_floating_point_v<decltype(value)>)
            ImGui::Text("%-18s %.5g", name, static_cast<double>(value));
        else
            ImGui::Text("%-18s %llu", name, static_cast<unsigned long long>(value));
    });
    ImGui::TextWrapped("%s", report.device.c_str());
}

}  // namespace player
