"""Pulses measured with their mean pulse, where no shape of the family is near them."""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ..edges import ERRORS, FIT, NO_PULSE, SHARED, SHARED_PEAK
from ..fit_errors import LEVEL, NOISE, ZERO
from ._laying import fit_to, lay, lay_clear, place_faint
from ._mean_pulse import (
    AMPLITUDE,
    FIRST,
    LAST,
    MISFIT,
    ONE,
    PLACE,
    SAMPLE,
    SIGMA,
    WIDTH,
)
from ._whole_pulse import read_whole

FARTHEST, NOISY = 0.7, 2.0
"""Of what the family leaves, root mean square, and standard errors of that: where more is left than
both allow, pulses do not share their mean."""
TURNS = 6
"""Steps of faint pulses."""
STEP = 0.3
"""Of the height, from one knot to the next: a jump."""
AS_HIGH, AS_LONG = 4.0, 4.0
"""Times as high, or as low, as the pulse that was found, one that is measured may be; and times as
long as those found their mean pulse may be: that of pulses and crests of noise together is longer.
"""


@allocating
def share_mean(rows, x, origin, timed, left):
    """Measure pulses by their mean pulse, in place; whether they have one.

    Parameters
    ----------
    rows, x, origin, timed
        As `share_shape` takes them.
    left : float
        Mean square of what the family leaves, over that of the heights.
    """
    possible, clear, mean, about, spread = lay_clear(rows, x, origin)
    if not possible or not _is_like(clear, mean, left):
        return False
    known, whole = read_whole(clear, rows, x, origin, mean, about)
    usual = (whole.end - whole.start) * math.exp(about)
    if not known or usual > AS_LONG * _usual_contact(clear, rows):
        return False
    faint = lay(rows, x, origin, False)
    place_faint(faint, rows, x, origin, mean, about, whole.start, whole.end)
    for _ in range(2):
        fit_to(clear, rows, x, origin, mean, about, spread, TURNS)
    fit_to(faint, rows, x, origin, mean, about, spread, TURNS)
    measured = np.zeros(len(rows), np.bool_)
    for group in range(2):
        laid = faint if group else clear
        for i in range(len(laid.known)):
            k = int(laid.known[i, ONE])
            if _is_near(rows[k], laid.known[i], whole, origin + len(x)):
                _write(rows[k], laid.known[i], laid.covariance[i], whole, timed)
                measured[k] = True
    for k in range(len(rows)):
        if not measured[k]:
            _doubt(rows[k], usual, timed)
    return True


@kernel
def _usual_contact(laid, rows):
    """Geometric mean of the contacts of pulses as they were found."""
    total = 0.0
    for i in range(len(laid.known)):
        total += math.log(max(rows[int(laid.known[i, ONE]), 1], 1.0))
    return math.exp(total / max(len(laid.known), 1))


@kernel
def _is_near(row, one, whole, limit):
    """Whether a pulse is about where and as high as it was, and within the samples."""
    width = math.exp(one[WIDTH])
    at = row[FIT + ZERO] + one[PLACE] + whole.start * width
    end = row[FIT + ZERO] + one[PLACE] + whole.end * width
    ratio = one[AMPLITUDE] * whole.crest / row[2]
    near = 1.0 / AS_HIGH < ratio < AS_HIGH and at < row[0] + row[1] and end > row[0]
    return near and at >= 0.0 and end <= limit


@kernel
def _write(row, one, covariance, whole, timed):
    """Write what is measured of a pulse, with standard errors, into its row."""
    kept = row[FIT:]
    width, height, long = math.exp(one[WIDTH]), one[AMPLITUDE], whole.end - whole.start
    # Shapes that differ scatter by more than noise.
    more = max(one[MISFIT], 1.0) * (kept[NOISE] / one[SIGMA]) ** 2
    at = whole.start * width
    own = covariance[1, 1] + at * (2.0 * covariance[2, 1] + at * covariance[2, 2])
    shared = whole.start_variance * width**2 + whole.jump
    row[0] = kept[ZERO] + one[PLACE] + at
    row[ERRORS] = math.sqrt(max(own, 0.0) * more + shared + whole.jump)
    row[SHARED] = math.sqrt(shared)
    if timed:
        row[1], row[4] = long * width, (whole.top - whole.start) * width
        both = covariance[2, 2] * more * long**2 + whole.both
        row[ERRORS + 1] = math.sqrt(both * width**2 + whole.jump + whole.drop)
    of_height = more * covariance[0, 0] / height**2
    base = kept[LEVEL] / height
    row[2], row[3] = height * whole.crest, height * width * whole.area
    row[ERRORS + 2] = math.sqrt(of_height + base**2 + whole.peak) * row[2]
    row[SHARED_PEAK] = math.sqrt(whole.peak) * row[2]
    both = of_height + more * (covariance[2, 2] + 2.0 * covariance[2, 0] / height)
    both = max(both, 0.0) + whole.tail + (base * long / whole.area) ** 2
    row[ERRORS + 3] = math.sqrt(both) * row[3]


@kernel
def _doubt(row, usual, timed):
    """Increase the errors of a pulse that was measured as none of those it may be one of."""
    if row[5] == NO_PULSE:
        return
    off = abs(usual - row[1]) if timed else 0.0
    row[ERRORS] = math.hypot(row[ERRORS], 0.5 * off)
    if timed:
        row[ERRORS + 1] = math.hypot(row[ERRORS + 1], off)
    row[ERRORS + 3] = math.hypot(row[ERRORS + 3], row[3] * off / usual)


@kernel
def _is_like(laid, mean, left):
    """Whether the mean pulse leaves much less of pulses than the family does.

    What it leaves of a jump, which lies between two samples and two knots, does not count.
    """
    missed = total = square = samples = highest = steps = stepped = 0.0
    for b in range(len(mean.heights)):
        square += mean.heights[b] ** 2 * mean.apart
        highest = max(highest, mean.heights[b])
    for b in range(len(mean.heights) - 1):
        step = abs(mean.heights[b + 1] - mean.heights[b])
        if step > STEP * highest:
            steps += (SAMPLE * step) ** 2 / mean.apart
    for i in range(len(laid.known)):
        one = laid.known[i]
        count = one[LAST] - one[FIRST]
        weight, width = (one[AMPLITUDE] / one[SIGMA]) ** 2, math.exp(one[WIDTH])
        missed += (one[MISFIT] - 1.0) * count
        samples += count
        total += weight * width * square
        stepped += weight * width * steps * max(mean.apart, 1.0 / width) ** 2
    return missed - stepped < FARTHEST**2 * left * total + NOISY * math.sqrt(2.0 * samples)
