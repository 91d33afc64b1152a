// SPDX-License-Identifier: MIT
// Chains the stages of a frame over the caller's Jobs: the last task of a stage starts the next one,
// so nothing waits between stages. The only wait of the runtime is in end_frame().
#pragma once
#include <atomic>
#include <cstdint>

#include "rill/rill.h"

namespace rill {

/// One stage of a frame. prepare() runs alone and says how many tasks the stage has; run() is then
/// called once per index, in any order, on any worker. When `repeats` is set prepare() is called again
/// after each round until it answers 0 (marching rounds).
struct Stage {
    uint32_t (*prepare)(void* context);
    void (*run)(void* context, uint32_t index, uint32_t worker);  ///< may be null: serial only
    bool repeats;
};

/// Runs the stages in order on this thread: tools, tests, and Jobs without submit.
inline void run_inline(const Stage* stages, uint32_t count, void* context) {
    for (uint32_t s = 0; s < count; ++s) {
        for (;;) {
            const uint32_t tasks = stages[s].prepare(context);
            for (uint32_t i = 0; i < tasks && stages[s].run; ++i) stages[s].run(context, i, 0);
            if (tasks == 0 || !stages[s].repeats) break;
        }
    }
}

/// The stages of one frame and how far they are. add() all, then start() once; reusable when done.
struct Relay {
    static constexpr uint32_t most_steps = 32;

    /// Forgets the last frame's stages.
    void clear(const Jobs& over) noexcept;
    void add(const Stage* stages, uint32_t count, void* context) noexcept;
    /// Returns at once; the stages run as jobs. Needs Jobs::submit.
    void start() noexcept;
    /// Everything here and now.
    void run_all() noexcept;
    /// From within prepare(): the stage is not over before finish_one() was called once more, or expect() taken back.
    void expect() noexcept { tasks_left_.fetch_add(1, std::memory_order_relaxed); }
    void expect_no_more() noexcept { tasks_left_.fetch_sub(1, std::memory_order_relaxed); }
    /// Work of a stage is done; what it wrote is visible to the next one. The last to say so goes on with that.
    void finish_one(uint32_t worker) noexcept;
    /// Everything the stages wrote is visible once this is true, and no task touches the relay any more.
    bool done() const noexcept { return done_.load(std::memory_order_acquire); }

private:
    struct Step {
        Stage stage;
        void* context;
    };
    void advance(uint32_t worker) noexcept;
    static void run_task(void* relay, uint32_t index, uint32_t worker);

    Step steps_[most_steps];
    Step running_{};  ///< of the tasks that are out
    uint32_t step_count_ = 0, current_ = 0;
    Jobs jobs_{};
    std::atomic<uint32_t> tasks_left_{0};
    std::atomic<bool> done_{true};
};

}  // namespace rill
