"""Kernel of sounds that begin gradually. See `_growth.py` for the method."""

from __future__ import annotations

import math

import numpy as np

from ._lane_kernels import fused

SPANS = 1, 2, 4  # slices in each of the two times
NOISE = 2, 8  # slices before the attack in which noise is measured
PEAK = 2  # slices of the greatest power
AFTER = 24  # slices after the attack in which that is looked for
VARIED = 0.5  # standard deviation of the logarithm of the power of sounds at the same age


@fused
def spread_by_growth(total, before, size):
    """Standard deviation of instants before which `total` has so many samples.

    `size` samples make a slice, rounded to whole ones from the instant on.
    """
    count = min(AFTER, int((len(total) - before) / size))
    quiet, loud = before + _samples(-NOISE[1], size), before + _samples(-NOISE[0], size)
    if size < 1.0 or quiet < 0 or count < PEAK:
        return 0.0
    noise, power = _mean(total, quiet, loud), np.empty(count)
    for n in range(count):
        begin, end = before + _samples(n, size), before + _samples(n + 1, size)
        power[n] = _mean(total, begin, end) - noise
    growth = 0.0
    for span in SPANS:
        if span < count:
            first, second = _mean(power, 0, span), _mean(power, span, min(2 * span, count))
            if second > first > 0.0:
                growth = max(growth, math.log(second / first) / (span * size))
    at, level, greatest = 0, _mean(power, 0, PEAK), -np.inf
    for n in range(count - PEAK + 1):
        one = _mean(power, n, n + PEAK)
        if one > greatest:
            at, greatest = n, one
    if not (greatest > level > 0.0 and growth > 0.0):
        return 0.0
    rise = math.log(greatest / level)
    growth = max(growth, rise / (at * size))  # as it is until then on the mean
    return -VARIED / growth * math.expm1(-(rise**2))


@fused
def _samples(slices, size):
    """So many slices in whole samples."""
    return int(np.rint(size * slices))


@fused
def _mean(values, begin, end):
    total = 0.0
    for k in range(begin, end):
        total += values[k]
    return total / (end - begin)
