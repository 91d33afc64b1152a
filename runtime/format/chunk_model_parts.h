// SPDX-License-Identifier: MIT
// The parts of ChunkModel, included by chunk_model.h inside its namespace.

/// How many of the box's points lie in its lower half.
template <class Coder>
uint32_t ChunkModel<Coder>::split_count(uint32_t n, uint32_t value) {
    if (n <= 8) {  // unary from the bottom: P(value = v | value ≥ v)
        uint32_t v = 0;
        while (v < n && bit(learned_.split_small[n][v], value > v)) ++v;
        return v;
    }
    uint32_t size = 0;
    while (n >> size > 8) ++size;
    size = at_most(size, 15);
    if (bit(learned_.split_empty[0][size], value == 0)) return 0;
    if (bit(learned_.split_empty[1][size], value == n)) return n;
    // A sixteenth of the range, then what is left at even odds.
    const uint64_t range = n - 1;  // values 1 … n − 1
    const uint32_t part =
        tree(learned_.split_tree[at_most(size, 7)], 4, uint32_t((uint64_t(value - 1) * 16) / range) & 15);
    const uint32_t low = uint32_t((part * range + 15) / 16), high = uint32_t(((part + 1) * range + 15) / 16);
    uint32_t bits = 0;
    while (1u << bits < high - low) ++bits;
    const uint32_t rest = raw(bits, value - 1 - low);
    return 1 + at_most(low + rest, n - 2);
}

/// Places are searched in units so coarse that differences of any two fit 16 bits.
template <class Coder>
void ChunkModel<Coder>::begin_search(const int32_t (&low)[3], const uint8_t (&bits)[3]) {
    recent_.count = 0, search_shift_ = 0;
    for (int c = 0; c < 3; ++c) {
        search_low_[c] = int64_t(low[c]) * steps_.ratio;
        while ((int64_t(steps_.ratio) << bits[c]) >> search_shift_ > 8192) ++search_shift_;
    }
}

template <class Coder>
void ChunkModel<Coder>::coarse_place(const int64_t (&x)[3], int16_t (&out)[3]) const {
    for (int c = 0; c < 3; ++c) {
        const int64_t place = (x[c] - search_low_[c]) >> search_shift_;
        out[c] = int16_t(place < -8192 ? -8192 : place > 16383 ? 16383 : place);
    }
}

template <class Coder>
void ChunkModel<Coder>::remember(uint32_t index, const RawTrack& t, const Frame& frame) {
    const uint32_t slot = (index - first_) % window;
    const float* at = block_.coefficients + block_.tracks[index].first_coefficient;
    int64_t mean[3];
    int16_t place[3];
    for (int c = 0; c < 3; ++c) {
        mean[c] = recent_.mean[slot][c] = load(at + c);
        recent_.normal[slot][c] = int16_t(frame.row[2][c]);
    }
    coarse_place(mean, place);
    for (int c = 0; c < 3; ++c) recent_.place[c][slot] = place[c];
    recent_.birth[slot] = t.birth, recent_.death[slot] = t.death;
    recent_.track[slot] = index;
    std::memcpy(recent_.rest[slot], rest_, sizeof rest_);
    for (int i = 0; i < 2; ++i) recent_.slip_rest[i][slot] = slip_rest_[i];
    if (recent_.count < window) ++recent_.count;
}

/// Distances from x to all that is remembered.
template <class Coder>
void ChunkModel<Coder>::measure(const int64_t (&x)[3]) {
    int16_t from[3];
    coarse_place(x, from);
    for (uint32_t i = 0; i < recent_.count; ++i) {
        const int16_t a = int16_t(from[0] - recent_.place[0][i]), b = int16_t(from[1] - recent_.place[1][i]),
                      c = int16_t(from[2] - recent_.place[2][i]);
        distance_[i] = uint32_t(int32_t(a) * a + int32_t(b) * b + int32_t(c) * c);
    }
}

/// The nearest by score(slot, distance), which is no less than the distance, ties by slot; UINT32_MAX: never.
template <class Coder>
template <class Score>
typename ChunkModel<Coder>::Near ChunkModel<Coder>::find_near(const uint32_t (&distance)[window], const Score& score) const {
    Near near;
    uint32_t limit = UINT32_MAX;
    for (uint32_t i = 0; i < recent_.count; ++i) {
        if (distance[i] >= limit) continue;
        const uint32_t d = score(i, distance[i]);
        if (d >= limit) continue;
        uint32_t at = near.count < nearest ? near.count++ : nearest - 1;
        for (; at > 0 && d < near.distance[at - 1]; --at)
            near.distance[at] = near.distance[at - 1], near.slot[at] = near.slot[at - 1];
        near.distance[at] = d, near.slot[at] = i;
        if (near.count == nearest) limit = near.distance[nearest - 1];
    }
    return near;
}

