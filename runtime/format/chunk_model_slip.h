// SPDX-License-Identifier: MIT
// The slip of a track in ChunkModel, included by chunk_model.h inside its namespace.

/// What the neighbours say of a track's slip, or of its change.
template <class Coder>
struct ChunkModel<Coder>::Sliding {
    int64_t mean[3] = {}, weights = 0;  ///< Σ weight · value, in 1/16
    uint32_t count = 0, rest = 0, apart = 0;
};

/// As at the middle of the life; of its change, by how much it would be over a life as long, for those whose slip changes.
template <class Coder>
typename ChunkModel<Coder>::Sliding ChunkModel<Coder>::sliding_of(const RawTrack& t, const Near& near, bool change) const {
    Sliding said;
    int64_t first[3] = {};
    const int32_t middle = t.birth + t.death, length = t.death - t.birth;
    for (uint32_t j = 0; j < near.count; ++j) {
        const Track& other = block_.tracks[recent_.track[near.slot[j]]];
        const int32_t span = other.death - other.birth;
        if (change && span + 1u < least_changing_life) continue;
        const int32_t away = middle - other.birth - other.death, within = away < -span ? -span : away > span ? span : away;
        const int64_t weight = weight_of(near, j);
        for (int c = 0; c < 3; ++c) {
            const int64_t goes = int64_t(other.slip_change[c]) * 16;
            const int64_t value = change ? rounded_division(goes * (length < 2 * span ? length : 2 * span), span)
                                         : int64_t(other.slip[c]) * 16 + (span ? rounded_division(goes * within, span) : 0);
            said.mean[c] += weight * value;
            if (said.count == 0) first[c] = value;
            said.apart += magnitude(int32_t(rounded_division(value - first[c], 16)));
        }
        said.weights += weight, said.rest += recent_.slip_rest[change][near.slot[j]], ++said.count;
    }
    return said;
}

template <class Coder>
bool ChunkModel<Coder>::slip_values(const RawTrack& t, const Frame& frame, const Near& near, bool change, const RawTrack* source,
                                    int32_t (&out)[2]) {
    const Sliding said = sliding_of(t, near, change);
    const int32_t* given = !source ? nullptr : change ? source->slip_change : source->slip;
    const uint32_t expected = residual_level(said.rest * 8 * uint32_t(share[said.count]) >> 16);
    const uint32_t spread = said.count < 2 ? said.count : 2 + at_most(magnitude_class(said.apart), 5);
    const uint32_t length = change ? magnitude_class(slip_rest_[0]) : magnitude_class(t.death - t.birth + 1u);
    uint32_t sum = 0;
    for (uint32_t c = 0; c < 2; ++c) {
        int64_t along = 0;
        for (int a = 0; a < 3; ++a) along += said.mean[a] * frame.row[c][a];
        const int32_t guess = said.weights ? int32_t(rounded_division(along, 2 * 16384 * 16 * said.weights)) : 0;
        const uint32_t own = magnitude_class(magnitude(guess)), before = magnitude_class(sum);
        const Contexts context = {16 * (c ? 1 + (sum > 0) : 0) + expected, 7 * at_most(before, 6) + at_most(own, 6),
                                  5 * spread + at_most(length, 4), 6 * spread + at_most(before, 5)};
        int32_t wanted = given ? given[c] : 0;
        if (!change && source && source->flags & track_slips_along && magnitude(wanted - guess) <= slips_along_within)
            wanted = guess < -max_slip ? -max_slip : guess > max_slip ? max_slip : guess;
        const int32_t delta = signed_value(change ? slide_change : sliding, context, wanted - guess);
        sum += magnitude(delta);
        out[c] = guess + delta;
        if (magnitude(out[c]) > uint32_t(max_slip)) {
            reason = "a slip is out of range";
            return false;
        }
    }
    slip_rest_[change] = uint8_t(at_most(sum, 255));
    return true;
}

/// How the liquid slides along the surface: as at the neighbours that live when it does.
template <class Coder>
bool ChunkModel<Coder>::slip(RawTrack& t, const Frame& frame, const RawTrack* source) {
    t.slip[0] = t.slip[1] = t.slip_change[0] = t.slip_change[1] = 0;
    if (drops_ || !(steps_.slip_step > 0)) return true;
    coder_.category(bits_slip);
    const Near near = find_near(distance_, [&](uint32_t slot, uint32_t d) {
        return recent_.birth[slot] <= t.death && t.birth <= recent_.death[slot] ? d : UINT32_MAX;
    });
    if (!slip_values(t, frame, near, false, source, t.slip)) return false;
    slip_rest_[1] = 0;
    if (!steps_.slip_changes || t.death - t.birth + 1u < least_changing_life) return true;
    return slip_values(t, frame, near, true, source, t.slip_change);
}
