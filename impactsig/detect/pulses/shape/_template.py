"""The mean pulse of a span, of whatever shape, and the pulses measured with it.

Where no member of the family is near the pulses, fits of the family say neither how they lie to
each other nor how long they are. Here clear pulses are brought to lie on each other: each is

    A T((t - t0) / w),

with a mean pulse T of straight lines between knots. Pulses are fitted to T by A, t0 and ln w, and T
to the pulses so scaled, in turns. The first t0 and w are where the pulse crosses BEGINS of its
height, so that no shape is assumed. What the clear ones tell of the scatter of ln w is the prior of
all others, which are measured last.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...signal.order_kernels import centre_of
from .._small_matrices import factor, invert, solve
from ..edges import FIT
from ..fit_errors import BASE, CLEAR, FROM, NOISE, SEEN, TILT, TO, ZERO
from ._common_rest import EXACT, MEAN_SLOPE

BEGINS = 0.3
"""Height of the crossings that pulses are first laid on each other by."""
LOW, HIGH = -1.5, 5.0
"""Where the mean pulse is looked for [widths at that height, from the first crossing]."""
FINEST, SAMPLES = 1.0 / 64.0, 4.0
"""Distance of knots [widths], and samples between two at least."""
SMOOTH = 1e-3
"""Of the mean weight of a knot: with so much the line between two stays as it was."""
CURVED, NEAR = 2.0, 3
"""Second derivative of the mean pulse that is expected at least, and knots to either side that tell
more of it."""
ROUNDS, STAYS, STEPS = 10, 0.05, 3
"""Of fits to the mean pulse, until instants stay [errors]; steps in each."""
FREE, LEAST = 0.5, 5e-4
"""Standard deviation of ln w, before it is known, and no less is it taken to be."""
SCAN = 24.0
"""Steps in a width in which the place of a faint pulse is looked for."""
AMPLITUDE, PLACE, WIDTH, FIRST, LAST, SIGMA, MISFIT, ONE = range(8)
COLUMNS = 8
"""Of what is known of a pulse: A, t0 and ln w, samples, their noise, misfit over noise; its row."""


class Mean(NamedTuple):
    """The mean pulse: heights at knots, their weights, and distance of knots [widths]."""

    heights: np.ndarray
    weight: np.ndarray
    apart: float


class Laid(NamedTuple):
    """Pulses laid on each other: what is known of each, and the covariances of A, t0, ln w."""

    known: np.ndarray  # (n, COLUMNS)
    covariance: np.ndarray  # (n, 3, 3)


@kernel
def height_at(v, mean):
    """The mean pulse at a place [widths]; nothing beyond its knots."""
    place = (v - LOW) / mean.apart
    if not 0.0 <= place < len(mean.heights) - 1:
        return 0.0
    j = int(place)
    return mean.heights[j] + (place - j) * (mean.heights[j + 1] - mean.heights[j])


@kernel
def sample(x, origin, kept, i):
    """A sample of a pulse, from the place that it counts from, above its baseline."""
    return x[int(kept[ZERO]) + i - origin] - kept[BASE] - kept[TILT] * i


@kernel
def is_seen(row):
    """Whether a pulse is whole, and what it was measured in is kept."""
    return row[5] == 0 and row[6] == 0 and row[FIT + SEEN] >= 0.0 and row[2] > 0.0


@allocating
def lay(rows, x, origin, clear):
    """The pulses that are seen; `clear` or the others. With samples up to their neighbours'."""
    chosen = np.empty(len(rows), np.int64)
    count = 0
    for k in range(len(rows)):
        if is_seen(rows[k]) and (rows[k, 2] >= CLEAR * rows[k, FIT + NOISE]) == clear:
            chosen[count] = k
            count += 1
    known, covariance = np.zeros((count, COLUMNS)), np.zeros((count, 3, 3))
    for i in range(count):
        k = chosen[i]
        kept = rows[k, FIT:]
        zero = kept[ZERO]
        first, last = origin - zero, origin + len(x) - zero
        if k > 0:
            before = rows[k - 1]
            end = before[0] + 1.5 * before[1]
            if is_seen(before):
                end = before[FIT + ZERO] + before[FIT + TO]
            first = max(first, math.ceil(end) - zero)
        if k + 1 < len(rows):
            after = rows[k + 1]
            begin = after[0] - 0.25 * after[1]
            if is_seen(after):
                begin = after[FIT + ZERO] + after[FIT + FROM]
            last = min(last, math.floor(begin) - zero)
        known[i, FIRST] = max(min(first, kept[FROM]), origin - zero)
        known[i, LAST] = min(max(last, kept[TO]), origin + len(x) - zero)
        known[i, SIGMA] = max(kept[NOISE], EXACT * rows[k, 2])
        known[i, AMPLITUDE], known[i, ONE] = rows[k, 2], k
    return Laid(known, covariance)


