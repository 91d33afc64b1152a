// SPDX-License-Identifier: MIT
#include "chunks_to_asset.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <tuple>
#include <utility>

#include "format/check.h"
#include "format/crc32.h"
#include "mesh.h"

namespace rill::cooker {
namespace {

/// A file being written; every failure names it and the system's reason. Removed unless kept.
class NewFile {
public:
    explicit NewFile(std::string path) : path_(std::move(path)) {
        file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
        if (file_ < 0) fail("cannot be written");
    }
    ~NewFile() {
        if (file_ >= 0) ::close(file_);
        if (!path_.empty()) ::unlink(path_.c_str());
    }
    NewFile(const NewFile&) = delete;
    NewFile& operator=(const NewFile&) = delete;

    void write(const uint8_t* bytes, size_t size) {
        while (size) {
            const ssize_t wrote = ::write(file_, bytes, size);
            if (wrote < 0 && errno == EINTR) continue;
            if (wrote < 0) fail("cannot be written");
            bytes += wrote;
            size -= size_t(wrote);
        }
    }
    void copy_from(const NewFile& other, uint64_t size) {
        std::vector<uint8_t> buffer(1 << 20);
        for (uint64_t at = 0; at < size;) {
            const size_t most = size_t(std::min<uint64_t>(buffer.size(), size - at));
            const ssize_t got = ::pread(other.file_, buffer.data(), most, off_t(at));
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) other.fail("cannot be read");
            if (got == 0) throw InputError(other.path_ + ": was shortened by somebody else");
            write(buffer.data(), size_t(got));
            at += uint64_t(got);
        }
    }
    /// On the disk under its last name, or not at all.
    void rename_to(const std::string& target) {
        if (::fsync(file_) != 0) fail("cannot be written");
        const int file = std::exchange(file_, -1);
        if (::close(file) != 0) fail("cannot be written");
        if (::rename(path_.c_str(), target.c_str()) != 0)
            throw InputError(target + ": cannot be written: " + std::strerror(errno));
        path_.clear();
    }

private:
    [[noreturn]] void fail(const char* what) const {
        throw InputError(path_ + ": " + what + ": " + std::strerror(errno));
    }
    std::string path_;
    int file_ = -1;
};

/// Little-endian bytes, field by field: the counterpart of format/cursor.h.
struct ByteWriter {
    std::vector<uint8_t> bytes;

