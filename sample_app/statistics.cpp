// SPDX-License-Identifier: MIT
#include "statistics.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>

#include "new_file.h"

namespace player {

std::string cut_names(uint32_t cut) {
    static const char* const names[] = {"points", "vertices", "indices", "ranges", "time", "residency", "late", "damaged"};
    std::string out;
    for (size_t bit = 0; bit < sizeof names / sizeof names[0]; ++bit)
        if (cut & (1u << bit)) out += (out.empty() ? "" : ", ") + std::string(names[bit]);
    return out.empty() ? "nothing" : out;
}

static std::string quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
        char escape[8];
        if (c == '"' || c == '\\') out += '\\';
        if (static_cast<unsigned char>(c) < 0x20) {
            std::snprintf(escape, sizeof escape, "\\u%04x", c);
            out += escape;
        } else {
            out += c;
        }
    }
    return out + '"';
}

static void print(std::FILE* file, const char* name, uint32_t value) { std::fprintf(file, ", \"%s\": %" PRIu32, name, value); }
static void print(std::FILE* file, const char* name, uint64_t value) { std::fprintf(file, ", \"%s\": %" PRIu64, name, value); }
static void print(std::FILE* file, const char* name, double value) { std::fprintf(file, ", \"%s\": %.6g", name, value); }
static void print(std::FILE* file, const char* name, float value) { print(file, name, static_cast<double>(value)); }

static void print_frame(std::FILE* file, const FrameRecord& record) {
    std::fprintf(file, "    {\"frame\": %d", record.frame);
    print(file, "seconds", record.seconds);
    print(file, "frame_ms", record.frame_ms);
    print(file, "vertices", record.vertices);
    print(file, "triangles", record.triangles);
    std::fprintf(file, ", \"status\": %s", quoted(rill::text(record.status)).c_str());
    for_each_stat(record.stats, [&](const char* name, auto value) { print(file, name, value); });
    std::fputc('}', file);
}

static void print_summary(std::FILE* file, const Clip& clip, uint64_t allocations_after_create,
                          const std::vector<FrameRecord>& frames) {
    FrameRecord sum{}, most{};
    uint32_t cut = 0;
    for (const FrameRecord& record : frames) {
        cut |= record.stats.cut;
        sum.frame_ms += record.frame_ms;
        most.frame_ms = std::max(most.frame_ms, record.frame_ms);
        most.vertices = std::max(most.vertices, record.vertices);
        most.triangles = std::max(most.triangles, record.triangles);
        most.stats.chunks_late = std::max(most.stats.chunks_late, record.stats.chunks_late);
    }
    const double count = static_cast<double>(std::max<size_t>(frames.size(), 1));
    std::fprintf(file, "  \"summary\": {\"frames\": %zu", frames.size());
    print(file, "frame_ms_mean", sum.frame_ms / count);
    print(file, "frame_ms_most", most.frame_ms);
    // Means of what a frame spends where.
    const uint32_t rill::Stats::* const stages[] = {&rill::Stats::plan_us, &rill::Stats::decode_us, &rill::Stats::field_us,
                                                    &rill::Stats::mesh_us, &rill::Stats::wait_us};
    static const char* const names[] = {"plan_us_mean", "decode_us_mean", "field_us_mean", "mesh_us_mean", "wait_us_mean"};
    for (int i = 0; i < 5; ++i) {
        double total = 0.0;
        for (const FrameRecord& record : frames) total += record.stats.*stages[i];
        print(file, names[i], total / count);
    }
    print(file, "vertices_most", most.vertices);
    print(file, "triangles_most", most.triangles);
    print(file, "chunks_late_most", most.stats.chunks_late);
    print(file, "cut", cut);
    std::fprintf(file, ", \"cut_names\": %s", quoted(cut_names(cut)).c_str());
    print(file, "memory_bytes_peak", clip.heap().bytes_peak());
    print(file, "allocations_after_create", allocations_after_create);
    std::fprintf(file, "}\n");
}

bool write_statistics(const std::string& path, const std::string& asset, const Clip& clip,
                      uint64_t allocations_after_create, const std::vector<FrameRecord>& frames) {
    const NewFile beside(path);
    std::FILE* file = std::fopen(beside.place.c_str(), "w");
    if (!file) return false;
    std::fprintf(file, "{\n  \"asset\": %s,\n  \"frames\": [\n", quoted(asset).c_str());
    for (size_t i = 0; i < frames.size(); ++i) {
        print_frame(file, frames[i]);
        std::fputs(i + 1 < frames.size() ? ",\n" : "\n", file);
    }
    std::fputs("  ],\n", file);
    print_summary(file, clip, allocations_after_create, frames);
    std::fputs("}\n", file);
    const bool good = !std::ferror(file);
    return beside.finish(std::fclose(file) == 0 && good);
}

}  // namespace player
