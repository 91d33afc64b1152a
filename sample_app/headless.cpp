// SPDX-License-Identifier: MIT
// Pictures without a window: every frame waits for its data, so the same command draws the same pictures.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <thread>

#include "engine.h"
#include "options.h"
#include "statistics.h"

namespace player {

namespace {

constexpr int most_tiles = 24;
constexpr int tile_width = 320;

/// What one picture shows.
struct Moment {
    int frame;       ///< the source's number; of moments between frames that of the one before
    double seconds;  ///< in the clip
};

struct Headless {
    const Options& options;
    Clip clip;
    std::vector<Moment> moments;
    Bounds bounds;
    Camera camera;
    std::unique_ptr<OffscreenContext, EndOffscreen> context;
    std::unique_ptr<Renderer> renderer;  // after the context: goes before it
    std::vector<FrameRecord> records;
    uint64_t allocations_at_create = 0;

    explicit Headless(const Options& o)
        : options(o), clip(o.jobs ? o.jobs : std::max(1u, std::thread::hardware_concurrency())) {}

    int open();
    int choose_frames();
    void divide_steps();
    int number_of(size_t picture) const { return options.substeps > 1 ? static_cast<int>(picture) : moments[picture].frame; }
    int measure_source();
    int start_renderer();
    int decode(const Moment& moment);
    int draw_source(int frame, Picture& out);
    int draw(const Moment& moment, Picture& out);
    int run();
};

int Headless::open() {
    if (options.asset.empty()) return exit_ok;
    std::string cause;
    if (!clip.open(options.asset, cause)) return complain(exit_bad_asset, options.asset, cause);
    allocations_at_create = clip.heap().allocations();
    const rill::AssetInfo& info = clip.info();
    bounds = {{info.lower[0], info.lower[1], info.lower[2]}, {info.upper[0], info.upper[1], info.upper[2]}};
    return exit_ok;
}

int Headless::choose_frames() {
    FrameRange range = options.frames;
    if (options.asset.empty()) {
        for (int64_t frame = range.first; frame <= range.last; frame += range.step) moments.push_back({static_cast<int>(frame), 0.0});
        return exit_ok;
    }
    const std::vector<int>& numbers = clip.frame_numbers();
    if (!range.given) range = {true, numbers.front(), numbers.back(), 1};
    for (uint32_t i = 0; i < numbers.size(); ++i)
        if (numbers[i] >= range.first && numbers[i] <= range.last && (int64_t(numbers[i]) - range.first) % range.step == 0)
            moments.push_back({numbers[i], clip.frame_seconds(i)});
    if (range.first < numbers.front() || range.last > numbers.back() || moments.empty()) {
        const int step = clip.info().frame_step;
        const bool all = numbers.back() - numbers.front() == step * (static_cast<int>(numbers.size()) - 1);
        return complain(exit_usage, "--frames",
                        "the asset has frames " + std::to_string(numbers.front()) + ":" + std::to_string(numbers.back()) +
                            (step > 1 ? ":" + std::to_string(step) : "") + (all ? "" : ", of which some are missing"));
    }
    divide_steps();
    // A sheet alone needs no more pictures than it shows.
    const size_t all = moments.size();
    if (options.out.empty() && options.stats.empty() && !options.contact_sheet.empty() && all > most_tiles) {
        for (size_t i = 0; i < most_tiles; ++i) moments[i] = moments[i * (all - 1) / (most_tiles - 1)];
        moments.resize(most_tiles);
    }
    return exit_ok;
}

/// Slow motion: `substeps` moments from each one to the next, evenly spaced.
void Headless::divide_steps() {
    std::vector<Moment> divided;
    for (size_t i = 0; i + 1 < moments.size(); ++i)
        for (int step = 0; step < options.substeps; ++step) {
            const double share = static_cast<double>(step) / options.substeps;
            divided.push_back({moments[i].frame, moments[i].seconds + share * (moments[i + 1].seconds - moments[i].seconds)});
        }
    divided.push_back(moments.back());
    moments = std::move(divided);
}

/// Without an asset nobody knows the bounds: all frames are read once, so that the camera stands still.
int Headless::measure_source() {
    if (!options.asset.empty()) return exit_ok;
    bool first = true;
    for (const Moment& moment : moments) {
        Mesh mesh;
        std::string cause;
        const std::string path = fill_pattern(options.source, moment.frame);
        if (!read_ply(path, mesh, cause)) return complain(exit_bad_asset, path, cause);
        if (mesh.vertices.empty()) continue;
        bounds.lower = first ? mesh.bounds.lower : glm::min(bounds.lower, mesh.bounds.lower);
        bounds.upper = first ? mesh.bounds.upper : glm::max(bounds.upper, mesh.bounds.upper);
        first = false;
    }
    return exit_ok;
}

int Headless::start_renderer() {
    std::string cause;
    context = make_offscreen_context(options.api, cause);
    if (context) renderer = Renderer::create(cause);
    if (!renderer) return complain(exit_usage, "cannot draw", cause);
    if (!options.environment.empty()) {
        const Panorama panorama = read_panorama(options.environment);
        if (panorama.rgb.empty()) return complain(exit_usage, options.environment, "not a readable picture");
        renderer->set_panorama(panorama);
    }
    renderer->set_scene(bounds);
    if (!options.asset.empty())
        renderer->reserve(clip.limits().vertices, clip.limits().indices, clip.limits().points);
    camera = make_camera(options, bounds);
    return exit_ok;
}

int Headless::decode(const Moment& moment) {
    const auto views = camera.with_casters(options.width, options.height, bounds, renderer->to_sun());
    rill::Frame frame{};
    frame.seconds = moment.seconds;
    frame.rate = 1.0f;
    for (int i = 0; i < 3; ++i) frame.asset_to_world[5 * i] = 1.0f;
    frame.views = views.data();
    frame.view_count = uint32_t(views.size());
    frame.budget = make_budget(options.detail, clip.info());
    frame.wait_for_data = true;
    FrameRecord record{moment.frame, moment.seconds, 0.0, 0, 0, rill::Status::ok, {}};
    do {
        rill::Target* target = renderer->map(options.look);
        frame.target = target;
        const double begun = now_seconds();
        record.status = clip.begin_frame(frame);
        if (record.status >= rill::Status::ok) record.status = clip.end_frame(&record.stats);
        record.frame_ms = 1000.0 * (now_seconds() - begun);
        record.vertices = target->vertices_used;
        record.triangles = target->indices_used / 3;
        renderer->unmap();
    } while (record.status == rill::Status::clipped && renderer->grow(record.stats));
    const std::string where = options.asset + ": frame " + std::to_string(moment.frame);
    if (record.status < rill::Status::ok) return complain(exit_bad_asset, where, rill::text(record.status));
    if (record.stats.chunks_rejected > 0)
        return complain(exit_bad_asset, where, std::to_string(record.stats.chunks_rejected) + " damaged chunks");
    if (record.stats.reads_failed > 0) return complain(exit_bad_asset, where, "cannot be read to its end");
    if (record.stats.cut) std::fprintf(stderr, "rill-player: frame %d: cut %s\n", moment.frame, cut_names(record.stats.cut).c_str());
    records.push_back(record);
    return exit_ok;
}

int Headless::draw_source(int frame, Picture& out) {
    Mesh mesh;
    std::string cause;
    const std::string path = fill_pattern(options.source, frame);
    if (!read_ply(path, mesh, cause)) return complain(exit_bad_asset, path, cause);
    renderer->upload(mesh);
    renderer->draw(camera, options.look, options.width, options.height);
    out = renderer->read_picture();
    return exit_ok;
}

int Headless::draw(const Moment& moment, Picture& out) {
    // With a source and no wish to see both, the asset lends its bounds to the camera.
    const bool decoded = options.source.empty() || options.side_by_side;
    if (decoded) {
        if (const int code = decode(moment)) return code;
        renderer->draw(camera, options.look, options.width, options.height);
        out = renderer->read_picture();
        if (!options.side_by_side) return exit_ok;
    }
    Picture source;
    if (const int code = draw_source(moment.frame, source)) return code;
    if (!decoded) {
        out = std::move(source);
        return exit_ok;
    }
    Picture both(2 * options.width, options.height);
    paste(both, out, 0, 0);
    paste(both, source, options.width, 0);
    out = std::move(both);
    return exit_ok;
}

/// Places for at most most_tiles pictures of `frames` frames, about as many rows as columns.
struct Sheet {
    int tiles, columns, width, height;
    Picture picture;
    Sheet(int frames, int picture_width, int picture_height) {
        tiles = std::min(frames, most_tiles);
        width = std::min(picture_width, tile_width * (picture_width > 3 * picture_height ? 2 : 1));
        height = std::max(1, width * picture_height / picture_width);
        columns = std::max(1, static_cast<int>(std::lround(std::sqrt(tiles * 1.0 * height / width * 16 / 9))));
        picture = Picture(columns * width, (tiles + columns - 1) / columns * height);
    }
    void add(int index, int frames, const Picture& from) {
        for (int tile = 0; tile < tiles; ++tile) {
            if ((tiles > 1 ? tile * (frames - 1) / (tiles - 1) : 0) != index) continue;
            paste(picture, shrink(from, width, height), tile % columns * width, tile / columns * height);
        }
    }
};

int Headless::run() {
    for (int (Headless::*step)() : {&Headless::open, &Headless::choose_frames, &Headless::measure_source,
                                    &Headless::start_renderer})
        if (const int code = (this->*step)()) return code;
    std::printf("rill-player: %s\n", renderer->description().c_str());
    const int count = static_cast<int>(moments.size());
    Sheet sheet(count, options.width * (options.side_by_side ? 2 : 1), options.height);
    for (int i = 0; i < count; ++i) {
        Picture picture;
        if (const int code = draw(moments[i], picture)) return code;
        const std::string path = fill_pattern(options.out, number_of(size_t(i)));
        if (!path.empty() && !write_png(path, picture)) return complain(exit_usage, path, std::strerror(errno));
        if (!options.contact_sheet.empty()) sheet.add(i, count, picture);
    }
    if (!options.contact_sheet.empty() && !write_png(options.contact_sheet, sheet.picture))
        return complain(exit_usage, options.contact_sheet, std::strerror(errno));
    const uint64_t late = clip.heap().allocations() - allocations_at_create;
    if (!options.stats.empty() && !write_statistics(options.stats, options.asset, clip, late, records))
        return complain(exit_usage, options.stats, std::strerror(errno));
    double ms = 0.0;
    for (const FrameRecord& record : records) ms += record.frame_ms;
    if (!records.empty())
        std::printf("rill-player: %zu frames decoded, %.2f ms a frame, %.1f MB of memory, %llu late allocations\n",
                    records.size(), ms / records.size(), clip.heap().bytes_peak() / 1e6,
                    static_cast<unsigned long long>(late));
    return exit_ok;
}

}  // namespace

int run_headless(const Options& options) { return Headless(options).run(); }

}  // namespace player