/// Those whose motion says most about a life: that live, and move, through half of it at least, and the more the two lives share the better.
/// (The nearest that move at any time: +1.6 % bytes (dam_break), +2.1 % (drop_splash), +.9 % (pour_sphere); through half of it, however
/// much: +.3, +.6, +.2 %.)
template <class Coder>
typename ChunkModel<Coder>::Near ChunkModel<Coder>::find_moving(uint8_t birth, uint8_t death) const {
    const uint8_t life = uint8_t(death - birth + 1), least = uint8_t((life + 1) / 2);
    // Which are ruled out, all at once and in bytes: asked one by one, half of them are, at random.
    uint8_t shared[window], ruled_out[window];
    uint32_t distance[window];
    for (uint32_t i = 0; i < window; ++i) {
        const uint8_t from = recent_.birth[i] > birth ? recent_.birth[i] : birth, to = recent_.death[i] < death ? recent_.death[i] : death;
        shared[i] = uint8_t(to - from + 1);
        const bool out = (to < from) | (shared[i] < least) | (recent_.birth[i] == recent_.death[i]);
        ruled_out[i] = out ? 255 : 0;
    }
    for (uint32_t i = 0; i < window; ++i) distance[i] = distance_[i] | uint32_t(int32_t(int8_t(ruled_out[i])));
    return find_near(distance, [&](uint32_t slot, uint32_t d) -> uint32_t {
        const uint32_t from = recent_.birth[slot] < birth ? recent_.birth[slot] : birth, to = recent_.death[slot] > death ? recent_.death[slot] : death;
        const uint64_t score = d * uint64_t(life * (to - from + 1)) / (uint32_t(shared[slot]) * shared[slot]);
        return score < UINT32_MAX ? uint32_t(score) : UINT32_MAX - 1;
    });
}

/// Which half of a box its only point is in: where the planes of the nearest points pass.
template <class Coder>
uint32_t ChunkModel<Coder>::leaf_bit(const Box& box, uint32_t dimension, const Planes& planes, uint32_t value) {
    const uint32_t level = box.bits[dimension];
    const int64_t quarter =
        (int64_t(steps_.ratio) << level) / 4;  // from the centre to that of a half, step/16
    uint32_t side = 0, steep = 0, far = 0, away = 0;
    if (planes.count) {
        int64_t centre[3], height = -planes.height;
        for (int c = 0; c < 3; ++c) {
            centre[c] = (2 * int64_t(box.low[c]) + (int64_t(1) << box.bits[c]) - 1) * steps_.ratio / 2;
            height += centre[c] * planes.normal[c];
        }
        /// round(a / b) counted up to `most`, without dividing.
        const auto steps = [](int64_t a, int64_t b, int32_t most) {
            int32_t count = 0;
            for (int32_t j = 1; j <= most; ++j) count += 2 * a >= (2 * j - 1) * b;
            return count;
        };
        const int64_t slope = planes.normal[dimension], steepness = slope < 0 ? -slope : slope;
        steep = (steepness > 3000 * int64_t(planes.count)) + (steepness > 8000 * int64_t(planes.count)) +
                (steepness > 13000 * int64_t(planes.count));
        // The plane crosses this axis at −height / slope from the centre.
        int32_t crossing = 0;
        if (steepness >= 500 * int64_t(planes.count))
            crossing = steps(2 * (height < 0 ? -height : height), steepness * quarter, 6);
        side = uint32_t((height < 0) == (slope < 0) ? 6 - crossing : 6 + crossing);
        const int64_t offset = planes.first[dimension] - centre[dimension];
        const int32_t apart = steps(2 * (offset < 0 ? -offset : offset), quarter, 4);
        away = uint32_t(offset < 0 ? 4 - apart : 4 + apart);
        const uint64_t unit = uint64_t(quarter >> search_shift_) * uint64_t(quarter >> search_shift_) + 1;
        for (uint32_t j = 0; j < 5; ++j) far += planes.distance > (8 * unit) << 2 * j;
    }
    const uint32_t low = at_most(level, 6) - 1;
    return bit(learned_.leaf_mixer[dimension], &learned_.leaf[0][steep * 13 + side],
               &learned_.leaf[1][side * 6 + low], &learned_.leaf[2][side * 6 + far],
               &learned_.leaf[3][away * 6 + far], value);
}

