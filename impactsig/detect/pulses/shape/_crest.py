"""Height and place of the crest of a mean pulse."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import kernel
from ._mean_pulse import LOW, SAMPLE, SIGNIFICANT, height_at

BESIDE, BEHIND, HIGHEST, ROUND = 3.0, 8, 1.5, 0.5
"""Knots beside a jump that overshoot, those behind them that tell how high it is, logarithm of how
much higher it may be than these, and share of that by which it is uncertain."""


@kernel
def crest_of(mean, about, low, high):
    """Height of the mean pulse, where it is, and how much it falls within a sample or two knots.

    From `low` to `high`.
    """
    count = len(mean.heights)
    best, at = 0.0, 0
    for b in range(1, count - 1):
        if not low <= LOW + b * mean.apart <= high:
            continue
        if mean.heights[b] > best and mean.heights[b] * math.sqrt(mean.weight[b]) > SIGNIFICANT:
            best, at = mean.heights[b], b
    if best <= 0.0:
        return 0.0, 0.0, 0.0
    total = number = middle = 0.0
    noise = 1.0 / math.sqrt(mean.weight[at])
    for b in range(count):
        if not mean.weight[b] > 0.0 or not low <= LOW + b * mean.apart <= high:
            continue
        if mean.heights[b] > best * 0.999 - 1.5 * noise and abs(b - at) * mean.apart < 1.0:
            total += mean.heights[b]
            middle += LOW + b * mean.apart
            number += 1.0
    crest, top = total / number, middle / number
    one = max(math.exp(-about), 2.0 * mean.apart)
    fall = min(crest - height_at(top - one, mean), crest - height_at(top + one, mean))
    return crest, top, max(fall / crest, 0.0)


@kernel
def crest_beside(mean, about, start, end, jumps, drops, top):
    """As `crest_of`, of a mean pulse that jumps at `start` or drops at `end`: knots overshoot.

    Where they do, the crest of all knots is at the jump, which lies between two samples and two
    knots. Where it is beyond, at `top`, the rise is round.
    The logarithm of the height of a jump is at most that of a line through the knots behind these.
    Whether it is round, these do not tell: it may be lower by ROUND of the way from the first of
    them to there.
    """
    beside = max(2.0 * math.exp(-about), BESIDE * mean.apart)
    near = math.exp(-about) + mean.apart
    jumps, drops = jumps and top < start + near, drops and top > end - near
    low = start + beside if jumps else start
    high = end - beside if drops else end
    best, at, sharp = crest_of(mean, about, low, high)
    middle, square = 0.5 * (BEHIND - 1), BEHIND * (BEHIND**2 - 1.0) / 12.0
    back = middle + beside / mean.apart
    for side in range(2):
        if not (drops if side else jumps):
            continue
        first, step = (high, -mean.apart) if side else (low, mean.apart)
        height = slope = scatter = 0.0
        for k in range(BEHIND):
            one = _logarithm(height_at(first + k * step, mean), best)
            height += one / BEHIND
            slope += (k - middle) * one / square
        for k in range(BEHIND):
            one = _logarithm(height_at(first + k * step, mean), best)
            scatter += (one - height - slope * (k - middle)) ** 2 / (BEHIND - 2.0)
        rise = -slope * back
        error = math.sqrt(scatter * (1.0 / BEHIND + back * back / square))
        here = math.exp(height + min(rise, HIGHEST))
        if rise > 0.0 and here > best * (1.0 - 2.0 * error):
            way = 1.0 - math.exp(min(slope * (back - middle), 0.0))
            sharp = math.hypot(ROUND * way, error) / SAMPLE
            best, at = here * (1.0 - 0.5 * ROUND * way), end if side else start
    return best, at, sharp


@kernel
def _logarithm(height, usual):
    """Logarithm of the height of a knot, which noise may leave below zero."""
    return math.log(max(height, 0.01 * usual, 1e-300))


@kernel
def noise_at(mean, v):
    """Standard error of the mean pulse at a place, over its height; inf if no sample lies there."""
    b = min(max(int((v - LOW) / mean.apart), 0), len(mean.heights) - 1)
    return 1.0 / math.sqrt(mean.weight[b]) if mean.weight[b] > 0.0 else np.inf
