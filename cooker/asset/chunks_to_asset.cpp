// SPDX-License-Identifier: MIT
#include "asset/chunks_to_asset.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <tuple>
#include <utility>

#include "common/mesh.h"
#include "common/output_file.h"
#include "format/check.h"
#include "format/crc32.h"
#include "format/lattice.h"

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
    void integer(T value, size_t size = sizeof(T)) {
        for (size_t i = 0; i < size; ++i) bytes.push_back(uint8_t(uint64_t(value) >> (8 * i)));
    }
    void real(float value) { integer(bits<uint32_t>(value)); }
    void real(double value) { integer(bits<uint64_t>(value)); }
    /// The nearest that is half as long.
    void half(float value) { integer(uint16_t((uint64_t(bits<uint32_t>(value)) + 0x8000) >> 16)); }
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
    out.integer(h.walls);
    out.integer(format::crc32(out.bytes.data(), out.bytes.size()));
}

void write_window(ByteWriter& out, const format::WindowRecord& w) {
    out.integer(w.offset);
    for (const uint32_t field : {w.first_sample, w.sample_count, w.first_chunk, w.chunk_count}) out.integer(field);
    out.integer(w.block_count);
    out.integer(w.ratio);
    for (const float field : {w.step, w.normal_step, w.slip_step}) out.real(field);
}

/// The nearest bound of the format that is no less than x, or no more.
int16_t bound_units(const std::string& path, const format::Header& h, int axis, float x, bool upper) {
    const double units = (double(x) - h.lower[axis]) / format::bounds_unit(h);
    double whole = std::round(units);  // bounds that were read from a file stay what they are
    if (!(std::abs(whole) < INT16_MAX)) throw InputError(path + ": cannot be stored as an asset: a chunk reaches far out of the bounds");
    const auto misses = [&] {
        const float bound = format::bound_at(h, axis, int16_t(whole));
        return upper ? bound < x : bound > x;
    };
    if (misses()) whole += upper ? 1 : -1;
    return int16_t(whole);
}

/// `h`: its bounds and cell size. `path`: named in errors.
void write_chunk(ByteWriter& out, const format::ChunkRecord& c, const format::Header& h, const std::string& path) {
    out.integer(c.bytes);
    out.integer(c.crc);
    out.integer(uint8_t(c.layer));
    out.integer(uint8_t(c.block));
    out.integer(c.point_count, 3);
    out.integer(c.drop_count, 3);
    out.integer(c.coefficient_count);
    for (int a = 0; a < 3; ++a) out.integer(bound_units(path, h, a, c.lower[a], false));
    for (int a = 0; a < 3; ++a) out.integer(bound_units(path, h, a, c.upper[a], true));
    out.half(c.spacing);
    out.half(c.error_mean);
    out.half(c.error_p99);
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
    std::vector<format::WindowRecord> windows;  ///< offsets within the spool until finish()
    std::vector<format::ChunkRecord> chunks;
    glm::vec3 origin{NAN};                      ///< of all positions so far; NaN: there are none

    explicit Impl(std::string target) : path(std::move(target)), spool(path + ".spool") {}

    void told_from(const glm::vec3& place);
    std::vector<uint8_t> directory(const AssetFacts& facts, uint64_t chunks_at) const;
    format::Header header(const AssetFacts& facts, const std::vector<uint8_t>& directory) const;
};

/// The file has one origin, the low corner of its bounds.
void AssetWriter::Impl::told_from(const glm::vec3& place) {
    if (std::isnan(origin.x)) origin = place;
    if (origin != place) throw InputError(path + ": cannot be stored as an asset: its positions are told from different places");
}

void set_bounds(format::Header& h, const AssetFacts& facts) {
    h.cell_size = facts.cell_size, h.walls = facts.walls;
    for (int a = 0; a < 3; ++a) h.lower[a] = facts.lower[a], h.upper[a] = facts.upper[a];
}

