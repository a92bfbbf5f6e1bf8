"""Kernels of the force detector: block ranges, matched response, hysteresis.

The matched response is the mean over the width w of a typical pulse less the mean of both flanks,

    y[n] = mean(x[n - w/2 ... n + w/2]) - mean(x over near < |m - n| <= far),

which passes pulses and removes offset, drift and hum. It lies between min(x) - max(x) and
max(x) - min(x) over its reach, so a stretch of small range cannot hold an impact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from ._pulse import measure_pulse, measure_reach

BLOCK = 512  # samples that share one least and one greatest value


class Matched(NamedTuple):
    """The matched response: sign of the pulses, width and flanks in samples."""

    sign: float
    width: int
    near: int
    far: int


# nnan: the caller has checked that all samples are finite; it lets min and max run in lanes.
@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})
def block_ranges(x, low, high):
    """Least and greatest value of each BLOCK samples of x."""
    for k in range(len(low)):
        first, last = k * BLOCK, min((k + 1) * BLOCK, len(x))
        least = greatest = x[first]
        for i in range(first, last):
            value = x[i]
            least = value if value < least else least
            greatest = value if value > greatest else greatest
        low[k], high[k] = least, greatest


@njit(cache=True, nogil=True)
def respond(buffer, origin, total, first, last, matched, sums, y, sides):
    """Response y and flank mean for samples [first, last) of a segment of `total` samples.

    buffer[0] is sample `origin` of the segment. `sums` is scratch of at least
    last - first + 2 * (far + width) + 1. Flanks end at the ends of the segment.
    """
    reach = matched.far + matched.width
    lo, hi = max(0, first - reach), min(total, last + reach)
    reference = float(buffer[lo - origin])
    running = 0.0
    sums[0] = 0.0
    for i in range(lo, hi):
        running += buffer[i - origin] - reference
        sums[i - lo + 1] = running
    before = (matched.width - 1) // 2
    after = matched.width - before
    near, far = matched.near, matched.far
    a, b = min(max(first, far), last), max(min(last, total - far), first)
    per_width = matched.sign / matched.width
    per_side = matched.sign / (2 * (far - near))
    for i in range(a, b):
        k = i - lo
        centre = (sums[k + after] - sums[k - before]) * per_width
        side = (sums[k - near] - sums[k - far] + sums[k + far + 1] - sums[k + near + 1]) * per_side
        sides[i - first] = side
        y[i - first] = centre - side
    for i in range(first, last):
        if a <= i < b:
            continue
        c0, c1 = max(i - before, 0), min(i + after, total)
        l0, l1 = max(i - far, 0), max(i - near, 0)
        r0, r1 = min(i + near + 1, total), min(i + far + 1, total)
        centre = (sums[c1 - lo] - sums[c0 - lo]) / (c1 - c0)
        count = l1 - l0 + r1 - r0
        side = 0.0
        if count > 0:
            side = (sums[l1 - lo] - sums[l0 - lo] + sums[r1 - lo] - sums[r0 - lo]) / count
        else:
            side = centre
        sides[i - first] = matched.sign * side
        y[i - first] = matched.sign * (centre - side)
    for i in range(last - first):
        sides[i] += matched.sign * reference


@njit(cache=True, nogil=True)
def scan(buffer, origin, total, first, last, unit, matched, levels, low, high, skip, state, out):
    """Search samples [first, last) for stretches where the response exceeds the threshold.

    Parameters
    ----------
    levels : (threshold, release)
    low, high : ranges of the blocks of the segment
    skip : pass over units whose range shows that they cannot hold an impact
    state : array (inside, peak value, peak index, flank mean there), carried from call to call
    out : array (m, 2), room for the peak index and flank mean of the impacts found

    Returns
    -------
    number of impacts found
    """
    threshold, release = levels
    reach = matched.far + matched.width
    sums = np.empty(unit + 2 * reach + 1)
    y, sides = np.empty(unit), np.empty(unit)
    found = 0
    for start in range(first, last, unit):
        stop = min(start + unit, last)
        if skip:
            b0 = max(0, start - reach) // BLOCK
            b1 = (min(total, stop + reach) - 1) // BLOCK + 1
            least, greatest = low[b0], high[b0]
            for k in range(b0, b1):
                least = min(least, low[k])
                greatest = max(greatest, high[k])
            # The margin covers the rounding of the response.
            if (greatest - least) * 1.000001 < release:
                if state[0] != 0.0:
                    out[found, 0], out[found, 1] = state[2], state[3]
                    found += 1
                    state[0] = 0.0
                continue
        respond(buffer, origin, total, start, stop, matched, sums, y, sides)
        for i in range(stop - start):
            value = y[i]
            if state[0] == 0.0:
                if value >= threshold:
                    state[0], state[1], state[2], state[3] = 1.0, value, start + i, sides[i]
            elif value < release:
                out[found, 0], out[found, 1] = state[2], state[3]
                found += 1
                state[0] = 0.0
            elif value > state[1]:
                state[1], state[2], state[3] = value, start + i, sides[i]
    return found


@njit(cache=True, nogil=True)
def measure_all(buffer, origin, total, candidates, first, last, matched, sigma, level, limit, out):
    """Measure candidates [first, last) into rows of `out`: the fields of Pulse, then clipping.

    `limit` is the greatest value of the record (times sign): three samples in a row at it are
    called clipped.
    """
    reach = measure_reach(matched.width)
    for k in range(first, last):
        peak = int(candidates[k, 0])
        before = int(candidates[k - 1, 0]) if k > 0 else -1
        after = int(candidates[k + 1, 0]) if k + 1 < len(candidates) else total
        pulse = measure_pulse(
            buffer, origin, total, matched.sign, peak, candidates[k, 1], before, after,
            matched.width, sigma, level,
        )
        row = k - first
        out[row, 0], out[row, 1], out[row, 2] = pulse.start, pulse.contact, pulse.peak
        out[row, 3], out[row, 4], out[row, 5] = pulse.impulse, pulse.rise, pulse.flags
        run = longest = 0
        for i in range(max(0, peak - reach), min(total, peak + reach + 1)):
            run = run + 1 if matched.sign * buffer[i - origin] >= limit else 0
            longest = max(longest, run)
        out[row, 6] = 1.0 if longest >= 3 else 0.0
