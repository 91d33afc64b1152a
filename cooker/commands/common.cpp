// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <charconv>
#include <cstdio>

#include "commands/commands.h"
#include "common/interrupt.h"
#include "common/output_file.h"

namespace rill::cooker {
namespace {

double seconds_between(std::chrono::steady_clock::time_point a, std::chrono::steady_clock::time_point b) {
    return std::chrono::duration<double>(b - a).count();
}

std::string readable_time(double seconds) {
    char text[32];
    const int s = int(seconds + 0.5);
    if (s < 60) std::snprintf(text, sizeof text, "%d s", s);
    else std::snprintf(text, sizeof text, "%d:%02d min", s / 60, s % 60);
    return text;
}

}  // namespace

FrameRange parse_frames(const std::string& text) {
    FrameRange range;
    if (text.empty()) return range;
    int values[3] = {0, 0, 1}, count = 0;
    const char *at = text.data(), *end = text.data() + text.size();
    for (bool more = true; more; ++count) {
        const auto [stop, error] = count < 3 ? std::from_chars(at, end, values[count]) : std::from_chars_result{at, std::errc::invalid_argument};
        more = stop != end && *stop == ':';
        if (error != std::errc() || (stop != end && !more)) throw UsageError("--frames '" + text + "' is not A:B or A:B:STEP");
        at = stop + (more ? 1 : 0);
    }
    if (count == 1) values[1] = values[0];
    if (values[1] < values[0] || values[2] < 1) throw UsageError("--frames '" + text + "' needs A <= B and a step of at least 1");
    return {values[0], values[1], values[2]};
}

CLI::Option* InputOptions::add_to(CLI::App& command) {
    CLI::Option* input = command.add_option("INPUT", path, "Directory, pattern (frame_%04d.ply, 'frame_*.ply') or file")->required();
    command.add_option("--fps", read.frames_per_second, "Frames per second, over what the source says")->check(CLI::Range(1e-6, 1e6));
    command.add_option("--velocity", read.velocity_name, "Name of the velocity attribute");
    command.add_option("--velocity-unit", velocity_unit, "Metres per: second, frame")->check(CLI::IsMember({"second", "frame"}));
    command.add_option("--up", up, "Axis of the input that points up: z, y")->check(CLI::IsMember({"y", "z"}));
    command.add_option("--handedness", handedness, "Of the input: right, left")->check(CLI::IsMember({"left", "right"}));
    command.add_option("--scale", read.scale, "Metres per unit of the input")->check(CLI::PositiveNumber);
    return input;
}

ReadOptions InputOptions::checked() const {
    ReadOptions options = read;
    options.velocity_per_frame = velocity_unit == "frame";
    options.up = up.empty() ? 0 : up[0], options.handedness = handedness.empty() ? 0 : handedness[0];
    options.warn = [](const std::string& message) { std::fprintf(stderr, "rill: warning: %s\n", message.c_str()); };
    return options;
}

Progress::Progress(std::string what, bool quiet)
    : what_(std::move(what)), quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now()), stage_end_(start_) {}

Progress::~Progress() {
    if (open_line_) std::fprintf(stderr, "\n");
}

void Progress::operator()(const std::string& stage, double done, double total) {
    stop_if_interrupted();
    if (quiet_ || !(total > 0)) return;
    const auto now = std::chrono::steady_clock::now();
    if (stage != last_stage_) start_ = stage_end_, last_quarter_ = 0, last_stage_ = stage;
    stage_end_ = now;
    const int quarter = int(4 * done / total);
    const bool finished = done >= total;
    if (terminal_ ? seconds_between(last_shown_, now) < 0.1 && !finished : quarter == last_quarter_) return;
    const double elapsed = seconds_between(start_, now), rate = elapsed > 0 ? done / elapsed : 0;
    char line[200];
    std::snprintf(line, sizeof line, "%s%s%s: %.0f of %.0f frames, %.1f frames/s, %s %s", what_.c_str(), stage.empty() ? "" : ", ", stage.c_str(),
                  done, total, rate, finished ? readable_time(elapsed).c_str() : rate > 0 ? readable_time((total - done) / rate).c_str() : "?",
                  finished ? "in all" : "left");
    if (terminal_) std::fprintf(stderr, "\r\033[K%s", line);
    else std::fprintf(stderr, "%s\n", line);
    open_line_ = terminal_;
    last_shown_ = now, last_quarter_ = quarter;
}

void write_json(const std::string& path, const nlohmann::json& json) {
    const std::string text = json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    if (path == "-") std::fwrite(text.data(), 1, text.size(), stdout);
    else write_file(path, text);
}

std::string readable_bytes(double bytes) {
    char text[32];
    if (bytes < 1000) std::snprintf(text, sizeof text, "%.0f B", bytes);
    else if (bytes < 1e6) std::snprintf(text, sizeof text, "%.2f kB", bytes / 1e3);
    else if (bytes < 1e9) std::snprintf(text, sizeof text, "%.2f MB", bytes / 1e6);
    else std::snprintf(text, sizeof text, "%.2f GB", bytes / 1e9);
    return text;
}

}  // namespace rill::cooker