/// The remaining bits of a box with one point, largest dimension first.
template <class Coder>
void ChunkModel<Coder>::leaf(Box& box, const RawTrack* source) {
    Planes planes;
    if (!drops_) {
        int64_t centre[3];
        for (int c = 0; c < 3; ++c)
            centre[c] = (2 * int64_t(box.low[c]) + (int64_t(1) << box.bits[c]) - 1) * steps_.ratio / 2;
        measure(centre);
        const Near near = find_near(distance_, [](uint32_t, uint32_t d) { return d; });
        planes.count = near.count;
        for (uint32_t j = 0; j < near.count; ++j)
            for (int c = 0; c < 3; ++c) {
                const int64_t n = recent_.normal[near.slot[j]][c], y = recent_.mean[near.slot[j]][c];
                planes.height += y * n, planes.normal[c] += n;
                if (j == 0) planes.first[c] = y;
            }
        if (near.count) planes.distance = near.distance[0];
    }
    for (;;) {
        uint32_t d = 0;
        for (uint32_t c = 1; c < 3; ++c)
            if (box.bits[c] > box.bits[d]) d = c;
        if (box.bits[d] == 0) return;
        const int32_t half = 1 << (box.bits[d] - 1);
        const uint32_t upper = leaf_bit(box, d, planes, source ? source->lattice[d] >= box.low[d] + half : 0);
        if (upper) box.low[d] += half;
        --box.bits[d];
    }
}

/// When a track is born (`which` 0) or dies (1; 2 if it was born in the window): sample by sample from `from`, is it then? `last` is what
/// is left. Often it is when a neighbour is born, or dies, or where one takes over from the other.
template <class Coder>
uint32_t ChunkModel<Coder>::moment(uint32_t which, uint32_t from, uint32_t last, const Near& near, uint32_t wanted) {
    const uint32_t death = which > 0;
    Counter(&counters)[Mixer::inputs][Statistics::life_contexts] = learned_.life[death];
    uint32_t s = from;
    for (; s < last; ++s) {
        uint32_t same = 0, meets = 0, away[2] = {7, 7};
        for (uint32_t j = 0; j < near.count; ++j) {
            const Track& other = block_.tracks[recent_.track[near.slot[j]]];
            const int32_t its = int32_t(death ? other.death : other.birth) - int32_t(s);
            const int32_t end = int32_t(death ? other.birth : other.death) - int32_t(s);
            same += its == 0, meets += end >= -1 && end <= 1;
            if (j < 2) away[j] = uint32_t((its < -3 ? -3 : its > 3 ? 3 : its) + 3);
        }
        const uint32_t done = s - from, left = at_most(last - s, 7);
        if (bit(learned_.life_mixer[death], &counters[0][128 * (which == 2) + done], &counters[1][8 * away[0] + away[1]],
                &counters[2][32 * same + 8 * meets + left], &counters[3][8 * at_most(done, 15) + away[0]], wanted == s))
            break;
    }
    return s;
}

/// Birth, death, flags.
template <class Coder>
void ChunkModel<Coder>::life(RawTrack& t, const Near& near, const RawTrack* source) {
    const Track* like = near.count ? &block_.tracks[recent_.track[near.slot[0]]] : nullptr;
    const uint32_t last = samples_ - 1, set = drops_ ? 6 : 0;
    const uint32_t context = like ? 1 + (like->flags & 3) : 0;
    t.flags = 0;
    const uint32_t wanted = source ? source->flags : 0;
    if (bit(learned_.flag[0][set + context], wanted & track_born)) t.flags |= track_born;
    if (bit(learned_.flag[1][set + context], (wanted & track_dies) != 0)) t.flags |= track_dies;
    const bool born = t.flags & track_born, dies = t.flags & track_dies;
    const bool from_start = !born && bit(learned_.at_border[0], source && source->birth == 0);
    t.birth = uint8_t(from_start ? 0 : moment(0, 0, last, near, source ? source->birth : 0));
    const bool to_end = !dies && bit(learned_.at_border[1], source && source->death == last);
    t.death = uint8_t(to_end ? last : moment(1 + born, t.birth, last, near, source ? source->death : 0));
    const uint32_t length = t.death - t.birth + 1u;
    if (length > 2 && bit(learned_.cosine[like && like->flags & track_cosine][at_most(length, 15)], (wanted & track_cosine) != 0))
        t.flags |= track_cosine;
    if (!drops_ && bit(learned_.fine, (wanted & track_fine) != 0)) t.flags |= track_fine;
}

