"""Kernels for the narrow bands of a sound: rise, background and means."""

from __future__ import annotations

import numpy as np

from .._lane_kernels import fused, logarithms, sum_of

TIMES_BACKGROUND = 2.0  # a power that counts
RANGE = 1e-4  # of the strongest nearby, below which nothing counts: 40 dB
SURELY = 1.0 + 1e-9  # times a sum: it is not less, rounding included
ALMOST = 1.0 - 1e-9  # times the greatest so far: less cannot exceed it, rounding included
_NONE, _TOGETHER = np.uint64(0), np.uint64(32)  # frames that are asked about at once
FACTORS = 16  # rises multiplied before their logarithm is taken: rounding bounds each by 1e14


@fused
def band_rise(earlier, power, background, freedom, per, out):
    """Rise of each frame above as many frames before it as `earlier` has, over the narrow bands.

    `earlier` are the powers before the first frame.

    out[0, i]: the mean over the bands of max(0, ln(max(P_b, F_b) / max(Q_b, F_b))) with F_b twice
    the background, Q_b the greatest of the bands b - 1, b, b + 1 before.
    out[1, i]: the greatest over the bands of n_b / 2 (x_b - 1 - ln x_b), the logarithm of the
    likelihood ratio of a rise by x_b = P_b / max(Q'_b / 2, L_b) > 1; Q'_b is of the band itself,
    n_b its `freedom`.

    `background` has a column for `per` frames.
    """
    bands, count = power.shape
    frames = np.uint64(count)  # unsigned: what may count from the end is no loop of vector lanes
    # The same rows; of an unknown stride, so that the loop with logarithms stays scalar, for few.
    _, greatest = out
    total, greatest_before = out[0], out[1]
    out[:] = 0.0
    bases, bound = np.empty(count), np.empty(count)
    level, rise = np.empty(background.shape[1] * per), np.ones(count)
    before = np.empty((3, count))  # powers then, of three bands
    put_before(earlier[0], power[0], before[0])
    for b in range(bands):
        if b + 1 < bands:
            put_before(earlier[b + 1], power[b + 1], before[(b + 1) % 3])
        now, then = power[b], before[b % 3]
        lower, upper = before[max(b - 1, 0) % 3], before[min(b + 1, bands - 1) % 3]
        half = 0.5 * freedom[b]
        at = 0
        for group in range(background.shape[1]):
            noise = background[b, group]
            for k in range(per):
                level[at + k] = noise
            at += per
        # What may exceed the greatest so far is found in vector lanes: ln x >= 2 (x - 1) / (x + 1).
        for i in range(frames):
            noise, past = level[i], then[i]
            half_past = 0.5 * past
            base = half_past if half_past > noise else noise
            top = now[i] if now[i] > base else base
            more = top - base
            bases[i] = base
            bound[i] = half * more * more
            bound[i] -= ALMOST * greatest_before[i] * (top + base) * base
            noise *= TIMES_BACKGROUND
            past = past if past > noise else noise
            past = past if past > lower[i] else lower[i]
            past = past if past > upper[i] else upper[i]
            risen = now[i] / past
            rise[i] *= risen if risen > 1.0 and past > 0.0 else 1.0
        for begin in range(_NONE, frames, _TOGETHER):
            end, some = min(begin + _TOGETHER, frames), 0
            for i in range(begin, end):
                some += bound[i] > 0.0
            if some:
                for i in range(begin, end):
                    if bound[i] > 0.0:
                        x = now[i] / bases[i]
                        greatest[i] = max(greatest[i], half * (x - 1.0 - np.log(x)))
        if (b + 1) % FACTORS == 0 or b == bands - 1:
            logarithms(rise)
            for i in range(frames):
                total[i] += rise[i]
            rise[:] = 1.0
    total /= bands


@fused
def put_before(earlier, power, out):
    """Powers as many frames before each as `earlier` has."""
    lag = np.uint64(min(len(earlier), len(out)))
    for i in range(lag):
        out[i] = earlier[i]
    for i in range(lag, np.uint64(len(out))):
        out[i] = power[i - lag]


