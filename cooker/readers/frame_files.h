// SPDX-License-Identifier: MIT
// Sequences stored as one file per frame: finding the files, their numbers, and the formats that are just
// "a file → a mesh". Adding such a format is one function and one row in frame_formats().
#pragma once
#include <filesystem>
#include <optional>
#include <functional>

#include "readers/reader.h"

namespace rill::cooker {

struct FrameFile {
    int number = 0;
    std::filesystem::path path;
};
/// Files of `directory` whose name matches: `*` any characters, `?` one, `%d` / `%04d` / `####` a number.
/// Sorted by frame number, which stands where `%d` says, or else is the last run of digits before the extension. Throws InputError for a
/// directory that cannot be read and for two files of one number.
std::vector<FrameFile> find_frames(const std::filesystem::path& directory, const std::string& pattern);
bool is_pattern(const std::string& name);
/// The last run of digits before the extension, with a minus that stands first or after `_`, `.` or a blank; nothing when there is
/// none or it is no int.
std::optional<int> frame_number(const std::filesystem::path& path);

/// The rate that a JSON file beside the frames states as {"fps": 24}; 0 when it is not there or silent.
double stated_rate(const std::filesystem::path& json_file);

struct FrameFormat {
    std::string extension;  ///< lower case, with dot
    std::string name;       ///< "PLY sequence"
    Mesh (*read)(const std::filesystem::path& path, const ReadOptions& options);
    /// Further files that reading `path` needs; null: none.
    std::vector<std::filesystem::path> (*beside)(const std::filesystem::path& path) = nullptr;
};
const std::vector<FrameFormat>& frame_formats();
/// Null when no format has this extension.
const FrameFormat* format_of(const std::filesystem::path& path);

std::unique_ptr<SequenceReader> open_frame_files(const FrameFormat& format, std::vector<FrameFile> files,
                                                 const std::string& input, const ReadOptions& options);

Mesh read_ply(const std::filesystem::path& path, const ReadOptions& options);
Mesh read_obj(const std::filesystem::path& path, const ReadOptions& options);
Mesh read_gltf(const std::filesystem::path& path, const ReadOptions& options);
#ifdef RILL_OPENVDB
Mesh read_vdb(const std::filesystem::path& path, const ReadOptions& options);
#endif
std::vector<std::filesystem::path> gltf_buffers(const std::filesystem::path& path);
Mesh read_alembic_frame(const std::filesystem::path& path, const ReadOptions& options);  ///< its first sample

/// Readers with a directory layout of their own; null when `directory` is not theirs.
std::unique_ptr<SequenceReader> open_mantaflow(const std::filesystem::path& directory, const ReadOptions& options);
std::unique_ptr<SequenceReader> open_flip_fluids(const std::filesystem::path& directory, const ReadOptions& options);
/// The samples of one Alembic file.
std::unique_ptr<SequenceReader> open_alembic(const std::filesystem::path& path, const ReadOptions& options);

}  // namespace rill::cooker
