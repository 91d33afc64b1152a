// SPDX-License-Identifier: MIT
// Frames back out, for other programs.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "common/mesh.h"

namespace rill::cooker {

/// Writes by extension: .ply (binary little endian, nx ny nz, vx vy vz), .obj (no velocity), .glb (POSITION,
/// NORMAL, _VELOCITY). Absent attributes are left out. Throws UsageError for other extensions, InputError
/// when the file cannot be written; it appears complete or not at all.
void write_frame(const std::filesystem::path& path, const Mesh& mesh);
/// Throws UsageError unless write_frame() knows the extension.
void check_frame_extension(const std::filesystem::path& path);

/// Throws InputError where there is a file that write_frame(), or AnimatedGlb, has not written: source meshes must not be lost to a wrong folder.
void check_frame_output(const std::filesystem::path& path);

/// `frame_%04d.ply`, 7 → `frame_0007.ply`. Throws UsageError when there is more than one place for a number.
std::string number_pattern(const std::string& pattern, int number);
bool has_number_place(const std::string& pattern);

std::string to_ply(const Mesh& mesh);
std::string to_obj(const Mesh& mesh);
std::string to_glb(const Mesh& mesh);

/// A sequence in one GLB: a mesh per frame, shown in turn by STEP keys of its node's scale.
class AnimatedGlb {
public:
    AnimatedGlb();
    ~AnimatedGlb();
    /// Frames in order of time; a mesh may be empty. Throws InputError when all together exceed what GLB can hold.
    void add(const Mesh& mesh, double seconds);
    /// After at least one frame; the last is shown for `last_for` seconds.
    std::string bytes(double last_for);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace rill::cooker
