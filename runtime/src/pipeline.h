// SPDX-License-Identifier: MIT
// The runtime, top to bottom: every stage, and the structs that pass from one to the next.
//
//   file → directory                        asset_to_directory.cpp      once, in poll()
//   time, views, directory → plan, wants    view_to_wants.cpp           begin_frame()
//   plan, time there is → detail            frame_budget.cpp            begin_frame()
//   wants → reads                           wants_to_reads.cpp          begin_frame(): residency, eviction
//   reads → chunks                          reads_to_chunks.cpp         completions; decoding in tasks
//   chunks → points                         chunks_to_points.cpp        tasks, over coefficients_to_points.h
//   points → field                          points_to_field.cpp         tasks, over surface/field.h
//   field → mesh → buffers                  field_to_mesh.h             tasks
//   frame → stats                           frame_to_stats.cpp          end_frame()
//
// player.cpp strings them together. Up to the reads everything is serial and cheap; the rest are
// Stages that a Relay chains over the caller's jobs.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "arena.h"
#include "coefficients_to_points.h"
#include "surface/field_to_mesh.h"
#include "format/check.h"
#include "format/fourier_extension.h"
#include "format/tracks.h"
#include "levels.h"
#include "relay.h"
#include "rill/rill.h"
#include "surface/field.h"

namespace rill {

// ---- file → directory ---------------------------------------------------------------------------

/// Everything known of a file before any chunk is read. Immutable once poll() has answered ok.
struct Directory {
    format::Header header;
    format::DirectoryTables tables;      ///< settings: zero-terminated
    format::BasisTables basis;
    AssetInfo info;
    surface::Container container;        ///< sides of the bounds that the liquid is cut off at
    float layer_error[format::max_layers];  ///< mean over the clip, with this and all coarser layers; falls
    uint32_t most_point_tracks, most_drop_tracks, most_chunks;  ///< of any one window
    uint64_t suggested_resident_bytes, suggested_vertices;
};
double frame_time(const Directory& directory, uint32_t index) noexcept;
/// Cells from which on the layer adds nothing that they would show: what is coarser is fine enough. Until then it fades,
/// from `layer_fades` of them on; cells of the source's size have all layers.
float layer_limit(const Directory& directory, uint32_t layer) noexcept;
inline constexpr float layer_fades = 0.7f;
/// Bytes a chunk takes of a player's residency: head, tracks, coefficients; with its read: + bytes.
uint64_t decoded_bytes(const format::ChunkRecord& chunk) noexcept;
uint64_t reading_bytes(const format::ChunkRecord& chunk) noexcept;

/// Where a read is. The word holds ticket << 2 | state, so that a completion that is stale, doubled or
/// meant for somebody else changes nothing.
struct ReadSlot {
    enum State : uint64_t { free = 0, out = 1, arrived = 2, failed = 3 };
    std::atomic<uint64_t> word{free};
    uint32_t chunk = 0;
    bool forgotten = false;

    State state() const noexcept { return State(word.load(std::memory_order_acquire) & 3); }
    uint64_t ticket() const noexcept { return word.load(std::memory_order_relaxed) >> 2; }
    void set(State state, uint64_t ticket) noexcept {
        word.store(ticket << 2 | state, std::memory_order_release);
    }
    /// The one thing an IO thread does. Afterwards it must not touch the slot.
    void complete(uint64_t ticket, bool did_arrive) noexcept;
};
/// A ticket says which player (0: the asset itself) and which of its slots; the rest never repeats.
inline constexpr uint32_t most_players = 1023, most_slots = 4096;
constexpr uint64_t make_ticket(uint64_t serial, uint32_t player, uint32_t slot) noexcept {
    return serial << 22 | uint64_t(slot) << 10 | player;
}
constexpr uint32_t ticket_player(uint64_t ticket) noexcept { return ticket & 1023; }
constexpr uint32_t ticket_slot(uint64_t ticket) noexcept { return ticket >> 10 & 4095; }

}  // namespace rill