std::vector<uint8_t> AssetWriter::Impl::directory(const AssetFacts& facts, uint64_t chunks_at) const {
    format::Header bounds{};
    set_bounds(bounds, facts);
    ByteWriter out;
    for (const double seconds : facts.frame_seconds) out.real(seconds);
    for (format::WindowRecord window : windows) {
        window.offset += chunks_at;
        write_window(out, window);
    }
    for (const format::ChunkRecord& chunk : chunks) write_chunk(out, chunk, bounds, path);
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
    h.frames_per_second = facts.frames_per_second;
    h.first_seconds = facts.first_seconds;
    set_bounds(h, facts);
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

bool alike(const format::LatticeSteps& a, const format::LatticeSteps& b) {
    return std::tie(a.step, a.normal_step, a.ratio, a.slip_step) == std::tie(b.step, b.normal_step, b.ratio, b.slip_step);
}

}  // namespace

AssetWriter::AssetWriter(std::string path) : impl_(std::make_unique<Impl>(std::move(path))) {}
AssetWriter::~AssetWriter() = default;

void AssetWriter::add_window(uint32_t first_sample, uint32_t sample_count, uint32_t block_count,
                             std::vector<ChunkToWrite> chunks) {
    std::sort(chunks.begin(), chunks.end(), [](const ChunkToWrite& a, const ChunkToWrite& b) {
        return std::tie(a.layer, a.block) < std::tie(b.layer, b.block);
    });
    const format::LatticeSteps steps = chunks.empty() ? format::LatticeSteps{} : chunks.front().encoded.shape.steps;
    impl_->windows.push_back({impl_->spooled, first_sample, sample_count, uint32_t(impl_->chunks.size()), uint32_t(chunks.size()),
                              uint16_t(block_count), steps.ratio, steps.step, steps.normal_step, steps.slip_step});
    for (const ChunkToWrite& chunk : chunks) {
        if (chunk.layer >= format::max_layers || chunk.block >= format::max_blocks || block_count > format::max_blocks ||
            chunk.encoded.bytes.size() > UINT32_MAX)
            throw InputError(impl_->path + ": cannot be stored as an asset: a chunk is beyond the format's limits");
        if (!alike(chunk.encoded.shape.steps, steps))
            throw InputError(impl_->path + ": cannot be stored as an asset: the chunks of a window have different steps");
        impl_->told_from({steps.origin[0], steps.origin[1], steps.origin[2]});
        impl_->chunks.push_back(record_of(chunk));
        impl_->spool.write(chunk.encoded.bytes.data(), chunk.encoded.bytes.size());
        impl_->spooled += chunk.encoded.bytes.size();
    }
}

void AssetWriter::append(const AssetDirectory& part, uint32_t first_sample) {
    const uint32_t first_chunk = uint32_t(impl_->chunks.size());
    for (format::WindowRecord window : part.windows) {
        const uint32_t first = window.first_chunk;
        window.offset = impl_->spooled, window.first_sample += first_sample, window.first_chunk += first_chunk;
        impl_->windows.push_back(window);
        for (uint32_t c = first; c < first + window.chunk_count; ++c) {
            const std::vector<uint8_t> bytes = read_chunk(part, c);
            impl_->chunks.push_back(part.chunks[c]);
            impl_->spool.write(bytes.data(), bytes.size());
            impl_->spooled += bytes.size();
        }
    }
    if (!part.chunks.empty()) impl_->told_from({part.header.lower[0], part.header.lower[1], part.header.lower[2]});
}

void AssetWriter::finish(const AssetFacts& facts) {
    Impl& impl = *impl_;
    if (!impl.chunks.empty()) impl.told_from(facts.lower);
    const size_t directory_bytes = impl.directory(facts, 0).size();
    const std::vector<uint8_t> directory = impl.directory(facts, format::header_bytes + directory_bytes);
    if (directory.size() > format::max_directory_bytes)
        throw InputError(impl.path + ": cannot be stored as an asset: too many chunks for one directory");
    ByteWriter head;
    const format::Header header = impl.header(facts, directory);
    write_header(head, header);
    check_own(impl.path, head.bytes, directory, header.file_bytes);

    const std::string place = followed(impl.path).string();
    NewFile partial(place + ".partial");
    partial.write(head.bytes.data(), head.bytes.size());
    partial.write(directory.data(), directory.size());
    partial.copy_from(impl.spool, impl.spooled);
    partial.rename_to(place);
}

}  // namespace rill::cooker
