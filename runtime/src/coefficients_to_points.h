// SPDX-License-Identifier: MIT
// Coefficients at a time → points and drops with exact velocity.
#pragma once
#include <cstddef>
#include <cstdint>

#include "format/fourier_extension.h"
#include "format/tracks.h"

namespace rill {

/// Basis rows at one moment of one window, shared by all its tracks: computed once per frame, and only those that tracks need.
struct TimeRows;
size_t time_rows_bytes(uint32_t sample_count) noexcept;
/// s: samples since the window's first, 0 … sample_count − 1. `steps`: of the frames around it. samples_per_second:
/// ds/dt at s, which turns derivatives into metres per second. The tables must outlive the rows.
TimeRows* place_time_rows(void* memory, const format::BasisTables& tables, uint32_t sample_count,
                          double s, const format::StepRatios& steps, double samples_per_second) noexcept;
/// How many of the tracks [first, last) of the block are active at the rows' time; makes their rows.
uint32_t count_active(TimeRows* rows, const format::TrackBlock& block, uint32_t first, uint32_t last) noexcept;
/// Appends those of them that are active, and sound, to points/drops. They must have been counted.
/// `capacity`: of each set. Returns how many were active (appended + those that did not fit).
uint32_t evaluate_tracks(const TimeRows* rows, const format::TrackBlock& block, uint32_t first,
                         uint32_t last, uint32_t point_capacity, uint32_t drop_capacity,
                         format::PointSet& points, format::DropSet& drops) noexcept;

}  // namespace rill
