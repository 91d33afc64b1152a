// SPDX-License-Identifier: MIT
#include "common/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "common/mesh.h"

namespace rill::cooker {

void write_file(const std::filesystem::path& path, std::string_view bytes) {
    std::filesystem::path partial = path;
    partial += '.', partial += std::to_string(::getpid()), partial += ".partial";  // several may write one file: the last wins
    errno = 0;
    std::ofstream file(partial, std::ios::binary | std::ios::trunc);
    file.write(bytes.data(), std::streamsize(bytes.size()));
    file.close();
    std::error_code error;
    if (file) std::filesystem::rename(partial, path, error);
    if (file && !error) return;
    const std::string cause = error ? error.message() : errno ? std::strerror(errno) : "write error";
    std::filesystem::remove(partial, error);
    throw InputError(path.string() + ": cannot be written: " + cause);
}

}  // namespace rill::cooker