    template <class T>
    void integer(T value) {
        for (size_t i = 0; i < sizeof(T); ++i) bytes.push_back(uint8_t(uint64_t(value) >> (8 * i)));
    }
    void real(float value) { integer(bits<uint32_t>(value)); }
    void real(double value) { integer(bits<uint64_t>(value)); }
    void vector(const float* v) {
        for (int a = 0; a < 3; ++a) real(v[a]);
    }
    void raw(const void* data, size_t size) {
        const auto* from = static_cast<const uint8_t*>(data);
        bytes.insert(bytes.end(), from, from + size);
    }

private:
    template <class To, class From>
    static To bits(From from) {
        static_assert(sizeof(To) == sizeof(From));
        To to;
        std::memcpy(&to, &from, sizeof to);
        return to;
    }
};

void write_header(ByteWriter& out, const format::Header& h) {
    out.raw(h.magic, sizeof h.magic);
    out.integer(h.version);
    out.integer(h.header_bytes);
    out.integer(h.file_bytes);
    out.integer(h.content_hash);
    out.integer(h.directory_bytes);
    out.integer(h.directory_crc);
    out.integer(h.frame_count);
    out.integer(h.first_frame);
    out.integer(h.frame_step);
    out.integer(h.window_count);
    out.integer(h.chunk_count);
    out.integer(h.layer_count);
    out.integer(h.frame_time_count);
    out.integer(h.model_bytes);
    out.integer(h.settings_bytes);
    out.real(h.cell_size);
    out.real(h.frames_per_second);
    out.real(h.first_seconds);
    out.vector(h.lower);
    out.vector(h.upper);
    out.integer(h.reserved);
    out.integer(format::crc32(out.bytes.data(), out.bytes.size()));
}

void write_window(ByteWriter& out, const format::WindowRecord& w) {
    for (const uint32_t field :
         {w.first_sample, w.sample_count, w.first_chunk, w.chunk_count, w.block_count, w.reserved})
        out.integer(field);
}

void write_chunk(ByteWriter& out, const format::ChunkRecord& c) {
    out.integer(c.offset);
    out.integer(c.bytes);
    out.integer(c.crc);
    out.integer(c.layer);
    out.integer(c.block);
    out.integer(c.point_count);
    out.integer(c.drop_count);
    out.integer(c.coefficient_count);
    out.vector(c.lower);
    out.vector(c.upper);
    out.real(c.spacing);
    out.real(c.error_mean);
    out.real(c.error_p99);
    out.integer(c.reserved);
}

format::ChunkRecord record_of(const ChunkToWrite& chunk) {
    format::ChunkRecord record{};
    record.bytes = uint32_t(chunk.encoded.bytes.size());
    record.crc = format::crc32(chunk.encoded.bytes.data(), chunk.encoded.bytes.size());
    record.layer = uint16_t(chunk.layer);
    record.block = uint16_t(chunk.block);
    record.point_count = chunk.encoded.shape.point_count;
    record.drop_count = chunk.encoded.shape.drop_count;
    record.coefficient_count = chunk.encoded.shape.coefficient_count;
    for (int a = 0; a < 3; ++a) {
        record.lower[a] = chunk.lower[a];
        record.upper[a] = chunk.upper[a];
    }
    record.spacing = chunk.spacing;
    record.error_mean = chunk.error_mean;
    record.error_p99 = chunk.error_p99;
    return record;
}

}  // namespace

struct AssetWriter::Impl {
    std::string path;
    NewFile spool;
    uint64_t spooled = 0;
    std::vector<format::WindowRecord> windows;
    std::vector<format::ChunkRecord> chunks;  ///< offsets within the spool until finish()

    explicit Impl(std::string target) : path(std::move(target)), spool(path + ".spool") {}

    std::vector<uint8_t> directory(const AssetFacts& facts, uint64_t chunks_at) const;
    format::Header header(const AssetFacts& facts, const std::vector<uint8_t>& directory) const;
};

std::vector<uint8_t> AssetWriter::Impl::directory(const AssetFacts& facts, uint64_t chunks_at) const {
    ByteWriter out;
    for (const double seconds : facts.frame_seconds) out.real(seconds);
    for (const format::WindowRecord& window : windows) write_window(out, window);
    for (format::ChunkRecord chunk : chunks) {
        chunk.offset += chunks_at;
        write_chunk(out, chunk);
    }
    out.raw(facts.model.data(), facts.model.size());
    out.raw(facts.settings_json.data(), facts.settings_json.size());
    return std::move(out.bytes);
}

format::Header AssetWriter::Impl::header(const AssetFacts& facts, const std::vector<uint8_t>& directory) const {
    format::Header h{};
    std::memcpy(h.magic, format::magic, sizeof h.magic);
    h.version = format::current_version;
    h.header_bytes = format::header_bytes;
    h.file_bytes = format::header_bytes + directory.size() + spooled;
    h.content_hash = format::fnv1a_start;
    for (const format::ChunkRecord& chunk : chunks) h.content_hash = format::fnv1a(h.content_hash, chunk.crc);
    h.directory_bytes = uint32_t(directory.size());
    h.directory_crc = format::crc32(directory.data(), directory.size());
    h.frame_count = facts.frame_count;
    h.first_frame = facts.first_frame;
    h.frame_step = facts.frame_step;
    h.window_count = uint32_t(windows.size());
    h.chunk_count = uint32_t(chunks.size());
    h.layer_count = facts.layer_count;
    h.frame_time_count = uint32_t(facts.frame_seconds.size());
    h.model_bytes = uint32_t(facts.model.size());
    h.settings_bytes = uint32_t(facts.settings_json.size());
    h.cell_size = facts.cell_size;
    h.frames_per_second = facts.frames_per_second;
    h.first_seconds = facts.first_seconds;
    for (int a = 0; a < 3; ++a) {
        h.lower[a] = facts.lower[a];
        h.upper[a] = facts.upper[a];
    }
    return h;
}

