// SPDX-License-Identifier: MIT
// Mantaflow's liquid mesh cache as Blender writes it: config/config_####.uni (where the domain is, and when),
// mesh/fluid_mesh_####.bobj.gz and mesh/lVelMesh_####.uni, all of them gzip streams whatever their names say.
// Positions are relative to the domain's centre in units of its longest side, velocities in base grid cells
// per solver time unit; both leave here in metres and seconds of world space.
#include <algorithm>
#include <cmath>

#include "readers/file_bytes.h"
#include "readers/frame_files.h"

namespace rill::cooker {
namespace fs = std::filesystem;
namespace {

struct Config {
    float longest_side = 0;      // S: of the domain in the world, metres
    int resolution = 0;          // base cells along it
    float solver_time = 0;       // solver time units since the start
    glm::vec3 axes[3];           // rows of the object's matrix: world = x·axes[0] + y·axes[1] + z·axes[2] + origin
    glm::vec3 origin{};
};

Config read_config(const fs::path& path) {
    const std::string bytes = read_gzip(path);
    ByteCursor cursor(bytes, path.string());
    struct Layout {
        int32_t active_fields, resolution[3];
        float dx, dt, lower[3], upper[3], lower_again[3];
        int32_t shift[3];
        float object_shift[3], matrix[16];
        int32_t base_resolution[3], lower_cell[3], upper_cell[3];
        float colour[3], time_total;
        char version[4];
    };
    static_assert(sizeof(Layout) == 204);
    const Layout layout = cursor.take<Layout>("domain description");
    if (std::string(layout.version, 3) != "C01") cursor.fail("not a domain description of version C01");
    Config config;
    for (int a = 0; a < 3; ++a) {
        config.axes[a] = {layout.matrix[4 * a], layout.matrix[4 * a + 1], layout.matrix[4 * a + 2]};
        const float side = (layout.upper[a] - layout.lower[a]) * glm::length(config.axes[a]);
        config.longest_side = std::max(config.longest_side, side);
        config.resolution = std::max(config.resolution, layout.resolution[a]);
        config.origin[a] = layout.matrix[12 + a];
        if (!(side > 0) || !std::isfinite(side) || !std::isfinite(config.origin[a]) || layout.resolution[a] <= 0)
            cursor.fail("describes a domain without extent");
    }
    config.solver_time = layout.time_total;
    return config;
}

class Mantaflow : public SequenceReader {
public:
    Mantaflow(fs::path cache, std::vector<FrameFile> meshes, const ReadOptions& options)
        : cache_(std::move(cache)), meshes_(std::move(meshes)) {
        if (options.velocity_per_frame || !options.velocity_name.empty())
            throw UsageError("--velocity and --velocity-unit do not apply: a Mantaflow cache states its velocity");
        info_.format = "Mantaflow cache";
        info_.path = cache_.string();
        find_velocities();
        find_rate(options);
        for (const FrameFile& mesh : meshes_) {
            info_.numbers.push_back(mesh.number);
            info_.seconds.push_back(mesh.number / info_.frames_per_second);
            std::error_code error;
            for (const fs::path& path : {mesh.path, velocity_path(mesh.number)})
                if (const uintmax_t size = fs::file_size(path, error); !error) info_.raw_bytes += size;
        }
    }
    const SequenceInfo& info() const override { return info_; }
    std::string name(size_t index) const override { return meshes_.at(index).path.string(); }
    std::vector<fs::path> files(size_t index) const override {
        const int number = meshes_.at(index).number;
        std::vector<fs::path> all = {meshes_.at(index).path, config_path(number)};
        for (const fs::path& path : {velocity_path(number), cache_ / "bake.json"})
            if (fs::exists(path)) all.push_back(path);
        return all;
    }
    Mesh read(size_t index) const override {
        const FrameFile& file = meshes_.at(index);
        const std::string bytes = read_gzip(file.path);
        ByteCursor cursor(bytes, file.path.string());
        Mesh mesh;
        mesh.positions = cursor.triples<glm::vec3>(cursor.count("vertices", 12), "vertices");
        if (cursor.count("normals", 12) != mesh.positions.size()) cursor.fail("not as many normals as vertices");
        cursor.skip(mesh.positions.size() * 12);  // normals: computed from the triangles for every format alike
        mesh.triangles = cursor.triples<Triangle>(cursor.count("triangles", 12), "triangles");
        if (cursor.left() != 0) cursor.fail(std::to_string(cursor.left()) + " bytes too many");

        const Config config = read_config(config_path(file.number));
        glm::vec3 directions[3], scaled[3];
        for (int a = 0; a < 3; ++a) {
            directions[a] = glm::normalize(config.axes[a]);
            scaled[a] = directions[a] * config.longest_side;  // raw·S/|axis| along the axis: its length cancels
        }
        for (glm::vec3& x : mesh.positions) x = scaled[0] * x.x + scaled[1] * x.y + scaled[2] * x.z + config.origin;
        if (info_.velocity != VelocityMeaning::none && !mesh.positions.empty()) {
            mesh.velocities = read_velocity(velocity_path(file.number), mesh.positions.size());
            const float factor = float(config.longest_side / config.resolution * solver_time_per_second_);
            for (glm::vec3& v : mesh.velocities)
                v = (directions[0] * v.x + directions[1] * v.y + directions[2] * v.z) * factor;
        }
        return mesh;
    }

private:
    fs::path numbered(const char* folder, const char* prefix, int number) const {
        std::string digits = std::to_string(number);
        digits.insert(0, digits.size() < 4 ? 4 - digits.size() : 0, '0');
        return cache_ / folder / (prefix + digits + ".uni");
    }
    fs::path config_path(int number) const { return numbered("config", "config_", number); }
    fs::path velocity_path(int number) const { return numbered("mesh", "lVelMesh_", number); }