@kernel
def cross(row, x, origin, one):
    """Put the first crossing from outside and the width of a pulse into `one`; whether it has."""
    kept = row[FIT:]
    level, first, last = BEGINS * row[2], int(kept[FROM]), int(kept[TO]) - 1
    begin, end = first, last
    while begin < last and not _is_above(x, origin, kept, begin, 1, level, last):
        begin += 1
    while end > first and not _is_above(x, origin, kept, end, -1, level, first):
        end -= 1
    if begin <= first or end >= last or end < begin:
        return False
    low, high = sample(x, origin, kept, begin - 1), sample(x, origin, kept, begin)
    one[PLACE] = begin - min(max((high - level) / max(high - low, 1e-300), 0.0), 1.0)
    low, high = sample(x, origin, kept, end + 1), sample(x, origin, kept, end)
    until = end + min(max((high - level) / max(high - low, 1e-300), 0.0), 1.0)
    one[WIDTH] = math.log(max(until - one[PLACE], 0.5))
    return True


@kernel
def _is_above(x, origin, kept, i, step, level, limit):
    """Whether the edge of a pulse lies at sample i: that one or the next are no noise."""
    here = sample(x, origin, kept, i)
    if here < level:
        return False
    return i == limit or here >= 2.0 * level or sample(x, origin, kept, i + step) >= level


@allocating
def build(laid, rows, x, origin, before):
    """The mean pulse of pulses as they are laid; `before` is that of the last round.

    Samples count less by how much the error of t0 moves them.
    """
    count, apart = len(before.heights), before.apart
    own, beside, right = np.zeros(count), np.zeros(count), np.zeros(count)
    for i in range(len(laid.known)):
        one = laid.known[i]
        kept = rows[int(one[ONE]), FIT:]
        width, height = math.exp(one[WIDTH]), one[AMPLITUDE]
        blur = math.sqrt(max(laid.covariance[i, 1, 1], 0.0)) / width
        near = max(0.5 * apart, MEAN_SLOPE / width)
        first = int(max(one[FIRST], math.ceil(one[PLACE] + LOW * width)))
        last = int(min(one[LAST], math.floor(one[PLACE] + HIGH * width)))
        for j in range(first, last):
            v = (j - one[PLACE]) / width
            place = (v - LOW) / apart
            b = int(place)
            if not 0 <= b < count - 1:
                continue
            slope = (height_at(v + near, before) - height_at(v - near, before)) / (2.0 * near)
            weight = height**2 / (one[SIGMA] ** 2 + (height * slope * blur) ** 2)
            value, f = sample(x, origin, kept, j) / height, place - b
            own[b] += weight * (1.0 - f) ** 2
            own[b + 1] += weight * f * f
            beside[b] += weight * f * (1.0 - f)
            right[b] += weight * (1.0 - f) * value
            right[b + 1] += weight * f * value
    total = 0.0
    for b in range(count):
        total += own[b]
    smooth = max(SMOOTH * total / count, 1e-300)
    weight = own.copy()
    for b in range(count - 1):
        change = smooth * (before.heights[b + 1] - before.heights[b])
        own[b] += smooth
        own[b + 1] += smooth
        beside[b] -= smooth
        right[b] -= change
        right[b + 1] += change
    own[0] += smooth
    own[count - 1] += smooth
    heights = np.empty(count)
    none = np.zeros(count)
    _solve_bands(own, beside, none, right, heights)
    own_too, beside_too, beyond = own.copy(), beside.copy(), np.zeros(count)
    for b in range(1, count - 1):
        one = 1.0 / _bend(heights, own, b, apart)
        own_too[b - 1] += one
        own_too[b] += 4.0 * one
        own_too[b + 1] += one
        beside_too[b - 1] -= 2.0 * one
        beside_too[b] -= 2.0 * one
        beyond[b - 1] += one
    smoothed = np.empty(count)
    _solve_bands(own_too, beside_too, beyond, right, smoothed)
    return Mean(smoothed, weight, apart)


