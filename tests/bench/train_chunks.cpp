// SPDX-License-Identifier: MIT
// rill-train-chunks ASSET...: writes runtime/format/chunk_priors.h to stdout, from what every chunk of the assets had
// learned at its end. When the order or the meaning of counters changes: empty the table, build, cook the assets,
// train; and once more from there.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "asset/asset_directory.h"
#include "common/mesh.h"
#include "format/chunk_walk.h"

namespace {
namespace format = rill::format;
using rill::cooker::AssetDirectory;

constexpr double least_met = 20;  ///< bits that make a counter known

/// Weighted mean of one number of the table.
struct Mean {
    double sum = 0, weight = 0;
    void add(double x, double w) { sum += w * x, weight += w; }
};
struct Sums {
    std::vector<Mean> means;
    size_t at = 0;
    void add(double x, double w) {
        if (at == means.size()) means.emplace_back();
        means[at++].add(x, w);
    }
    void operator()(const format::Counter& c) {
        const double p = c.probability < 16 ? 16 : c.probability > 65520 ? 65520 : c.probability;
        const int before = format::PriorReader::seen;
        add((256 * std::log(p / (65536 - p)) + 2040) / 80, c.seen > before ? c.seen - before : 0);
    }
    void operator()(const format::Mixer& mixer) {
        for (const uint32_t weight : mixer.weight) add((int32_t(weight) + 20480) / 1280.0, least_met);
    }
    void operator()(const format::Statistics::Trust& trust) { add(trust.factor / 5.0, trust.seen); }
};

void learn(const AssetDirectory& directory, uint32_t chunk, const format::WindowRecord& window, Sums& sums) {
    const format::ChunkRecord& record = directory.chunks[chunk];
    const std::vector<uint8_t> bytes = rill::cooker::read_chunk(directory, chunk);
    std::vector<format::Track> tracks(record.point_count + record.drop_count);
    std::vector<float> coefficients(record.coefficient_count);
    format::TrackBlock block{{}, 0, record.point_count, record.drop_count, record.coefficient_count, tracks.data(), coefficients.data()};
    const format::ChunkShape shape{window.sample_count, record.point_count, record.drop_count, record.coefficient_count,
                                   steps_of(directory.header, window)};
    format::RangeDecoder coder(bytes.data(), bytes.data() + bytes.size());
    static format::Statistics learned;
    learned = format::first_statistics;
    if (const char* why = format::walk_chunk(coder, shape, block, learned))
        throw rill::cooker::InputError(directory.path + ": " + why);
    sums.at = 0;
    format::each_part_of(learned, [&](auto& part) { sums(part); });
}

void write(const std::vector<Mean>& means) {
    std::puts("// SPDX-License-Identifier: MIT\n// Made by tests/bench/train_chunks.cpp; how to read it: PriorReader in chunk_statistics.h.\n#pragma once\n"
              "namespace rill::format {\ninline constexpr char chunk_priors[] = R\"(");
    std::string line;
    for (size_t i = 0; i < means.size();) {
        size_t dots = 0;
        while (i + dots < means.size() && means[i + dots].weight < least_met) ++dots;
        if (dots) {
            line += '.';
            if (dots > 1) line += std::to_string(dots);
            i += dots;
        } else {
            const long level = std::min(51l, std::max(0l, std::lround(means[i].sum / means[i].weight)));
            line += char(level < 26 ? 'A' + level : 'a' + level - 26);
            ++i;
        }
        if (line.size() > 100 || i == means.size()) std::puts(line.c_str()), line.clear();
    }
    std::puts(")\";\n}  // namespace rill::format");
}

}  // namespace

int main(int count, char** arguments) try {
    Sums sums;
    for (int a = 1; a < count; ++a) {
        const AssetDirectory directory = rill::cooker::read_directory(arguments[a]);
        for (const format::WindowRecord& window : directory.windows)
            for (uint32_t c = 0; c < window.chunk_count; ++c) learn(directory, window.first_chunk + c, window, sums);
    }
    if (sums.means.empty()) throw rill::cooker::InputError("usage: rill-train-chunks ASSET...");
    write(sums.means);
} catch (const std::exception& error) {
    std::fprintf(stderr, "rill-train-chunks: %s\n", error.what());
    return 2;
}
