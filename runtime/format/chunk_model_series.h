// SPDX-License-Identifier: MIT
// The time coefficients in ChunkModel, included by chunk_model.h inside its namespace.

/// Motion of the neighbours on this track's life, in its channels: their first terms as polynomials, at the speed of
/// their ends beyond them. Its first `terms` terms, if as many are carried.
template <class Coder>
void ChunkModel<Coder>::carry(const RawTrack& t, const Frame& frame, uint32_t terms, const Near& moving) {
    const uint32_t life = t.death - t.birth + 1u;
    terms = at_most(terms, carried_terms);
    const auto* to = polynomials.of(life);
    int64_t weights = 0;
    for (uint32_t j = 0; j < moving.count; ++j) weights += carried_share_[j] = 64 + weight_of(moving, j);
    for (uint32_t j = 0; j < moving.count; ++j) carried_share_[j] = 65536 * carried_share_[j] / weights;
    for (uint32_t j = 0; j < moving.count; ++j) {
        const Track& from = block_.tracks[recent_.track[moving.slot[j]]];
        const auto* at = polynomials.of(from.death - from.birth + 1u);
        const uint32_t known = at_most(from.position_terms - 1u, carried_terms);
        int64_t c[carried_terms][3] = {}, place[3] = {}, sum[carried_terms][3] = {};
        for (uint32_t k = 1; k <= known; ++k)
            for (uint32_t a = 0; a < 3; ++a)
                c[k - 1][a] = load(block_.coefficients + from.first_coefficient + 3 * k + a) * polynomial_sign(k, from.flags);
        for (uint32_t s = 1; s < life; ++s) {
            const int32_t when = t.birth + int32_t(s) - from.birth, last = from.death - from.birth;
            const int32_t end = when < 1 ? 1 : when > last ? last : when;
            for (uint32_t k = 0; k < known; ++k)
                for (int a = 0; a < 3; ++a) place[a] += c[k][a] * (at[end][k] - at[end - 1][k]);
            for (uint32_t k = 0; k < terms; ++k)
                for (int a = 0; a < 3; ++a) sum[k][a] += (place[a] >> 12) * to[s][k];
        }
        const int64_t scale = life_scale(from.death - from.birth + 1u) * 4096 / life_scale(life);  // of its steps to mine
        for (uint32_t k = 0; k < terms; ++k) {
            int64_t v[3];
            for (int a = 0; a < 3; ++a) {
                v[a] = (((sum[k][a] >> 12) / life) * scale >> 12) * polynomial_sign(k + 1, t.flags);
                v[a] = v[a] < -max_mean ? -max_mean : v[a] > max_mean ? max_mean : v[a];
            }
            for (int b = 0; b < 3; ++b) {
                const int64_t turned = (v[0] * frame.row[b][0] + v[1] * frame.row[b][1] + v[2] * frame.row[b][2]) >> 14;
                carried_[j][k][b] = b == 2 || drops_ || t.flags & track_fine ? turned : turned * coarse_scale_ >> 16;
            }
        }
    }
}

/// Of one coefficient of the motion.
template <class Coder>
typename ChunkModel<Coder>::Said ChunkModel<Coder>::said(const Near& moving, uint32_t k, uint32_t channel) const {
    int64_t sum = 0, least = 0, most = 0;
    for (uint32_t j = 0; j < moving.count && k <= carried_terms; ++j) {
        const int64_t x = carried_[j][k - 1][channel];
        sum += carried_share_[j] * x;
        least = j == 0 || x < least ? x : least;
        most = j == 0 || x > most ? x : most;
    }
    const auto size = [](int64_t x) { return at_most(magnitude_class(at_most(uint32_t((x < 0 ? -x : x) / 64), 1u << 20)), 7); };
    Said out;
    out.mean = sum >> 16;
    out.size = size(out.mean);
    out.spread = moving.count == 0 ? 0 : moving.count == 1 ? 1 + at_most(out.size / 3, 1) : 3 + size(most - least);
    return out;
}

/// Sixteen levels of an expected magnitude in 1/16, finer than magnitude_class().
inline constexpr auto residual_levels = [] {
    constexpr uint32_t above[15] = {0, 2, 4, 7, 10, 14, 20, 28, 40, 56, 80, 120, 190, 320, 640};
    std::array<uint8_t, above[14] + 2> levels{};
    for (uint32_t expected = 1; expected < levels.size(); ++expected) levels[expected] = uint8_t(levels[expected - 1] + (expected - 1 == above[levels[expected - 1]]));
    return levels;
}();
inline uint32_t residual_level(uint32_t expected) { return residual_levels[at_most(expected, uint32_t(residual_levels.size() - 1))]; }