@kernel
def _bend(heights, weight, b, apart):
    """Expected square of the second difference of heights about a knot, with noise taken off."""
    total = count = 0.0
    for k in range(max(b - NEAR, 1), min(b + NEAR + 1, len(heights) - 1)):
        second = heights[k - 1] - 2.0 * heights[k] + heights[k + 1]
        total += second**2 - 1.0 / weight[k - 1] - 4.0 / weight[k] - 1.0 / weight[k + 1]
        count += 1.0
    return max(total / count, (CURVED * apart * apart) ** 2)


@allocating
def _solve_bands(own, beside, beyond, right, out):
    """Put the solution of a symmetric positive definite system of five diagonals into `out`."""
    count = len(own)
    pivot, first, second = np.empty(count), np.zeros(count), np.zeros(count)
    for b in range(count):
        pivot[b] = own[b]
        if b > 0:
            pivot[b] -= first[b - 1] ** 2 * pivot[b - 1]
        if b > 1:
            pivot[b] -= second[b - 2] ** 2 * pivot[b - 2]
        pivot[b] = max(pivot[b], 1e-300)
        first[b] = beside[b]
        if b > 0:
            first[b] -= first[b - 1] * second[b - 1] * pivot[b - 1]
        first[b] /= pivot[b]
        second[b] = beyond[b] / pivot[b]
        out[b] = right[b]
        if b > 0:
            out[b] -= first[b - 1] * out[b - 1]
        if b > 1:
            out[b] -= second[b - 2] * out[b - 2]
    for b in range(count - 1, -1, -1):
        out[b] /= pivot[b]
        if b + 1 < count:
            out[b] -= first[b] * out[b + 1]
        if b + 2 < count:
            out[b] -= second[b] * out[b + 2]


@kernel
def _normal_at(p, one, kept, x, origin, mean, normal):
    """Sum of squares of noise that the mean pulse at `p` leaves; normal equations (3 x 4)."""
    for m in range(3):
        for n in range(4):
            normal[m, n] = 0.0
    height, width = p[0], math.exp(p[2])
    near = max(0.5 * mean.apart, MEAN_SLOPE / width)
    over, misfit = one[SIGMA] ** -2.0, 0.0
    for i in range(int(one[FIRST]), int(one[LAST])):
        v = (i - p[1]) / width
        f = height_at(v, mean)
        slope = (height_at(v + near, mean) - height_at(v - near, mean)) / (2.0 * near)
        j1 = -height * slope / width
        j2 = j1 * (i - p[1])
        e = sample(x, origin, kept, i) - height * f
        misfit += over * e * e
        normal[0, 0] += over * f * f
        normal[1, 0] += over * j1 * f
        normal[1, 1] += over * j1 * j1
        normal[2, 0] += over * j2 * f
        normal[2, 1] += over * j2 * j1
        normal[2, 2] += over * j2 * j2
        normal[0, 3] += over * f * e
        normal[1, 3] += over * j1 * e
        normal[2, 3] += over * j2 * e
    return misfit


