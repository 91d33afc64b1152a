// SPDX-License-Identifier: MIT
#include "cook/work_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <vector>

#include "common/mesh.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

/// Of all cooks of this output, whatever their input and settings.
std::vector<fs::path> work_folders(const std::string& output) {
    std::error_code ignored;
    const fs::path target = fs::absolute(output, ignored);
    const std::string prefix = target.filename().string() + ".cook-";
    std::vector<fs::path> folders;
    for (fs::directory_iterator at(target.parent_path(), ignored), end; !ignored && at != end; at.increment(ignored)) {
        const std::string name = at->path().filename().string();
        if (name.size() == prefix.size() + 16 && name.compare(0, prefix.size(), prefix) == 0 &&
            name.find_first_not_of("0123456789abcdef", prefix.size()) == std::string::npos)
            folders.push_back(at->path());
    }
    return folders;
}

/// Locks a folder until it is closed, or the process ends, however it ends. False: somebody else has. Where the file system knows no
/// locks, nobody has.
bool lock(const fs::path& folder, int& file) {
    file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    return file < 0 || ::flock(file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}
void unlock(int file) {
    if (file >= 0) ::close(file);
}
bool is_locked(const fs::path& folder) {
    int file;
    const bool is_free = lock(folder, file);
    unlock(file);
    return !is_free;
}

}  // namespace

WorkFolder::WorkFolder(const std::string& output, const std::string& path, std::function<void(const std::string&)> warn)
    : output_(output), path_(path), warn_(std::move(warn)) {
    std::error_code error;
    fs::create_directory(path_, error);
    if (error) throw InputError(output + ": cannot be written: " + error.message());
    const bool is_ours = lock(path_, lock_);
    bool is_free = is_ours;
    for (const fs::path& other : work_folders(output)) is_free = is_free && (fs::equivalent(other, path_, error) || !is_locked(other));
    if (is_free) return;
    if (is_ours) fs::remove(path_, error);  // if it is empty
    unlock(lock_);
    throw InputError(output + ": another cook is writing it");
}

WorkFolder::~WorkFolder() {
    std::error_code ignored;
    if (!is_gone_) fs::remove(path_, ignored);  // if it is empty
    if (!is_gone_ && warn_ && fs::exists(path_, ignored)) warn_(path_ + ": keeps the finished spans; the same cook goes on from them");
    unlock(lock_);
}

void WorkFolder::remove_all() {
    std::error_code ignored;
    is_gone_ = true;  // one of the same name is somebody else's from now on
    for (const fs::path& folder : work_folders(output_)) fs::remove_all(folder, ignored);
}

}  // namespace rill::cooker
