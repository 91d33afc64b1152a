// SPDX-License-Identifier: MIT
// Parts → asset. A part is an asset of its own (it plays, and every check of an asset is a check of a part) that holds some
// of a cook's spans; its settings tell which, and what was measured. Linking copies chunks and adds up sums in the order
// of the spans, so it does not matter which machine cooked which span, nor how they were gathered.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "asset/chunks_to_asset.h"
#include "cook/verdict.h"
#include "verify/verify.h"

namespace rill::cooker {

/// What is known of a span that has been cooked.
struct SpanResult {
    uint32_t span = 0;
    std::vector<int> numbers;         ///< of its frames; the last is also the next span's first
    std::vector<double> seconds;      ///< on the source's clock
    ChunkBits bits;
    std::vector<double> layer_bytes;
    uint64_t tracks = 0, point_frames = 0;
    std::vector<uint64_t> lives;      ///< [n]: tracks that were seen at n frames, over all their windows
    std::vector<uint64_t> deaths;     ///< tracks by what ended them, as death_names
    double tolerance = 0;             ///< metres: what the closed loop settled on
    int attempts = 0;
    ErrorTotals measured;
};
struct Part {
    AssetDirectory directory;
    nlohmann::json cook;              ///< equal for all parts of a cook; cook["key"] names it
    std::vector<SpanResult> spans;    ///< ascending, without gaps
};
/// Throws InputError when the file is no part, or damaged anywhere.
Part read_part(const std::string& path);

/// What an asset or a part says of itself beside the chunks. `cook` as in Part; `span_count`: of the whole cook.
struct CookFacts {
    nlohmann::json cook;
    double frames_per_second = 24;
    uint32_t layers = 1;
    float edge = 1;
    glm::vec3 lower{0}, upper{0};
    uint32_t walls = 0;               ///< as format::Header
};
/// Header facts for these frames; even times are stored as a rate.
AssetFacts asset_facts(const CookFacts& facts, const std::vector<int>& numbers, const std::vector<double>& seconds);
/// What a span that is alone in `part` adds to the asset, with its share of header and settings.
double bytes_in_asset(const CookFacts& facts, const AssetDirectory& part, const SpanResult& span);
/// Settings text of a part.
std::string part_settings(const CookFacts& facts, const std::vector<SpanResult>& spans, const std::vector<int>& numbers);

struct Linked : Verdict {
    nlohmann::json report;            ///< stable, see REPORTS.md; stored in the asset
};
/// Measured against target, out of the JSON that an asset stores, and the size of its file.
Linked judge(const nlohmann::json& stored, uint64_t file_bytes);
inline constexpr double met_within = 0.1;  // of the target

/// Throws InputError where there is something that is neither an asset nor empty: a source given as output must not be lost.
void check_output(const std::string& path);
/// All spans of the cook, from parts in any order, into the finished asset. Empty files are segments without spans.
/// Throws InputError naming the part and what does not fit, or the frames that are missing.
Linked link_asset(const std::vector<std::string>& parts, const std::string& output);
/// Neighbouring spans into one part.
void link_part(const std::vector<std::string>& parts, const std::string& output);

}  // namespace rill::cooker
