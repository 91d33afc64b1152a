// SPDX-License-Identifier: MIT
// rill/rill.h - the whole public face of the runtime. C++17; needs <cstddef> and <cstdint> only.
//
// Nothing here throws, and no callback may. Memory you pass in stays yours. One thread at a time
// drives a Player; many Players may share an Asset; complete_read() alone may be called from any
// thread. Lengths are metres, times are seconds, angles radians, unless a name says otherwise.
// "Asset space" is the space of the source sequence; Frame::asset_to_world takes it to yours.
#pragma once
#include <cstddef>
#include <cstdint>

namespace rill {

/// Travels inside Host; a library built from another header refuses it with api_mismatch.
inline constexpr uint32_t api_version = 1;

/// Below 0: failed. 0: done. Above 0: usable, not finished.
enum class Status : int32_t {
    ok = 0,
    pending = 1,          ///< not there yet: call again after reads have completed
    clipped = 2,          ///< whole and drawable, but something was held back: see Stats::cut
    bad_argument = -1,    ///< a programmer's mistake: null where a pointer is needed, NaN time …
    api_mismatch = -2,    ///< Host::api is not the api_version this library was built with
    not_an_asset = -3,    ///< the file does not begin as a .rill file does
    unknown_format = -4,  ///< a .rill file of a format version this library does not read
    corrupt = -5,         ///< header, directory or chunk contradicts itself or its checksum
    read_failed = -6,     ///< the caller's IO said so
    out_of_memory = -7,   ///< Memory::allocate returned null
};
/// One English sentence fragment, static storage. Never null, also for values not listed above.
const char* text(Status status) noexcept;

/// Called from open/poll/close/create/destroy only; frames never allocate.
struct Memory {
    void* user;
    void* (*allocate)(void* user, size_t bytes, size_t alignment);
    void (*release)(void* user, void* block, size_t bytes);
};

/// One unit of work: `index` < count of its submit(); `worker` < Jobs::workers, and no two tasks
/// that run at the same time share a worker number. It needs up to 128 KB of stack.
using Task = void (*)(void* context, uint32_t index, uint32_t worker);

/// The engine's threads. submit == nullptr: all work runs inside end_frame() on the calling thread.
struct Jobs {
    void* user;
    uint32_t workers;
    /// Runs task(context, 0 … count-1, worker) some time, in any order. Must not wait.
    /// needed_this_frame is false for prefetch: submitted in end_frame() when there are several workers, it may yield to the
    /// engine's own work and take any time, but must run before destroy() can end. A frame that needs it earlier does it itself.
    void (*submit)(void* user, Task task, void* context, uint32_t count, bool needed_this_frame);
    /// Called in a loop while end_frame() waits, and by destroy(): run one job (rather one that is needed this frame), or
    /// yield. By several threads at once when several drive Players: each needs a worker number of its own, or only one of
    /// them at a time runs a job.
    void (*help)(void* user);
};

struct Asset;   ///< one file: its checked directory and its reads in flight
struct Player;  ///< one playing copy: clock, resident chunks, scratch

/// A wish for bytes [file_offset, file_offset + bytes) of the file, to be written to destination.
struct Read {
    Asset* asset;
    uint64_t ticket;
    uint64_t file_offset;
    void* destination;
    uint32_t bytes;
    float seconds_until_needed;  ///< real seconds, 0 = already late; sort by it
};
struct Io {
    void* user;
    /// Returns at once; false = busy, you will be asked again. May complete the read before
    /// returning (memory-mapped files do). Called from the thread that drives the Player.
    bool (*begin)(void* user, const Read& read);
    /// A hint that nobody waits for the ticket any more; complete_read() must still follow.
    /// May be null.
    void (*forget)(void* user, uint64_t ticket);
};

struct Host {
    uint32_t api = api_version;
    Memory memory{};  ///< required
    Jobs jobs{};      ///< all null = inline
    void* log_user = nullptr;
    /// May be null. The message is valid during the call.
    void (*log)(void* user, Status status, const char* message) = nullptr;
    void* clock_user = nullptr;
    /// Microseconds that never go back; null: the system's. Read from any worker, and only for frames with
    /// Budget::microseconds.
    uint64_t (*clock)(void* user) = nullptr;
};

struct AssetInfo {
    double seconds;              ///< length of the clip: last frame's time − first frame's time
    double first_seconds;        ///< time of the first frame on the source's clock; Frame::seconds
                                 ///< counts from 0 = first frame
    double frames_per_second;    ///< of the source (mean where frames are unevenly spaced)
    float lower[3], upper[3];    ///< bounds of the surface over the whole clip, asset space
    float cell_size;             ///< the source's own resolution: its median edge length
    uint32_t format;             ///< version of the file format
    uint32_t frames, windows, layers, blocks;  ///< blocks: most blocks in any window
    int32_t first_frame;         ///< the source's number of the first frame
    int32_t frame_step;          ///< to that of the next; where some are missing the least such step, and all
                                 ///< numbers are "frame_numbers" in settings_json
    uint32_t most_points;        ///< most points alive in any one window: sizes Limits::points
    uint64_t largest_window_bytes;  ///< most resident bytes any one window needs, all layers
    uint64_t content_hash;       ///< of the payload bytes: names this exact cook
    const char* settings_json;   ///< cook settings and source facts; owned by the Asset, UTF-8
};
/// Starts reading; returns at once. The Asset is valid (for poll and close) when ok is returned.
Status open(const Host& host, const Io& io, uint64_t file_bytes, Asset** out) noexcept;
/// pending until the directory has arrived and passed its checks. A failure is final: close().
Status poll(Asset* asset, AssetInfo* out) noexcept;
/// Any thread; also from inside Io::begin(). Exactly once for every begin() that returned true.
void complete_read(Asset* asset, uint64_t ticket, bool arrived) noexcept;
/// pending while reads are out (call again); bad_argument while Players live.
Status close(Asset* asset) noexcept;
/// The time of frame `index` (0 … frames-1), seconds after the first; for unevenly spaced sources.
double frame_seconds(const Asset* asset, uint32_t index) noexcept;

/// Sizes fixed at create(). A zero takes the asset's own need (see suggest_limits()).
struct Limits {
    uint64_t resident_bytes;   ///< decoded windows and reads in flight
    uint32_t points;           ///< alive at one moment
    uint32_t vertices;         ///< scratch of the mesher; Target has capacities of its own
    uint32_t indices;          ///< for a Target that takes a whole frame; the player itself needs none
    uint32_t reads_in_flight;  ///< 4096 at most
};
/// What plays this asset whole, at source resolution, with prefetch of one window either way.
Limits suggest_limits(const Asset* asset) noexcept;
/// Exactly what create() will allocate, in bytes.
uint64_t footprint(const Asset* asset, const Limits& limits) noexcept;
Status create(Asset* asset, const Limits& limits, Player** out) noexcept;
/// pending while its reads or jobs are out: they still point at its memory; bad_argument between begin_frame() and end_frame().
Status destroy(Player* player) noexcept;

/// World space. Planes (n, d): n·x + d ≥ 0 inside; n of unit length.
struct View {
    float planes[6][4];
    float eye[3];
    float pixels_per_radian;  ///< viewport height / vertical field of view, in pixels
};
/// 0 = no cap / automatic, for every field.
struct Budget {
    float pixel_error;     ///< size of a cell on the screen aimed at; needs at least one View. Where eyes go in small steps
                           ///< vertices do as well: they go from cells of one size to those of the next
    float cell_size;       ///< if > 0: this cell size (asset space), whatever the views say
    uint32_t layers;       ///< use at most so many layers
    uint32_t points;       ///< per frame
    uint32_t microseconds; ///< of a frame's work, from its first stage to its last: what is seen of the surface gets
                           ///< coarser. 0: no clock is read, and frames are repeatable
    uint64_t read_bytes;   ///< asked for per frame; a chunk that is larger goes alone. Not with Frame::wait_for_data
};
/// May be mapped GPU memory: written once, never read back. null data = not wanted.
struct Stream {
    void* data;
    uint32_t stride;  ///< bytes from one element to the next
};
/// One drawable piece, `block` being its number: indices [first_index, first_index + index_count), asset space bounds.
struct Range {
    uint32_t block, first_index, index_count;
    float lower[3], upper[3];
};
/// Where a frame goes. Everything is written in asset space; the winding is counter-clockwise seen
/// from the air; normals, of unit length, point into the air (in the smallest cells between the field's and the triangles', in
/// larger ones the field's); velocity is the liquid's there, m/s;
/// across the surface it is that with which the surface moves.
struct Target {
    Stream position, normal, velocity;  ///< three floats each
    uint32_t* indices;
    Range* ranges;
    uint32_t vertex_capacity, index_capacity, range_capacity;
    /// The decoded surface points themselves (debug views, particles): same units as above.
    Stream point_position, point_normal;
    uint32_t point_capacity;
    uint32_t vertices_used, indices_used, ranges_used, points_used;  ///< filled in by end_frame()
};
struct Frame {              ///< views and target must stay valid until end_frame()
    double seconds;         ///< where in the clip; any jump is legal; clamped to the clip
    float rate;             ///< clip seconds per real second, signed: steers prefetch
    bool loops;             ///< beyond one end of the clip comes the other: steers prefetch
    float asset_to_world[12];  ///< three rows of four: rotation·scale | translation
    const View* views;      ///< none: no culling, and cells of the source's size
    uint32_t view_count;    ///< 16 at most
    Budget budget;
    Target* target;         ///< null: stream and decode only
    bool wait_for_data;     ///< end_frame() waits until all wanted chunks arrived (offline tools)
};
/// What was held back this frame, and so what to raise.
enum Cut : uint32_t {
    cut_points = 1,     ///< by Limits, Budget or Target::point_capacity
    cut_vertices = 2,
    cut_indices = 4,
    cut_ranges = 8,
    cut_time = 16,
    cut_residency = 32,
    cut_late = 64,
    cut_damaged = 128,  ///< of the file: nothing to raise
};
struct Stats {
    uint32_t cut;  ///< Cut bits
    uint32_t blocks_in_view, blocks_drawn, layers_wanted, layers_drawn;
    uint32_t points_wanted, points_used, vertices_wanted, indices_wanted, ranges_wanted;
    uint32_t chunks_resident, chunks_late;  ///< now; late: wanted for this moment and not there
    uint32_t reads_in_flight;
    uint32_t chunks_rejected, reads_refused, reads_failed;  ///< since create()
    uint64_t bytes_resident, bytes_asked, bytes_arrived;  ///< asked/arrived: since create()
    uint32_t windows_decoded;                             ///< since create()
    uint32_t plan_us, decode_us, field_us, mesh_us, wait_us;  ///< 0 unless Budget::microseconds
    float cell_size;     ///< the smallest meshed, asset space
    float pixel_error;   ///< delivered, to hold against Budget::pixel_error
};
/// Plans, asks for reads, submits; returns.
Status begin_frame(Player* player, const Frame& frame) noexcept;
/// The only wait. clipped = whole and drawable, but see Stats::cut. out may be null.
Status end_frame(Player* player, Stats* out) noexcept;

}  // namespace rill
