// SPDX-License-Identifier: MIT
// The cache of the FLIP Fluids add-on: bakefiles/######.bobj (the surface, Blender units), velocity######.bobj
// (simulated metres per second: what BROUGHT the liquid to the frame), metadata######.json (scales) and
// export/flipdata.sim (the rate). A surface is taken after the FIRST substep of its frame, whose length
// only logs/*.txt or flipstats.data tell: so frames are unevenly spaced wherever the substep count changes.
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "readers/file_bytes.h"
#include "readers/frame_files.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {
using nlohmann::json;

json read_json(const fs::path& path) {
    json value = json::parse(read_file(path), nullptr, false);
    if (!value.is_object()) throw InputError(path.string() + ": not a JSON object");
    return value;
}

/// A positive number at `pointer`; `otherwise` when nothing is there. An animated value counts by its first.
double positive(const json& object, const char* pointer, const fs::path& path, double otherwise) {
    const json::json_pointer place(pointer);
    if (!object.contains(place)) return otherwise;
    json value = object.at(place);
    if (value.is_array() && !value.empty()) value = json(value.front());
    if (!value.is_number() || !(value.get<double>() > 0 && value.get<double>() <= 1e6))
        throw InputError(path.string() + ": " + pointer + " is not a positive number");
    return value.get<double>();
}

struct Bobj {
    std::vector<glm::vec3> vertices;
    std::vector<Triangle> triangles;
};
Bobj read_bobj(const fs::path& path) {
    const std::string bytes = read_file(path);
    Bobj bobj;
    if (bytes.empty()) return bobj;  // how the add-on leaves a frame without liquid
    ByteCursor cursor(bytes, path.string());
    bobj.vertices = cursor.triples<glm::vec3>(cursor.count("vertices", 12), "vertices");
    bobj.triangles = cursor.triples<Triangle>(cursor.count("triangles", 12), "triangles");
    if (cursor.left() != 0) cursor.fail(std::to_string(cursor.left()) + " bytes too many");
    return bobj;
}

/// Which part of its frame had passed when the surface was taken, by frame number, from the solver's log:
/// "Timeline Frame: 7 / 90", "Substep: 1", "Substep Time: 0.0166667s (50% of frame)". Later runs win.
void parts_from_log(const std::string& log, std::map<int, double>& parts) {
    int frame = 0, substep = 0;
    for (size_t at = 0; at < log.size();) {
        const size_t end = std::min(log.find('\n', at), log.size());
        const std::string line = log.substr(at, std::min<size_t>(end - at, 200));
        at = end + 1;
        double length = 0, percent = 0;
        if (std::sscanf(line.c_str(), " Timeline Frame: %d", &frame) == 1) substep = 0;
        else if (std::sscanf(line.c_str(), " Substep: %d", &substep) == 1) continue;
        else if (substep == 1 && std::sscanf(line.c_str(), " Substep Time: %lfs (%lf%%", &length, &percent) == 2 &&
                 percent > 0 && percent <= 100.01)
            parts[frame] = std::min(percent / 100, 1.0);
    }
}

std::vector<fs::path> logs_of(const fs::path& cache) {
    std::vector<fs::path> logs;
    if (fs::is_directory(cache / "logs"))
        for (const auto& entry : fs::directory_iterator(cache / "logs"))
            if (entry.path().extension() == ".txt") logs.push_back(entry.path());
    std::sort(logs.begin(), logs.end());
    return logs;
}

std::map<int, double> first_substeps(const fs::path& cache) {
    std::map<int, double> parts;
    if (const fs::path stats = cache / "flipstats.data"; fs::exists(stats)) {
        // Not the lengths, only how many: equal ones are the best guess.
        const json frames = read_json(stats);
        for (const auto& [key, frame] : frames.items())
            if (frame.is_object() && frame.contains("substeps"))
                parts[std::atoi(key.c_str())] = 1 / std::max(1.0, positive(frame, "/substeps", stats, 1));
    }
    for (const fs::path& log : logs_of(cache)) parts_from_log(read_file(log), parts);
    return parts;
}

