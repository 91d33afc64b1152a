// SPDX-License-Identifier: MIT
#include "asset_directory.h"

#include <cmath>
#include <fstream>

#include "format/check.h"
#include "mesh.h"

namespace rill::cooker {

double AssetDirectory::diagonal() const {
    double sum = 0;
    for (int a = 0; a < 3; ++a) sum += std::pow(double(header.upper[a]) - header.lower[a], 2);
    return std::sqrt(sum);
}

AssetDirectory read_directory(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file.tellg();
    if (!file || size < 0) throw InputError(path + ": cannot be read");
    AssetDirectory result;
    const char* reason = "it ends early";
    auto take = [&](uint64_t from, uint64_t bytes) {
        std::vector<uint8_t> taken(bytes);
        file.clear();
        file.seekg(std::streamoff(from));
        if (!file.read(reinterpret_cast<char*>(taken.data()), std::streamsize(bytes)))
            throw InputError(path + ": cannot be read: " + reason);
        return taken;
    };
    auto need = [&](Status status) {
        if (status != Status::ok) throw InputError(path + ": " + text(status) + " (" + reason + ")");
    };
    const std::vector<uint8_t> head = take(0, std::min<uint64_t>(uint64_t(size), format::header_bytes));
    need(format::check_header(head.data(), head.size(), uint64_t(size), result.header, &reason));
    const std::vector<uint8_t> bytes = take(format::header_bytes, result.header.directory_bytes);
    std::vector<double> times(result.header.frame_time_count);
    result.windows.resize(result.header.window_count);
    result.chunks.resize(result.header.chunk_count);
    format::DirectoryTables tables{times.data(), result.windows.data(), result.chunks.data(), nullptr, nullptr};
    need(format::check_directory(result.header, bytes.data(), tables, &reason));
    result.settings_json.assign(reinterpret_cast<const char*>(tables.settings), result.header.settings_bytes);
    return result;
}

}  // namespace rill::cooker
