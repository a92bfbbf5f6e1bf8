"""Kernels that recognise two pulses that touch or overlap.

Two half-sines are fitted to the samples (`pair_fit.py`), and one pulse of the family of shapes
(`_fit.py`). They are two where two half-sines leave far less than one pulse does: less by
what noise could explain, and less by what the shape of single pulses could.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ._fit import fit_pair, fit_pulse
from ._half_sine_kernels import FOOT, is_half_sine
from ._model import PARAMETERS, put_parameters
from .pair_fit import PAIR, begin_pair

PER_WIDTH = 24  # means of samples in a width that are looked at, at most
REACH = 3.2  # widths to either side of a crest within which a pair ends
CORE, LOW = 0.4, 0.35  # widths to either side that belong to a crest; and that separate pulses
FEWEST = 16  # points that the fits need
NOISE = 1.3  # times its variance: what a half-sine between the feet may leave, with ALIKE
ALIKE = 0.06  # of the height, root mean square: what is as near to a half-sine is one pulse
GAIN, SHAPE = 20.0, 0.015  # what two leave less than one, in the noise's variance; of the height
BETTER = 9.0  # times as much of what noise does not explain is left by one as by two
APART, UNLIKE, WEAK = 0.6, 2.5, 0.4  # contacts between starts, ratio of lengths, of heights
DIP = 0.9  # of the lower crest: what the samples fall below between two that touch
NOT_TWO, MAYBE, TWO = 0, 1, 2


class Window(NamedTuple):
    """Means of `per` samples around a pulse, above the baseline, in units of their noise."""

    points: int  # 0 where there is no such window
    per: int
    first: int  # sample of the series that the first point begins with
    unit: float
    level: float  # of the baseline
    left: float  # feet, in points
    right: float


class _Limits(NamedTuple):
    """Of sums of squares that are left, in the noise's variance."""

    rough: float  # by what counts as a half-sine
    clear: float  # by one pulse that explains the samples
    least: float  # more by one than by two, where there are two
    chance: float