@fused
def frames_above(values, least, others, least_other, out):
    """Put the indices at which a value or the other one exceeds its `least` in `out`.

    Returns their number.
    """
    count = 0
    for i in range(len(values)):
        out[count] = i
        count += (values[i] > least) | (others[i] > least_other)
    return count


@fused
def band_growth(earlier, power, following, later, background, per, frames, out):
    """out[k]: by how much the bands that rise at frames[k] have grown `later` frames after it.

    The mean over the bands of ln(P_b later / P_b), weighted by their rise over what was as many
    frames before as `earlier` has, ln(P_b / max(Q_b, F_b)) where that is positive; F_b is twice the
    background. `earlier` and `following` are the powers beside those of the frames; after them the
    last ones go on.
    """
    lag, count = earlier.shape[1], power.shape[1]
    end = count + following.shape[1] - 1
    risen, group = np.zeros(len(frames)), frames // per
    which, rises, growths = np.empty_like(frames), np.empty(len(frames)), np.empty(len(frames))
    bases = np.empty(len(frames))
    out[:] = 0.0
    for b in range(power.shape[0]):
        some = 0
        for k in range(len(frames)):  # without a branch, of which none can be foretold
            i, j = frames[k], min(frames[k] + later, end)
            now = power[b, i]
            then = earlier[b, i] if i < lag else power[b, i - lag]
            base = max(then, TIMES_BACKGROUND * background[b, group[k]])
            ahead = power[b, j] if j < count else following[b, j - count]
            which[some], rises[some], bases[some] = k, now, base
            growths[some] = max(ahead, base)
            some += now > base > 0.0
        for m in range(np.uint64(some)):
            growths[m] /= rises[m]
            rises[m] /= bases[m]
        logarithms(rises[:some])
        logarithms(growths[:some])
        for m in range(some):
            risen[which[m]] += rises[m]
            out[which[m]] += rises[m] * growths[m]
    for k in range(len(frames)):
        out[k] = out[k] / risen[k] if risen[k] > 0.0 else 0.0


@fused
def background(noise, per, means, first, nearby, out):
    """Background of band b in group first + g, from the means of neighbouring groups.

    `noise` has a column for `per` groups. Where all means together do not count beside it, none
    does. Otherwise the greatest of 2, 4, 8 groups are made one of the other, and the last two cover
    all nearby.
    """
    groups, width = out.shape[1], 2 * nearby + 1
    begin, end = max(first - nearby, 0), min(first + groups + nearby, means.shape[1])
    begins, ends = begin - first + nearby, end - first + nearby
    near, wider = np.zeros(groups + width - 1), np.zeros(groups + width - 1)
    for b in range(out.shape[0]):
        least = noise[b, 0]
        for k in range(1, (groups - 1) // per + 1):
            least = min(least, noise[b, k])
        if SURELY * RANGE * sum_of(means[b, begin:end]) < least:
            for g in range(groups):
                out[b, g] = noise[b, g // per]
            continue
        near[:begins] = 0.0
        near[begins:ends] = means[b, begin:end]
        near[ends:] = 0.0
        within = 1
        while 2 * within <= width:
            ahead = near[within:]
            for k in range(len(ahead)):
                wider[k] = near[k] if near[k] > ahead[k] else ahead[k]
            near, wider = wider, near
            within *= 2
        ahead = near[width - within :]
        for g in range(groups):
            strongest = near[g] if near[g] > ahead[g] else ahead[g]
            out[b, g] = max(noise[b, g // per], RANGE * strongest)


@fused
def group_means(power, heard, per, out):
    """Mean power of the audible frames of each group, or of all if none is."""
    counts = np.empty(out.shape[1], np.int64)
    for g in range(out.shape[1]):
        counts[g] = heard[g * per : (g + 1) * per].sum()
    for b in range(out.shape[0]):
        row = power[b]
        for g in range(out.shape[1]):
            begin, end = g * per, min((g + 1) * per, power.shape[1])
            if counts[g] == 0 or counts[g] == end - begin:
                out[b, g] = sum_of(row[begin:end]) / (end - begin)
                continue
            total = 0.0
            for k in range(begin, end):
                if heard[k]:
                    total += row[k]
            out[b, g] = total / counts[g]
