"""Kernels of the sound detector: octave powers, their rise, attack and peak.

The octaves are the details of the LeGall 5/3 wavelet, computed by lifting [LeGall1988]_:

    d[i] = x[2i+1] - (x[2i] + x[2i+2]) / 2,      s[i] = x[2i] + (d[i-1] + d[i]) / 4,

and again on s. Each value depends on the samples nearby and on nothing else, so that a stretch
gives the same numbers wherever the record is cut.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._compiled import njit

BLOCK = 128  # frames that share one greatest forward and one least past power
GROUP = 16  # frames that share one noise power
EDGE = 4  # frames beside a stretch that its octave powers depend on
BINS = 64 * 400  # of the histogram of log2(power), 64 an octave from 2**-300
_LEAST_EXPONENT = -300.0


class Scale(NamedTuple):
    """Lengths: in samples, but past, forward and spacing in frames of one hop.

    `before` is how much of a sound is kept before its attack.
    """

    hop: int
    octaves: int
    past: int
    forward: int
    spacing: int
    short_lag: int
    long_lag: int
    slope: int
    reach: int
    before: int


@njit(nogil=True)
def octave_powers(x, octaves, even, odd, high, power):
    """power[b, j]: mean square of the details of octave b (0: the highest) in frame j of x.

    `even`, `odd` and `high` are scratch of half the length of x. The powers of the first and last
    EDGE frames are not those of a longer stretch.
    """
    frames = power.shape[1]
    count = len(x) // 2
    for i in range(count - 1):
        high[i] = x[2 * i + 1] - 0.5 * (x[2 * i] + x[2 * i + 2])
    high[count - 1] = 0.0
    even[0] = x[0]
    for i in range(1, count):
        even[i] = x[2 * i] + 0.25 * (high[i - 1] + high[i])
    for b in range(octaves):
        per = count // frames
        for j in range(frames):
            total = 0.0
            for i in range(j * per, (j + 1) * per):
                total += high[i] * high[i]
            power[b, j] = total / per
        if b == octaves - 1:
            break
        count //= 2
        for i in range(count - 1):
            high[i] = even[2 * i + 1] - 0.5 * (even[2 * i] + even[2 * i + 2])
        high[count - 1] = 0.0
        odd[0] = even[0]
        for i in range(1, count):
            odd[i] = even[2 * i] + 0.25 * (high[i - 1] + high[i])
        even, odd = odd, even


@njit(nogil=True)
def both_sides(power, first, count, scale, after, before):
    """Mean powers over the `forward` frames from each frame on and over the `past` before it."""
    for b in range(power.shape[0]):
        for j in range(count):
            after[b, j] = before[b, j] = 0.0
        for k in range(scale.forward):
            weight = 2.0 * (scale.forward - k) / (scale.forward * (scale.forward + 1.0))
            for j in range(count):
                after[b, j] += weight * power[b, first + j + k]
        for k in range(1, scale.past + 1):
            for j in range(count):
                before[b, j] += power[b, first + j - k]
        for j in range(count):
            before[b, j] /= scale.past


@njit(nogil=True)
def rises(after, before, floor, count, ratio):
    """ratio[j]: product over the octaves of max(1, (after + floor) / (before + floor))."""
    for j in range(count):
        ratio[j] = 1.0
    for b in range(after.shape[0]):
        if floor[b] > 0.0:
            for j in range(count):
                ratio[j] *= max(1.0, (after[b, j] + floor[b]) / (before[b, j] + floor[b]))


@njit(nogil=True)
def survey(x, left, frames, full, octaves_counts, scale, after, before, greatest, least):
    """Both-sided powers of the `frames` frames of a window, their block ranges, and noise counts.

    The window x begins `left` frames before them. Only the first `full` of them are as they would
    be in a longer record, and count as noise.
    `octaves_counts` (octaves, BINS) is added to. Returns the greatest group power of each octave.
    """
    n = len(x)
    total = n // scale.hop
    even, odd, high = np.empty(n // 2), np.empty(n // 2), np.empty(n // 2)
    power = np.empty((scale.octaves, total))
    octave_powers(x, scale.octaves, even, odd, high, power)
    both_sides(power, left, frames, scale, after, before)
    strongest = np.zeros(scale.octaves)
    for b in range(scale.octaves):
        for block in range(-(-frames // BLOCK)):
            top, bottom = 0.0, np.inf
            for j in range(block * BLOCK, min((block + 1) * BLOCK, frames)):
                top, bottom = max(top, after[b, j]), min(bottom, before[b, j])
            greatest[b, block], least[b, block] = top, bottom
        for g in range(full // GROUP):
            mean = 0.0
            for j in range(left + g * GROUP, left + (g + 1) * GROUP):
                mean += power[b, j]
            mean /= GROUP
            strongest[b] = max(strongest[b], mean)
            place = 0
            if mean > 0.0:
                place = int(64.0 * (np.log2(mean) - _LEAST_EXPONENT))
            octaves_counts[b, min(max(place, 0), BINS - 1)] += 1
    return strongest


@njit(nogil=True)
def _is_crest(ratio, j, spacing):
    """No ratio within `spacing` frames is greater, nor one before it as great."""
    for k in range(1, spacing + 1):
        if ratio[j - k] >= ratio[j] or ratio[j + k] > ratio[j]:
            return False
    return True


@njit(nogil=True)
def search(x, left, frames, valid, telling, floor, limits, active, scale, out, sounds):
    """Find the impacts among the `frames` frames of a window and measure their attack and peak.

    Parameters
    ----------
    x : samples from `left` frames before the first frame to as many after the last as D needs
    valid : first and last (exclusive) index of x that is a sample of the record
    telling : first and last (exclusive) frame whose past and forward stretches are complete
    floor : (octaves,) power below which a rise does not count
    limits : (ratio, least power over floor in every octave, least and greatest sample)
    active : for each block of frames, whether to search it
    out : (m, 3), room for attack (index in x, between samples), peak, and whether it is clipped
    sounds : (m, n), room for what is heard about each attack; zeros where that is not all there

    Returns
    -------
    number of impacts found
    """
    hop, spacing = scale.hop, scale.spacing
    margin = scale.past + spacing + EDGE
    ahead = scale.forward + spacing + EDGE
    found = 0
    block, blocks = 0, len(active)
    while block < blocks:
        if not active[block]:
            block += 1
            continue
        begin = block
        while block < blocks and active[block]:
            block += 1
        first, last = begin * BLOCK, min(block * BLOCK, frames)
        a, b = (left + first - margin) * hop, (left + last + ahead) * hop
        n = b - a
        power = np.empty((scale.octaves, n // hop))
        even, odd, high = np.empty(n // 2), np.empty(n // 2), np.empty(n // 2)
        octave_powers(x[a:b], scale.octaves, even, odd, high, power)
        count = last - first + 2 * spacing
        after, before = np.empty((scale.octaves, count)), np.empty((scale.octaves, count))
        both_sides(power, margin - spacing, count, scale, after, before)
        ratio = np.empty(count)
        rises(after, before, floor, count, ratio)
        for j in range(count):
            if not telling[0] <= first + j - spacing < telling[1]:
                ratio[j] = 1.0
        for j in range(spacing, count - spacing):
            if ratio[j] < limits[0] or not _is_crest(ratio, j, spacing):
                continue
            heard = True
            for octave in range(scale.octaves):
                loudest = 0.0
                for k in range(spacing + 1):
                    loudest = max(loudest, after[octave, j + k])
                heard &= loudest >= limits[1] * floor[octave]
            if heard:
                at = (left + first + j - spacing) * hop
                split = attack(x, at, valid, scale)
                out[found, 0] = split - 0.5
                out[found, 1], out[found, 2] = crest(x, split, valid, limits, scale)
                begin_sound = split - scale.before
                earliest = valid[0] + scale.short_lag + scale.slope
                if begin_sound < earliest or begin_sound + sounds.shape[1] > valid[1]:
                    sounds[found] = 0.0
                else:
                    innovations(x, begin_sound, scale.short_lag, scale.slope, sounds[found])
                found += 1
    return found


@njit(nogil=True)
def attack(x, at, valid, scale):
    """First sample after the greatest change of variance near `at`.

    Of the innovations over the short and the long lag, those whose change is the more likely
    count: room noise is weakest in the former, white noise in the latter. `at` itself where the
    variance rises in neither.
    """
    first = max(at - scale.past * scale.hop, valid[0] + scale.long_lag + scale.slope)
    last = min(at + scale.forward * scale.hop, valid[1])
    squares = np.empty(max(last - first, 0))
    innovations(x, first, scale.short_lag, scale.slope, squares)
    square(squares)
    short_split, short_gain = variance_change(squares, at - first, scale.reach)
    innovations(x, first, scale.long_lag, scale.slope, squares)
    square(squares)
    long_split, long_gain = variance_change(squares, at - first, scale.reach)
    return first + (short_split if short_gain >= long_gain else long_split)


@njit(nogil=True)
def innovations(x, first, lag, slope, out):
    """What a straight line through two earlier samples leaves of those from `first` on.

    y[i] = x[i] - x[i - lag] - lag / slope (x[i - lag] - x[i - lag - slope]): hum is straight.
    """
    share = lag / slope
    for k in range(len(out)):
        i = first + k
        out[k] = x[i] - (1.0 + share) * x[i - lag] + share * x[i - lag - slope]


@njit(nogil=True)
def square(values):
    """Square them, in place."""
    for k in range(len(values)):
        values[k] *= values[k]


@njit(nogil=True)
def variance_change(squares, at, reach):
    """The split k of N squares at most `reach` from `at` after which they are greater [Maeda1985]_.

    That which makes AIC(k) = k ln mean(squares[:k]) + (N - k) ln mean(squares[k:]) least; and by
    how much that is less than N ln mean(squares). (at, -1) where the mean rises nowhere.
    """
    count = len(squares)
    total = 0.0
    for k in range(count):
        total += squares[k]
    split, gain = at, -1.0
    if total == 0.0:
        return split, gain
    whole, least = count * np.log(total / count), 1e-12 * total / count
    head = 0.0
    for k in range(1, min(count, at + reach + 1)):
        head += squares[k - 1]
        if k < at - reach:
            continue
        before = max(head / k, least)
        after = max((total - head) / (count - k), least)
        if after > before:
            gained = whole - k * np.log(before) - (count - k) * np.log(after)
            if gained > gain:
                split, gain = k, gained
    return split, gain


@njit(nogil=True)
def crest(x, split, valid, limits, scale):
    """Greatest deviation, in the forward stretch, from the mean before; 1.0 if it is clipped.

    It is clipped if two samples in a row lie at the least or greatest sample of the record.
    """
    i0 = max(split - scale.past * scale.hop, valid[0])
    base = 0.0
    for i in range(i0, split):
        base += x[i]
    base /= max(split - i0, 1)
    greatest, clipped, before = 0.0, 0.0, False
    for i in range(split, min(split + scale.forward * scale.hop, valid[1])):
        greatest = max(greatest, abs(x[i] - base))
        extreme = x[i] <= limits[2] or x[i] >= limits[3]
        if extreme and before:
            clipped = 1.0
        before = extreme
    return greatest, clipped