/// Mean normal, against that of the nearest tracks, in the half of the octahedron theirs is in.
template <class Coder>
bool ChunkModel<Coder>::axis(RawTrack& t, const Near& near, const RawTrack* source) {
    int64_t sum[3] = {0, 0, 1};
    uint32_t spread = 0;
    for (uint32_t j = 0; j < near.count; ++j) {
        const int16_t* n = recent_.normal[near.slot[j]];
        const int64_t weight = weight_of(near, j);
        for (int c = 0; c < 3; ++c) sum[c] += weight * n[c];
        if (j == 1) {
            int64_t difference = 0;
            for (int c = 0; c < 3; ++c) {
                const int64_t d = n[c] - recent_.normal[near.slot[0]][c];
                difference += d * d;
            }
            const int64_t unit = int64_t(16384 / levels_) * (16384 / levels_) / 2 + 1;
            for (uint32_t k = 0; k < 6; ++k) spread += difference >= unit << 2 * k;
        }
    }
    spread = near.count < 2 ? 0 : 1 + spread;
    const bool below = sum[2] < 0;
    if (below) sum[2] = -sum[2];
    int32_t guess[2], wanted[2] = {0, 0};
    nearest_axis(sum, levels_, guess);
    const auto flip = [&](int32_t(&a)[2]) {  // mirrors the direction in z = 0: exact on the integers
        const int32_t u = (levels_ - int32_t(magnitude(a[1]))) * (a[0] < 0 ? -1 : 1);
        a[1] = (levels_ - int32_t(magnitude(a[0]))) * (a[1] < 0 ? -1 : 1);
        a[0] = u;
    };
    if (source) wanted[0] = source->axis[0], wanted[1] = source->axis[1];
    if (below && source) flip(wanted);
    uint32_t previous = 0;
    for (uint32_t c = 0; c < 2; ++c) {
        const Contexts context = {c, spread, 8 * c + spread, 6 * c + at_most(magnitude_class(previous), 5)};
        const int32_t delta = signed_value(axis_delta, context, wanted[c] - guess[c]);
        previous = magnitude(delta);
        t.axis[c] = guess[c] + delta;
        if (magnitude(t.axis[c]) > uint32_t(levels_)) return false;
    }
    if (below) flip(t.axis);
    return true;
}

/// From the lattice point to the surface: a circle through a neighbour whose two normals are known.
template <class Coder>
void ChunkModel<Coder>::along_axis(RawTrack& t, const Frame& frame, const Near& near,
                                   const RawTrack* source) {
    int64_t guess = 0, weights = 0, least = 0, most = 0;
    for (uint32_t j = 0; j < near.count; ++j) {
        int64_t height = 0, along = 0;
        for (int c = 0; c < 3; ++c) {
            const int64_t both = frame.row[2][c] + recent_.normal[near.slot[j]][c];
            height += (recent_.mean[near.slot[j]][c] - int64_t(t.lattice[c]) * steps_.ratio) * both;
            along += frame.row[2][c] * both;
        }
        along >>= 14;
        if (along < 8000) continue;                              // more than about 120° apart: another sheet
        const int64_t offset = rounded_division(height, along);  // step/16
        const int64_t weight = weight_of(near, j);
        guess += weight * offset, weights += weight;
        least = weights == weight || offset < least ? offset : least;
        most = weights == weight || offset > most ? offset : most;
    }
    guess = weights ? rounded_division(guess, weights) : 0;
    const int64_t reach = steps_.ratio;  // the nearest lattice point is nearer than this
    const bool wild = guess > reach || guess < -reach;
    if (wild) guess = 0;
    const int32_t likely = int32_t(rounded_division(guess * 256, life_scale(t.death - t.birth + 1u)));
    const int64_t range = (most - least) / 8;
    const uint32_t spread =
        wild || !weights ? 0 : 1 + at_most(magnitude_class(range < 1000 ? uint32_t(range) : 1000), 6);
    const Contexts context = {spread,
                              uint32_t(likely < -8  ? 0
                                       : likely > 8 ? 16
                                                    : likely + 8),
                              at_most(near.count, 3) * 8 + spread, 0};
    t.position[0][2] = likely + signed_value(along, context, source ? source->position[0][2] - likely : 0);
    for (uint32_t c = 0; c < 2; ++c)
        t.position[0][c] = t.flags & track_fine
                               ? signed_value(along, {8 + c, 20, 33, 1}, source ? source->position[0][c] : 0)
                               : 0;
}

