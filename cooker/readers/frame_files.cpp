// SPDX-License-Identifier: MIT
#include "readers/frame_files.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <nlohmann/json.hpp>

#include "common/number_place.h"
#include "readers/draco_mesh.h"
#include "readers/file_bytes.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

/// Classic two-pointer wildcard match; `*` any run, `?` any character, `#` a digit.
bool matches(const std::string& text, const std::string& pattern) {
    size_t t = 0, p = 0, star = std::string::npos, star_text = 0;
    auto one = [&](char c, char wanted) {
        return wanted == '?' || (wanted == '#' ? std::isdigit(static_cast<unsigned char>(c)) != 0 : c == wanted);
    };
    while (t < text.size()) {
        if (p < pattern.size() && pattern[p] == '*')
            star = p++, star_text = t;
        else if (p < pattern.size() && one(text[t], pattern[p]))
            ++t, ++p;
        else if (star != std::string::npos)
            p = star + 1, t = ++star_text;
        else
            return false;
    }
    while (p < pattern.size() && pattern[p] == '*') ++p;
    return p == pattern.size();
}

/// `%04d` → `####`, `%d` → `*`: the number itself is read from the name anyway.
std::string plain_pattern(std::string pattern) {
    while (const auto place = find_number_place(pattern))
        pattern.replace(place->begin, place->end - place->begin, place->width > 0 ? std::string(size_t(place->width), '#') : "*");
    return pattern;
}

