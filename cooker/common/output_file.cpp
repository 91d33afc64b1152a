// SPDX-License-Identifier: MIT
#include "common/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

#include "common/mesh.h"

namespace rill::cooker {
namespace fs = std::filesystem;

namespace {
/// Devices and pipes are there for good: a file in their place would take them from everybody.
bool is_written_in_place(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}
}  // namespace

fs::path followed(const fs::path& path) {
    std::error_code error;
    if (!fs::is_symlink(fs::symlink_status(path, error))) return path;
    const fs::path target = fs::weakly_canonical(path, error);
    return error ? path : target;
}

void write_file(const fs::path& path, std::string_view bytes) {
    const bool in_place = is_written_in_place(path);
    const fs::path place = followed(path);
    fs::path partial = place;
    if (!in_place) partial += '.', partial += std::to_string(::getpid()), partial += ".partial";  // several may write one file: the last wins
    errno = 0;
    std::ofstream file(partial, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), std::streamsize(bytes.size()));
    file.close();
    std::error_code error;
    if (file && !in_place) fs::rename(partial, place, error);
    if (file && !error) return;
    const std::string cause = error ? error.message() : errno ? std::strerror(errno) : "write error";
    if (!in_place) fs::remove(partial, error);
    throw InputError(path.string() + ": cannot be written: " + cause);
}

void spare_inputs(const fs::path& path, const std::vector<fs::path>& inputs) {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return;
    for (const fs::path& input : inputs)
        if (fs::equivalent(path, input, error)) throw InputError(path.string() + ": is a file of the input, so it is not overwritten");
}

void spare_others(const fs::path& path, size_t most, const std::function<bool(std::string_view)>& is_ours, const char* what) {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return;
    std::string begins(most, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(begins.data(), std::streamsize(begins.size()));
    begins.resize(size_t(file.gcount()));
    if (!begins.empty() && !is_ours(begins))
        throw InputError(path.string() + ": is there already and " + what + ", so it is not overwritten; delete it or choose another name");
}

}  // namespace rill::cooker