template <class Coder>
bool ChunkModel<Coder>::track(uint32_t index, const Box& box, const RawTrack* source) {
    RawTrack t;
    coder_.category(drops_ ? bits_drops : bits_structure);
    int64_t x[3];
    for (int c = 0; c < 3; ++c) {
        t.lattice[c] = box.low[c];
        x[c] = int64_t(box.low[c]) * steps_.ratio;
        t.position[0][c] = t.second[0][c] = t.second[0][c + 3] = 0;
    }
    measure(x);
    const Near near = find_near(distance_, [](uint32_t, uint32_t d) { return d; });
    life(t, near, source);
    levels_ = axis_levels(steps_, t.death - t.birth + 1u);
    Frame frame = identity_frame;
    t.axis[0] = t.axis[1] = 0;
    if (drops_) {
        for (uint32_t c = 0; c < 3; ++c)
            t.position[0][c] = signed_value(drop_path, {0, 0, 0, 0}, source ? source->position[0][c] : 0);
    } else {
        coder_.category(bits_first);
        if (!axis(t, near, source)) {
            reason = "a normal is out of range";
            return false;
        }
        frame = frame_of(t.axis, levels_);
        along_axis(t, frame, near, source);
    }
    std::memset(rest_, 0, sizeof rest_);
    const Near moving = find_moving(t.birth, t.death);
    if (!drops_) coder_.category(bits_motion);
    if (!series(t, frame, false, moving, source)) return false;
    if (!drops_) coder_.category(bits_normals);
    if (!series(t, frame, true, moving, source)) return false;
    if (!slip(t, frame, source)) return false;
    const uint32_t size = coefficients_of(t, drops_);
    if (size > block_.coefficient_count - used_) {
        reason = "more coefficients than the directory says";
        return false;
    }
    if (!place_track(t, steps_, drops_, block_, index, used_)) {
        reason = "a value is out of range";
        return false;
    }
    used_ += size;
    remember(index, t, frame);
    return true;
}

template <class Coder>
template <class Source>
bool ChunkModel<Coder>::code_set(bool drops, uint32_t first, uint32_t count, const int32_t (&low)[3],
                                 const uint8_t (&bits)[3], const Source& source) {
    drops_ = drops, first_ = first, done_ = 0;
    if (count == 0) return true;
    begin_search(low, bits);
    Box stack[3 * 31 + 2];
    uint32_t height = 0;
    stack[height++] = {{low[0], low[1], low[2]}, {bits[0], bits[1], bits[2]}, count};
    while (height > 0) {
        Box box = stack[--height];
        coder_.category(drops ? bits_drops : bits_births);
        if (coder_.exhausted()) {
            reason = "the chunk ends too early";
            return false;
        }
        uint32_t d = 0;
        for (uint32_t c = 1; c < 3; ++c)
            if (box.bits[c] > box.bits[d]) d = c;
        if (box.count == 1 || box.bits[d] == 0) {
            if (box.count == 1) leaf(box, source(done_));
            for (; box.count > 0; --box.count) {
                if (coder_.exhausted()) break;
                if (!track(first_ + done_, box, source(done_))) return false;
                ++done_;
            }
            continue;
        }
        const int32_t half = 1 << (box.bits[d] - 1);
        uint32_t below = 0;
        if (source(done_))
            while (below < box.count && source(done_ + below)->lattice[d] < box.low[d] + half) ++below;
        below = split_count(box.count, below);
        --box.bits[d];
        Box upper = box;
        upper.low[d] += half;
        upper.count = box.count - below, box.count = below;
        if (upper.count) stack[height++] = upper;  // depth first, lower half first: Morton order
        if (box.count) stack[height++] = box;
    }
    if (done_ != count) {
        reason = "the chunk ends too early";
        return false;
    }
    return true;
}