    static std::vector<glm::vec3> read_velocity(const fs::path& path, size_t vertices) {
        const std::string bytes = read_gzip(path);
        ByteCursor cursor(bytes, path.string());
        if (bytes.compare(0, 4, "MD01") != 0) cursor.fail("not velocities of format MD01");
        cursor.skip(4);
        const int32_t count = cursor.take<int32_t>("header");
        cursor.skip(16);  // dimensions: uninitialised memory, and the element type
        const int32_t each = cursor.take<int32_t>("header");
        cursor.skip(292 - 28);
        if (count < 0 || size_t(count) != vertices)
            cursor.fail("velocities for " + std::to_string(count) + " vertices, the mesh has " + std::to_string(vertices));
        if (each != 12) cursor.fail(std::to_string(each) + " bytes per velocity instead of 12");
        std::vector<glm::vec3> values = cursor.triples<glm::vec3>(vertices, "velocities");
        if (cursor.left() != 0) cursor.fail(std::to_string(cursor.left()) + " bytes too many");
        return values;
    }
    /// All frames with liquid or none: one that is missing is a broken cache, not a source without velocity.
    void find_velocities() {
        bool any = false;
        const FrameFile* missing = nullptr;
        for (const FrameFile& mesh : meshes_) {
            if (fs::exists(velocity_path(mesh.number))) any = true;
            else if (!missing && !read_positions_empty(mesh)) missing = &mesh;
        }
        if (missing && any) throw InputError(velocity_path(missing->number).string() + ": missing, though other frames have velocities");
        info_.velocity = missing ? VelocityMeaning::none : VelocityMeaning::forward;
    }
    static bool read_positions_empty(const FrameFile& file) {
        const std::string bytes = read_gzip(file.path);
        return ByteCursor(bytes, file.path.string()).take<int32_t>("vertices") == 0;
    }
    /// The cache holds solver time per frame, but not the frame rate.
    void find_rate(const ReadOptions& options) {
        const FrameFile &first = meshes_.front(), &last = meshes_.back();
        const double begin = first.number == last.number ? 0 : read_config(config_path(first.number)).solver_time;
        const double span = first.number == last.number ? std::max(first.number, 1) : last.number - first.number;
        const double solver_time_per_frame = (read_config(config_path(last.number)).solver_time - begin) / span;
        if (!(solver_time_per_frame > 0) || !std::isfinite(solver_time_per_frame))
            throw InputError(config_path(last.number).string() + ": solver time does not advance");
        double& rate = info_.frames_per_second;
        rate = options.frames_per_second > 0 ? options.frames_per_second : stated_rate(cache_ / "bake.json");
        if (rate == 0) {
            rate = 24;
            // One frame is 2.5 / rate solver time units at time scale 1, as Blender sets Mantaflow up.
            const double likely = 2.5 / solver_time_per_frame;
            if (std::abs(likely - rate) > 0.01 * rate && options.warn)
                options.warn(info_.path + ": states no frame rate; taking 24, though its times suggest " +
                             std::to_string(int(std::lround(likely))) + " (give --fps)");
        }
        solver_time_per_second_ = rate * solver_time_per_frame;
    }
    fs::path cache_;
    std::vector<FrameFile> meshes_;
    SequenceInfo info_;
    double solver_time_per_second_ = 2.5;
};

}  // namespace

std::unique_ptr<SequenceReader> open_mantaflow(const fs::path& directory, const ReadOptions& options) {
    fs::path cache = directory;
    // Users point at <cache>/mesh as often as at <cache>.
    if (!fs::is_directory(cache / "mesh") && fs::is_directory(cache.parent_path() / "config")) cache = cache.parent_path();
    if (!fs::is_directory(cache / "mesh") || !fs::is_directory(cache / "config")) return nullptr;
    std::vector<FrameFile> meshes = find_frames(cache / "mesh", "fluid_mesh_*.bobj.gz");
    if (meshes.empty())
        throw InputError((cache / "mesh").string() + ": no fluid_mesh_####.bobj.gz (bake the mesh with format 'bobj', cache data format 'uni')");
    return std::make_unique<Mantaflow>(cache, std::move(meshes), options);
}

}  // namespace rill::cooker
