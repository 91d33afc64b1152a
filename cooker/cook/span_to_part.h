// SPDX-License-Identifier: MIT
// Cooks one span into a part of its own, in a closed loop: what it decodes to is measured, the tolerance follows.
#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cook/cook.h"
#include "cook/error_target.h"
#include "cook/parts_to_asset.h"
#include "cook/survey.h"
#include "format/fourier_extension.h"
#include "surface/container.h"
#include "tracks/pipeline.h"

namespace rill::cooker {

/// What a window looks back at: the two last frames of the one before it, and how the surface moved between them. Nothing of it
/// at the first window of a span.
struct Past {
    std::shared_ptr<const SurfaceFrame> frame, border;  ///< border: the window's first frame
    std::vector<glm::vec3> motion;                      ///< of the vertices of `frame`, metres
    double seconds = 0;                                 ///< between the two
};

/// Keeps references to all it is given.
class SpanCook {
public:
    SpanCook(const SequenceReader& reader, const CookSettings& settings, const Survey& survey, const SpanPlan& plan,
             const CookFacts& facts, const Aim& aim);
    /// Writes the part; a failure leaves none. `done` hears, on this thread, how many frames the first attempt has got through.
    void run(uint32_t span, const std::string& output, const std::function<void(uint32_t)>& done) const;

private:
    /// Decoded by the runtime and measured after every attempt.
    SpanResult at_error(uint32_t span, const std::string& candidate, const std::string& best, const std::function<void(uint32_t)>& done) const;
    /// Every span may have the bytes of its time: what bytes there are tells at once, so only the last is measured.
    SpanResult within_rate(uint32_t span, const std::string& candidate, const std::string& best, const std::function<void(uint32_t)>& done) const;
    /// Evenly spread, as many of every span, so that spans weigh what they are; the border frame is the next span's.
    std::vector<size_t> judged_frames_of(uint32_t span) const;
    SpanResult cook(uint32_t span, const std::string& output, double tolerance, const std::function<void(uint32_t)>& done) const;
    surface::Container container() const { return surface::container_of(&facts_.lower.x, &facts_.upper.x, facts_.walls, facts_.edge); }
    void write(AssetWriter& writer, const SpanResult& result) const;
    /// From `first` on, and how its points go: longer where the liquid is calm.
    Window next_window(uint32_t first, uint32_t span_end, const Past& past, float tolerance) const;
    /// The frames of the window that it has not got yet, up to `last`.
    void load(Window& window, uint32_t last, const Past& past, float tolerance) const;

    const SequenceReader& reader_;
    const CookSettings& settings_;
    const Survey& survey_;
    const SpanPlan& plan_;
    const CookFacts& facts_;
    Aim aim_;
    format::BasisTables tables_{};
    std::vector<double> tables_memory_;
};

}  // namespace rill::cooker
