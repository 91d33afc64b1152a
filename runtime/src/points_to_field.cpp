// SPDX-License-Identifier: MIT
// Points → field → mesher, as stages; the work itself is surface/field.h's.
#include <algorithm>

#include "pipeline.h"

namespace rill {
namespace {

constexpr uint32_t points_per_task = 256;  // about a millisecond of fitting

uint32_t prepare_fit(void* context) {
    auto& player = *static_cast<Player*>(context);
    surface::begin_field(player.field, player.field_memory, player.evaluation.points, player.evaluation.drops,
                         player.directory->container);
    return (player.field.point_count + points_per_task - 1) / points_per_task;
}

void run_fit(void* context, uint32_t index, uint32_t) {
    surface::Field& field = static_cast<Player*>(context)->field;
    const uint32_t first = index * points_per_task;
    surface::fit_patches(field, first, std::min(first + points_per_task, field.point_count));
}

uint32_t prepare_mesh(void* context) {
    auto& player = *static_cast<Player*>(context);
    surface::finish_field(player.field);
    Target* target = player.frame.target;
    MeshInput input{};
    input.field = &player.field;
    input.levels = player.plan.levels_drawn;
    input.views = player.plan.view_count ? player.plan.views : nullptr;
    input.view_count = player.plan.view_count;
    input.velocity = target->velocity.data != nullptr;
    input.target = target;
    if (player.frame.budget.cell_size == 0) {  // else that size is an order
        input.most_octaves = std::max(0.f, most_octaves(*player.directory) - player.pace.octaves);
        input.late = player.frame.budget.microseconds ? is_late : nullptr;
        input.user = &player;
    }
    begin_mesh(player.mesher, input);
    return 0;
}

}  // namespace

const Stage field_stages[field_stage_count] = {
    {prepare_fit, run_fit, false},
    {prepare_mesh, nullptr, false},
};

}  // namespace rill
