// SPDX-License-Identifier: MIT
// What points decode to with a few more: only those that have one of these among their neighbours are fitted anew, so that a trial
// takes a fraction of the time of a field of its own.
#pragma once
#include <memory>
#include <mutex>
#include <vector>

#include "tracks/points_to_mesh.h"

namespace rill::cooker {

class TrialField : public PointField {
public:
    /// With room for `room` points more, in all.
    TrialField(const std::vector<SurfacePoint>& points, size_t room);
    /// Adds points, after all others.
    void add(const std::vector<SurfacePoint>& points);
    /// The field is again what it was before the last add(), to the bit.
    void take_back();

private:
    struct Fitted {
        uint32_t bundle;
        std::vector<surface::Patch> patches;
        std::vector<float> support, steep, area, reach2;
    };
    void fit(uint32_t bundle);
    Fitted copy_of(uint32_t bundle, uint32_t count) const;

    std::vector<float> reach2_;  ///< by point: squared distance of the farthest neighbour that its patch is made of
    std::vector<Fitted> before_; ///< the last add()
    uint32_t count_before_ = 0;
};

/// Fields of the same points, one for each thread that asks for one at a time.
class TrialFields {
public:
    TrialFields(std::vector<SurfacePoint> points, size_t room) : points_(std::move(points)), room_(room) {}
    /// Work(field) with those points added; they are taken back then. Any thread.
    template <typename Work>
    void with(const std::vector<SurfacePoint>& added, Work work) {
        std::unique_ptr<TrialField> field = take();
        field->add(added);
        work(static_cast<const PointField&>(*field));
        field->take_back();
        give_back(std::move(field));
    }
    /// From now on these belong to all fields. No thread may be at work.
    void keep(const std::vector<SurfacePoint>& added);

private:
    std::unique_ptr<TrialField> take();
    void give_back(std::unique_ptr<TrialField> field);

    const std::vector<SurfacePoint> points_;
    std::vector<SurfacePoint> kept_;
    size_t room_;
    std::mutex free_;
    std::vector<std::unique_ptr<TrialField>> fields_;
};

}  // namespace rill::cooker
