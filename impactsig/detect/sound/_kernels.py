"""Kernels of the sound detector: powers in octaves and their rise.

The octaves are the details of the LeGall 5/3 wavelet, computed by lifting [LeGall1988]_:

    d[i] = x[2i+1] - (x[2i] + x[2i+2]) / 2,      s[i] = x[2i] + (d[i-1] + d[i]) / 4,

and again on s. Each value depends on the samples nearby and on nothing else, so that a stretch
gives the same numbers wherever the record is cut.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._lane_kernels import fused, logarithms

BLOCK = 128  # frames that share one background
GROUP = 16  # frames that share one power that the background is read from
SAMPLED = 16  # frames, of which one rise is kept
STEP = 4  # frames from one likelihood to the next
_NONE, _ONE, _TWO, _FOUR = np.uint64(0), np.uint64(1), np.uint64(2), np.uint64(4)
TOGETHER = 512  # frames, or details, that stay in the nearest memory
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


@fused
def octave_powers(x, octaves, even, odd, high, power):
    """power[b, j]: mean square of the details of octave b (0: the highest) in frame j of x.

    `even`, `odd` and `high` are scratch of half the length of x. The powers of the first and last
    EDGE frames are not those of a longer stretch.
    """
    frames = power.shape[1]
    count = len(x) // 2
    halve_and_square(x, high, even[:count], count // frames, power[0])
    for b in range(1, octaves):
        count //= 2
        halve_and_square(even, high, odd[:count], count // frames, power[b])
        even, odd = odd, even


@fused
def halve_and_square(x, high, low, per, out):
    """Sums of pairs of samples, and the mean squares of each `per` Haar details.

    Details are squared part by part, while they are in the nearest memory; `high` is scratch.
    Indices are unsigned: signed ones, which may count from the end, keep loops out of vector lanes.
    """
    count, size, before = len(low), max(TOGETHER // per, 1) * per, 0.0
    for first in range(0, count, size):
        part = np.uint64(min(size, count - first))
        own, now, sums = x[2 * first :], high[:part], low[first : first + size]
        end = np.int64(first + size >= count)
        for i in range(_NONE, part - np.uint64(end)):
            j = _TWO * i
            now[i] = own[j + _ONE] - 0.5 * (own[j] + own[j + _TWO])
        if end:
            now[part - _ONE] = 0.0
        sums[0] = own[0] + 0.25 * (before + now[0]) if first else own[0]
        for i in range(_ONE, part):
            sums[i] = own[_TWO * i] + 0.25 * (now[i - _ONE] + now[i])
        before = now[part - _ONE]
        mean_squares(now, per, out[first // per : (first + size) // per])


@fused
def mean_squares(values, per, out):
    """Means of the squares of each `per` values, added in sequence.

    A few usual numbers are written out, so that they run in vector lanes.
    """
    v = values
    if per == 1:
        for j in range(_NONE, np.uint64(len(out))):
            out[j] = v[j] * v[j]
    elif per == 2:
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


@fused
def octave_rise(power, first, scale, background, weights, after, every, out):
    """Rise of the octaves at each frame, power[:, first] and those that follow.

    after[b, j]: mean power over `forward` frames from frame j on, weighted by a line that falls to
    zero. every[0] and every[1]: that, and the mean over `past` frames before, of every STEP-th
    frame. out[j]: mean over the octaves of max(0, ln(after / max(before, 2 background))).

    `background` holds a power for each octave and each BLOCK of frames.
    """
    count, forward, past = after.shape[1], scale.forward, scale.past
    falling = 2.0 * np.arange(forward, 0, -1) / (forward * (forward + 1.0))
    level = np.full(past, 1.0 / past)
    before, ratio = np.empty(TOGETHER), np.empty(BLOCK)
    out[:] = 0.0
    for begin in range(0, count, TOGETHER):
        size, at = min(TOGETHER, count - begin), first + begin
        for b in range(power.shape[0]):
            later, earlier = after[b, begin : begin + size], before[:size]
            weighted_sums(power[b, at : at + size + forward - 1], falling, later)
            weighted_sums(power[b, at - past : at + size - 1], level, earlier)
            for i in range((size + STEP - 1) // STEP):
                every[0, b, begin // STEP + i] = later[STEP * i]
                every[1, b, begin // STEP + i] = earlier[STEP * i]
            for start in range(0, size, BLOCK):
                end = min(start + BLOCK, size)
                least = 2.0 * background[b, (begin + start) // BLOCK]
                own = out[begin + start : begin + end]
                add_rise(later[start:end], earlier[start:end], least, weights[b], ratio, own)


@fused
def weighted_sums(values, weights, out):
    """out[j]: sum over k of weights[k] values[j + k], in sequence.

    Value by value in the inner loop, which runs in vector lanes, with some weights at a time.
    """
    k = 0
    out[:] = 0.0
    while k + 8 <= len(weights):
        w, row = weights[k : k + 8], values[k:]
        w0, w1, w2, w3, w4, w5, w6, w7 = w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7]
        for j in range(len(out)):
            total = out[j] + w0 * row[j] + w1 * row[j + 1] + w2 * row[j + 2] + w3 * row[j + 3]
            total += w4 * row[j + 4]
            out[j] = total + w5 * row[j + 5] + w6 * row[j + 6] + w7 * row[j + 7]
        k += 8
    while k < len(weights):
        w0, row = weights[k], values[k:]
        for j in range(len(out)):
            out[j] += w0 * row[j]
        k += 1


@fused
def add_rise(after, before, least, weight, ratio, out):
    """Add the weight times the logarithm of the ratio of `after` to `before`, at least `least`.

    Only where that is positive. `ratio` is scratch of a BLOCK.
    """
    risen = 0
    for j in range(len(out)):
        base = before[j] if before[j] > least else least
        ratio[j] = after[j] / base if after[j] > base > 0.0 else 1.0
        risen += ratio[j] > 1.0
    if risen:
        logarithms(ratio[: len(out)])
        for j in range(len(out)):
            out[j] += weight * ratio[j]


@fused
def loudness(after, background, weights, every, out):
    """out[k]: the loudness at frame k times `every`."""
    for k in range(len(out)):
        out[k] = loudness_at(after, background, weights, k * every)


@fused
def loudness_at(after, background, weights, j):
    """Mean over the octaves of max(0, ln(after / 2 background)) at frame j."""
    total = 0.0
    for b in range(after.shape[0]):
        level = 2.0 * background[b, j // BLOCK]
        if after[b, j] > level > 0.0:
            total += weights[b] * np.log(after[b, j] / level)
    return total
