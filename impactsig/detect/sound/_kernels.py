"""Kernels of the sound detector: octave powers, rise, attack and peak.

The octaves are the details of the LeGall 5/3 wavelet, computed by lifting [LeGall1988]_:

    d[i] = x[2i+1] - (x[2i] + x[2i+2]) / 2,      s[i] = x[2i] + (d[i-1] + d[i]) / 4,

and again on s. Each value depends on the samples nearby and on nothing else, so that a stretch
gives the same numbers wherever the record is cut.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, njit
from ._lane_kernels import logarithms

BLOCK = 128  # frames that share one background
GROUP = 16  # frames that share one power that the background is read from
DEPENDENT = 0.9  # times how many dependent squares hold what one independent one does
MOST_TOGETHER, JUMP = 0.6, 5.0  # power of dependent ones, at most, and jump [neper] that halves it
CLEAR = 0.03  # share of the greatest power at which a sound is no longer a filter's ringing
CHANGES = 50  # of a sample to the next, that show the step of a converter
_NONE, _ONE, _TWO, _FOUR = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(4)
SIDE_BY_SIDE = 64  # samples that are looked at in vector lanes
LAGS = 8  # that are summed in vector lanes
TOGETHER = 512  # frames whose sums stay in the nearest memory
EDGE = 4  # frames beside a stretch that its octave powers depend on


class Scale(NamedTuple):
    """Lengths of the detector in samples; past, forward and spacing in frames.

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