@allocating
def fit_to(laid, rows, x, origin, mean, about, spread, steps):
    """Fit pulses to the mean pulse, ln w being `about` +- `spread`; how far t0 moves [errors]."""
    here, there = np.zeros((3, 4)), np.zeros((3, 4))
    low, p, trial, step = np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3)
    farthest = 0.0
    for i in range(len(laid.known)):
        one = laid.known[i]
        kept = rows[int(one[ONE]), FIT:]
        p[0], p[1], p[2] = one[AMPLITUDE], one[PLACE], one[WIDTH]
        misfit = _normal_at(p, one, kept, x, origin, mean, here)
        cost, damping = misfit + ((p[2] - about) / spread) ** 2, 1e-3
        for _ in range(steps):
            for m in range(3):
                for n in range(m):
                    low[m, n] = here[m, n]
                low[m, m] = here[m, m] * (1.0 + damping) + 1e-300
                step[m] = here[m, 3]
            low[2, 2] += spread**-2.0
            step[2] -= (p[2] - about) / spread**2
            if not factor(low):
                break
            solve(low, step)
            width = math.exp(p[2])
            trial[0] = p[0] + min(max(step[0], -0.5 * p[0]), p[0])
            trial[1] = p[1] + min(max(step[1], -0.3 * width), 0.3 * width)
            trial[2] = p[2] + min(max(step[2], -0.3), 0.3)
            new = _normal_at(trial, one, kept, x, origin, mean, there)
            new_cost = new + ((trial[2] - about) / spread) ** 2
            if new_cost < cost:
                for m in range(3):
                    p[m] = trial[m]
                    for n in range(4):
                        here[m, n] = there[m, n]
                misfit, cost, damping = new, new_cost, 0.1 * damping
            else:
                damping = max(10.0 * damping, 0.1)
        for m in range(3):
            for n in range(m + 1):
                low[m, n] = here[m, n]
            low[m, m] += 1e-12 * here[m, m] + 1e-300
        low[2, 2] += spread**-2.0
        if factor(low):
            invert(low, laid.covariance[i])
        error = math.sqrt(max(laid.covariance[i, 1, 1], 1e-300))
        farthest = max(farthest, abs(p[1] - one[PLACE]) / error)
        one[AMPLITUDE], one[PLACE], one[WIDTH] = p[0], p[1], p[2]
        one[MISFIT] = misfit / max(one[LAST] - one[FIRST] - 3.0, 1.0)
    return farthest


@allocating
def spread_of(laid, spread):
    """Mean of ln w, and its standard deviation, from fits with a prior of `spread`."""
    n = len(laid.known)
    noise = np.empty(n)
    for i in range(n):
        # The prior hardly counts in clear pulses.
        noise[i] = max(laid.covariance[i, 2, 2], 1e-12)
    variance, about, error = 0.0, 0.0, 0.0
    for _ in range(8):
        total = weight = 0.0
        for i in range(n):
            one = 1.0 / (noise[i] + variance)
            total += one * laid.known[i, WIDTH]
            weight += one
        about = total / weight
        total = square = 0.0
        for i in range(n):
            one = (noise[i] + variance) ** -2.0
            # The mean follows each by its share.
            own = 1.0 - 1.0 / ((noise[i] + variance) * weight)
            total += one * ((laid.known[i, WIDTH] - about) ** 2 / max(own, 0.1) - noise[i])
            square += one
        variance, error = max(total / square, 0.0), 2.0 / square
    expected = 0.5 * (variance + math.sqrt(variance * variance + error))
    return about, math.sqrt(max(expected, LEAST**2))


@allocating
def lay_clear(rows, x, origin, fewest):
    """Lay the clear pulses of a span on each other.

    Returns
    -------
    (whether this is possible, the pulses, their mean, mean and spread of ln w)
    """
    every = lay(rows, x, origin, True)
    count = 0
    for i in range(len(every.known)):
        if cross(rows[int(every.known[i, ONE])], x, origin, every.known[i]):
            every.known[count] = every.known[i]
            count += 1
    laid = Laid(every.known[:count], every.covariance[:count])
    none = Mean(np.zeros(2), np.zeros(2), 1.0)
    if count < fewest:
        return False, laid, none, 0.0, 1.0
    widths = np.empty(count)
    square = fourth = 0.0
    for i in range(count):
        widths[i] = laid.known[i, WIDTH]
        one = (laid.known[i, AMPLITUDE] / laid.known[i, SIGMA]) ** 2
        square += one
        fourth += one * one
    about = centre_of(widths, count)
    for i in range(count):
        _look_within(laid.known[i], about, LOW, HIGH)
    many = math.exp(about) * square * square / fourth
    apart = max(FINEST, SAMPLES / many)
    if apart > 0.25:
        return False, laid, none, 0.0, 1.0
    knots = int((HIGH - LOW) / apart) + 2
    mean = Mean(np.zeros(knots), np.zeros(knots), apart)
    spread = FREE
    for turn in range(ROUNDS):
        mean = build(laid, rows, x, origin, mean)
        moved = fit_to(laid, rows, x, origin, mean, about, spread, STEPS)
        about = spread_of(laid, spread)[0]
        if turn > 1 and moved < STAYS:
            break
    about, spread = spread_of(laid, spread)
    return True, laid, mean, about, spread


