// SPDX-License-Identifier: MIT
#include "asset/byte_account.h"

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <memory>

#include "common/mesh.h"
#include "common/parallel.h"
#include "format/chunk_walk.h"

namespace rill::cooker {
namespace {
using Bits = std::array<double, format::bit_categories>;

/// Decodes, and counts what every bit told.
class CountingDecoder : public format::RangeDecoder {
public:
    using format::RangeDecoder::RangeDecoder;
    uint32_t bit(uint32_t probability, uint32_t) {
        const uint32_t bit = format::RangeDecoder::bit(probability, 0);
        spent[size_t(category_)] -= std::log2((bit ? probability : 65536 - probability) / 65536.0);
        return bit;
    }
    void category(int which) { category_ = which; }
    Bits spent{};

private:
    int category_ = 0;
};

Bits bits_of(const AssetDirectory& directory, uint32_t index, const format::WindowRecord& window) {
    const format::ChunkRecord& record = directory.chunks[index];
    const std::vector<uint8_t> bytes = read_chunk(directory, index);
    std::vector<format::Track> tracks(record.point_count + record.drop_count);
    std::vector<float> coefficients(record.coefficient_count);
    format::TrackBlock block{{}, 0, record.point_count, record.drop_count, record.coefficient_count, tracks.data(), coefficients.data()};
    CountingDecoder coder(bytes.data(), bytes.data() + bytes.size());
    const format::ChunkShape shape{window.sample_count, record.point_count, record.drop_count, record.coefficient_count,
                                   steps_of(directory.header, window)};
    const auto learned = std::make_unique<format::Statistics>(format::first_statistics);
    if (const char* why = format::walk_chunk(coder, shape, block, *learned))
        throw InputError(directory.path + ": damaged: chunk " + std::to_string(index) + ": " + why);
    return coder.spent;
}

/// Whole bytes that add up: each kind ends at the byte nearest to where its bits end.
void share_out(const Bits& bits, uint64_t coded, LayerBytes& layer) {
    double end = 0;
    uint64_t taken = 0;
    const auto take = [&](format::BitCategory kind) {
        end += bits[kind] / 8;
        const uint64_t bytes = std::min(coded, uint64_t(std::llround(end))) - taken;
        taken += bytes;
        return bytes;
    };
    layer.structure = take(format::bits_structure), layer.births = take(format::bits_births);
    layer.first_coefficients = take(format::bits_first), layer.motion = take(format::bits_motion);
    layer.normals = take(format::bits_normals), layer.slip = take(format::bits_slip);
    layer.drops = take(format::bits_drops);
    layer.padding = coded - taken;
}

}  // namespace

uint64_t LayerBytes::sum() const {
    return directory + structure + births + first_coefficients + motion + normals + slip + drops + padding;
}
uint64_t ByteAccount::sum() const {
    uint64_t all = header + frame_times + windows + model + settings + unused;
    for (const LayerBytes& layer : layers) all += layer.sum();
    return all;
}

ByteAccount account_for_bytes(const AssetDirectory& directory) {
    const format::Header& h = directory.header;
    std::vector<const format::WindowRecord*> windows(directory.chunks.size());
    for (const format::WindowRecord& window : directory.windows)
        std::fill_n(windows.begin() + window.first_chunk, window.chunk_count, &window);
    std::vector<Bits> chunk_bits(windows.size());
    parallel_for(windows.size(), 0, [&](size_t c) { chunk_bits[c] = bits_of(directory, uint32_t(c), *windows[c]); });

    ByteAccount account;
    account.header = format::header_bytes, account.frame_times = uint64_t(h.frame_time_count) * sizeof(double);
    account.windows = uint64_t(h.window_count) * format::window_record_bytes, account.model = h.model_bytes;
    account.settings = h.settings_bytes;
    account.layers.resize(h.layer_count);
    std::vector<Bits> bits(h.layer_count, Bits{});
    std::vector<uint64_t> coded(h.layer_count, 0);
    uint64_t end = format::header_bytes + h.directory_bytes;
    for (size_t c = 0; c < windows.size(); ++c) {
        const format::ChunkRecord& record = directory.chunks[c];
        account.unused += record.offset - end, end = record.offset + record.bytes;
        LayerBytes& layer = account.layers[record.layer];
        layer.directory += format::chunk_record_bytes;
        coded[record.layer] += record.bytes;
        for (size_t kind = 0; kind < chunk_bits[c].size(); ++kind) bits[record.layer][kind] += chunk_bits[c][kind];
    }
    account.unused += h.file_bytes - end;
    for (uint32_t l = 0; l < h.layer_count; ++l) share_out(bits[l], coded[l], account.layers[l]);
    return account;
}

nlohmann::json to_json(const ByteAccount& account) {
    nlohmann::json layers = nlohmann::json::array();
    for (const LayerBytes& l : account.layers)
        layers.push_back({{"directory", l.directory}, {"structure", l.structure}, {"births", l.births},
                          {"first_coefficients", l.first_coefficients}, {"motion", l.motion}, {"normals", l.normals},
                          {"slip", l.slip}, {"drops", l.drops}, {"padding", l.padding}});
    return {{"header", account.header}, {"frame_times", account.frame_times}, {"windows", account.windows}, {"model", account.model},
            {"settings", account.settings}, {"unused", account.unused}, {"layers", layers}};
}

}  // namespace rill::cooker
