// SPDX-License-Identifier: MIT
#include "format/check.h"

#include <cstring>

#include "format/crc32.h"
#include "format/cursor.h"
#include "format/lattice.h"

namespace rill::format {
namespace {

/// False for NaN and infinities as well.
bool is_length(float x) { return x >= -largest_length && x <= largest_length; }
bool is_extent(float x) { return x >= 0 && x <= largest_length; }

bool is_box(const float* lower, const float* upper) {
    for (int a = 0; a < 3; ++a)
        if (!is_length(lower[a]) || !is_length(upper[a]) || lower[a] > upper[a]) return false;
    return true;
}

void read_vector(Cursor& cursor, float* out) {
    for (int a = 0; a < 3; ++a) out[a] = cursor.f32();
}

uint64_t directory_size(const Header& h) {
    return uint64_t(h.frame_time_count) * sizeof(double) +
           uint64_t(h.window_count) * window_record_bytes +
           uint64_t(h.chunk_count) * chunk_record_bytes + h.model_bytes + h.settings_bytes;
}

void read_header(Cursor& cursor, Header& h) {
    std::memcpy(h.magic, cursor.take(sizeof h.magic), sizeof h.magic);
    h.version = cursor.u32();
    h.header_bytes = cursor.u32();
    h.file_bytes = cursor.u64();
    h.content_hash = cursor.u64();
    h.directory_bytes = cursor.u32();
    h.directory_crc = cursor.u32();
    h.frame_count = cursor.u32();
    h.first_frame = cursor.i32();
    h.frame_step = cursor.i32();
    h.window_count = cursor.u32();
    h.chunk_count = cursor.u32();
    h.layer_count = cursor.u32();
    h.frame_time_count = cursor.u32();
    h.model_bytes = cursor.u32();
    h.settings_bytes = cursor.u32();
    h.cell_size = cursor.f32();
    h.frames_per_second = cursor.f64();
    h.first_seconds = cursor.f64();
    read_vector(cursor, h.lower);
    read_vector(cursor, h.upper);
    h.walls = cursor.u32();
    h.header_crc = cursor.u32();
}

const char* header_fault(const Header& h, uint64_t file_bytes) {
    if (h.header_bytes != header_bytes) return "header has a wrong size";
    const uint32_t walls = h.walls & every_wall, sharp = h.walls >> sharp_rims_shift & every_wall;
    if (sharp & ~walls || (h.walls != 0 && walls == 0) || h.walls >> walls_bits || (h.version == version_4 && h.walls != 0))
        return "walls are none of its bounds' sides";
    if (h.file_bytes > file_bytes) return "file is shorter than its header says";
    if (h.file_bytes < file_bytes) return "file is longer than its header says";
    if (h.directory_bytes > max_directory_bytes || h.directory_bytes > file_bytes - header_bytes)
        return "directory does not fit in the file";
    if (directory_size(h) != h.directory_bytes) return "counts do not add up to the directory's size";
    if (h.frame_count < 1 || h.window_count < 1 || h.window_count > h.frame_count)
        return "frame or window count is out of range";
    if (h.frame_time_count != 0 && h.frame_time_count != h.frame_count)
        return "table of frame times does not match the frame count";
    // Source numbers of all frames stay within 32 bits: tools print them.
    if (h.frame_step < 1 || h.first_frame + (int64_t(h.frame_count) - 1) * h.frame_step > INT32_MAX)
        return "frame numbers are out of range";
    if (h.layer_count < 1 || h.layer_count > max_layers) return "layer count is out of range";
    if (!(h.cell_size > 0) || !is_extent(h.cell_size)) return "cell size is not a length";
    if (!(h.frames_per_second >= 1e-6 && h.frames_per_second <= 1e6)) return "frame rate is out of range";
    if (!(h.first_seconds >= -1e12 && h.first_seconds <= 1e12)) return "first time is out of range";
    if (!is_box(h.lower, h.upper)) return "bounds are not a box";
    return nullptr;
}

/// Printable UTF-8 (tab and line feeds allowed): safe to show and to log.
bool is_text(const uint8_t* text, size_t size) {
    for (size_t i = 0; i < size;) {
        const uint8_t c = text[i];
        if (c < 0x80) {
            if ((c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7F) return false;
            ++i;
            continue;
        }
        const size_t more = c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : 1;
        if (c < 0xC2 || c > 0xF4 || i + more >= size) return false;
        uint32_t code = c & (0x3F >> more);
        for (size_t k = 1; k <= more; ++k) {
            if ((text[i + k] & 0xC0) != 0x80) return false;
            code = code << 6 | (text[i + k] & 0x3F);
        }
        const uint32_t smallest = more == 1 ? 0xA0 : more == 2 ? 0x800 : 0x10000;  // U+0080…9F: controls
        if (code < smallest || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return false;
        i += more + 1;
    }
    return true;
}

const char* frame_time_fault(const Header& h, const double* times) {
    for (uint32_t i = 0; i < h.frame_time_count; ++i) {
        if (!(times[i] >= 0 && times[i] <= 1e12)) return "a frame time is out of range";
        // Apart enough that the rate between two frames stays a sensible number.
        if (i == 0 ? times[i] != 0 : !(times[i] - times[i - 1] >= 1e-9)) return "frame times do not ascend";
    }
    return nullptr;
}

const char* window_fault(const Header& h, const WindowRecord* windows) {
    uint64_t sample = 0, chunk = 0;
    for (uint32_t i = 0; i < h.window_count; ++i) {
        const WindowRecord& w = windows[i];
        const uint32_t fewest = h.window_count == 1 ? 1 : 2;  // neighbours share a frame
        if (w.sample_count < fewest || w.sample_count > max_window_samples || w.first_sample != sample)
            return "windows do not follow each other in time";
        sample += w.sample_count - 1;
        if (w.first_chunk != chunk || w.chunk_count > h.chunk_count - chunk)
            return "windows do not share out the chunks";
        chunk += w.chunk_count;
        if (w.block_count > max_blocks) return "a window's block count is out of range";
        if (w.chunk_count && !valid(steps_of(h, w))) return "a window's steps are not sensible";
    }
    if (sample != uint64_t(h.frame_count) - 1) return "windows do not end with the last frame";
    if (chunk != h.chunk_count) return "windows do not share out the chunks";
    return nullptr;
}

const char* chunk_fault(const Header& h, const WindowRecord& w, const ChunkRecord& c, uint64_t free_from) {
    if (c.offset < free_from || c.offset > h.file_bytes || c.bytes > h.file_bytes - c.offset || c.bytes == 0)
        return "a chunk lies outside the file or over another part of it";
    if (c.layer >= h.layer_count || c.block >= w.block_count) return "a chunk's layer or block is out of range";
    const uint64_t tracks = uint64_t(c.point_count) + c.drop_count;
    if (tracks > max_tracks_per_chunk || tracks > uint64_t(c.bytes) * most_tracks_per_byte)
        return "a chunk claims more tracks than its bytes can hold";
    const uint64_t most = (uint64_t(c.point_count) * 6 + uint64_t(c.drop_count) * 9) * max_terms;
    if (c.coefficient_count > most || c.coefficient_count > uint64_t(c.bytes) * most_coefficients_per_byte)
        return "a chunk claims more coefficients than its bytes can hold";
    if (!is_box(c.lower, c.upper)) return "a chunk's bounds are not a box";
    if (!is_extent(c.spacing) || !is_extent(c.error_mean) || !is_extent(c.error_p99))
        return "a chunk's spacing or error is not a length";
    return nullptr;
}

const char* chunks_fault(const Header& h, const DirectoryTables& tables) {
    uint64_t free_from = uint64_t(header_bytes) + h.directory_bytes;
    uint64_t hash = fnv1a_start;
    for (uint32_t i = 0; i < h.window_count; ++i) {
        const WindowRecord& w = tables.windows[i];
        int64_t before = -1;
        for (uint32_t k = 0; k < w.chunk_count; ++k) {
            ChunkRecord& c = tables.chunks[w.first_chunk + k];
            c.offset = k ? free_from : w.offset;
            if (const char* fault = chunk_fault(h, w, c, free_from)) return fault;
            const int64_t place = int64_t(c.layer) << 16 | c.block;
            if (place <= before) return "chunks of a window are not in order of layer and block";
            before = place;
            free_from = c.offset + c.bytes;
            hash = fnv1a(hash, c.crc);
        }
    }
    return hash == h.content_hash ? nullptr : "content hash does not match the chunks";
}

void read_tables(const Header& h, Cursor& cursor, DirectoryTables& out) {
    for (uint32_t i = 0; i < h.frame_time_count; ++i) out.frame_times[i] = cursor.f64();
    for (uint32_t i = 0; i < h.window_count; ++i) {
        WindowRecord& w = out.windows[i];
        w.offset = cursor.u64();
        w.first_sample = cursor.u32();
        w.sample_count = cursor.u32();
        w.first_chunk = cursor.u32();
        w.chunk_count = cursor.u32();
        w.block_count = cursor.u16();
        w.ratio = cursor.u16();
        w.step = cursor.f32();
        w.normal_step = cursor.f32();
        w.slip_step = cursor.f32();
    }
    for (uint32_t i = 0; i < h.chunk_count; ++i) {
        ChunkRecord& c = out.chunks[i];
        c.offset = 0;  // known once the windows are checked
        c.bytes = cursor.u32();
        c.crc = cursor.u32();
        c.layer = cursor.u8();
        c.block = cursor.u8();
        c.point_count = cursor.u24();
        c.drop_count = cursor.u24();
        c.coefficient_count = cursor.u32();
        for (int a = 0; a < 3; ++a) c.lower[a] = bound_at(h, a, cursor.i16());
        for (int a = 0; a < 3; ++a) c.upper[a] = bound_at(h, a, cursor.i16());
        c.spacing = cursor.f16();
        c.error_mean = cursor.f16();
        c.error_p99 = cursor.f16();
    }
    out.model = cursor.take(h.model_bytes);
    out.settings = cursor.take(h.settings_bytes);
}

Status verdict(const char* fault, const char** reason) {
    if (fault && reason) *reason = fault;
    return fault ? Status::corrupt : Status::ok;
}

}  // namespace

Status check_header(const uint8_t* bytes, size_t size, uint64_t file_bytes, Header& out,
                    const char** reason) noexcept {
    if (size < sizeof magic || std::memcmp(bytes, magic, sizeof magic) != 0) {
        if (reason) *reason = "file does not begin as a .rill file";
        return Status::not_an_asset;
    }
    if (size < header_bytes || file_bytes < header_bytes) return verdict("file ends within its header", reason);
    Cursor cursor(bytes, header_bytes);
    read_header(cursor, out);
    // Before the checksum: another version may keep its checksum elsewhere.
    if (out.version < version_4 || out.version > current_version) {
        if (reason) *reason = "format version is not known to this library";
        return Status::unknown_format;
    }
    if (out.header_crc != crc32(bytes, header_bytes - 4)) return verdict("header checksum is wrong", reason);
    return verdict(header_fault(out, file_bytes), reason);
}

Status check_directory(const Header& header, const uint8_t* bytes, DirectoryTables& out,
                       const char** reason) noexcept {
    if (crc32(bytes, header.directory_bytes) != header.directory_crc)
        return verdict("directory checksum is wrong", reason);
    Cursor cursor(bytes, header.directory_bytes);
    read_tables(header, cursor, out);
    const char* fault = cursor.overrun || cursor.left() ? "directory has a wrong size" : nullptr;
    if (!fault) fault = frame_time_fault(header, out.frame_times);
    if (!fault) fault = window_fault(header, out.windows);
    if (!fault) fault = chunks_fault(header, out);
    if (!fault && !is_text(out.settings, header.settings_bytes)) fault = "settings are not printable text";
    return verdict(fault, reason);
}

}  // namespace rill::format
