// SPDX-License-Identifier: MIT
#include "src/coefficients_to_points.h"

#include <cmath>
#include <cstring>
#include <new>

#include "format/layout.h"

namespace rill {

/// Behind it: for every life [birth, death] and both bases one row of values and one of derivatives, once a track needs them;
/// and whether they have been made.
struct TimeRows {
    format::BasisTables tables;
    uint32_t samples, stride;  ///< stride: floats in a row
    double s;
    format::StepRatios steps;
    float samples_per_second;
};

namespace {

constexpr uint32_t alignment = 64;

uint32_t row_stride(uint32_t samples) {
    const uint32_t terms = samples < format::max_terms ? samples : format::max_terms;
    return (terms + 3) / 4 * 4;
}
size_t aligned(size_t bytes) { return (bytes + alignment - 1) / alignment * alignment; }
size_t rows_in(uint32_t samples) { return size_t(samples) * (samples + 1); }

/// Of a track's life and basis: its place in a triangle.
uint32_t row_of(const TimeRows& rows, const format::Track& track) {
    const uint32_t birth = track.birth, life = birth * rows.samples - birth * (birth - 1) / 2 + (track.death - birth);
    return life * 2 + ((track.flags & format::track_cosine) != 0);
}
uint8_t* made_of(const TimeRows* rows) {
    return reinterpret_cast<uint8_t*>(reinterpret_cast<uintptr_t>(rows) + aligned(sizeof(TimeRows)));
}
float* floats_of(const TimeRows* rows, uint32_t row) {
    return reinterpret_cast<float*>(made_of(rows) + aligned(rows_in(rows->samples))) + size_t(row) * 2 * rows->stride;
}

void make_row(const TimeRows* rows, const format::Track& track) {
    const uint32_t row = row_of(*rows, track), life = track.death - track.birth + 1u;
    if (made_of(rows)[row]) return;
    made_of(rows)[row] = 1;
    const bool cosine = (track.flags & format::track_cosine) != 0;
    float* out = floats_of(rows, row);
    const uint32_t terms = life == 1 ? 2 : format::most_terms(life, cosine);
    format::spline_row(rows->tables, life, cosine, rows->s - track.birth, rows->steps, terms, out, out + rows->stride);
}

/// 0: absent. Points fade within half a step, so that in the middle between two frames the surface is that of those that live through both:
/// others, going on along their tangents or coming along them, stand beside it, and are seen as scraps and lumps (cooker/README.md, "Between
/// frames"). Drops are all there is of most pieces and shrink until the next frame; but those of one sample that do not drift would
/// stand where fast liquid only will be, or was.
float activity_at(const format::TrackBlock& block, uint32_t index, double s) {
    const format::Track& track = block.tracks[index];
    const bool before = s < track.birth, after = s > track.death;
    if (!before && !after) return 1;
    if (!(track.flags & (before ? format::track_born : format::track_dies))) return 0;
    const double away = before ? track.birth - s : s - track.death;
    const bool whole_step = index >= block.point_count && (track.birth < track.death || track.position_terms > 1);
    return float(1 - away * (whole_step ? 1 : 2));
}

/// Σ row[k] · coefficient[k][c]: the channels of a track at one moment.
template <uint32_t channels>
void combine(const float* coefficients, const float* row, uint32_t terms, float* out) {
    float sum[channels] = {};
    for (uint32_t k = 0; k < terms; ++k, coefficients += channels)
        for (uint32_t c = 0; c < channels; ++c) sum[c] += row[k] * coefficients[c];
    for (uint32_t c = 0; c < channels; ++c) out[c] = sum[c];
}

}  // namespace

size_t time_rows_bytes(uint32_t sample_count) noexcept {
    const size_t rows = rows_in(sample_count);
    return aligned(sizeof(TimeRows)) + aligned(rows) + rows * 2 * row_stride(sample_count) * sizeof(float);
}

TimeRows* place_time_rows(void* memory, const format::BasisTables& tables, uint32_t sample_count, double s,
                          const format::StepRatios& steps, double samples_per_second) noexcept {
    auto* rows = new (memory) TimeRows{tables, sample_count, row_stride(sample_count), s, steps, float(samples_per_second)};
    std::memset(made_of(rows), 0, rows_in(sample_count));
    return rows;
}

uint32_t count_active(TimeRows* rows, const format::TrackBlock& block, uint32_t first, uint32_t last) noexcept {
    uint32_t active = 0;
    for (uint32_t i = first; i < last; ++i) {
        if (!(activity_at(block, i, rows->s) > 0)) continue;
        make_row(rows, block.tracks[i]);
        ++active;
    }
    return active;
}

uint32_t evaluate_tracks(const TimeRows* rows, const format::TrackBlock& block, uint32_t first, uint32_t last,
                         uint32_t point_capacity, uint32_t drop_capacity, format::PointSet& points,
                         format::DropSet& drops) noexcept {
    uint32_t active = 0;
    for (uint32_t i = first; i < last; ++i) {
        const format::Track& track = block.tracks[i];
        const float activity = activity_at(block, i, rows->s);
        if (!(activity > 0)) continue;
        const float* row = floats_of(rows, row_of(*rows, track));
        const float* coefficients = block.coefficients + track.first_coefficient;
        const float* second = coefficients + 3 * track.position_terms;
        float x[3], v[3];
        combine<3>(coefficients, row, track.position_terms, x);
        combine<3>(coefficients, row + rows->stride, track.position_terms, v);
        for (int c = 0; c < 3; ++c) x[c] += block.origin[c], v[c] *= rows->samples_per_second;
        if (i < block.point_count && block.slip_unit > 0) {
            const float place = format::place_in_life(track, rows->s);
            for (int c = 0; c < 3; ++c) v[c] += block.slip_unit * (float(track.slip[c]) + place * float(track.slip_change[c]));
        }
        bool sound = true;
        for (int c = 0; c < 3; ++c) sound = sound && std::isfinite(x[c]) && std::isfinite(v[c]);
        if (i < block.point_count) {
            float n[3];
            combine<3>(second, row, track.second_terms, n);
            const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            if (!sound || !(length > 1e-20f) || !std::isfinite(length)) continue;
            ++active;
            if (points.count >= point_capacity) continue;
            const uint32_t at = points.count++;
            points.x[at] = x[0], points.y[at] = x[1], points.z[at] = x[2];
            points.nx[at] = n[0] / length, points.ny[at] = n[1] / length, points.nz[at] = n[2] / length;
            points.vx[at] = v[0], points.vy[at] = v[1], points.vz[at] = v[2];
            points.activity[at] = activity;
        } else {
            float shape[6];
            combine<6>(second, row, track.second_terms, shape);
            for (const float value : shape) sound = sound && std::isfinite(value);
            if (!sound) continue;
            ++active;
            if (drops.count >= drop_capacity) continue;
            const uint32_t at = drops.count++;
            drops.x[at] = x[0], drops.y[at] = x[1], drops.z[at] = x[2];
            for (int c = 0; c < 6; ++c) drops.shape[c][at] = shape[c];
            drops.vx[at] = v[0], drops.vy[at] = v[1], drops.vz[at] = v[2];
            drops.activity[at] = activity;
        }
    }
    return active;
}

}  // namespace rill
