"""Kernels for matched responses at all widths, and their crests."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ..signal.ladder import FACTOR, Ladder

GATE = 0.35
"""A crest must rise above the higher of its flanks by this much of its response."""
VALLEY = 0.7
"""Two crests are two where the response falls below this share of the lower one between them."""
STRIDE = 1024  # values that share their sums
STEP = 64  # of them, looked at together
CREST = 4  # fields of a crest: centre, rung, response, response over its noise


class Stretch(NamedTuple):
    """Samples to be searched, with their surroundings.

    `x` holds the samples from sample `origin` on, of `total` in all, far enough to either side of
    those searched: [first, last). `origin` and `first` are whole numbers of the widest blocks.
    """

    x: np.ndarray
    origin: int
    total: int
    first: int
    last: int
    rungs: Ladder
    noise: np.ndarray  # standard deviation of that of the responses, on each rung


@kernel
def block_means(x, out):
    """Means of each FACTOR values of x, as many as `out` holds."""
    for k in range(len(out)):
        total = 0.0
        for i in range(FACTOR):
            total += x[FACTOR * k + i]
        out[k] = total / FACTOR


@kernel
def running_sums(x, first, count, sums):
    """sums[k] = sum of the first k of `count` values from x[first], less x[first] each.

    Four runs side by side, because a single chain of additions waits for each sum; each a view,
    whose indices need no look at their signs.
    """
    reference = x[first]
    part = count // 4
    middle, end = 2 * part, 4 * part
    x0, x1 = x[first : first + part], x[first + part : first + middle]
    x2, x3 = x[first + middle : first + middle + part], x[first + middle + part : first + end]
    y0, y1 = sums[1 : part + 1], sums[part + 1 : middle + 1]
    y2, y3 = sums[middle + 1 : middle + part + 1], sums[middle + part + 1 : end + 1]
    s0 = s1 = s2 = s3 = 0.0
    sums[0] = 0.0
    for k in range(part):
        s0 += x0[k] - reference
        s1 += x1[k] - reference
        s2 += x2[k] - reference
        s3 += x3[k] - reference
        y0[k], y1[k], y2[k], y3[k] = s0, s1, s2, s3
    carry = s0
    for k in range(part):
        y1[k] += carry
    carry += s1
    for k in range(part):
        y2[k] += carry
    carry += s2
    for k in range(part):
        y3[k] += carry
    for k in range(end, count):
        sums[k + 1] = sums[k] + (x[first + k] - reference)


@kernel
def parts(sums, lo, total, i, unit, near, far):
    """Mean over the centre and over either flank, at value i, above a common reference.

    `sums` are those of the values from `lo` on, of `total` in all. Where less than a width of
    a flank lies within the series, the other flank speaks for both: what is under way there may be
    a pulse; where neither does, there is no response.
    """
    before = (unit - 1) // 2
    if i < before or i - before + unit > total:
        return -np.inf, 0.0, 0.0
    c0, c1 = i - before, i - before + unit
    l0, l1 = max(i - far, 0), max(i - near, 0)
    r0, r1 = min(i + near + 1, total), min(i + far + 1, total)
    centre = (sums[c1 - lo] - sums[c0 - lo]) / (c1 - c0)
    least = unit
    left = right = centre
    if l1 - l0 >= least:
        left = (sums[l1 - lo] - sums[l0 - lo]) / (l1 - l0)
    if r1 - r0 >= least:
        right = (sums[r1 - lo] - sums[r0 - lo]) / (r1 - r0)
        if l1 - l0 < least:
            left = right
    elif l1 - l0 >= least:
        right = left
    return centre, left, right


@kernel
def gated(centre, left, right, gain):
    """The response, limited by the rise above the higher flank; not positive on a ramp."""
    return gain * min(centre - 0.5 * (left + right), (centre - max(left, right)) / GATE)


@kernel
def parts_inside(sums, k, unit, near, far, per_unit, per_side):
    """As `parts`, where both flanks lie within the series.

    `per_unit` and `per_side` are one over the values of the centre and of a flank.
    """
    at = k - (unit - 1) // 2
    centre = (sums[at + unit] - sums[at]) * per_unit
    left = (sums[k - near] - sums[k - far]) * per_side
    right = (sums[k + far + 1] - sums[k + near + 1]) * per_side
    return centre, left, right


@kernel
def _respond(sums, lo, total, start, stop, unit, near, far, gain, y):
    """Responses of values [start, stop), without the limit."""
    reach = far + unit
    a, b = min(max(start, reach), stop), max(min(stop, total - reach), start)
    if b > a:
        _respond_inside(sums, a - lo, unit, near, far, gain, y[a - start : b - start])
    for i in range(start, min(a, stop)):
        centre, left, right = parts(sums, lo, total, i, unit, near, far)
        y[i - start] = gain * (centre - 0.5 * (left + right))
    for i in range(max(b, a), stop):
        centre, left, right = parts(sums, lo, total, i, unit, near, far)
        y[i - start] = gain * (centre - 0.5 * (left + right))


@kernel
def _respond_inside(sums, k, unit, near, far, gain, y):
    """The same where all flanks lie within the series."""
    before = (unit - 1) // 2
    after = unit - before
    count = len(y)
    per_unit = gain / unit
    per_side = gain / (2 * (far - near))
    c1, c0 = sums[k + after : k + after + count], sums[k - before : k - before + count]
    l1, l0 = sums[k - near : k - near + count], sums[k - far : k - far + count]
    r1, r0 = sums[k + far + 1 : k + far + 1 + count], sums[k + near + 1 : k + near + 1 + count]
    for i in range(count):
        y[i] = (c1[i] - c0[i]) * per_unit - ((l1[i] - l0[i]) + (r1[i] - r0[i])) * per_side


@kernel
def _next_above(y, i, stop, least):
    """Index of the first value from i on that is at least `least`; `stop` if none."""
    # Values are counted, because the compiler runs that in lanes; by numbers without a sign,
    # because it looks at the sign of every other index.
    at, step = np.uint64(i), np.uint64(STEP)
    while at + step <= np.uint64(stop):
        count = 0
        for k in range(step):
            count += y[at + k] >= least
        if count:
            break
        at += step
    i = np.int64(at)
    while i < stop and y[i] < least:
        i += 1
    return i


@allocating
def find_crests(here, thresholds, out):
    """Crests of the responses of all widths.

    Parameters
    ----------
    here : Stretch
    thresholds : array
        Least response on each rung.
    out : array (n, CREST), filled
        Crests: centre, rung, response, response over noise.

    Returns
    -------
    int
        Crests found, at most as many as there is room for.
    """
    rungs = here.rungs
    found = 0
    values = here.x
    for level in range(int(rungs.level[-1]) + 1):
        if level:
            means = np.empty(len(values) // FACTOR)
            block_means(values, means)
            values = means
        block = FACTOR**level
        found = crests_on(
            values,
            here.origin // block,
            here.total // block,
            here.first // block,
            here.last // block,
            level,
            rungs,
            thresholds,
            out,
            found,
        )
    for k in range(found):
        out[k, 3] = out[k, 2] / here.noise[int(out[k, 1])]
    return found


@allocating
def crests_on(x, origin, total, first, last, level, rungs, thresholds, out, found):
    """Append the crests of one block size, within values [first, last)."""
    block = FACTOR**level
    below, beyond = 0, 0
    for j in range(len(rungs.level)):
        below += rungs.level[j] < level
        beyond += rungs.level[j] <= level
    count = beyond - below
    reach = 0
    for j in range(below, beyond):
        reach = max(reach, rungs.far[j] + rungs.unit[j])
    sums = np.empty(STRIDE + 2 * reach + 2)
    y = np.empty(STRIDE)
    inside, at = np.empty(count, np.bool_), np.empty(count, np.int64)
    greatest, valley = np.empty(count), np.empty(count)
    for k in range(count):
        inside[k], at[k], greatest[k], valley[k] = False, 0, 0.0, 0.0
    # Crests at the border belong to the side on which they are highest.
    start = max(first - rungs.unit[beyond - 1], 0)
    end = min(last + rungs.unit[beyond - 1], total)
    while start < end:
        stop = min(start + STRIDE, end)
        lo, hi = max(0, start - reach), min(total, stop + reach)
        running_sums(x, lo - origin, hi - lo, sums)
        for k in range(count):
            j = below + k
            unit, near, far = rungs.unit[j], rungs.near[j], rungs.far[j]
            gain, threshold = rungs.gain[j], thresholds[j]
            enough = VALLEY * threshold
            per_unit, per_side = 1.0 / unit, 1.0 / (far - near)
            inner, outer = far + unit, total - far - unit
            _respond(sums, lo, total, start, stop, unit, near, far, gain, y)
            within, height, top, low = inside[k], greatest[k], at[k], valley[k]
            i = start
            while i < stop:
                if not within and (low <= 0.0 or low < enough):  # no lower valley is needed
                    i = _next_above(y, i - start, stop - start, threshold) + start
                    if i == stop:
                        break
                value = y[i - start]
                if value >= VALLEY * threshold:
                    if inner <= i < outer:
                        centre, left, right = parts_inside(
                            sums, i - lo, unit, near, far, per_unit, per_side
                        )
                    else:
                        centre, left, right = parts(sums, lo, total, i, unit, near, far)
                    value = gated(centre, left, right, gain)
                if within:
                    if value > height:
                        height, top = value, i
                    elif value < VALLEY * height:
                        found = _note(top, first, last, unit, block, j, height, out, found)
                        within, low = False, value
                else:
                    low = min(low, value)
                    if value >= threshold and VALLEY * value > low:
                        within, height, top = True, value, i
                i += 1
            inside[k], greatest[k], at[k], valley[k] = within, height, top, low
        start = stop
    for k in range(count):
        if inside[k]:
            unit = rungs.unit[below + k]
            found = _note(at[k], first, last, unit, block, below + k, greatest[k], out, found)
    return found


@kernel
def _note(at, first, last, unit, block, rung, response, out, found):
    """Append a crest to `out` if it lies in [first, last) and there is room."""
    if first <= at < last and found < len(out):
        shift = 0.5 * (unit - 1) - (unit - 1) // 2  # of the centre, where the width is even
        out[found, 0] = (at + 0.5 + shift) * block - 0.5
        out[found, 1], out[found, 2] = rung, response
        found += 1
    return found


@kernel
def noise_at(width, widths, noise):
    """Noise of the response of a width, interpolated between the tabulated widths."""
    if width <= widths[0]:
        return noise[0]
    for j in range(1, len(widths)):
        if width <= widths[j]:
            share = math.log(width / widths[j - 1]) / math.log(widths[j] / widths[j - 1])
            return noise[j - 1] ** (1.0 - share) * noise[j] ** share
    return noise[-1]
