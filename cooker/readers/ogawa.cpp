// SPDX-License-Identifier: MIT
#include "readers/ogawa.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace rill::cooker {
namespace {
constexpr uint64_t data_bit = uint64_t(1) << 63;
}

OgawaFile::OgawaFile(const std::filesystem::path& path) : name_(path.string()) {
    file_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file_ < 0) fail(std::strerror(errno));
    try {
        struct stat facts{};
        if (fstat(file_, &facts) != 0 || !S_ISREG(facts.st_mode)) fail("not a regular file");
        size_ = uint64_t(facts.st_size);
        if (size_ == 0) fail("empty file");
        unsigned char head[8] = {};
        read(0, head, std::min<uint64_t>(size_, 8), "header");
        if (std::memcmp(head, "\x89HDF", 4) == 0) fail("an Alembic file in the old HDF5 container; export it again as Ogawa");
        if (std::memcmp(head, "Ogawa", 5) != 0) fail("not an Alembic (Ogawa) file");
        if (head[5] != 0xff) fail("was not finished by the program that wrote it");
        if (head[6] != 0 || head[7] != 1) fail("Ogawa of version " + std::to_string(head[6] * 256 + head[7]) + "; 1 is read");
        root_.position = number(8, "header");
    } catch (...) {
        close(file_);
        throw;
    }
}

OgawaFile::~OgawaFile() { close(file_); }

void OgawaFile::read(uint64_t position, void* to, uint64_t count, const char* what) const {
    if (position > size_ || count > size_ - position)
        fail(std::string(what) + ": " + std::to_string(count) + " bytes at " + std::to_string(position) + " lie beyond the end (" +
             std::to_string(size_) + " bytes)");
    for (uint64_t done = 0; done < count;) {
        const ssize_t got = pread(file_, static_cast<char*>(to) + done, count - done, off_t(position + done));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) fail(std::string(what) + ": cannot be read: " + (got < 0 ? std::strerror(errno) : "the file shrank"));
        done += uint64_t(got);
    }
}

uint64_t OgawaFile::number(uint64_t position, const char* what) const {
    uint64_t value = 0;
    read(position, &value, 8, what);
    return value;
}

std::vector<OgawaFile::Node> OgawaFile::group(Node node, const char* what) const {
    if (node.is_data) fail(std::string(what) + ": a block of bytes stands where a group must be");
    if (node.position == 0) return {};
    const uint64_t count = number(node.position, what);
    if (count > (size_ - node.position) / 8)
        fail(std::string(what) + ": states a group of " + std::to_string(count) + " at byte " + std::to_string(node.position));
    std::vector<uint64_t> raw(count);
    if (count > 0) read(node.position + 8, raw.data(), count * 8, what);
    std::vector<Node> nodes(count);
    for (size_t i = 0; i < nodes.size(); ++i) nodes[i] = {raw[i] & ~data_bit, (raw[i] & data_bit) != 0};
    return nodes;
}

std::string OgawaFile::data(Node node, const char* what, uint64_t skip) const {
    if (!node.is_data) fail(std::string(what) + ": a group stands where a block of bytes must be");
    if (node.position == 0) return {};
    const uint64_t count = number(node.position, what);
    if (count > size_ - node.position - 8)
        fail(std::string(what) + ": states " + std::to_string(count) + " bytes at " + std::to_string(node.position) + ", more than follow");
    if (count <= skip) return {};
    std::string bytes(count - skip, '\0');
    read(node.position + 8 + skip, bytes.data(), bytes.size(), what);
    return bytes;
}

}  // namespace rill::cooker
