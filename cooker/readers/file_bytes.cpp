// SPDX-License-Identifier: MIT
#include "readers/file_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

namespace rill::cooker {
namespace {
constexpr uint64_t largest_file = uint64_t(4) << 30;  // of one frame, also after decompression
}

std::string read_file(const std::filesystem::path& path) {
    std::error_code error;
    const uint64_t size = std::filesystem::file_size(path, error);
    if (error) throw InputError(path.string() + ": " + error.message());
    if (size > largest_file) throw InputError(path.string() + ": larger than 4 GiB");
    std::string bytes(size, '\0');
    std::ifstream file(path, std::ios::binary);
    if (!file || !file.read(bytes.data(), std::streamsize(size)))
        throw InputError(path.string() + ": cannot be read" + (errno ? ": " + std::string(std::strerror(errno)) : ""));
    return bytes;
}

std::string read_gzip(const std::filesystem::path& path) {
    const std::string packed = read_file(path);
    if (packed.size() < 2 || packed[0] != '\x1f' || packed[1] != '\x8b')
        throw InputError(path.string() + (packed.empty() ? ": empty file" : ": not a gzip stream"));
    z_stream stream{};
    if (inflateInit2(&stream, 15 + 16) != Z_OK) throw InputError(path.string() + ": zlib cannot start");
    struct End {
        z_stream* stream;
        ~End() { inflateEnd(stream); }
    } end{&stream};
    std::string bytes;
    size_t taken = 0;
    for (int status = Z_OK; status != Z_STREAM_END;) {
        constexpr size_t slice = size_t(1) << 20;
        const size_t done = bytes.size();
        if (done >= largest_file) throw InputError(path.string() + ": unpacks to more than 4 GiB");
        bytes.resize(done + std::max(slice, done / 2));
        if (stream.avail_in == 0 && taken < packed.size()) {
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + taken));
            stream.avail_in = uInt(std::min(packed.size() - taken, size_t(1) << 30));
            taken += stream.avail_in;
        }
        stream.next_out = reinterpret_cast<Bytef*>(bytes.data() + done);
        stream.avail_out = uInt(std::min(bytes.size() - done, size_t(1) << 30));
        const uInt room = stream.avail_out;
        status = inflate(&stream, Z_NO_FLUSH);
        bytes.resize(done + (room - stream.avail_out));
        if (status == Z_BUF_ERROR || (status == Z_OK && stream.avail_out > 0 && taken == packed.size()))
            throw InputError(path.string() + ": ends in the middle of its gzip stream (" + std::to_string(packed.size()) +
                             " bytes)");
        if (status != Z_OK && status != Z_STREAM_END)
            throw InputError(path.string() + ": damaged gzip stream" + (stream.msg ? ": " + std::string(stream.msg) : ""));
    }
    return bytes;
}

}  // namespace rill::cooker