class FlipFluids : public SequenceReader {
public:
    FlipFluids(fs::path cache, std::vector<FrameFile> meshes, const ReadOptions& options)
        : cache_(std::move(cache)), meshes_(std::move(meshes)) {
        if (options.velocity_per_frame || !options.velocity_name.empty())
            throw UsageError("--velocity and --velocity-unit do not apply: a FLIP Fluids cache states its velocity");
        info_.format = "FLIP Fluids cache";
        info_.path = cache_.string();
        leave_out_unfinished(options);
        find_velocities();
        find_rate(options);
        const std::map<int, double> parts = first_substeps(cache_);
        for (const FrameFile& mesh : meshes_) {
            const auto part = parts.find(mesh.number);
            info_.numbers.push_back(mesh.number);
            info_.seconds.push_back((mesh.number - 1 + (part == parts.end() ? 1 : part->second)) / info_.frames_per_second);
            std::error_code error;
            for (const fs::path& path : {mesh.path, numbered("velocity", mesh.number, ".bobj")})
                if (const uintmax_t size = fs::file_size(path, error); !error) info_.raw_bytes += size;
        }
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return meshes_.at(index).path.string(); }
    std::vector<fs::path> files(size_t index) const override {
        const int number = meshes_.at(index).number;
        std::vector<fs::path> all = {meshes_.at(index).path};
        for (const fs::path& path : {numbered("velocity", number, ".bobj"), numbered("metadata", number, ".json"),
                                     cache_ / "export" / "flipdata.sim", cache_ / "flipstats.data"})
            if (fs::exists(path)) all.push_back(path);
        for (const fs::path& log : logs_of(cache_)) all.push_back(log);
        return all;
    }
    Mesh read(size_t index) const override {
        const FrameFile& file = meshes_.at(index);
        Bobj bobj = read_bobj(file.path);
        double time_scale = time_scale_, world_scale = world_scale_;
        if (const fs::path metadata = numbered("metadata", file.number, ".json"); fs::exists(metadata)) {
            const json values = read_json(metadata);
            time_scale = positive(values, "/time_scale", metadata, time_scale);
            world_scale = positive(values, "/world_scale", metadata, world_scale);
        }
        Mesh mesh;
        mesh.positions = std::move(bobj.vertices);
        mesh.triangles = std::move(bobj.triangles);
        for (glm::vec3& x : mesh.positions) x *= float(world_scale);
        if (info_.velocity != VelocityMeaning::none && !mesh.positions.empty()) {
            const fs::path path = numbered("velocity", file.number, ".bobj");
            mesh.velocities = read_bobj(path).vertices;
            if (mesh.velocities.size() != mesh.positions.size())
                throw InputError(path.string() + ": velocities for " + std::to_string(mesh.velocities.size()) +
                                 " vertices, the mesh has " + std::to_string(mesh.positions.size()));
            for (glm::vec3& v : mesh.velocities) v *= float(time_scale * faster_);
        }
        return mesh;
    }

private:
    fs::path numbered(const char* prefix, int number, const char* ending) const {
        std::string digits = std::to_string(number);
        digits.insert(0, digits.size() < 6 ? 6 - digits.size() : 0, '0');
        return cache_ / "bakefiles" / (prefix + digits + ending);
    }
    /// finished######.txt is written last: a frame without it is still being baked, or was interrupted.
    void leave_out_unfinished(const ReadOptions& options) {
        const auto finished = [&](const FrameFile& mesh) { return fs::exists(numbered("finished", mesh.number, ".txt")); };
        if (std::none_of(meshes_.begin(), meshes_.end(), finished)) return;  // somebody tidied up
        while (!finished(meshes_.back())) {
            if (options.warn) options.warn(meshes_.back().path.string() + ": left out, the add-on has not finished this frame");
            meshes_.pop_back();
        }
    }
    /// All frames with liquid or none: one that is missing is a broken cache, not a source without velocity.
    void find_velocities() {
        bool any = false;
        const FrameFile* missing = nullptr;
        for (const FrameFile& mesh : meshes_) {
            if (fs::exists(numbered("velocity", mesh.number, ".bobj"))) any = true;
            else if (!missing && fs::file_size(mesh.path) > 8) missing = &mesh;
        }
        if (missing && any)
            throw InputError(numbered("velocity", missing->number, ".bobj").string() + ": missing, though other frames have velocities");
        info_.velocity = missing ? VelocityMeaning::none : VelocityMeaning::backward;
    }
    void find_rate(const ReadOptions& options) {
        const fs::path settings = cache_ / "export" / "flipdata.sim";
        double stated = 24;
        if (fs::exists(settings)) {
            const json values = read_json(settings);
            stated = positive(values, "/domain_data/simulation/frames_per_second/data", settings, stated);
            time_scale_ = positive(values, "/domain_data/simulation/time_scale/data", settings, 1);
            world_scale_ = positive(values, "/domain_data/initialize/scale", settings, 1);
        } else if (options.frames_per_second == 0 && options.warn) {
            options.warn(settings.string() + ": not there; taking 24 frames per second (give --fps)");
        }
        if (!fs::exists(settings) && options.frames_per_second > 0) stated = options.frames_per_second;
        info_.frames_per_second = options.frames_per_second > 0 ? options.frames_per_second : stated;
        faster_ = info_.frames_per_second / stated;
    }
    fs::path cache_;
    std::vector<FrameFile> meshes_;
    SequenceInfo info_;
    double time_scale_ = 1, world_scale_ = 1;  // where a frame's metadata is silent
    double faster_ = 1;                        // played at --fps instead of the rate it was simulated for
};

}  // namespace

std::unique_ptr<SequenceReader> open_flip_fluids(const fs::path& directory, const ReadOptions& options) {
    fs::path cache = directory;
    // Users point at <cache>/bakefiles as often as at <cache>.
    fs::path whole = fs::absolute(directory).lexically_normal();
    if (!whole.has_filename()) whole = whole.parent_path();  // ended in a slash
    if (whole.filename() == "bakefiles") cache = whole.parent_path();
    if (!fs::is_directory(cache / "bakefiles")) return nullptr;
    std::vector<FrameFile> meshes = find_frames(cache / "bakefiles", "######.bobj");
    if (meshes.empty()) throw InputError((cache / "bakefiles").string() + ": no ######.bobj: nothing is baked");
    return std::make_unique<FlipFluids>(cache, std::move(meshes), options);
}

}  // namespace rill::cooker