@allocating
def octave_powers(x, octaves, even, odd, high, power):
    """power[b, j]: mean square of the details of octave b (0: the highest) in frame j of x.

    `even`, `odd` and `high` are scratch of half the length of x. The powers of the first and last
    EDGE frames are not those of a longer stretch.
    """
    frames = power.shape[1]
    count = len(x) // 2
    halve(x, high[:count], even[:count])
    for b in range(octaves):
        mean_squares(high, count // frames, power[b])
        if b == octaves - 1:
            break
        count //= 2
        halve(even, high[:count], odd[:count])
        even, odd = odd, even


@allocating
def mean_squares(values, per, out):
    """Means of the squares of each `per` values, added in sequence.

    A few usual numbers are written out, so that they run in vector lanes.
    """
    v = values
    if per == 2:
        for j in range(_NONE, np.uint64(len(out))):
            i = _TWO * j
            out[j] = (v[i] * v[i] + v[i + _ONE] * v[i + _ONE]) / per
    elif per == 4:
        for j in range(_NONE, np.uint64(len(out))):
            i = _FOUR * j
            k = i + _TWO
            first = v[i] * v[i] + v[i + _ONE] * v[i + _ONE]
            out[j] = (first + v[k] * v[k] + v[k + _ONE] * v[k + _ONE]) / per
    else:
        for j in range(len(out)):
            total = 0.0
            for i in range(j * per, (j + 1) * per):
                total += v[i] * v[i]
            out[j] = total / per


@njit(nogil=True)
def part_means(power, first, groups, per, real, parts, counted, silent):
    """Mean powers of `per` frames each, in so many GROUPs from frame `first` on.

    silent[g]: whether all power of GROUP g - 2 is 0, two before and two after them included;
    counted[i]: whether the frames of part i lie between those of `real` and no silence touches
    them. `per` is 8.
    """
    octaves, each = power.shape[0], GROUP // per
    for g in range(groups + 4):
        at = first + (g - 2) * GROUP
        silent[g] = real[0] <= at and at + GROUP <= real[1]
        for b in range(octaves):
            if silent[g]:
                for j in range(at, at + GROUP):
                    if power[b, j] != 0.0:
                        silent[g] = False
                        break
    for b in range(octaves):
        for i in range(groups * each):
            p = power[b, first + i * per : first + (i + 1) * per]
            total = ((p[0] + p[1]) + (p[2] + p[3])) + ((p[4] + p[5]) + (p[6] + p[7]))
            parts[b, i] = total / per
    for i in range(groups * each):
        g, at = 2 + i // each, first + i * per
        counted[i] = real[0] <= at and at + per <= real[1]
        counted[i] &= not (silent[g - 1] or silent[g] or silent[g + 1])


@njit(nogil=True)
def halve(x, high, low):
    """Haar details and sums of pairs of samples.

    Indices are unsigned: signed ones, which may count from the end, keep loops out of vector lanes.
    """
    count = np.uint64(len(high))
    for i in range(_NONE, count - _ONE):
        j = _TWO * i
        high[i] = x[j + _ONE] - 0.5 * (x[j] + x[j + _TWO])
    high[count - _ONE] = 0.0
    low[0] = x[0]
    for i in range(_ONE, count):
        low[i] = x[_TWO * i] + 0.25 * (high[i - _ONE] + high[i])


@njit(nogil=True)
def both_sides(power, first, count, scale, after, before):
    """Mean powers over `forward` frames from each frame on, and over `past` before it."""
    weights = 2.0 * np.arange(scale.forward, 0, -1) / (scale.forward * (scale.forward + 1.0))
    for b in range(power.shape[0]):
        for begin in range(0, count, TOGETHER):
            size, at = min(TOGETHER, count - begin), first + begin
            later, earlier = after[b, begin : begin + size], before[b, begin : begin + size]
            later[:] = 0.0
            earlier[:] = 0.0
            # Frame by frame in the inner loop: it runs in vector lanes; four at a time.
            k = 0
            while k + 4 <= scale.forward:
                w0, w1, w2, w3 = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
                row = power[b, at + k : at + k + size + 3]
                for j in range(size):
                    first_two = later[j] + w0 * row[j] + w1 * row[j + 1]
                    later[j] = first_two + w2 * row[j + 2] + w3 * row[j + 3]
                k += 4
            while k < scale.forward:
                row = power[b, at + k : at + k + size]
                for j in range(size):
                    later[j] += weights[k] * row[j]
                k += 1
            k = 1
            while k + 3 <= scale.past:
                row = power[b, at - k - 3 : at - k + size]
                for j in range(size):
                    earlier[j] = earlier[j] + row[j + 3] + row[j + 2] + row[j + 1] + row[j]
                k += 4
            while k <= scale.past:
                row = power[b, at - k : at - k + size]
                for j in range(size):
                    earlier[j] += row[j]
                k += 1
            for j in range(size):
                earlier[j] /= scale.past


@njit(nogil=True)
def octave_rise(after, before, background, weights, out):
    """out[j]: mean over the octaves of max(0, ln(after / max(before, 2 background))).

    `background` holds a power for each octave and each BLOCK of frames.
    """
    count = after.shape[1]
    ratio = np.empty(BLOCK)
    out[:] = 0.0
    for begin in range(0, count, BLOCK):
        size = min(BLOCK, count - begin)
        for b in range(after.shape[0]):
            least = 2.0 * background[b, begin // BLOCK]
            now, then = after[b, begin : begin + size], before[b, begin : begin + size]
            # What needs no logarithm runs in vector lanes.
            for j in range(size):
                base = then[j] if then[j] > least else least
                ratio[j] = now[j] / base if now[j] > base > 0.0 else 1.0
            for j in range(size):
                if ratio[j] > 1.0:
                    out[begin + j] += weights[b] * np.log(ratio[j])


@allocating
def loudness(after, background, weights, frames, out):
    """out[k]: mean over the octaves of max(0, ln(after / 2 background)) at frames[k]."""
    for k in range(len(frames)):
        j = frames[k]
        total = 0.0
        for b in range(after.shape[0]):
            level = 2.0 * background[b, j // BLOCK]
            if after[b, j] > level > 0.0:
                total += weights[b] * np.log(after[b, j] / level)
        out[k] = total


@njit(nogil=True)
def extremes(x):
    """Least and greatest sample, and the least nonzero difference of two in a row.

    That is infinite if hardly any differ.
    """
    changes, done = 0, 1
    steps = np.full(SIDE_BY_SIDE, np.inf)
    low, high = np.full(SIDE_BY_SIDE, np.float64(x[0])), np.full(SIDE_BY_SIDE, np.float64(x[0]))
    for i in range(1, len(x) - SIDE_BY_SIDE + 1, SIDE_BY_SIDE):
        now, before = x[i : i + SIDE_BY_SIDE], x[i - 1 : i - 1 + SIDE_BY_SIDE]
        for k in range(SIDE_BY_SIDE):
            value = np.float64(now[k])
            step = abs(value - before[k])
            changes += step > 0.0
            steps[k] = step if 0.0 < step < steps[k] else steps[k]
            low[k] = value if value < low[k] else low[k]
            high[k] = value if value > high[k] else high[k]
        done = i + SIDE_BY_SIDE
    step, least, greatest = steps.min(), low.min(), high.max()
    for i in range(done, len(x)):
        value = np.float64(x[i])
        least, greatest = min(least, value), max(greatest, value)
        away = abs(value - x[i - 1])
        if away > 0.0:
            changes += 1
            step = min(step, away)
    return least, greatest, step if changes >= CHANGES else np.inf


@njit(nogil=True)
def crests(rise, spacing, least, first, last, out):
    """Frames first <= j < last with a rise of at least `least` that is a local maximum.

    No rise within `spacing` frames is greater, nor one before it as great. Returns their number.
    """
    found = 0
    for j in range(first, last):
        if rise[j] < least or rise[j] == 0.0:
            continue
        greatest = True
        for k in range(1, spacing + 1):
            if rise[j - k] >= rise[j] or rise[j + k] > rise[j]:
                greatest = False
                break
        if greatest:
            out[found] = j
            found += 1
    return found


@njit(nogil=True)
def greatest_between(values, first, last, out):
    """out[k]: index of the maximum of values[first[k] : last[k]]; -1 if empty."""
    for k in range(len(out)):
        out[k] = -1
        for i in range(first[k], last[k]):
            if out[k] < 0 or values[i] > values[out[k]]:
                out[k] = i


@njit(nogil=True)
def greatest_about(place, height, reach, queue, out):
    """out[k]: the greatest height from place[k] - reach to before place[k] + reach, and at it.

    Places ascend. `queue`, with room for all, holds those ahead that no later one exceeds.
    """
    first = last = end = 0
    for k in range(len(place)):
        while end < len(place) and (place[end] < place[k] + reach or end == k):
            while last > first and height[queue[last - 1]] <= height[end]:
                last -= 1
            queue[last] = end
            last += 1
            end += 1
        while place[queue[first]] < place[k] - reach:
            first += 1
        out[k] = height[queue[first]]


@njit(nogil=True)
def ranked_between(order, first, last, rank, tree, out):
    """out[k]: index of the rank[k]-th least of the values first[k] to last[k]; -1 if there is none.

    `order` sorts all values. Neither `first` nor `last` falls. `tree`, zeros, one more than there
    are values, counts those in the window by their place in the order (a binary indexed tree).
    """
    count, begin, end = len(order), 0, 0
    place = np.empty(count, np.int64)
    for r in range(count):
        place[order[r]] = r
    top = 1
    while 2 * top <= count:
        top *= 2
    for k in range(len(out)):
        while end < last[k]:
            add_count(tree, place[end], 1)
            end += 1
        while begin < min(first[k], end):
            add_count(tree, place[begin], -1)
            begin += 1
        out[k] = -1
        if 0 <= rank[k] < end - begin:
            left, at, step = rank[k], 0, top
            while step > 0:
                if at + step <= count and tree[at + step] <= left:
                    at += step
                    left -= tree[at]
                step //= 2
            out[k] = order[at]


@njit(nogil=True)
def add_count(tree, place, one):
    """Count a value more or less at this place."""
    k = place + 1
    while k < len(tree):
        tree[k] += one
        k += k & -k


@njit(nogil=True)
def as_high_near(height, asked, first, last, share, out):
    """out[k]: how many others of height[first[k] : last[k]] exceed share * height[asked[k]]."""
    for k in range(len(asked)):
        own = height[asked[k]]
        level, near = share * own, height[first[k] : last[k]]
        count = 0
        for i in range(len(near)):  # without a branch: it runs in vector lanes
            count += near[i] > level
        out[k] = count - (own > level)


@allocating
def measure(x, places, valid, limits, scale, out, sounds):
    """Attack and peak of the impacts at `places`, and the sound around each.

    Parameters
    ----------
    x : samples from well before the first place to well after the last
    places : (n,) first samples of the frames that hold the crests, as indices of x
    valid : first and last (exclusive) index of x that is a sample of the record
    limits : least and greatest sample of the record
    out : (n, 5), room for attack (index in x, between samples), peak, whether it is clipped, the
        variance of the attack and the samples from there until the sound is clear
    sounds : (n, m), room for what is heard about each attack; zeros where that is not all there
    """
    gains = np.empty((2, 3, 2 * scale.reach + 1))
    for found in range(len(places)):
        split, out[found, 3] = attack(x, places[found], valid, scale, gains)
        out[found, 0] = split - 0.5
        out[found, 1], out[found, 2] = crest(x, split, valid, limits, scale)
        out[found, 4] = clear_after(x, split, valid, scale)
        begin_sound = split - scale.before
        earliest = valid[0] + scale.short_lag + scale.slope
        if begin_sound < earliest or begin_sound + sounds.shape[1] > valid[1]:
            sounds[found] = 0.0
        else:
            innovations(x, begin_sound, scale.short_lag, scale.slope, sounds[found])


@allocating
def attack(x, at, valid, scale, gains):
    """First sample after the greatest change of variance near `at`, with its variance.

    Of the innovations over the short and the long lag, those whose change is the more likely
    count: room noise is weakest in the former, white noise in the latter. `at` itself where the
    variance rises in neither. `gains` is scratch of (2, 3, 2 reach + 1).

    The variance is that of the probability of all splits within reach, and of the place between
    two samples.
    """
    first = max(at - scale.past * scale.hop, valid[0] + scale.long_lag + scale.slope)
    last = min(at + scale.forward * scale.hop, valid[1])
    squares = np.empty((2, max(last - first, 0)))
    best, split, gain = 0, at - first, -1.0
    for k in range(2):
        lag = scale.short_lag if k == 0 else scale.long_lag
        innovations(x, first, lag, scale.slope, squares[k])
        square(squares[k])
        place, gained = variance_change(squares[k], at - first, scale.reach, gains[k])
        if k == 0 or gained > gain:
            best, split, gain = k, place, gained
    together = counting_as_one(squares[best], split, gain, 3 * scale.slope // 2)
    earliest = at - first - scale.reach
    return first + split, split_variance(gains[best, 0], earliest, split, 2.0 * together)


@njit(nogil=True)
def counting_as_one(squares, split, gain, lags):
    """Number of dependent squares that count as one where their mean changes by `gain`.

    A weak rise shows in the mean of many: 1 + 2 sum r of them count as nearly one, r their
    correlation at each lag before and after the split. A strong one shows in a single square.
    """
    spare = lags + LAGS  # zeros behind what is before the split, and behind what is after it
    away, totals = np.zeros(len(squares) + 2 * spare), np.zeros(spare)
    alone, together, at = 0.0, 1.0, _NONE
    for first, last in ((0, split), (split, len(squares))):
        mean, end = 0.0, at + np.uint64(last - first)
        for i in range(first, last):
            mean += squares[i] / (last - first)
        for i in range(at, end):
            away[i] = squares[i - at + np.uint64(first)] / mean - 1.0 if mean > 0.0 else 0.0
            alone += away[i] * away[i]
        for lag in range(_ONE, np.uint64(lags + 1), np.uint64(LAGS)):
            for i in range(at, end):
                one, far = away[i], i + lag
                for k in range(np.uint64(LAGS)):  # lags side by side, in vector lanes
                    totals[lag + k] += one * away[far + k]
        at = end + np.uint64(spare)
    if not alone > 0.0:
        return DEPENDENT
    for lag in range(1, lags + 1):
        together += 2.0 * max(totals[lag] / alone, 0.0)
    jump = 2.0 * max(gain, 0.0) / len(squares)  # logarithm of the variance after over that before
    return DEPENDENT * together ** (MOST_TOGETHER / (1.0 + (jump / JUMP) ** 4))


@njit(nogil=True)
def split_variance(gains, first, split, together):
    """Variance of the split about `split`, with probability exp(gain / together).

    gains[i] is that of first + i, less than 0 where it is none. All are as likely if all are none.
    """
    greatest = gains.max()
    if greatest < 0.0:
        return (len(gains) // 2) ** 2 / 3.0
    total = second = 0.0
    for i in range(len(gains)):
        if gains[i] >= 0.0:
            weight = np.exp((gains[i] - greatest) / together)
            away = first + i - split
            total += weight
            second += weight * away * away
    return second / total + 1.0 / 12.0


@njit(nogil=True)
def clear_after(x, split, valid, scale):
    """Samples after the attack until innovations reach CLEAR of their greatest power.

    It is 0 where a sound begins at once, and not where a filter rings before it.
    """
    first = max(split, valid[0] + scale.short_lag + scale.slope)
    count = min(scale.reach, valid[1] - first)
    if count < 2:
        return 0
    values = np.empty(count)
    innovations(x, first, scale.short_lag, scale.slope, values)
    square(values)
    greatest = 0.0
    for k in range(count - 1):
        greatest = max(greatest, values[k] + values[k + 1])
    k = 0
    while values[k] + values[k + 1] < CLEAR * greatest:
        k += 1
    return k


@njit(nogil=True)
def innovations(x, first, lag, slope, out):
    """Residuals of linear extrapolation from two earlier samples.

    y[i] = x[i] - x[i - lag] - lag / slope (x[i - lag] - x[i - lag - slope]): hum is straight.
    """
    share, count = lag / slope, np.uint64(len(out))
    now, then, before = np.uint64(first), np.uint64(first - lag), np.uint64(first - lag - slope)
    for k in range(count):
        out[k] = x[now + k] - (1.0 + share) * x[then + k] + share * x[before + k]


@njit(nogil=True)
def square(values):
    """Square them, in place."""
    for k in range(len(values)):
        values[k] *= values[k]


@allocating
def variance_change(squares, at, reach, gains):
    """The split of N squares near `at` at which their variance changes most [Maeda1985]_.

    That which makes AIC(k) = k ln mean(squares[:k]) + (N - k) ln mean(squares[k:]) least; and by
    how much that is less than N ln mean(squares). (at, -1) where the mean rises nowhere. That of
    every split at - reach + i is left in gains[0, i], -1 where the mean does not rise; the other
    two rows are scratch.
    """
    count, total = len(squares), 0.0
    gains[0] = -1.0
    for k in range(count):
        total += squares[k]
    mean, least = total / count, 1e-12 * total / count
    split, gain = at, -1.0
    begin, end = max(at - reach, 1), min(count, at + reach + 1)
    if begin >= end or not mean > 0.0:
        return split, gain
    low, high = begin - at + reach, end - at + reach
    of, before, after = gains[0][low:high], gains[1][low:high], gains[2][low:high]
    near = np.uint64(len(of))
    head = 0.0
    for k in range(begin - 1):
        head += squares[k]
    for k in range(begin, end):
        head += squares[k - 1]
        before[k - begin] = head
    for i in range(near):  # in vector lanes, as what follows
        k = np.float64(begin) + np.float64(i)
        earlier, later = before[i] / k, (total - before[i]) / (count - k)
        earlier = earlier if earlier > least else least
        later = later if later > least else least
        of[i] = 0.0 if later > earlier else -1.0
        before[i], after[i] = earlier / mean, later / mean
    logarithms(before)
    logarithms(after)
    for i in range(near):
        k = np.float64(begin) + np.float64(i)
        gained = -k * before[i] - (count - k) * after[i]
        if of[i] == 0.0:
            of[i] = max(gained, 0.0)
            if gained > gain:
                split, gain = begin + np.int64(i), gained
    return split, gain


@njit(nogil=True)
def crest(x, split, valid, limits, scale):
    """Greatest deviation after the attack from the mean before; 1.0 as flag if clipped.

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
        extreme = x[i] <= limits[0] or x[i] >= limits[1]
        if extreme and before:
            clipped = 1.0
        before = extreme
    return greatest, clipped
