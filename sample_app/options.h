// SPDX-License-Identifier: MIT
// What the command line can say, and the two ways to play.
#pragma once
#include <string>
#include <vector>

#include "camera.h"
#include "draw.h"

namespace player {

/// How fine to decode.
struct Detail {
    bool follow_view = false;   ///< level of detail: cells of pixel_error pixels; else cells of the source's size
    float pixel_error = 2.0f;
    float cell = 0.0f;          ///< > 0: this cell size in metres, whatever follow_view says
    int layers = 0;             ///< at most so many; 0 = all
};
rill::Budget make_budget(const Detail& detail, const rill::AssetInfo& info);

/// Frame numbers are the source's own; the last is included.
struct FrameRange {
    bool given = false;
    int first = 0, last = 0, step = 1;
};

struct Options {
    std::string asset, out, stats, contact_sheet, source, environment;
    bool headless = false, side_by_side = false;
    FrameRange frames;
    int substeps = 1;           ///< pictures from a frame to the next one drawn; numbered from 0 when more than one
    int width = 1280, height = 720;
    unsigned jobs = 0;          ///< 0 = one per core
    Look look;
    Detail detail;
    Api api = Api::any;
    float speed = 1.0f;
    int quit_after = 0;         ///< > 0: a window closes after so many pictures, and saves the last to `out`
    std::vector<float> eye, target;
    float yaw_degrees = 32.0f, pitch_degrees = 24.0f, distance = 0.0f, fov_degrees = 40.0f;
};
Camera make_camera(const Options& options, const Bounds& bounds);

enum Exit { exit_ok = 0, exit_usage = 1, exit_bad_asset = 2 };
/// "rill-player: what: cause" on stderr; returns `code`.
int complain(Exit code, const std::string& what, const std::string& cause);

/// Pictures, contact sheets and statistics without a window.
int run_headless(const Options& options);
/// False: there is no display; `cause` says why in one line, and nothing was done. Else `code` is the exit code.
bool run_window(const Options& options, int& code, std::string& cause);

}  // namespace player
