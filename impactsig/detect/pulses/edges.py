"""Model-free quantities of one pulse, from its samples."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import kernel, njit
from ..signal.order_kernels import centre_of

NO_PULSE = -1  # flags of a stretch that turned out not to stand out
ERRORS = 10  # first column of the standard errors of start, contact, peak and impulse
SHARED, SHARED_PEAK = 14, 15  # what pulses of one span share of those of start and peak
FIT = 16  # first column of what is kept of a fit, see `fit_errors.py`


class Baseline(NamedTuple):
    """A line that was subtracted, and the standard errors of its level at `centre` and its slope.

    The slope itself is `tilt`.
    """

    at_top: float
    centre: float
    level: float
    slope: float
    tilt: float


@kernel
def walk(x, index, step, limit, level):
    """Walk outward from `index` to the first two successive samples below `level`."""
    while index != limit:
        if x[index] < level and (index + step == limit or x[index + step] < level):
            return index
        index += step
    return index


@kernel
def crossing(x, index, step, limit, level):
    """Position at which the signal first falls below `level`, outward, by linear interpolation."""
    if x[index] < level:
        return float(index)
    while index != limit:
        following = index + step
        if x[following] < level:
            return index + step * (x[index] - level) / (x[index] - x[following])
        index = following
    return float(limit)


@kernel
def edge_group(x, top, step, limit, level, noise):
    """Number of samples of an edge to average, and its slope [1 / sample], at a level.

    As many as show the slope between two groups to a tenth, within the lower half of the edge.
    """
    run = abs(crossing(x, top, step, limit, level) - crossing(x, top, step, limit, 2.0 * level))
    slope = level / max(run, 0.5)
    wanted = (10.0 * math.sqrt(2.0) * noise / slope) ** (2.0 / 3.0)
    return int(max(min(wanted, x[top] / (6.0 * slope)), 1.0)), slope


@kernel
def outermost(x, index, step, limit, level, run):
    """Last sample outward from `index` before `run` successive samples below `level`."""
    below = 0
    while index != limit and below < run:
        index += step
        below = below + 1 if x[index] < level else 0
    return index - step * below


@kernel
def touch(x, top, step, limit, level, noise):
    """Position at which the edge, extrapolated beyond the last sample above `level`, is zero.

    The parabola through that sample and the two before it, or their line where it does not
    reach zero; within a factor of two of the line, and not beyond the first sample that lies
    below half of `level`. In noise, through the means of three groups of samples, bent by as much
    as is more than noise.
    """
    group = edge_group(x, top, step, limit, level, noise)[0]
    # Where noise counts, one sample below a level is not yet the end.
    last = outermost(x, top, step, limit, level, min(group, 2))
    low = outermost(x, last, step, limit, 0.5 * level, group)
    low += step if low != limit and x[last] >= 0.5 * level else 0
    inner = (top - last) * -step
    if last == limit or inner < 2:
        return crossing(x, top, step, limit, level)
    drop = x[last] - x[last + step]
    if drop > 2.0 * (x[last - step] - x[last]) + 6.0 * noise:
        # A steep side, not the curve of a crest: the edge lies between two samples.
        return last + step * min(x[last] / drop, 1.0)
    group = min(group, (inner + 1) // 3)
    x0 = x1 = x2 = 0.0
    for i in range(group):
        x0 += x[last - step * i]
        x1 += x[last - step * (group + i)]
        x2 += x[last - step * (2 * group + i)]
    x0, x1, x2 = x0 / group, x1 / group, x2 / group
    slope, bend = x1 - x0, x2 - 2.0 * x1 + x0
    if slope <= 0.0:
        return crossing(x, top, step, limit, level)
    if noise > 0.0:
        bend *= bend * bend / (bend * bend + 6.0 * noise * noise / group)
    out = x0 / slope
    # x(u) = x0 - (slope - bend/2) u + bend/2 u^2, u groups outward from the middle of the last.
    linear = slope - 0.5 * bend
    square = linear * linear - 2.0 * bend * x0
    if square >= 0.0 and linear > 0.0:
        out = min(max(2.0 * x0 / (linear + math.sqrt(square)), 0.5 * out), 2.0 * out)
    touch = last + step * (group * out - 0.5 * (group - 1))
    return max(touch, float(low)) if step < 0 else min(touch, float(low))


@kernel
def crest_at(x, top, sigma):
    """Height and position of the crest at sample `top`, by a parabola.

    The sample itself where it does not stand out: at a plateau's edge a parabola would overshoot.
    """
    if not 0 < top < len(x) - 1 or x[top] - max(x[top - 1], x[top + 1]) <= 4.0 * sigma:
        return x[top], 0.0
    difference = x[top - 1] - x[top + 1]
    shift = 0.5 * difference / (x[top - 1] - 2.0 * x[top] + x[top + 1])
    return x[top] - 0.25 * difference * shift, shift


@kernel
def valley(x, a, b):
    """Index of the least mean of three samples strictly between a and b."""
    best = a + 1
    least = np.inf
    for i in range(a + 1, b):
        mean = x[i - 1] + x[i] + x[i + 1]
        if mean < least:
            least, best = mean, i
    return best


# reassoc: sums over the samples run in lanes.
@njit(nogil=True, error_model="numpy", _nrt=False, fastmath={"reassoc", "nsz", "contract"})
def remove_baseline(x, a, b, c, d, sigma, height, at_top, side):
    """Subtract the line through x[a:b] and x[c:d], in place (a level if one is empty).

    Returns it, with its value at index `at_top`. `side` is room for as many values as x has.

    Where the sides scatter far more than noise does (ringing, a neighbour), their median is used.
    """
    left, right = max(b - a, 0), max(d - c, 0)
    count = left + right
    if count < 4:
        return Baseline(0.0, float(at_top), sigma, 0.0, 0.0)
    # Places are counted from the middle of both, which those of whole numbers have in closed form.
    centre = (left * 0.5 * (a + b - 1) + right * 0.5 * (c + d - 1)) / count
    before, after = x[a : a + left], x[c : c + right]
    early, late = a - centre, c - centre
    total = cross = 0.0
    for i in range(left):
        total += before[i]
        cross += (i + early) * before[i]
    for i in range(right):
        total += after[i]
        cross += (i + late) * after[i]
    mean, slope, slope_error = total / count, 0.0, 0.0
    if left >= 4 and right >= 4:
        square = left * (left * left - 1.0) / 12.0 + right * (right * right - 1.0) / 12.0
        square += left * (0.5 * (a + b - 1) - centre) ** 2
        square += right * (0.5 * (c + d - 1) - centre) ** 2
        slope, slope_error = cross / square, sigma / math.sqrt(square)
    scatter = 0.0
    for i in range(left):
        scatter += (before[i] - mean - slope * (i + early)) ** 2
    for i in range(right):
        scatter += (after[i] - mean - slope * (i + late)) ** 2
    scatter = math.sqrt(scatter / count)
    error = sigma / math.sqrt(count)
    if scatter < 0.5 * sigma:
        error = sigma  # rounded to the same step, all of them
    elif scatter > max(2.0 * sigma, 0.05 * height):
        for i in range(left):
            side[i] = before[i]
        for i in range(right):
            side[left + i] = after[i]
        mean, slope, slope_error = centre_of(side, count), 0.0, 0.0
        error = scatter * math.sqrt(0.5 * math.pi / count)
    for i in range(len(x)):
        x[i] -= mean + slope * (i - centre)
    return Baseline(mean + slope * (at_top - centre), centre, error, slope_error, slope)


@kernel
def integral(x, a, b):
    """Integral of x from a to b, in samples.

    Cubic between samples where the four around a cell lie inside [a, b], linear at the ends.
    """
    total = 0.0
    for i in range(int(a), min(int(b) + 1, len(x) - 1)):
        u, v = max(a - i, 0.0), min(b - i, 1.0)
        if a <= i - 1 and i + 2 <= b:
            total += (13.0 * (x[i] + x[i + 1]) - x[i - 1] - x[i + 2]) / 24.0
        elif v > u:
            total += (v - u) * (x[i] + 0.5 * (u + v) * (x[i + 1] - x[i]))
    return total


@kernel
def mark_clipped(values, start, reference, factor, limit, rows):
    """Set the clipped flag of each measured pulse.

    What a clipped one has lost of its peak and impulse is unknown.

    Parameters
    ----------
    values : array
        As they came, from sample `start` on; samples are `factor` times what they are above the
        `reference`.
    limit : float
        Greatest sample of the record: three samples in a row at it are clipped.
    rows : array
        As `measure_all` fills them.
    """
    for k in range(len(rows)):
        run = longest = 0
        if rows[k, 5] != NO_PULSE:
            first = max(int(rows[k, 0]) - 1, start)
            last = min(int(rows[k, 0] + rows[k, 1]) + 2, start + len(values))
            for i in range(first, last):
                high = (np.float64(values[i - start]) - reference) * factor >= limit
                run = run + 1 if high else 0
                longest = max(longest, run)
        rows[k, 6] = 1.0 if longest >= 3 else 0.0
        if longest >= 3:
            rows[k, ERRORS + 2] = rows[k, ERRORS + 3] = np.inf
