// SPDX-License-Identifier: MIT
#include "png.h"

#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

#include <algorithm>
#include <cstdio>

#include "new_file.h"

namespace player {

bool write_png(const std::string& path, const Picture& picture) {
    const NewFile file(path);
    return file.finish(stbi_write_png(file.place.c_str(), picture.width, picture.height, 3, picture.rgb.data(), picture.width * 3) != 0);
}

void paste(Picture& into, const Picture& from, int x, int y) {
    const int columns = std::min(from.width, into.width - x);
    if (columns <= 0) return;
    for (int row = 0; row < std::min(from.height, into.height - y); ++row)
        std::copy_n(from.rgb.data() + size_t(row) * from.width * 3, size_t(columns) * 3,
                    into.rgb.data() + (size_t(y + row) * into.width + x) * 3);
}

Picture shrink(const Picture& from, int width, int height) {
    Picture out(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int x0 = x * from.width / width, x1 = std::max(x0 + 1, (x + 1) * from.width / width);
            const int y0 = y * from.height / height, y1 = std::max(y0 + 1, (y + 1) * from.height / height);
            for (int c = 0; c < 3; ++c) {
                unsigned sum = 0;
                for (int v = y0; v < y1; ++v)
                    for (int u = x0; u < x1; ++u) sum += from.rgb[(size_t(v) * from.width + u) * 3 + c];
                out.rgb[(size_t(y) * width + x) * 3 + c] = uint8_t(sum / unsigned((x1 - x0) * (y1 - y0)));
            }
        }
    return out;
}

Panorama read_panorama(const std::string& path) {
    Panorama out;
    int channels = 0;
    // Low dynamic range files come back linear too: stb undoes their gamma.
    if (float* pixels = stbi_loadf(path.c_str(), &out.width, &out.height, &channels, 3)) {
        out.rgb.assign(pixels, pixels + size_t(out.width) * out.height * 3);
        stbi_image_free(pixels);
    }
    return out;
}

}  // namespace player