/// Contexts of a channel's residual. `others`: magnitudes of this term's channels so far.
template <class Coder>
typename ChunkModel<Coder>::Contexts ChunkModel<Coder>::series_contexts(const RawTrack& t, const Terms& terms, Said about, uint32_t k,
                                                                        uint32_t c, uint32_t others) const {
    const uint32_t r1 = magnitude(terms.previous[c]), r2 = magnitude(terms.before[c]), own = 10 * r1 + 4 * r2 + 6 * others;
    // How large a residual to expect: as the neighbours' of this term, as this track's before, as this term's.
    uint32_t expected = 0;
    if (terms.channels == 3 && k < rest_terms)
        for (uint32_t j = 0; j < terms.moving.count; ++j) expected += recent_.rest[terms.moving.slot[j]][terms.second][k][c];
    expected = (expected * 16 * uint32_t(share[terms.moving.count]) >> 16) + (terms.moving.count ? own / 2 : own);
    const uint32_t fine = t.flags & track_fine ? 1 : 0;
    uint32_t part = !terms.moving.count ? 2 : k > 2 ? 1 : 0;
    if (terms.second && !drops_) {  // normals turn where the motion is, and leave their plane only in fine tracks
        const bool moves = k < t.position_terms;
        const uint32_t along = moves ? magnitude(t.position[k][2]) : 0;
        const uint32_t across = moves ? magnitude(t.position[k][0]) + magnitude(t.position[k][1]) : 0;
        about.size = moves ? 1 + at_most(magnitude_class(along), 6) : 0;
        about.spread = c == 2 ? 8 + fine : moves ? 1 + at_most(magnitude_class(at_most(across, 1u << 20)), 6) : 0;
        if (c == 2) part = 2 - fine;
    } else if (c < 2 && fine) {
        part = 2;
    }
    const uint32_t length = t.death - t.birth;
    return {16 * part + residual_level(expected),
            7 * at_most(magnitude_class(2 * r1 + r2), 6) + at_most(magnitude_class(others), 6),
            3 * about.spread + (length > 2) + (length > 7), 6 * about.size + at_most(magnitude_class(r1 + others), 5)};
}

template <class Coder>
bool ChunkModel<Coder>::term(const RawTrack& t, Terms& terms, uint32_t k, const int32_t* wanted, int32_t* out) {
    uint32_t others = 0;
    int32_t residual[6] = {};
    for (uint32_t i = 0; i < terms.channels; ++i) {
        const uint32_t c = terms.channels == 3 ? (i + 2) % 3 : i;  // along the normal first
        const Kind kind = drops_         ? (terms.second ? drop_shape : drop_path)
                          : terms.second ? (c == 2 ? turn_axis : turn)
                                         : (c == 2 ? normal : tangent);
        const Said about = terms.second ? Said{} : said(terms.moving, k, c);
        Statistics::Trust& trust = learned_.trust[kind][at_most(k, carried_terms)];
        const int32_t guess = int32_t((about.mean * trust.factor + 32768) >> 16);
        const int32_t value = signed_value(kind, series_contexts(t, terms, about, k, c, others), wanted[c] - guess);
        residual[c] = value;
        if (terms.channels == 3 && k < rest_terms) rest_[terms.second][k][c] = uint8_t(at_most(magnitude(value), 255));
        out[c] = value + guess;
        if (magnitude(out[c]) > uint32_t(max_symbol)) {
            reason = "a coefficient is out of range";
            return false;
        }
        others += magnitude(value);
        if (about.mean) trust.learn(out[c], about.mean);
    }
    for (uint32_t c = 0; c < terms.channels; ++c) terms.before[c] = terms.previous[c], terms.previous[c] = residual[c];
    return true;
}

/// The time coefficients of one channel group, term by term.
template <class Coder>
bool ChunkModel<Coder>::series(RawTrack& t, const Frame& frame, bool second, const Near& moving, const RawTrack* source) {
    Terms terms{moving, second, drops_ && second ? 6u : 3u, {}, {}};
    const uint32_t start = drops_ && second ? 0 : 1, group = drops_ * 2u + second, life = t.death - t.birth + 1u;
    const bool drifts = drops_ && !second && life == 1 && steps_.lone_drops_drift;
    const uint32_t limit = drifts ? 2 : most_terms(life, (t.flags & track_cosine) != 0);
    const uint32_t wanted_terms = source ? (second ? source->second_terms : source->position_terms) : 0;
    uint32_t count = start, likely = 0;  // likely: the neighbours' counts for a life as long as this
    for (uint32_t j = 0; j < moving.count; ++j) {
        const Track& other = block_.tracks[recent_.track[moving.slot[j]]];
        likely += 4 * (second ? other.second_terms : other.position_terms) * life / (other.death - other.birth + 1u);
    }
    if (moving.count) likely = (likely + 2 * moving.count) / (4 * moving.count);
    const int32_t none[6] = {};
    for (uint32_t k = start; k < limit; ++k) {
        uint32_t activity = 0, older = 0;
        for (uint32_t c = 0; c < terms.channels; ++c) activity += magnitude(terms.previous[c]), older += magnitude(terms.before[c]);
        const uint32_t place = at_most(k, 11), left = at_most(limit - k - 1, 11);
        const uint32_t expected = moving.count ? 1 + at_most(likely > k ? likely - k : 0, 4) : 0;
        const uint32_t now = at_most(magnitude_class(activity), 5), past = at_most(magnitude_class(older), 4);
        const uint32_t positions = second ? at_most(t.position_terms > k ? t.position_terms - k : 0, 4) : 5;
        if (!bit(learned_.more_mixer[group], &learned_.more[group][0][left * 6 + expected], &learned_.more[group][1][now * 5 + past],
                 &learned_.more[group][2][now * 12 + left], &learned_.more[group][3][positions * 12 + place], wanted_terms > k))
            break;
        count = k + 1;
        if (!second && k == 1) carry(t, frame, limit - 1, moving);
        const int32_t* wanted = source ? (second ? source->second[k] : source->position[k]) : none;
        if (!term(t, terms, k, wanted, second ? t.second[k] : t.position[k])) return false;
    }
    (second ? t.second_terms : t.position_terms) = uint8_t(count < 1 ? 1 : count);
    return true;
}
