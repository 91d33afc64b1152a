// SPDX-License-Identifier: MIT
#include "tracks/trial_field.h"

#include <algorithm>

#include "surface/field_kernels.h"

namespace rill::cooker {
namespace {

constexpr uint32_t lanes = surface::lanes;
constexpr float rounding = 1.001f;  // of squared distances, which kernels keep to 6e-5

}  // namespace

TrialField::TrialField(const std::vector<SurfacePoint>& points, size_t room) : PointField(points, room) {
    reach2_.resize(field.point_count + room + lanes, 0.f);
    for (uint32_t bundle = 0; bundle < field.bundles.count; ++bundle) fit(bundle);
    surface::finish_field(field);
}

void TrialField::fit(uint32_t bundle) {
    const uint32_t first = bundle * lanes, last = std::min(field.point_count, first + lanes);
    surface::Nearest nearest;
    field.kernels->nearest(field, bundle, nearest);
    field.kernels->fit(field, first, last, nearest);
    for (uint32_t i = first; i < last; ++i)
        reach2_[i] = rounding * std::max(nearest.d2[surface::most_neighbours - 1][i - first], nearest.any[surface::support_neighbour - 1][i - first]);
}

TrialField::Fitted TrialField::copy_of(uint32_t bundle, uint32_t count) const {
    const uint32_t first = bundle * lanes, last = std::min(count, first + lanes);
    return {bundle, {field.patches + first, field.patches + last}, {field.support + first, field.support + last},
            {field.steep + first, field.steep + last}, {field.area + first, field.area + last}, {reach2_.begin() + first, reach2_.begin() + last}};
}

void TrialField::add(const std::vector<SurfacePoint>& points) {
    PointRows rows(points);
    const uint32_t before = field.point_count;
    surface::resize_field(field, before + uint32_t(points.size()), rows.set());
    before_.clear(), count_before_ = before;
    for (uint32_t bundle = 0; bundle < field.bundles.count; ++bundle) {
        bool nears = false;
        for (uint32_t i = bundle * lanes; i < std::min(before, (bundle + 1) * lanes); ++i)
            for (uint32_t k = before; k < field.point_count; ++k) {
                const float x = field.x[i] - field.x[k], y = field.y[i] - field.y[k], z = field.z[i] - field.z[k];
                nears |= x * x + y * y + z * z <= reach2_[i];
            }
        if (!nears && (bundle + 1) * lanes <= before) continue;
        if (bundle * lanes < before) before_.push_back(copy_of(bundle, before));
        fit(bundle);
    }
    surface::finish_field(field);
}

void TrialField::take_back() {
    surface::resize_field(field, count_before_, {});
    for (const Fitted& old : before_) {
        const uint32_t first = old.bundle * lanes;
        std::copy(old.patches.begin(), old.patches.end(), field.patches + first);
        std::copy(old.support.begin(), old.support.end(), field.support + first);
        std::copy(old.steep.begin(), old.steep.end(), field.steep + first);
        std::copy(old.area.begin(), old.area.end(), field.area + first);
        std::copy(old.reach2.begin(), old.reach2.end(), reach2_.begin() + first);
    }
    surface::finish_field(field);
}

void TrialFields::keep(const std::vector<SurfacePoint>& added) {
    kept_.insert(kept_.end(), added.begin(), added.end());
    for (const auto& field : fields_) field->add(added);
}

std::unique_ptr<TrialField> TrialFields::take() {
    {
        const std::lock_guard lock(free_);
        if (!fields_.empty()) {
            std::unique_ptr<TrialField> field = std::move(fields_.back());
            fields_.pop_back();
            return field;
        }
    }
    auto field = std::make_unique<TrialField>(points_, room_);
    if (!kept_.empty()) field->add(kept_);
    return field;
}

void TrialFields::give_back(std::unique_ptr<TrialField> field) {
    const std::lock_guard lock(free_);
    fields_.push_back(std::move(field));
}

}  // namespace rill::cooker