std::optional<int> whole_number(const std::string& text) {
    int number = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    return error == std::errc() && stop == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

/// The number of a file that the pattern, whose one place for it is given, says to be one of the sequence.
std::optional<int> number_at(const std::string& name, const std::string& pattern, const NumberPlace& place) {
    const std::string before = pattern.substr(0, place.begin), after = pattern.substr(place.end);
    if (name.size() < before.size() + after.size() + size_t(std::max(place.width, 1))) return {};
    if (name.compare(0, before.size(), before) != 0 || name.compare(name.size() - after.size(), after.size(), after) != 0) return {};
    return whole_number(name.substr(before.size(), name.size() - before.size() - after.size()));
}

std::string lower(std::string text) {
    for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

class FrameFiles : public SequenceReader {
public:
    FrameFiles(const FrameFormat& format, std::vector<FrameFile> files, const std::string& input, const ReadOptions& options)
        : format_(format), files_(std::move(files)), options_(options) {
        info_.format = format.name;
        info_.path = input;
        info_.frames_per_second = options.frames_per_second;
        if (info_.frames_per_second == 0) info_.frames_per_second = stated_rate(files_.front().path.parent_path() / "sequence.json");
        if (info_.frames_per_second == 0) info_.frames_per_second = 24;
        for (const FrameFile& file : files_) {
            info_.numbers.push_back(file.number);
            info_.seconds.push_back(file.number / info_.frames_per_second);
            std::error_code error;
            const uintmax_t size = fs::file_size(file.path, error);
            if (!error) info_.raw_bytes += size;
        }
        // Frames without liquid may come without attributes: ask the first that has any. None: nothing lacks them.
        info_.velocity = VelocityMeaning::unknown;
        for (size_t i = 0; i < files_.size(); ++i) {
            const Mesh mesh = read(i);
            if (mesh.positions.empty()) continue;
            if (mesh.velocities.empty()) info_.velocity = VelocityMeaning::none;
            break;
        }
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return files_.at(index).path.string(); }
    std::vector<fs::path> files(size_t index) const override {
        const fs::path& path = files_.at(index).path;
        std::vector<fs::path> all = {path};
        if (format_.beside)
            for (fs::path& more : format_.beside(path)) all.push_back(std::move(more));
        if (const fs::path rate = path.parent_path() / "sequence.json"; fs::exists(rate)) all.push_back(rate);
        return all;
    }
    Mesh read(size_t index) const override {
        Mesh mesh = format_.read(files_.at(index).path, options_);
        if (options_.velocity_per_frame)
            for (glm::vec3& v : mesh.velocities) v *= float(info_.frames_per_second);
        return mesh;
    }

private:
    const FrameFormat& format_;
    std::vector<FrameFile> files_;
    ReadOptions options_;
    SequenceInfo info_;
};

}  // namespace

bool is_pattern(const std::string& name) {
    return name.find_first_of("*?#") != std::string::npos || plain_pattern(name) != name;
}

std::optional<int> frame_number(const fs::path& path) {
    std::string name = path.filename().string();
    name = name.substr(0, name.find_last_of('.'));
    if (fs::path(name).extension() == ".bobj") name = fs::path(name).stem().string();  // .bobj.gz
    auto digit = [&](size_t i) { return std::isdigit(static_cast<unsigned char>(name[i])) != 0; };
    size_t end = name.size();
    while (end > 0 && !digit(end - 1)) --end;
    size_t begin = end;
    while (begin > 0 && digit(begin - 1)) --begin;
    if (begin == end) return {};
    // frame_-008 comes before frame_0000, but of splash-0008 the dash is only a dash.
    if (begin > 0 && name[begin - 1] == '-' && (begin == 1 || std::string("_. ").find(name[begin - 2]) != std::string::npos)) --begin;
    return whole_number(name.substr(begin, end - begin));
}

std::vector<FrameFile> find_frames(const fs::path& directory, const std::string& pattern) {
    const std::string plain = lower(plain_pattern(pattern));
    const auto place = find_number_place(pattern);
    const bool is_told = place && !find_number_place(pattern, place->end) && pattern.find_first_of("*?#") == std::string::npos;
    std::error_code error;
    std::vector<FrameFile> files;
    for (fs::directory_iterator at(directory, error), end; !error && at != end; at.increment(error)) {
        const std::string name = lower(at->path().filename().string());
        const std::optional<int> number = is_told ? number_at(name, lower(pattern), *place) : frame_number(at->path());
        if ((is_told ? !number : !matches(name, plain)) || at->is_directory()) continue;
        if (!number) throw InputError(at->path().string() + ": no frame number in the name");
        files.push_back({*number, at->path()});
    }
    if (error) throw InputError(directory.string() + ": " + error.message());
    std::sort(files.begin(), files.end(), [](const FrameFile& a, const FrameFile& b) {
        return a.number != b.number ? a.number < b.number : a.path < b.path;
    });
    for (size_t i = 1; i < files.size(); ++i)
        if (files[i].number == files[i - 1].number)
            throw InputError(files[i].path.string() + ": frame " + std::to_string(files[i].number) + " is also " +
                             files[i - 1].path.filename().string() + "; name one sequence with a pattern, %d where its number stands");
    return files;
}

double stated_rate(const fs::path& json_file) {
    if (!fs::exists(json_file)) return 0;
    const nlohmann::json json = nlohmann::json::parse(read_file(json_file), nullptr, false);
    if (!json.is_object()) throw InputError(json_file.string() + ": not a JSON object");
    if (!json.contains("fps")) return 0;
    const nlohmann::json& rate = json["fps"];
    if (!rate.is_number() || !(rate.get<double>() > 0 && rate.get<double>() <= 1e6))
        throw InputError(json_file.string() + ": fps is not a positive number");
    return rate.get<double>();
}

namespace {
Mesh read_drc(const fs::path& path, const ReadOptions&) {
    const std::string bytes = read_file(path);
    if (bytes.empty()) throw InputError(path.string() + ": empty file");
    return draco_decode(bytes, path.string());
}
}  // namespace

const std::vector<FrameFormat>& frame_formats() {
    static const std::vector<FrameFormat> formats = {
        {".ply", "PLY sequence", read_ply},
        {".obj", "OBJ sequence", read_obj},
        {".drc", "Draco sequence", read_drc},
        {".glb", "glTF sequence", read_gltf, gltf_buffers},
        {".gltf", "glTF sequence", read_gltf, gltf_buffers},
        {".abc", "Alembic sequence", read_alembic_frame},
#ifdef RILL_OPENVDB
        {".vdb", "OpenVDB sequence", read_vdb},
#endif
    };
    return formats;
}

const FrameFormat* format_of(const fs::path& path) {
    const std::string extension = lower(path.extension().string());
    for (const FrameFormat& format : frame_formats())
        if (format.extension == extension) return &format;
    return nullptr;
}

std::unique_ptr<SequenceReader> open_frame_files(const FrameFormat& format, std::vector<FrameFile> files,
                                                 const std::string& input, const ReadOptions& options) {
    return std::make_unique<FrameFiles>(format, std::move(files), input, options);
}

}  // namespace rill::cooker
