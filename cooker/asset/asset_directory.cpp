// SPDX-License-Identifier: MIT
#include "asset/asset_directory.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/mesh.h"
#include "format/check.h"
#include "format/crc32.h"

namespace rill::cooker {

double AssetDirectory::diagonal() const {
    double sum = 0;
    for (int a = 0; a < 3; ++a) sum += std::pow(double(header.upper[a]) - header.lower[a], 2);
    return std::sqrt(sum);
}

double AssetDirectory::place_of(int number) const {
    for (uint32_t i = 0; i < header.frame_count; ++i) {
        const int here = frame_number(i), before = i ? frame_number(i - 1) : here;
        if (number == here) return i;
        if (before < number && number < here) return i - double(here - number) / (here - before);
    }
    throw InputError(path + ": has no frame " + std::to_string(number) + ": it holds " + std::to_string(frame_number(0)) + " to " +
                     std::to_string(frame_number(header.frame_count - 1)) + " by " + std::to_string(header.frame_step));
}

uint32_t AssetDirectory::index_of(int number) const {
    const double place = place_of(number);
    if (place == std::floor(place)) return uint32_t(place);
    throw InputError(path + ": has no frame " + std::to_string(number) + ", but others before and after it");
}

namespace {
/// Numbers that the header cannot state; anything odd there counts as silence.
std::vector<int> stated_numbers(const AssetDirectory& directory) {
    const nlohmann::json json = nlohmann::json::parse(directory.settings_json, nullptr, false);
    if (!json.is_object() || !json.contains("frame_numbers") || !json["frame_numbers"].is_array()) return {};
    std::vector<int> numbers;
    for (const nlohmann::json& number : json["frame_numbers"]) {
        if (!number.is_number_integer()) return {};
        numbers.push_back(number);
    }
    if (numbers.size() != directory.header.frame_count || !std::is_sorted(numbers.begin(), numbers.end())) return {};
    return numbers;
}
}  // namespace

std::vector<uint8_t> read_chunk(const AssetDirectory& directory, uint32_t chunk) {
    const format::ChunkRecord& record = directory.chunks.at(chunk);
    std::vector<uint8_t> bytes(record.bytes);
    std::ifstream file(directory.path, std::ios::binary);
    if (!file.seekg(std::streamoff(record.offset)) || !file.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size())))
        throw InputError(directory.path + ": cannot be read");
    if (format::crc32(bytes.data(), bytes.size()) != record.crc)
        throw InputError(directory.path + ": damaged: the checksum of chunk " + std::to_string(chunk) + " does not fit");
    return bytes;
}

void check_chunks(const AssetDirectory& directory) {
    for (uint32_t c = 0; c < directory.chunks.size(); ++c) read_chunk(directory, c);
}

AssetDirectory read_directory(const std::string& path) {
    if (std::filesystem::is_directory(path)) throw InputError(path + ": cannot be read: is a directory");
    errno = 0;
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::streamoff size = file.tellg();
    if (!file || size < 0) throw InputError(path + ": cannot be read" + (errno ? ": " + std::string(std::strerror(errno)) : ""));
    if (size == 0) throw InputError(path + ": not a .rill file: it is empty, as the parts of segments are that no span was left for");
    AssetDirectory result;
    result.path = path;
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
    result.numbers = stated_numbers(result);
    return result;
}

}  // namespace rill::cooker
