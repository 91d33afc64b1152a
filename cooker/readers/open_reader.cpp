// SPDX-License-Identifier: MIT
// A path → the reader for what lies there.
#include "readers/frame_files.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

std::string what_is_read() {
    std::string text = "Rill reads Mantaflow and FLIP Fluids cache directories";
    for (const FrameFormat& format : frame_formats()) text += ", " + format.extension + " files";
    return text;
}

std::unique_ptr<SequenceReader> open_directory(const fs::path& directory, const ReadOptions& options) {
    if (auto reader = open_mantaflow(directory, options)) return reader;
    if (auto reader = open_flip_fluids(directory, options)) return reader;
    std::unique_ptr<SequenceReader> found;
    std::string found_extension;
    for (const FrameFormat& format : frame_formats()) {
        std::vector<FrameFile> files = find_frames(directory, "*" + format.extension);
        if (files.empty()) continue;
        if (found)
            throw InputError(directory.string() + ": holds both " + found_extension + " and " + format.extension +
                             " files; name one kind with a pattern such as '" + (directory / ("*" + format.extension)).string() + "'");
        found = open_frame_files(format, std::move(files), directory.string(), options);
        found_extension = format.extension;
    }
    if (found) return found;
    if (fs::is_empty(directory)) throw InputError(directory.string() + ": the directory is empty");
    throw InputError(directory.string() + ": no frames found; " + what_is_read());
}

std::unique_ptr<SequenceReader> open_files(const fs::path& path, const ReadOptions& options) {
    const FrameFormat* format = format_of(path);
    const bool pattern = is_pattern(path.filename().string()) && !fs::exists(path);
    if (!pattern && !fs::exists(path)) throw InputError(path.string() + ": no such file or directory");
    if (!format) throw InputError(path.string() + ": unknown format '" + path.extension().string() + "'; " + what_is_read());
    if (!pattern && format->extension == ".abc") return open_alembic(path, options);
    std::vector<FrameFile> files;
    if (pattern) {
        const fs::path directory = path.has_parent_path() ? path.parent_path() : fs::path(".");
        files = find_frames(directory, path.filename().string());
        if (files.empty()) throw InputError(path.string() + ": no file matches");
    } else {
        files.push_back({frame_number(path).value_or(1), path});
    }
    return open_frame_files(*format, std::move(files), path.string(), options);
}

}  // namespace

std::unique_ptr<SequenceReader> open_reader(const std::string& input, const ReadOptions& options) {
    try {
        const fs::path path(input);
        return fs::is_directory(path) ? open_directory(path, options) : open_files(path, options);
    } catch (const fs::filesystem_error& error) {
        throw InputError(input + ": " + error.code().message());
    }
}

}  // namespace rill::cooker
