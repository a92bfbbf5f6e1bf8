"""Pairs of pulses of unknown shape, measured as sines to a power that they share."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..edges import ERRORS
from ._alike_kernels import BEFORE, KNOTS, PER_CONTACT
from ._pulses_of_shape import SIZES, Shape, Stretch, descend, measure_by_shape

FORGOTTEN = 0.3  # of what is known of the power, at each span
LOOSE = 0.25  # standard deviation of the logarithms of contact times
LOG, LOG_SD, STEPS = 0.2, 0.3, (0.35, 0.15, 0.05)
"""Logarithm of the power of a sine that an unknown shape is expected to be, and its standard
deviation; steps to either side in which it is looked for."""
STEP, HIDDEN, HIDES = 0.1, (1.2, 2.2), 3.0
"""Of the logarithm, to see what it moves; contact times that starts and contact times of shapes
outside of a family are off by, times what is left of them over the height; and standard deviations
of chi squared that noise hides of it."""
LOWEST, HIGHEST = -0.3, 0.9  # logarithms of powers
MOST = 8  # pairs of a span that tell the power


class Power(NamedTuple):
    """Logarithm of the power of a sine that pairs are like, and what is known of it."""

    log: float = LOG
    known: float = LOG_SD**-2.0  # over the square of its error
    rest: float = 0.0  # mean square of what it leaves, or noise may hide of it, over the height's


def find_power(pairs: list[tuple[np.ndarray, Stretch]], usual: float, before: Power) -> Power:
    """The power of a sine that fits pairs best; what spans `before` tell is forgotten slowly.

    It is where the parabola through three sums of squares is least, in ever smaller steps.
    """
    known = max((1.0 - FORGOTTEN) * before.known, LOG_SD**-2.0)
    log, total = before.log, known
    rest = square = points = 0.0
    for step in STEPS:
        slope, total = known * (log - before.log), known
        rest = square = points = 0.0
        for two, seen in pairs[:MOST]:
            shapes = (shape_of_power(log + m * step, usual) for m in (-1, 0, 1))
            low, middle, high = (descend(two, seen, shape)[2] for shape in shapes)
            least = min(low, middle, high)
            if not math.isfinite(low + middle + high):
                continue
            scale = 0.5 * len(seen.points) / max(least, 1.0)  # of noise, by what is left
            slope += scale * 0.5 * (high - low) / step
            total += scale * max(high - 2.0 * middle + low, 0.0) / step**2
            one = (seen.unit / seen.height) ** 2
            rest, square, points = (
                rest + (least - 1.0) * one,
                square + one,
                points + len(seen.points),
            )
        log -= min(max(slope / total, -1.5 * step), 1.5 * step)
        log = min(max(log, LOWEST), HIGHEST)
    if not points:
        return Power(log, total, before.rest)
    count = min(len(pairs), MOST)
    return Power(log, total, (max(rest, 0.0) + HIDES * math.sqrt(2.0 / points) * square) / count)


def measure_by_power(two: np.ndarray, seen: Stretch, usual: float, power: Power) -> None:
    """Measure a pair by a power of a sine, if it fits."""
    before = two.copy()
    if not measure_by_shape(two, seen, shape_of_power(power.log, usual)):
        return
    if not measure_by_shape(before, seen, shape_of_power(power.log + STEP, usual)):
        before = two
    turned = (before[:, :SIZES] - two[:, :SIZES]) / STEP * power.known**-0.5
    ends = math.sqrt(power.rest) * two[:, [1]] * [*HIDDEN, 0.0, 0.0]
    errors = two[:, ERRORS : ERRORS + SIZES]
    two[:, ERRORS : ERRORS + SIZES] = np.hypot(np.hypot(errors, turned), ends)


def shape_of_power(log: float, usual: float) -> Shape:
    """The shape of a sine to a power."""
    place = (np.arange(KNOTS) - BEFORE) / PER_CONTACT
    knots = np.maximum(np.sin(np.pi * np.clip(place, 0.0, 1.0)), 0.0) ** math.exp(log)
    area = float(knots.sum()) / PER_CONTACT
    none, every = np.zeros(SIZES), np.full(SIZES, np.inf)
    return Shape(knots, 0.5, area, math.log(usual), LOOSE, none, none, every, none[:2])
