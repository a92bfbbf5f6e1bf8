"""Scaling region of a divergence curve: the steps with the most certain slope."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri, stdtrit

BLOCKS = 30
"""Blocks of successive references that the scatter is told by."""

LEAST_POINTS = 4
LEAST_GROWTH = 1.0
"""Of the logarithm of the gap, over the region: by a factor e."""

BEND = 0.35
"""Difference of the slopes of the two halves, over the slope of all, at which it is no line."""

CURVED, CURVED_FREED = 0.17, 0.1
"""The stretch curve departs from its line by this much: an attractor is not alike on all scales.

It departs by more where noise of an unknown level bends it. Freed of noise, it may be seen to: then
twice what is seen counts.
"""

UNSTEADY = 0.06
"""A line of any length, freed of noise, has a slope that departs from the exponent by this share.

On a lacunar attractor neighbours at some distance are not where all are: 1 to 4 % at five
frequencies of the beam, at each with little scatter over series.
"""

BEYOND = 2.5
"""Standard errors by which the slope may be above one that leaves no line."""

RAISED = 0.5 / math.sqrt(3)
"""Standard error of what a curve was raised by: evenly distributed within half of it."""

ALONG = 0.5 * math.log(2)
"""Growth that a gap lacks whose halves were equal, and one of them does not grow."""

CANDIDATES = 48
"""First and last steps tried, at most."""


class Curve(NamedTuple):
    """A divergence curve, with the contribution of each block of references."""

    stretch: np.ndarray  # (K + 1,)
    blocks: np.ndarray  # (BLOCKS, K + 1)
    freed: bool = False  # of noise
    raised: np.ndarray | None = None  # by how much above the gaps, (K + 1,)


class Line(NamedTuple):
    """A line fitted to the curve, from step `first` to step `last`."""

    first: int
    last: int
    slope: float
    bend: float  # difference of the halves' slopes
    chance: float  # standard error of the slope over blocks
    unsure: float  # that of the bend
    departure: float  # of the curve, from the lowest below the line to the highest above
    freed: bool  # of noise
    raised: float = 0.0  # rise that the gaps themselves do not have
    most: float = math.inf  # slope above which it would not have been found


def median_curve(log: np.ndarray, time: np.ndarray) -> Curve:
    """Medians of the rows of `log`, shape (K + 1, pairs), with their scatter over blocks of time.

    A median moves by (1/2 - share below)/density: the blocks tell the share, and the density is
    that of the pairs within a quarter about the median.
    """
    stretch = np.median(log, axis=1)
    density = np.mean(np.abs(log - stretch[:, None]) <= 0.25, axis=1) / 0.5
    above = np.where(log > stretch[:, None], 0.5, -0.5)
    block = blocks_of_time(time)
    blocks = np.zeros((BLOCKS, len(log)))
    for b in range(BLOCKS):
        mine = block == b
        if mine.any():
            # Weighted as if all blocks were as large as the mean one.
            weight = mine.sum() * BLOCKS / len(time)
            blocks[b] = weight * above[:, mine].mean(axis=1)
    return Curve(stretch, blocks / np.maximum(density, 1e-9))


def blocks_of_time(time: np.ndarray) -> np.ndarray:
    """Index of the block of each reference."""
    return np.minimum(time * BLOCKS // (time.max() + 1), BLOCKS - 1)


def fit(curve: Curve, first: int, last: int) -> Line:
    """The least-squares line from step `first` to step `last`."""
    n = last - first + 1
    half = max(n // 2, 2)
    whole, part = _slope_weights(n), _slope_weights(half)
    turn = np.zeros(n)
    turn[-half:] += part
    turn[:half] -= part
    piece, blocks = curve.stretch[first : last + 1], curve.blocks[:, first : last + 1]
    slope = float(whole @ piece)
    chance, unsure = (blocks @ np.stack((whole, turn), axis=1)).std(axis=0, ddof=1)
    return Line(
        first,
        last,
        slope,
        float(turn @ piece),
        float(chance) / math.sqrt(BLOCKS),
        float(unsure) / math.sqrt(BLOCKS),
        float(np.ptp(piece - slope * np.arange(n))),
        curve.freed,
        0.0 if curve.raised is None else float(curve.raised[last] - curve.raised[first]),
    )


def best_line(
    curve: Curve, begin: int, least: int, end: int, low: float, high: float = math.inf
) -> Line | None:
    """The line within `begin` to `end`, above the level `low`, with the least standard error.

    Of all that end at step `least` or later, are long and straight enough and rise by a factor e,
    the one whose `standard_error` is the least share of its slope. The least error itself would
    prefer low slopes, since errors are shares of them: the exponent of the beam at 20.45 Hz came
    out 7 % low. What a curve was raised by is no rise. A curve that is beyond the level `high`
    before step `least` has no line.
    """
    found: Line | None = None
    least_error = math.inf
    if end - begin < LEAST_POINTS - 1:
        return None
    seen = curve.stretch if curve.raised is None else curve.stretch - curve.raised
    steps = np.unique(np.linspace(begin, end, min(CANDIDATES, end - begin + 1)).astype(int))
    for first in steps:
        if seen[first] < low:
            continue
        for last in steps[steps >= max(first + LEAST_POINTS - 1, least)]:
            if seen[last] - seen[first] < LEAST_GROWTH:
                continue
            line = fit(curve, int(first), int(last))
            if line.slope <= 0 or abs(line.bend) > BEND * line.slope:
                continue
            error = standard_error(line) / line.slope
            if error < least_error:
                found, least_error = line, error
    if found is None or found.first >= least:
        return found
    most = (high - float(curve.stretch[found.first])) / (least - found.first)
    return found._replace(most=max(most, found.slope))


def standard_error(line: Line) -> float:
    """Standard error of the slope: statistical, and from deviations of the curve from a line.

    Freed of noise, that is half of its bend as far as this is not by chance, and no less than what
    the curve departs from its line by, however it winds: of a parabola that departs by d over n
    steps, half of the bend is 2 d / n. Of 2000 intervals of Lorenz' flow in four coordinates d is
    0.1 to 0.2, and the slope is 12 % low. Under unknown noise the bend counts in full, and no less
    than it may be by chance: of the beam at 20.3355 Hz with 10 microseconds of jitter chance alone
    held the exponent in 38 % of 40 series of 2000 intervals, as the median bends where the noise
    ends. What a curve was raised by to be straight is known to half of it.
    """
    steps = line.last - line.first
    chance = math.hypot(line.chance, RAISED * line.raised / steps)
    if line.freed:
        bend = 0.5 * math.sqrt(max(line.bend**2 - line.unsure**2, 0.0))
        departure = max(2 * line.departure, CURVED_FREED)
        least = max(departure / steps, UNSTEADY * abs(line.slope))
        return math.hypot(chance, max(bend, least))
    return max(
        math.hypot(chance, 0.5 * line.unsure, 0.5 * line.bend),
        math.hypot(chance, CURVED / steps),
    )


def interval(line: Line, in_phase: bool = False) -> tuple[float, float]:
    """95 % interval of the slope, of pairs that stay in phase or not.

    Steeper curves than `line.most` have no line, so that what is found is a selection of too low
    ones, the more so the nearer to that it is: of 2000 intervals of Lorenz' flow in four
    coordinates with 2 % of noise, half of the series have a line, and slopes are 17 % low. The
    upper end is that of a normal deviate known to be below that bound.

    Pairs in phase may be apart along the flow too, where they stay so, and then grow by less.
    """
    error = standard_error(line)
    reach = float(stdtrit(BLOCKS - 1, 0.975)) * error
    wider = _selected((line.most - line.slope) / error) if error > 0 else 1.0
    more = ALONG / (line.last - line.first) if in_phase else 0.0
    return line.slope - reach, line.slope + wider * reach + more


def _selected(bound: float) -> float:
    """Upper end of the interval of a mean, for a deviate `bound` standard errors below a bound.

    As a multiple of the usual one. It is the mean of which one in 40 of the deviates below the
    bound is as low as the one found; but no mean 2.5 standard errors above the bound, of which
    one deviate in 160 is below it.
    """
    usual = float(ndtri(0.975))
    if bound > 6:
        return 1.0

    def rarer(z: float) -> float:
        return float(ndtr(-z) - 0.025 * ndtr(bound - z))

    most = bound + BEYOND
    return (most if rarer(most) > 0 else float(brentq(rarer, usual, most))) / usual


def _slope_weights(n: int) -> np.ndarray:
    k = np.arange(n) - (n - 1) / 2
    return k / (k @ k)
