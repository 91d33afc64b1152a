// SPDX-License-Identifier: MIT
#include "relay.h"

#include <cassert>

namespace rill {

void Relay::clear(const Jobs& over) noexcept {
    jobs_ = over;
    step_count_ = current_ = 0;
}

void Relay::add(const Stage* stages, uint32_t count, void* context) noexcept {
    assert(step_count_ + count <= most_steps);
    for (uint32_t i = 0; i < count; ++i) steps_[step_count_++] = {stages[i], context};
}

void Relay::run_all() noexcept {
    for (uint32_t i = 0; i < step_count_; ++i) run_inline(&steps_[i].stage, 1, steps_[i].context);
}

void Relay::start() noexcept {
    done_.store(false, std::memory_order_relaxed);
    // The first prepare() is a task too: begin_frame() returns at once, and all stages run where a
    // worker number is known.
    const Task kick_off = [](void* relay, uint32_t, uint32_t worker) {
        static_cast<Relay*>(relay)->advance(worker);
    };
    jobs_.submit(jobs_.user, kick_off, this, 1, true);
}

/// Runs on the one thread that holds the baton: nobody else touches the relay meanwhile.
void Relay::advance(uint32_t worker) noexcept {
    while (current_ < step_count_) {
        const Step step = steps_[current_];
        tasks_left_.store(1, std::memory_order_relaxed);  // this thread's own: nobody goes on before it lets go
        const uint32_t tasks = step.stage.prepare(step.context);
        if (tasks == 0 || !step.stage.repeats) ++current_;
        if (tasks == 1 && step.stage.run) {  // not worth a trip through the engine's queue
            step.stage.run(step.context, 0, worker);
        } else if (tasks > 1 && step.stage.run) {
            running_ = step;  // run_task() finds its stage here, also after current_ has moved on
            tasks_left_.fetch_add(tasks, std::memory_order_relaxed);
            jobs_.submit(jobs_.user, &Relay::run_task, this, tasks, true);
        }
        // With work still out, the baton is with whoever ends the last of it: touch nothing.
        if (tasks_left_.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    }
    done_.store(true, std::memory_order_release);
}

void Relay::run_task(void* context, uint32_t index, uint32_t worker) {
    auto* relay = static_cast<Relay*>(context);
    relay->running_.stage.run(relay->running_.context, index, worker);
    relay->finish_one(worker);
}

void Relay::finish_one(uint32_t worker) noexcept {
    if (tasks_left_.fetch_sub(1, std::memory_order_acq_rel) == 1) advance(worker);
}

}  // namespace rill
