"""Pulses of one shape, whatever it is, laid on each other.

Where no member of the family is near the pulses, fits of the family say neither how they lie to
each other nor how long they are. Here each pulse is A T((t - t0) / w), with a mean pulse T
(`_mean_pulse.py`). Pulses are fitted to T by A, t0 and ln w, and T to the pulses so scaled, in
turns. The first t0 and w are where the pulse crosses BEGINS of its height, so that no shape is
assumed. What the clear ones tell of the scatter of ln w is the prior of all others, which are
measured last.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...signal.order_kernels import centre_of
from .._damped_step import damped_step, factor_damped, more_damped
from .._small_matrices import invert
from ..edges import FIT
from ..fit_errors import CLEAR, FROM, NOISE, TO, ZERO
from ._common_rest import EXACT, LEAST, MEAN_SLOPE
from ._mean_pulse import (
    AMPLITUDE,
    COLUMNS,
    FIRST,
    HIGH,
    LAST,
    LOW,
    MISFIT,
    ONE,
    PLACE,
    SIGMA,
    WIDTH,
    Laid,
    Mean,
    build,
    height_at,
    is_seen,
    sample,
)

BEGINS = 0.3
"""Height of the crossings that pulses are first laid on each other by."""
FINEST, SAMPLES = 1.0 / 64.0, 4.0
"""Distance of knots [widths], and samples between two at least."""
COARSEST = 0.25
"""Distance of knots that shows no shape."""
ROUNDS, STAYS, STEPS = 10, 0.05, 3
"""Of fits to the mean pulse, until instants stay [errors]; steps in each."""
FREE, LEAST_SPREAD = 0.5, 5e-4
"""Standard deviation of ln w, before it is known, and no less is it taken to be."""
FIRST_DAMPING, FLOOR = 1e-3, 1e-300
"""Of steps, which begin near; on the diagonal, where samples say nothing of a parameter."""
SCAN = 24.0
"""Steps in a width in which the place of a faint pulse is looked for."""


@allocating
def lay(rows, x, origin, clear):
    """The pulses that are seen; `clear` or the others. With samples up to their neighbours'.

    Before the first and after the last, up to where they were looked at: what follows is unknown.
    """
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
        first, last = kept[FROM], kept[TO]
        if k > 0:
            before = rows[k - 1]
            end = before[0] + 1.5 * before[1]
            if is_seen(before):
                end = before[FIT + ZERO] + before[FIT + TO]
            first = math.ceil(end) - zero
        if k + 1 < len(rows):
            after = rows[k + 1]
            begin = after[0] - 0.25 * after[1]
            if is_seen(after):
                begin = after[FIT + ZERO] + after[FIT + FROM]
            last = math.floor(begin) - zero
        known[i, FIRST] = max(min(first, kept[FROM]), origin - zero)
        known[i, LAST] = min(max(last, kept[TO]), origin + len(x) - zero)
        known[i, SIGMA] = max(kept[NOISE], EXACT * rows[k, 2])
        known[i, AMPLITUDE], known[i, ONE] = rows[k, 2], k
    return Laid(known, covariance)


@kernel
def _cross(row, x, origin, one):
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


@kernel
def _normal_at(p, one, kept, x, origin, mean, about, spread, normal):
    """Sum of squares of noise that the mean pulse at `p` leaves, and the same with the prior.

    Fills the normal equations (3 x 4), which have the prior of ln w.
    """
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
    off = (about - p[2]) / spread
    normal[2, 2] += spread**-2.0
    normal[2, 3] += off / spread
    return misfit, misfit + off * off


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
        misfit, cost = _normal_at(p, one, kept, x, origin, mean, about, spread, here)
        damping = FIRST_DAMPING
        for _ in range(steps):
            if not damped_step(here, damping, FLOOR, low, step):
                break
            width = math.exp(p[2])
            trial[0] = p[0] + min(max(step[0], -0.5 * p[0]), p[0])
            trial[1] = p[1] + min(max(step[1], -0.3 * width), 0.3 * width)
            trial[2] = p[2] + min(max(step[2], -0.3), 0.3)
            left, new = _normal_at(trial, one, kept, x, origin, mean, about, spread, there)
            if new < cost:
                p, trial, here, there = trial, p, there, here
                misfit, cost, damping = left, new, 0.1 * damping
            else:
                damping = more_damped(damping)
        if factor_damped(here, 1e-12, FLOOR, low):
            invert(low, laid.covariance[i])
        error = math.sqrt(max(laid.covariance[i, 1, 1], 1e-300))
        farthest = max(farthest, abs(p[1] - one[PLACE]) / error)
        one[AMPLITUDE], one[PLACE], one[WIDTH] = p[0], p[1], p[2]
        one[MISFIT] = misfit / max(one[LAST] - one[FIRST] - 3.0, 1.0)
    return farthest


@allocating
def _spread_of(laid):
    """Mean of ln w, and its standard deviation, from fits of clear ones."""
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
    return about, math.sqrt(max(expected, LEAST_SPREAD**2))


@allocating
def lay_clear(rows, x, origin):
    """Lay the clear pulses of a span on each other.

    Returns
    -------
    (whether this is possible, the pulses, their mean, mean and spread of ln w)
    """
    every = lay(rows, x, origin, True)
    count = 0
    for i in range(len(every.known)):
        if _cross(rows[int(every.known[i, ONE])], x, origin, every.known[i]):
            every.known[count] = every.known[i]
            count += 1
    laid = Laid(every.known[:count], every.covariance[:count])
    none = Mean(np.zeros(2), np.zeros(2), 1.0)
    if count < LEAST:
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
    # Samples in a width, of pulses that count as much as the clearest.
    many = math.exp(about) * square * square / fourth
    apart = max(FINEST, SAMPLES / many)
    if apart > COARSEST:
        return False, laid, none, 0.0, 1.0
    knots = int((HIGH - LOW) / apart) + 2
    mean = Mean(np.zeros(knots), np.zeros(knots), apart)
    spread = FREE
    for turn in range(ROUNDS):
        mean = build(laid, rows, x, origin, mean)
        moved = fit_to(laid, rows, x, origin, mean, about, spread, STEPS)
        # A common width and that of the mean pulse are one: it is held.
        change = _spread_of(laid)[0] - about
        for i in range(count):
            laid.known[i, WIDTH] -= change
        if turn > 1 and moved < STAYS:
            break
    about, spread = _spread_of(laid)
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
        at = max(at, one[FIRST] - end * width)
        until = min(until, one[LAST] - begin * width)
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