struct rill::Asset {
    rill::Host host;
    rill::Io io;
    uint64_t file_bytes;
    enum class Phase { header, directory, ready, failed } phase = Phase::header;
    rill::Status failure = rill::Status::ok;
    rill::ReadSlot slot;                 ///< of the read below
    uint8_t header_bytes[rill::format::header_bytes];
    uint8_t* directory_bytes = nullptr;  ///< as read; released once it is parsed
    void* tables = nullptr;              ///< one block: what `directory` points into
    uint64_t tables_bytes = 0;
    rill::Directory directory{};
    std::atomic<uint64_t> next_serial{1};
    std::atomic<rill::Player*> players[rill::most_players]{};
    std::atomic<uint32_t> player_count{0};
};

namespace rill {

void log(const Asset& asset, Status status, const char* message) noexcept;
/// Asks for the header, so that it is on its way before the first poll().
void start_asset(Asset& asset) noexcept;
/// Moves opening on as far as arrived bytes allow: issues reads, checks, allocates. poll() in a word.
Status advance_asset(Asset& asset) noexcept;
/// Releases what advance_asset() allocated. No read may be out.
void release_tables(Asset& asset) noexcept;

// ---- time, views, directory → plan ----------------------------------------------------------------

inline constexpr float prefetch_seconds = 1;       ///< of real time, and one window at least

struct Moment {
    uint32_t window;
    double seconds;                ///< clamped to the clip
    double sample;                 ///< within the window
    double samples_per_second;
    format::StepRatios steps;
};
struct Want {
    uint32_t chunk;
    float seconds_until_needed;    ///< real seconds
};
struct Detail {
    uint32_t layers;               ///< longest prefix wanted of any block
    float pixels_per_metre;        ///< where what is seen is nearest; 0: no view
};
struct Plan {
    Moment moment;
    float rate;
    bool loops;
    uint32_t view_count;
    FrustumPlanes views[most_views];   ///< asset space
    float eyes[most_views][3];         ///< asset space
    Levels levels;                 ///< as asked
    Levels levels_held;            ///< kept from frame to frame while the views hardly move: chooses what is read
    Levels levels_drawn;           ///< with the detail given up for the sake of time
    Detail detail;
    uint32_t blocks_in_view;
    uint32_t now_count, want_count;    ///< wants[0, now_count) are of this moment, the rest is prefetch
    Want* wants;                       ///< chunk_count of them: most important first
};
inline constexpr float reach_in_spacings = 3;      ///< how far points act beyond their own bounds
/// Whether a box, widened, lies inside a frustum at least in part; true too for some beside its edges.
bool touches(const FrustumPlanes& view, const float* lower, const float* upper, float wider) noexcept;
Moment moment_at(const Directory& directory, double seconds) noexcept;
/// Real seconds until `window` is needed by the play direction, round the end if the clip loops; what lies behind
/// comes after all that is ahead.
float seconds_until(const Directory& directory, const Plan& plan, uint32_t window) noexcept;
/// Of what is in sight of this moment; the largest if nothing is.
float smallest_cell(const Directory& directory, const Plan& plan, const Levels& levels) noexcept;
/// Fills everything but Plan::wants' address.
void plan_frame(const Directory& directory, const Frame& frame, Plan& plan) noexcept;

// ---- plan → reads → chunks ------------------------------------------------------------------------

/// First fit with coalescing inside one block; neighbours found through boundary tags.
struct Heap {
    uint8_t* base;
    uint64_t bytes, used;
};
void clear_heap(Heap& heap, void* memory, uint64_t bytes) noexcept;
void* heap_take(Heap& heap, uint64_t bytes) noexcept;                ///< 64-byte aligned; null: no room
void heap_trim(Heap& heap, void* block, uint64_t bytes) noexcept;    ///< gives the tail back
void heap_give(Heap& heap, void* block) noexcept;

/// unpacking: a job that no frame waits for decodes it; undecodable: found out in this frame; rejected: its memory given
/// back, never asked for again.
enum class ChunkState : uint8_t { absent, reading, arrived, unpacking, resident, undecodable, rejected };
struct ChunkSlot {
    ChunkState state;
    uint8_t failures;              ///< reads that failed in a row
    uint32_t rank;                 ///< in this frame's wants; unwanted: UINT32_MAX
    uint32_t window;
    uint32_t held;                 ///< own place in Residency::held
    uint32_t read_slot;
    uint64_t retry_at;             ///< frame number
    format::TrackBlock* block;     ///< head, tracks, coefficients, bytes as read: one piece of the heap
    const char* fault;             ///< why it is undecodable
};
/// A job that decodes prefetch between frames, on workers that have nothing else to do. Whoever wins the phase decodes: a frame
/// that wants the chunk before the job has begun takes it over, and one that comes while it runs waits for it like for a task
/// of its own.
struct Unpacking {
    enum Phase : uint32_t {
        idle,
        queued,   ///< with the engine
        running,
        awaited,  ///< running, and the frame's relay expects it
        done,     ///< `result` stands; the job touches nothing any more
        taken,    ///< by a frame; the engine still has the job, which will only say idle
    };
    std::atomic<uint32_t> phase{idle};
    Player* player = nullptr;
    uint32_t chunk = 0;
    ChunkState result = ChunkState::absent;
};
inline constexpr uint32_t most_unpacking = 8;

struct Residency {
    Asset* asset;
    uint32_t player_index;         ///< in tickets
    Heap heap;
    ChunkSlot* chunks;             ///< chunk_count
    uint32_t* held;                ///< chunks that have memory
    uint32_t held_count;
    uint16_t* resident_in_window;  ///< window_count
    ReadSlot* slots;
    uint32_t slot_count, slots_out;
    uint32_t* to_decode;           ///< arrived chunks that this frame decodes
    uint32_t decode_count;
    uint64_t decode_bytes;         ///< of those, and of `joins`
    Unpacking unpacking[most_unpacking];
    uint32_t joins[most_unpacking];  ///< of `unpacking`: what this frame wants of them
    uint32_t join_count;
    double last_seconds;           ///< in the clip: the frame before
    uint64_t frame_number;
    uint64_t frame_bytes_asked;
    bool waiting;                  ///< Frame::wait_for_data: failed reads are repeated at once
    bool busy;                     ///< the IO refused: not asked again in this round
    bool no_room;                  ///< something of this moment found no memory, this frame
    // Since create():
    uint64_t bytes_asked, bytes_arrived;
    uint32_t reads_refused, reads_failed, chunks_rejected, windows_decoded;
};
/// Takes the ranks of the last frame's wants away: before plan_frame() overwrites them.
void drop_ranks(Residency& residency, const Plan& plan) noexcept;
/// Gives this frame's; reads that nobody wants any more are forgotten.
void rank_wants(Residency& residency, const Plan& plan) noexcept;
/// Asks for what is absent, in order, as far as memory, slots and `read_bytes` go. True: something was asked.
bool issue_reads(Residency& residency, const Directory& directory, const Plan& plan,
                 uint64_t read_bytes) noexcept;
/// Takes in completed reads. True: at least one arrived.
bool collect_reads(Residency& residency, const Directory& directory) noexcept;
/// Nothing of this moment can still arrive by waiting.
bool is_settled(const Residency& residency, const Plan& plan) noexcept;
void forget_reads(Residency& residency) noexcept;
/// Chooses what this frame decodes: of this moment what `most_bytes` allows, one chunk at least, and `prefetch` chunks of
/// what comes later.
void choose_decodes(Residency& residency, const Directory& directory, const Plan& plan, uint64_t most_bytes,
                    uint32_t prefetch) noexcept;
/// Prefetched chunks to decode this frame, so that those that are here are ready in time without one frame bearing many.
uint32_t prefetch_due(const Residency& residency, const Plan& plan) noexcept;
/// One task per chunk, then what jobs between frames have done of this moment; context Player.
inline constexpr uint32_t decode_stage_count = 2;
extern const Stage decode_stages[decode_stage_count];
/// After the frame: staging back to the heap, faults counted and logged. Before it, too: of jobs between frames.
void settle_decodes(Residency& residency, const Directory& directory) noexcept;
/// Hands `count` prefetched chunks to the engine, as jobs that no frame waits for.
void start_unpacking(Player& player, uint32_t count) noexcept;
/// False: some jobs are still with the engine. Those that have not begun will do nothing.
bool stop_unpacking(Residency& residency) noexcept;
void release_chunk(Residency& residency, uint32_t chunk) noexcept;

// ---- chunks → points ------------------------------------------------------------------------------

/// Up to 1024 tracks of one chunk, all points or all drops: the unit of work.
struct Piece {
    uint32_t chunk, first, last;
    uint32_t offset, room;         ///< its slice of the output
};
inline constexpr uint32_t piece_tracks = 1024;
struct Evaluation {
    void* rows_memory;
    TimeRows* rows;
    Piece* pieces;                 ///< (layer, block, first) ascending: what makes the order of points
    uint32_t piece_count;
    format::PointSet points;
    format::DropSet drops;
    uint32_t point_capacity, drop_capacity;
    uint32_t points_wanted;        ///< points and drops active in the chunks drawn
    bool cut;
};
extern const Stage evaluate_stage;  ///< context Player

// ---- plan, time there is → detail -----------------------------------------------------------------

/// Of detail, that may be given up: what then is left of the liquid is some cells across.
float most_octaves(const Directory& directory) noexcept;
/// What work takes here, learned from frames with Budget::microseconds; starts wary.
struct Pace {
    float octaves = 0;             ///< given up before the frame begins
    float us_per_vertex = 1, us_per_point = 4, us_per_byte = 1, vertices_per_cell = 1.5f;
    float cells = 0, points = 0;   ///< estimated of this frame
    uint32_t lates = 0;            ///< how often the mesher has been told that it is late
};
uint64_t read_clock(const Host& host) noexcept;
/// 0 when this frame has no time cap.
uint64_t microseconds_now(const Player& player) noexcept;
/// After plan_frame(): sets Pace::octaves and Plan::levels_drawn.
void give_up_detail(Player& player) noexcept;
/// MeshInput::late.
bool is_late(void* player) noexcept;
uint64_t decode_bytes_affordable(const Player& player) noexcept;
void learn_pace(Player& player, const MeshCounts& mesh, uint64_t bytes_decoded) noexcept;

// ---- points → field → mesh ------------------------------------------------------------------------

inline constexpr uint32_t field_stage_count = 2;
/// Build and fit; finish and begin_mesh(). Context Player.
extern const Stage field_stages[field_stage_count];

}  // namespace rill

struct rill::Player {
    rill::Asset* asset;
    const rill::Directory* directory;
    rill::Limits limits;               ///< no zeros
    uint64_t memory_bytes;
    rill::Frame frame;
    bool frame_open, started;          ///< started: the stages are chained, maybe running
    rill::Plan plan;
    rill::Residency residency;
    rill::Evaluation evaluation;
    rill::surface::Field field;
    void* field_memory;
    rill::Mesher* mesher;
    rill::Relay relay;
    rill::Pace pace;
    /// A stage that only reads the clock, and only when there is a time cap.
    struct Mark {
        Player* player;
        uint64_t us;
    } decode_begun, decode_done, mesh_begun, mesh_done;
    uint32_t plan_us, wait_us;
};

namespace rill {

// ---- frame → stats ----------------------------------------------------------------------------------

/// After the last stage and settle_decodes(). Also learns the pace.
Stats count_all(Player& player) noexcept;

}  // namespace rill
