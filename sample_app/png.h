// SPDX-License-Identifier: MIT
// Pictures in memory and on disk.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace player {

/// Rows from the top, three bytes a pixel.
struct Picture {
    int width = 0, height = 0;
    std::vector<uint8_t> rgb;
    Picture() = default;
    Picture(int w, int h) : width(w), height(h), rgb(static_cast<size_t>(w) * h * 3) {}
};

/// Appears under its name only when complete. False: it could not be written (errno says why).
bool write_png(const std::string& path, const Picture& picture);
/// `from` into `into` with its top left corner at (x, y); parts outside are cut off.
void paste(Picture& into, const Picture& from, int x, int y);
/// Area average, for contact sheets.
Picture shrink(const Picture& from, int width, int height);

/// Equirectangular surroundings; linear floats. Empty when the file cannot be read.
struct Panorama {
    int width = 0, height = 0;
    std::vector<float> rgb;
};
Panorama read_panorama(const std::string& path);

}  // namespace player
