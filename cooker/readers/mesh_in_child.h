// SPDX-License-Identifier: MIT
// For libraries that are not made for hostile bytes: they read in a process of their own, so that a crash, a hang or a
// hunger for memory there is one more InputError here.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>

#include "common/mesh.h"

namespace rill::cooker {

struct ChildLimits {
    uint64_t memory;    ///< bytes, on top of what this process holds
    uint32_t seconds;   ///< of processor time
    uint32_t wait;      ///< seconds until the mesh must be here: a process that waits for itself uses no processor time
};
/// What `work` returns, called in a child process; all else that it does is lost. Throws InputError naming `path` when it
/// throws, crashes or goes beyond a limit. Any thread; `work` must not need locks or threads that this process may have
/// (a child has but one thread, and a lock that another held stays held): it would wait until its limit.
Mesh mesh_in_child(const std::filesystem::path& path, const ChildLimits& limits, const std::function<Mesh()>& work);

}  // namespace rill::cooker
