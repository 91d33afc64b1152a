// SPDX-License-Identifier: MIT
// The slip of a track in ChunkModel, included by chunk_model.h inside its namespace.

/// How the liquid slides along the surface: as at the neighbours that live when it does.
template <class Coder>
bool ChunkModel<Coder>::slip(RawTrack& t, const Frame& frame, const RawTrack* source) {
    t.slip[0] = t.slip[1] = 0;
    if (drops_ || !(steps_.slip_step > 0)) return true;
    coder_.category(bits_slip);
    const Near near = find_near(distance_, [&](uint32_t slot, uint32_t d) {
        return recent_.birth[slot] <= t.death && t.birth <= recent_.death[slot] ? d : UINT32_MAX;
    });
    int64_t mean[3] = {}, weights = 0;
    uint32_t rest = 0, apart = 0;
    for (uint32_t j = 0; j < near.count; ++j) {
        const int8_t* other = block_.tracks[recent_.track[near.slot[j]]].slip;
        const int8_t* first = block_.tracks[recent_.track[near.slot[0]]].slip;
        const int64_t weight = weight_of(near, j);
        for (int c = 0; c < 3; ++c) mean[c] += weight * other[c], apart += magnitude(other[c] - first[c]);
        weights += weight, rest += recent_.slip_rest[near.slot[j]];
    }
    const uint32_t expected = residual_level(rest * 8 * uint32_t(share[near.count]) >> 16);
    const uint32_t spread = near.count < 2 ? near.count : 2 + at_most(magnitude_class(apart), 5);
    const uint32_t length = magnitude_class(t.death - t.birth + 1u);
    uint32_t sum = 0;
    for (uint32_t c = 0; c < 2; ++c) {
        int64_t along = 0;
        for (int a = 0; a < 3; ++a) along += mean[a] * frame.row[c][a];
        const int32_t guess = weights ? int32_t(rounded_division(along, 2 * 16384 * weights)) : 0;
        const uint32_t own = magnitude_class(magnitude(guess)), before = magnitude_class(sum);
        const Contexts context = {16 * (c ? 1 + (sum > 0) : 0) + expected, 7 * at_most(before, 6) + at_most(own, 6),
                                  5 * spread + at_most(length, 4), 6 * spread + at_most(before, 5)};
        int32_t wanted = source ? source->slip[c] : 0;
        if (source && source->flags & track_slips_along && magnitude(wanted - guess) <= slips_along_within)
            wanted = guess < -max_slip ? -max_slip : guess > max_slip ? max_slip : guess;
        const int32_t delta = signed_value(sliding, context, wanted - guess);
        sum += magnitude(delta);
        t.slip[c] = guess + delta;
        if (magnitude(t.slip[c]) > uint32_t(max_slip)) {
            reason = "a slip is out of range";
            return false;
        }
    }
    slip_rest_ = uint8_t(at_most(sum, 255));
    return true;
}
