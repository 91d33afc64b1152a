// SPDX-License-Identifier: MIT
// Where a cook keeps its finished spans until the asset is whole.
#pragma once
#include <functional>
#include <string>

namespace rill::cooker {

/// The folder is gone when the cook is done, and kept if there is anything in it when not: the same cook goes on from there. Of all cooks of an
/// output one has its folder at a time, for the first that is done takes away those of the others.
class WorkFolder {
public:
    /// Throws InputError when it cannot be made, or another cook is writing the output.
    WorkFolder(const std::string& output, const std::string& path, std::function<void(const std::string&)> warn);
    ~WorkFolder();
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    /// Also what earlier cooks of this output have left, of other input or settings.
    void remove_all();

private:
    std::string output_, path_;
    std::function<void(const std::string&)> warn_;
    int lock_;  ///< an open folder, or -1
    bool is_gone_ = false;
};

}  // namespace rill::cooker
