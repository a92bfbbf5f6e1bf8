"""Kernels of the sound detector: powers in octaves and their rise.

The octaves are the details of the LeGall 5/3 wavelet, computed by lifting [LeGall1988]_:

    d[i] = x[2i+1] - (x[2i] + x[2i+2]) / 2,      s[i] = x[2i] + (d[i-1] + d[i]) / 4,

and again on s. Each value depends on the samples nearby and on nothing else, so that a stretch
gives the same numbers wherever the record is cut.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._lane_kernels import fused

BLOCK = 128  # frames that share one background
GROUP = 16  # frames that share one power that the background is read from
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
    for g in range(groups):
        heard = not (silent[g + 1] or silent[g + 2] or silent[g + 3])
        for i in range(g * each, (g + 1) * each):
            at = first + i * per
            counted[i] = heard and real[0] <= at and at + per <= real[1]


@fused
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


@fused
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
            risen = 0
            for j in range(size):
                base = then[j] if then[j] > least else least
                ratio[j] = now[j] / base if now[j] > base > 0.0 else 1.0
                risen += ratio[j] > 1.0
            for j in range(size if risen else 0):
                if ratio[j] > 1.0:
                    out[begin + j] += weights[b] * np.log(ratio[j])


@fused
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
