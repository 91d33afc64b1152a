// SPDX-License-Identifier: MIT
// Points → field → mesher, as stages; the work itself is surface/field.h's.
#include <algorithm>

#include "pipeline.h"

namespace rill {
namespace {

constexpr uint32_t points_per_task = 256;  // about a millisecond of fitting

uint32_t prepare_fit(void* context) {
    auto& player = *static_cast<Player*>(context);
    surface::begin_field(player.field, player.field_memory, player.evaluation.points, player.evaluation.drops);
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
    begin_mesh(player.mesher, MeshInput{&player.field, player.plan.levels,
                                        player.plan.view_count ? player.plan.views : nullptr,
                                        player.plan.view_count, target->velocity.data != nullptr, target});
    return 0;
}

}  // namespace

const Stage field_stages[field_stage_count] = {
    {prepare_fit, run_fit, false},
    {prepare_mesh, nullptr, false},
};

}  // namespace rill