@kernel
def _look_within(one, width, low, high):
    """Bound the samples of a pulse to those from `low` to `high` about where it is."""
    wide = math.exp(width)
    one[FIRST] = max(one[FIRST], math.floor(one[PLACE] + low * wide))
    one[LAST] = max(min(one[LAST], math.ceil(one[PLACE] + high * wide) + 1.0), one[FIRST])


@kernel
def place_faint(laid, rows, x, origin, mean, about, begin, end):
    """Put pulses where the mean pulse, from `begin` to `end`, fits best, with its mean width."""
    width = math.exp(about)
    step = max(0.25, width / SCAN)
    for i in range(len(laid.known)):
        one = laid.known[i]
        row = rows[int(one[ONE])]
        kept = row[FIT:]
        from_row = row[0] - kept[ZERO]
        at = from_row - begin * width - 0.5 * (end - begin) * width
        until = from_row + max(row[1], 0.5 * (end - begin) * width)
        best, found, height = 0.0, from_row - begin * width, row[2]
        while at <= until:
            both = own = 0.0
            low = int(max(one[FIRST], math.ceil(at + begin * width)))
            high = int(min(one[LAST], math.floor(at + end * width) + 1.0))
            for k in range(low, high):
                f = height_at((k - at) / width, mean)
                both += f * sample(x, origin, kept, k)
                own += f * f
            if both > 0.0 and both * both > best * own:
                best, found, height = both * both / own, at, both / own
            at += step
        one[PLACE], one[WIDTH], one[AMPLITUDE] = found, about, max(height, 0.1 * row[2])
        _look_within(one, about, begin - 0.5, end + 0.5)


STRETCHES = 3
"""Stretches between two knots in which edges are looked at."""


@allocating
def edge_of(laid, rows, x, origin, mean, side, crest):
    """The edge of the mean pulse, as `read_end` takes it; `side` -1 for the end."""
    many = STRETCHES * (len(mean.heights) - 1)
    apart = mean.apart / STRETCHES
    sums = np.zeros((3, many))
    for i in range(len(laid.known)):
        one = laid.known[i]
        kept = rows[int(one[ONE]), FIT:]
        width, height = math.exp(one[WIDTH]), one[AMPLITUDE] * crest
        near = max(0.5 * mean.apart, MEAN_SLOPE / width)
        back = _back(laid.covariance[i], width)
        for j in range(int(one[FIRST]), int(one[LAST])):
            v = (j - one[PLACE]) / width
            b = math.floor((v - LOW) / apart)
            if not 0 <= b < many:
                continue
            slope = (height_at(v + near, mean) - height_at(v - near, mean)) / (2.0 * near * crest)
            blur = (height * slope) ** 2 * max(back[0] + v * (2.0 * back[1] + v * back[2]), 0.0)
            weight = height**2 / (one[SIGMA] ** 2 + blur)
            sums[0, b] += weight
            sums[1, b] += weight * v
            sums[2, b] += weight * sample(x, origin, kept, j) / height
    u, y, w = np.empty(many), np.empty(many), np.empty(many)
    count = 0
    for k in range(many):
        b = k if side > 0 else many - 1 - k
        if sums[0, b] > 0.0:
            u[count] = side * sums[1, b] / sums[0, b]
            y[count], w[count] = sums[2, b] / sums[0, b], sums[0, b]
            count += 1
    return u[:count], y[:count], w[:count]


@kernel
def _back(covariance, width):
    """Variances of t0 [widths], with ln w and of ln w."""
    return covariance[1, 1] / width**2, covariance[2, 1] / width, covariance[2, 2]