namespace {

/// What the runtime would refuse must not be written: the cause is a mistake further up.
void check_own(const std::string& path, const std::vector<uint8_t>& head, const std::vector<uint8_t>& directory,
               uint64_t file_bytes) {
    const char* reason = "";
    format::Header header;
    Status status = format::check_header(head.data(), head.size(), file_bytes, header, &reason);
    if (status == Status::ok) {
        std::vector<double> times(header.frame_time_count);
        std::vector<format::WindowRecord> windows(header.window_count);
        std::vector<format::ChunkRecord> chunks(header.chunk_count);
        format::DirectoryTables tables{times.data(), windows.data(), chunks.data(), nullptr, nullptr};
        status = format::check_directory(header, directory.data(), tables, &reason);
    }
    if (status != Status::ok) throw InputError(path + ": cannot be stored as an asset: " + reason);
}

}  // namespace

AssetWriter::AssetWriter(std::string path) : impl_(std::make_unique<Impl>(std::move(path))) {}
AssetWriter::~AssetWriter() = default;

void AssetWriter::add_window(uint32_t first_sample, uint32_t sample_count, uint32_t block_count,
                             std::vector<ChunkToWrite> chunks) {
    std::sort(chunks.begin(), chunks.end(), [](const ChunkToWrite& a, const ChunkToWrite& b) {
        return std::tie(a.layer, a.block) < std::tie(b.layer, b.block);
    });
    impl_->windows.push_back({first_sample, sample_count, uint32_t(impl_->chunks.size()),
                              uint32_t(chunks.size()), block_count, 0});
    for (const ChunkToWrite& chunk : chunks) {
        if (chunk.layer >= format::max_layers || chunk.block >= format::max_blocks ||
            chunk.encoded.bytes.size() > UINT32_MAX)
            throw InputError(impl_->path + ": cannot be stored as an asset: a chunk is beyond the format's limits");
        impl_->chunks.push_back(record_of(chunk));
        impl_->chunks.back().offset = impl_->spooled;
        impl_->spool.write(chunk.encoded.bytes.data(), chunk.encoded.bytes.size());
        impl_->spooled += chunk.encoded.bytes.size();
    }
}

void AssetWriter::append(const AssetDirectory& part, uint32_t first_sample) {
    const uint32_t first_chunk = uint32_t(impl_->chunks.size());
    for (format::WindowRecord window : part.windows) {
        window.first_sample += first_sample, window.first_chunk += first_chunk;
        impl_->windows.push_back(window);
    }
    for (uint32_t c = 0; c < part.chunks.size(); ++c) {
        const std::vector<uint8_t> bytes = read_chunk(part, c);
        impl_->chunks.push_back(part.chunks[c]);
        impl_->chunks.back().offset = impl_->spooled;
        impl_->spool.write(bytes.data(), bytes.size());
        impl_->spooled += bytes.size();
    }
}

void AssetWriter::finish(const AssetFacts& facts) {
    Impl& impl = *impl_;
    const size_t directory_bytes = impl.directory(facts, 0).size();
    const std::vector<uint8_t> directory = impl.directory(facts, format::header_bytes + directory_bytes);
    if (directory.size() > format::max_directory_bytes)
        throw InputError(impl.path + ": cannot be stored as an asset: too many chunks for one directory");
    ByteWriter head;
    const format::Header header = impl.header(facts, directory);
    write_header(head, header);
    check_own(impl.path, head.bytes, directory, header.file_bytes);

    NewFile partial(impl.path + ".partial");
    partial.write(head.bytes.data(), head.bytes.size());
    partial.write(directory.data(), directory.size());
    partial.copy_from(impl.spool, impl.spooled);
    partial.rename_to(impl.path);
}

}  // namespace rill::cooker