@kernel
def look_around(x, origin, centre, width, height, base, sigma, points, means):
    """Fill `points` and `means` with the surroundings of a crest, feet included.

    The baseline is the mean of what lies outside of the feet, as far as it does not rise again.
    """
    per = max(1, int(width) // PER_WIDTH)
    reach = min(int(REACH * width / per) + 3, len(means) // 2 - 1)
    middle = (int(centre) - origin) // per
    lo, hi = max(0, middle - reach), min(len(x) // per, middle + reach + 1)
    for k in range(lo, hi):
        total = 0.0
        for i in range(k * per, (k + 1) * per):
            total += x[i]
        means[k - lo] = total / per - base
    end = hi - lo - 1
    noise = sigma / math.sqrt(per)
    stop = max(FOOT * height, 2.0 * noise)
    # All of the event belongs to it, and what follows before the samples stay low for a while.
    half, gap = int(CORE * width / per), max(2, int(LOW * width / per))
    left = _foot(means, max(middle - lo - half, 0), -1, 0, stop, gap)
    right = _foot(means, min(middle - lo + half, end), 1, end, stop, gap)
    pad = max(3, (right - left) // 5)
    first = _pad(means, left, -1, 0, pad, 1.5 * stop)
    last = _pad(means, right, 1, end, pad, 1.5 * stop)
    count = last - first + 1
    if count < FEWEST:
        return Window(0, per, 0, 0.0, 0.0, 0.0, 0.0)
    skip = max(1, (right - left) // 16)
    level, beside = 0.0, 0
    for k in range(first, last + 1):
        if k < left - skip or k > right + skip:
            level += means[k]
            beside += 1
    level = level / beside if beside >= 4 else 0.0
    # A thousandth of the height stands for a silent record's noise.
    unit = max(noise, 1e-3 * height)
    for k in range(count):
        points[k] = k
        means[k] = (means[first + k] - level) / unit
    start = origin + (lo + first) * per
    return Window(count, per, start, unit, base + level, float(left - first), float(right - first))


@kernel
def _foot(means, k, step, limit, stop, gap):
    """From point k outward to the first of `gap` points that lie below `stop`."""
    low = 0
    while low < gap and k != limit:
        low = low + 1 if means[k] < stop else 0
        k += step
    return k - step * low


@kernel
def _pad(means, k, step, limit, pad, stop):
    """Up to `pad` points further, as far as they do not rise above `stop`."""
    for _ in range(pad):
        if k == limit or means[k + step] > stop:
            break
        k += step
    return k


@allocating
def is_one_pulse(x, origin, centre, width, height, base, sigma):
    """Whether a crest is near enough to a half-sine to be one pulse; most are, and need no fit."""
    points, means = np.empty(8 * PER_WIDTH), np.empty(8 * PER_WIDTH)
    seen = look_around(x, origin, centre, width, height, base, sigma, points, means)
    return seen.points > 0 and _is_one(means[: seen.points], seen, _limits(seen, height))


@kernel
def _limits(seen, height):
    n, relative = seen.points, height / seen.unit
    chance = 2.0 * math.sqrt(2.0 * n)
    rough = n * (NOISE + (ALIKE * relative) ** 2)
    return _Limits(rough, n + chance, GAIN + n * (SHAPE * relative) ** 2, chance)


@allocating
def _is_one(means, seen, limits):
    # Of what leaves less, two cannot leave so much less.
    enough = max(limits.clear, limits.least)
    return is_half_sine(means, seen.left, seen.right, limits.rough, enough)


@allocating
def two_pulses(x, origin, centre, width, height, base, sigma, pair):
    """Whether a crest is that of two overlapping pulses; if so, fills `pair`.

    Parameters
    ----------
    pair : array (PAIR + 1,), filled
        Height, start and length of either [samples], and the level of the baseline.

    Returns
    -------
    int
        TWO; NOT_TWO where one pulse explains the samples; MAYBE where neither does.
    """
    points, means = np.empty(8 * PER_WIDTH), np.empty(8 * PER_WIDTH)
    seen = look_around(x, origin, centre, width, height, base, sigma, points, means)
    n = seen.points
    if n == 0:
        return MAYBE
    points, means = points[:n], means[:n]
    limits = _limits(seen, height)
    if _is_one(means, seen, limits):
        return NOT_TWO
    least = limits.least
    left_by_one = _left_by_one(points, means, seen, False)
    otherwise = NOT_TWO if left_by_one < limits.clear else MAYBE
    p = pair[:PAIR]
    # Two leave nothing at best.
    if left_by_one < least or not begin_pair(points, means, seen.left, seen.right, p):
        return otherwise
    left_by_two = n * fit_pair(points, means, p)
    if left_by_one - left_by_two < least or not plausible(p):
        return otherwise
    left_by_one = min(left_by_one, _left_by_one(points, means, seen, True))
    if left_by_one - left_by_two < least:
        return otherwise
    if left_by_two - n > (left_by_one - n) / BETTER + limits.chance:
        return otherwise
    to_samples(p, seen)
    pair[PAIR] = seen.level
    return TWO


@kernel
def plausible(p):
    """Whether both are separate pulses, and neither is a ripple on the other."""
    long, short = math.exp(max(p[2], p[5])), math.exp(min(p[2], p[5]))
    high, weak = max(p[0], p[3]), min(p[0], p[3])
    apart = p[4] - p[1]
    return weak > WEAK * high and long < UNLIKE * short and apart > APART * math.exp(p[2])


@kernel
def to_samples(p, seen):
    """Convert a pair's parameters in place, from points and units of the noise."""
    for m in range(0, PAIR, 3):
        p[m] *= seen.unit
        p[m + 1] = seen.first + p[m + 1] * seen.per + 0.5 * (seen.per - 1)
        p[m + 2] += math.log(seen.per)


@allocating
def _left_by_one(points, means, seen, from_feet):
    """Residual sum of squares of one pulse, fitted from its crossings or from its feet."""
    p = np.empty(PARAMETERS)
    _begin_one(means, p)
    half = 0.5 * (seen.right - seen.left)
    if from_feet:
        put_parameters(p[0], seen.left, half, 0.2 * half, half, p)
    return len(means) * fit_pulse(points, means, math.log(half), p).misfit


@kernel
def _begin_one(means, p):
    """Initial guess for one pulse: its crossings of 0.2 and 0.8 of the height."""
    top = 0
    for k in range(len(means)):
        if means[k] > means[top]:
            top = k
    early, late = 0, len(means) - 1
    while means[early] < 0.2 * means[top]:
        early += 1
    while means[late] < 0.2 * means[top]:
        late -= 1
    up, down = early, late
    while means[up] < 0.8 * means[top]:
        up += 1
    while means[down] < 0.8 * means[top]:
        down -= 1
    # A quarter-sine is at 0.2 and 0.8 of its height after 0.128 and 0.590 of its length.
    rise, fall = max((up - early) / 0.462, 1.0), max((late - down) / 0.462, 1.0)
    start = early - 0.128 * rise
    flat = max(late + 0.128 * fall - start - rise - fall, 0.1 * (rise + fall))
    put_parameters(means[top], start, rise, flat, fall, p)


@allocating
def crests_between_dips(x, base, mean, least, sure, crests, dips):
    """Crests of the running mean of x over `mean` samples, which dips between any two of them.

    A dip lies below DIP of either crest, and by `sure`; a crest is at least `least` above `base`.
    Crests and dips are numbers of the means; returns how many crests there are.
    """
    smooth = np.empty(len(x) - mean + 1)
    total = x[:mean].sum()
    for i in range(len(smooth)):
        smooth[i] = total / mean - base
        if i < len(smooth) - 1:
            total += x[i + mean] - x[i]
    crest, dip, n = 0, 0, 0
    falling = False
    for i in range(len(smooth)):
        if not falling:
            if smooth[i] > smooth[crest]:
                crest = i
            elif smooth[i] < min(DIP * smooth[crest], smooth[crest] - sure):
                if smooth[crest] >= least and n < len(crests):
                    crests[n] = crest
                    n += 1
                falling, dip = True, i
        else:
            if smooth[i] < smooth[dip]:
                dip = i
            elif smooth[dip] < min(DIP * smooth[i], smooth[i] - sure):
                if n > 0:
                    dips[n - 1] = dip
                falling, crest = False, i
    if not falling and smooth[crest] >= least and n < len(crests):
        crests[n] = crest
        n += 1
    return n
