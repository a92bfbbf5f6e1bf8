"""The mean pulse of a span, of whatever shape: straight lines between knots.

Pulses that are laid on each other are A T((t - t0) / w), with one T for all of them. Its heights at
the knots are those of least squares, with a prior on their second differences, whose variance is
that of the knots near by less what noise makes: it smooths crests, and leaves steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._knots import add_bend, add_sample, copy_of, no_knots, solve_knots
from ..edges import FIT
from ..fit_errors import BASE, SEEN, TILT, ZERO
from ._common_rest import MEAN_SLOPE

LOW, HIGH = -1.5, 5.0
"""Where the mean pulse is looked for [widths, from the place of a pulse]."""
SMOOTH = 1e-3
"""Of the mean weight of a knot: with so much the line between two stays as it was."""
CURVED, NEAR = 2.0, 3
"""Second derivative of the mean pulse that is expected at least, and knots to either side that tell
more of it."""
SIGNIFICANT = 4.0
"""Standard errors of a knot that is no noise."""
SAMPLE = 0.29
"""Standard deviation of a place somewhere between two samples."""
STRETCHES = 3
"""Stretches between two knots in which edges are looked at."""
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
def build(laid, rows, x, origin, before):
    """The mean pulse of pulses as they are laid; `before` is that of the last round.

    Samples count less by how much the error of t0 moves them.
    """
    count, apart = len(before.heights), before.apart
    knots = no_knots(count)
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
            add_sample(knots, b, place - b, weight, sample(x, origin, kept, j) / height)
    total = 0.0
    for b in range(count):
        total += knots.own[b]
    smooth = max(SMOOTH * total / count, 1e-300)
    weight = knots.own.copy()
    for b in range(count - 1):
        change = smooth * (before.heights[b + 1] - before.heights[b])
        knots.own[b] += smooth
        knots.own[b + 1] += smooth
        knots.beside[b] -= smooth
        knots.right[b] -= change
        knots.right[b + 1] += change
    knots.own[0] += smooth
    knots.own[count - 1] += smooth
    heights, smoothed = np.empty(count), np.empty(count)
    solve_knots(knots, heights)
    bound = copy_of(knots)
    for b in range(1, count - 1):
        add_bend(bound, b, 1.0 / _bend(heights, knots.own, b, apart))
    solve_knots(bound, smoothed)
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
