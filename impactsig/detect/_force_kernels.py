"""Kernels of the force detector: block ranges, matched response, hysteresis.

The matched response is the mean over the width w of a typical pulse less the mean of both flanks,

    y[n] = g (mean(x[n - w/2 ... n + w/2]) - mean(x over near < |m - n| <= far)),

which passes pulses and removes offset, drift and hum. The gain g makes the response to a
half-sine of the matching length its peak, so that levels read as heights of pulses. |y| is at
most g times the range of x over its reach: a stretch of small range cannot hold an impact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._compiled import njit

BLOCK = 512  # samples that share one least and one greatest value


class Matched(NamedTuple):
    """The matched response: gain (with the sign of the pulses), width and flanks in samples."""

    gain: float
    width: int
    near: int
    far: int


# nnan: the caller has checked that all samples are finite; it lets min and max run in lanes.
@njit(nogil=True, fastmath={"nnan", "nsz"})
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


@njit(nogil=True)
def _cumulate(buffer, first, count, sums):
    """sums[k] = sum of the first k of `count` samples from buffer[first], less buffer[first] each.

    Four runs side by side, because a single chain of additions waits for each sum.
    """
    reference = float(buffer[first])
    part = count // 4
    s0 = s1 = s2 = s3 = 0.0
    sums[0] = 0.0
    for k in range(part):
        s0 += buffer[first + k] - reference
        s1 += buffer[first + part + k] - reference
        s2 += buffer[first + 2 * part + k] - reference
        s3 += buffer[first + 3 * part + k] - reference
        sums[k + 1] = s0
        sums[part + k + 1] = s1
        sums[2 * part + k + 1] = s2
        sums[3 * part + k + 1] = s3
    for run in range(1, 4):
        carry = sums[run * part]
        for k in range(run * part + 1, (run + 1) * part + 1):
            sums[k] += carry
    for k in range(4 * part, count):
        sums[k + 1] = sums[k] + (buffer[first + k] - reference)


@njit(nogil=True)
def respond(buffer, origin, total, first, last, matched, sums, y):
    """Response y for samples [first, last) of a segment of `total` samples.

    buffer[0] is sample `origin` of the segment. `sums` is scratch of at least
    last - first + 2 * (far + width) + 1. Flanks end at the ends of the segment.
    """
    reach = matched.far + matched.width
    lo, hi = max(0, first - reach), min(total, last + reach)
    _cumulate(buffer, lo - origin, hi - lo, sums)
    a, b = min(max(first, reach), last), max(min(last, total - reach), first)
    if b > a:
        before = (matched.width - 1) // 2
        after = matched.width - before
        near, far = matched.near, matched.far
        per_width = matched.gain / matched.width
        per_side = matched.gain / (2 * (far - near))
        count, k = b - a, a - lo
        out = y[a - first : b - first]
        c1, c0 = sums[k + after : k + after + count], sums[k - before : k - before + count]
        l1, l0 = sums[k - near : k - near + count], sums[k - far : k - far + count]
        r1, r0 = sums[k + far + 1 : k + far + 1 + count], sums[k + near + 1 : k + near + 1 + count]
        for i in range(count):
            out[i] = (c1[i] - c0[i]) * per_width - (l1[i] - l0[i] + r1[i] - r0[i]) * per_side
    for i in range(first, min(a, last)):
        y[i - first] = matched.gain * _centre_and_side(sums, lo, total, i, matched)[0]
    for i in range(max(b, a), last):
        y[i - first] = matched.gain * _centre_and_side(sums, lo, total, i, matched)[0]


@njit(nogil=True)
def _centre_and_side(sums, lo, total, i, matched):
    """Response without gain, and flank mean, at sample i; both above the reference of `sums`.

    Beyond its ends the segment goes on at the mean of its first or last `width` samples.
    """
    width, near, far = min(matched.width, total), matched.near, matched.far
    before = (matched.width - 1) // 2
    c0, c1 = max(i - before, 0), min(i - before + matched.width, total)
    l0, l1 = max(i - far, 0), max(i - near, 0)
    r0, r1 = min(i + near + 1, total), min(i + far + 1, total)
    flanks = sums[l1 - lo] - sums[l0 - lo] + sums[r1 - lo] - sums[r0 - lo]
    missing_left, missing_right = far - near - (l1 - l0), far - near - (r1 - r0)
    if missing_left > 0:
        flanks += missing_left * sums[width] / width  # lo is 0 here
    if missing_right > 0:
        flanks += missing_right * (sums[total - lo] - sums[total - width - lo]) / width
    side = flanks / (2 * (far - near))
    return (sums[c1 - lo] - sums[c0 - lo]) / (c1 - c0) - side, side


@njit(nogil=True)
def strongest_responses(x, whole, trials, out):
    """For each row of `trials`, the fields of a Matched: its extremes over x and where they are.

    Where x is not the whole segment, only samples with both flanks count; rows without any are
    zero. Wide responses are smooth: every width/8-th sample tells their extremes.
    """
    sums = np.empty(len(x) + 1)
    _cumulate(x, 0, len(x), sums)
    for k in range(len(trials)):
        matched = Matched(trials[k, 0], int(trials[k, 1]), int(trials[k, 2]), int(trials[k, 3]))
        margin = 0 if whole else matched.far + matched.width
        greatest, least, at_greatest, at_least = -np.inf, np.inf, 0, 0
        for i in range(margin, len(x) - margin, max(1, matched.width // 8)):
            value = _centre_and_side(sums, 0, len(x), i, matched)[0]
            if value > greatest:
                greatest, at_greatest = value, i
            if value < least:
                least, at_least = value, i
        for column in range(4):
            out[k, column] = 0.0
        if greatest >= least:
            out[k, 0], out[k, 1] = greatest * matched.gain, at_greatest
            out[k, 2], out[k, 3] = least * matched.gain, at_least


@njit(nogil=True)
def _local_noise(buffer, first, last, width):
    """Standard deviation of the noise of buffer[first:last], from its quiet stretches.

    A quarter of 24 stretches of a pulse's width stay below it, but for the factor that makes it
    right for white noise in stretches of eleven samples. Zero where there are too few stretches.
    """
    length = max(width, 8)
    count = min(24, (last - first) // length)
    if count < 4:
        return 0.0
    deviations = np.empty(count)
    for k in range(count):
        a = first + (last - first - length) * k // (count - 1)
        mean = square = 0.0
        for i in range(a, a + length):
            mean += buffer[i] - buffer[a]
        mean = mean / length + buffer[a]
        for i in range(a, a + length):
            square += (buffer[i] - mean) ** 2
        j = k
        value = math.sqrt(square / length)
        while j > 0 and deviations[j - 1] > value:
            deviations[j] = deviations[j - 1]
            j -= 1
        deviations[j] = value
    return 1.25 * deviations[count // 4]


@njit(nogil=True)
def scan(buffer, origin, total, first, last, unit, matched, levels, low, high, skip, state, out):
    """Search samples [first, last) for stretches where the response exceeds the threshold.

    Parameters
    ----------
    levels : (threshold, release, noise, noise of the response, least threshold in that noise)
        Where a unit, or the one before or after it, is more than twice as noisy as the record,
        that noise sets the threshold.
    low, high : ranges of the blocks of the segment
    skip : pass over units whose range shows that they cannot hold an impact
    state : array (6,), carried from call to call: the impact under way, as in `out`, if state[0]
    out : array (m, 5), room for the impacts found: peak index, flank mean, response, noise, noise
        of the response

    Returns
    -------
    number of impacts found
    """
    threshold, release, noise, matched_noise, least_sigma = levels
    whitened = abs(matched.gain) * math.sqrt(1.125 / matched.width)
    inside, at, base, greatest = state[0] != 0.0, state[1], state[2], state[3]
    sigma, matched_sigma = state[4], state[5]
    reach = matched.far + matched.width
    sums = np.empty(unit + 2 * reach + 1)
    y = np.empty(unit)
    found = 0
    nearby = np.zeros(3)  # noise of the units before, here and after
    newest = -1  # start of the unit that nearby[2] is of
    for start in range(first, last, unit):
        stop = min(start + unit, last)
        quiet = False
        if skip:
            b0 = max(0, start - reach) // BLOCK
            b1 = (min(total, stop + reach) - 1) // BLOCK + 1
            bottom, top = low[b0], high[b0]
            for k in range(b0, b1):
                bottom = min(bottom, low[k])
                top = max(top, high[k])
            # The margin covers the rounding of the response.
            quiet = (top - bottom) * abs(matched.gain) * 1.000001 < release
        here, matched_here, on, off = noise, matched_noise, threshold, release
        if not quiet:
            fresh = 1 if newest == start else 3
            for k in range(3 - fresh):
                nearby[k] = nearby[k + 1]
            for k in range(3 - fresh, 3):
                a = max(start + (k - 1) * unit, 0)
                b = min(start + k * unit, total)
                nearby[k] = _local_noise(buffer, a - origin, b - origin, matched.width)
            newest = start + unit
            local = max(nearby[0], nearby[1], nearby[2])
            if local > 2.0 * noise:
                here, matched_here = local, max(matched_noise, local * whitened)
                on = max(threshold, least_sigma * matched_here)
                off = max(release, 0.5 * on)
            respond(buffer, origin, total, start, stop, matched, sums, y)
        lo = max(0, start - reach)
        for i in range(stop - start):
            value = 0.0 if quiet else y[i]
            if inside and value < off:
                out[found, 0], out[found, 1], out[found, 2] = at, base, greatest
                out[found, 3], out[found, 4] = sigma, matched_sigma
                found += 1
                inside = False
            elif value >= on and (not inside or value > greatest):
                inside = True
                greatest, at = value, float(start + i)
                sigma, matched_sigma = here, matched_here
                side = _centre_and_side(sums, lo, total, start + i, matched)[1]
                base = math.copysign(1.0, matched.gain) * (side + buffer[lo - origin])
            if quiet:
                break
    state[0] = 1.0 if inside else 0.0
    state[1], state[2], state[3] = at, base, greatest
    state[4], state[5] = sigma, matched_sigma
    return found
