// SPDX-License-Identifier: MIT
#include "cook/input_hash.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <unordered_set>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "common/parallel.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

std::string hexadecimal(const XXH128_hash_t& hash) {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, hash);
    std::string text;
    for (const unsigned char byte : canonical.digest) text += "0123456789abcdef"[byte >> 4], text += "0123456789abcdef"[byte & 15];
    return text;
}

XXH128_hash_t hash_file(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> part(size_t(1) << 20);
    XXH3_state_t state;
    XXH3_128bits_reset(&state);
    do {
        file.read(part.data(), std::streamsize(part.size()));
        XXH3_128bits_update(&state, part.data(), size_t(file.gcount()));
    } while (file);
    if (!file.eof()) throw InputError(path.string() + ": cannot be read: " + std::strerror(errno));
    return XXH3_128bits_digest(&state);
}

}  // namespace

std::vector<fs::path> input_files(const SequenceReader& reader) {
    std::vector<fs::path> all;
    std::unordered_set<std::string> seen;
    for (size_t i = 0; i < reader.info().numbers.size(); ++i)
        for (fs::path& path : reader.files(i))
            if (seen.insert(path.string()).second) all.push_back(std::move(path));
    return all;
}

std::string hash_contents(const std::vector<fs::path>& files, int jobs) {
    std::vector<XXH128_canonical_t> hashes(files.size());
    parallel_for(files.size(), jobs, [&](size_t i) { XXH128_canonicalFromHash(&hashes[i], hash_file(files[i])); });
    return hexadecimal(XXH3_128bits(hashes.data(), hashes.size() * sizeof hashes[0]));
}

std::string hash_states(const std::vector<fs::path>& files) {
    std::string text;
    for (const fs::path& path : files) {
        std::error_code error;
        text += fs::absolute(path, error).string() + '\n' + std::to_string(fs::file_size(path, error)) + '\n';
        text += std::to_string(fs::last_write_time(path, error).time_since_epoch().count()) + '\n';
    }
    return hash_text(text);
}

std::string hash_text(const std::string& text) { return hexadecimal(XXH3_128bits(text.data(), text.size())); }

}  // namespace rill::cooker
