"""Start, end, crest and area of a mean pulse, and their variances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ._crest import crest_beside, crest_of, noise_at
from ._ends import LEVELS, read_end
from ._mean_pulse import HIGH, LOW, SAMPLE, SIGNIFICANT, edge_of, height_at

FARTHER, TAIL, LONGER = 0.3, 0.9, 0.4
"""Of the way from where an edge is seen to where it is taken to begin, that it may be off, in full
where that way is TAIL + LONGER times that from there to the highest of LEVELS, and from TAIL on."""
STEEP, SHORT = 1.5, 0.05
"""Samples, and share of the length, from the lowest of LEVELS to the highest: where both edges have
less, little but a flat top is there to be laid on each other, and its corners overshoot between
knots. Edges of the family or of single pulses say more.
"""


class Whole(NamedTuple):
    """What the mean pulse tells of all pulses; times are in widths, from the first crossing.

    Variances are over the squares of these, of the peak or of the area; those of a jump at the
    start or of a drop at the end, which lie between two samples, are in samples. `both` is that of
    the length: feet that end below the noise both begin farther out than is seen, or both nearer.
    """

    start: float
    end: float
    top: float
    start_variance: float
    end_variance: float
    both: float
    jump: float
    drop: float
    crest: float
    peak: float
    area: float
    tail: float


NOTHING = Whole(*[0.0] * len(Whole._fields))


@allocating
def read_whole(laid, rows, x, origin, mean, about):
    """Read what a mean pulse tells, and whether it tells anything; nothing is left beyond its ends.

    Parameters
    ----------
    laid, rows, x, origin
        The pulses laid on each other, and what they were measured in.
    mean : Mean
    about : float
        Mean logarithm of their widths.
    """
    crest, top, sharp = crest_of(mean, about, LOW, HIGH)
    if crest <= 0.0:
        return False, NOTHING
    start, start_variance, begun, steep = _end(laid, rows, x, origin, mean, 1.0, crest)
    end, end_variance, done, gentle = _end(laid, rows, x, origin, mean, -1.0, crest)
    end, done = -end, -done
    if not (LOW < start < end and start_variance + end_variance < np.inf):
        return False, NOTHING
    if max(steep, gentle) < max(STEEP * math.exp(-about), SHORT * (end - start)):
        return False, NOTHING
    top = min(max(top, start), end)
    for b in range(len(mean.heights)):
        v = LOW + b * mean.apart
        if v < start or v > end:
            mean.heights[b] = 0.0
    early, late = _of_tail(begun - start, steep), _of_tail(end - done, gentle)
    start_variance += early**2
    end_variance += late**2
    # A jump lies between two samples; of all pulses alike, and of each.
    width = math.exp(about)
    jump = _jump(steep, mean.apart, width)
    drop = _jump(gentle, mean.apart, width)
    if jump > 0.0 or drop > 0.0:
        crest, top, sharp = crest_beside(
            mean, about, begun + steep, done - gentle, jump > 0.0, drop > 0.0, top
        )
    area = 0.0
    for b in range(len(mean.heights)):
        area += mean.heights[b] * mean.apart
    if not area > 0.0:
        return False, NOTHING
    tail = math.hypot(
        _cut_off(begun - start, steep, start_variance, height_at(begun, mean), mean.apart),
        _cut_off(end - done, gentle, end_variance, height_at(done, mean), mean.apart),
    )
    tail = math.hypot(tail, crest * math.hypot(jump, drop) / width)
    peak = (sharp * SAMPLE) ** 2 + 0.5 * noise_at(mean, top) ** 2
    if not peak < np.inf:
        return False, NOTHING
    return True, Whole(
        start,
        end,
        top,
        start_variance,
        end_variance,
        start_variance + end_variance + 2.0 * early * late,
        jump**2,
        drop**2,
        crest,
        peak,
        area,
        (tail / area) ** 2,
    )


@allocating
def _end(laid, rows, x, origin, mean, side, crest):
    """Where an end lies, its variance, where the edge is first seen; its length to 0.6 there."""
    u, y, w = edge_of(laid, rows, x, origin, mean, side, crest)
    count = len(mean.heights)
    first = np.empty(len(LEVELS), np.int64)
    place = np.empty(len(LEVELS))
    for m in range(len(LEVELS)):
        place[m] = np.inf
        for k in range(count - 1):
            b = k if side > 0 else count - 1 - k
            next_one = b + 1 if side > 0 else b - 1
            here, there = mean.heights[b] / crest, mean.heights[next_one] / crest
            seen = mean.weight[b] > 0.0 and here * crest * math.sqrt(mean.weight[b]) > SIGNIFICANT
            if here >= LEVELS[m] and there >= LEVELS[m] and seen:
                place[m] = side * (LOW + b * mean.apart)
                break
    if len(u) < 8 or place[len(LEVELS) - 1] == np.inf:
        return 0.0, np.inf, 0.0, 1.0
    for m in range(len(LEVELS)):
        first[m] = min(np.searchsorted(u, place[m]), len(u) - 1)
    at, variance = read_end(u, y, w, first)
    return min(at, place[0]), variance, place[0], place[len(LEVELS) - 1] - place[0]


@kernel
def _of_tail(way, edge):
    """Error of the end of an edge that is seen `way` before it and climbs within `edge`."""
    tail = min(max((way / max(edge, 1e-9) - TAIL) / LONGER, 0.0), 1.0)
    return FARTHER * tail * way


@kernel
def _jump(edge, apart, width):
    """Standard error of where a jump lies [samples]; 0 of an edge of a sample and more."""
    return max(1.0 - edge * width, 0.0) * max(SAMPLE, SAMPLE * apart * width)


@kernel
def _cut_off(way, edge, variance, height, apart):
    """Standard error of the area below the foot of an edge, or of a step between two knots."""
    step = SAMPLE * apart * min(2.0 * apart / max(edge, apart), 1.0)
    return height * math.hypot(step, 0.5 * variance / max(way, apart))
