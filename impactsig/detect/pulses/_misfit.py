"""Pulses of a shape that no member of the family has: how far their fits are off, and which way.

What the family leaves of the pulses of a span, over their heights, has the mean square r^2. By
instants and ends of many shapes, fits of such pulses are off by OFF_START r and OFF_CONTACT r
contact times, and peaks by what is left at the crest, or OFF_PEAK r peaks. Edges know of no shape:
with d the mean difference between what they say and what the fits do, of standard error s, and v
the variance of what the fits are off by, the fits move by d v/(v + s^2), which leaves them a
variance of v s^2/(v + s^2), and that by which the fits scatter about d beyond the noise.
"""

from __future__ import annotations

import math

from ..._compiled import inner
from ._model import parts_of
from .edges import ERRORS, FIT
from .fit_errors import AT_TOP, EDGES, ESTIMATE, LEFT, LEFT_SD, UNIT

OFF_START, OFF_CONTACT, OFF_PEAK = 1.2, 2.2, 0.35
FARTHEST = 0.2
"""Contact times that a fit is moved."""


@inner
def correct_misfit(rows, alike, timed):
    """Correct instants and contact times, in place, and add to the errors, for misfit.

    Parameters
    ----------
    rows : array
        As `impactsig.detect.pulses.pulse.measure_all` fills them.
    alike : array of int
        The rows that are measured by a fit.
    timed : bool
        Contact times are those from first to last touch.
    """
    left, at_top = _left(rows, alike)
    if left <= 0.0:
        return
    start, start_variance = _moved(rows, alike, 0, left * OFF_START**2)
    length, length_variance = 0.0, 0.0
    if timed:
        length, length_variance = _moved(rows, alike, 1, left * OFF_CONTACT**2)
    # The peak is off by about what is left there, or near by.
    peak = max(at_top**2, (OFF_PEAK**2) * left)
    for k in alike:
        row = rows[k]
        contact = _length(row)
        row[0] = max(row[0] + start * contact, 0.0)
        row[ERRORS] = math.sqrt(row[ERRORS] ** 2 + start_variance * contact**2)
        if timed:
            row[1] += length * contact
            row[ERRORS + 1] = math.sqrt(row[ERRORS + 1] ** 2 + length_variance * contact**2)
        if row[FIT + UNIT] > 0.0:
            row[ERRORS + 2] = math.sqrt(row[ERRORS + 2] ** 2 + peak * row[2] ** 2)


@inner
def _left(rows, alike):
    """What the family leaves of the pulses, over their heights: its mean square; at the crest."""
    total = weight = crest = share = 0.0
    for k in alike:
        kept = rows[k, FIT:]
        if kept[LEFT_SD] > 0.0:
            one = kept[LEFT_SD] ** -2.0
            total += one * kept[LEFT]
            weight += one
            crest += kept[AT_TOP] / kept[LEFT_SD]
            share += 1.0 / kept[LEFT_SD]
    if weight <= 0.0:
        return 0.0, 0.0
    # More than noise leaves now and then.
    return max(total / weight - 2.0 / math.sqrt(weight), 0.0), crest / share


@inner
def _length(row):
    """Length of a pulse by its fit, whatever level its contact time refers to."""
    parts = parts_of(row[FIT + ESTIMATE :])
    return parts.rise + parts.flat + parts.fall


@inner
def _moved(rows, alike, column, variance):
    """By how much fits move in contact times, and the variance that this leaves of each."""
    total = weight = square = noise = white = curve = 0.0
    for k in alike:
        kept, contact = rows[k, FIT:], _length(rows[k])
        if kept[EDGES + 1] <= 0.0:
            continue
        by_noise = kept[EDGES + 2 + column] / contact
        by_curve = kept[EDGES + 4 + column] / contact
        off = (kept[EDGES + column] - rows[k, column]) / contact
        one = 1.0 / (by_noise**2 + by_curve**2 + 1e-12)
        total += one * off
        weight += one
        square += one * off**2
        noise += (one * by_noise) ** 2
        white += one * by_noise**2
        curve += one * by_curve
    if weight <= 0.0:
        return 0.0, variance
    mean, error = total / weight, (noise + curve**2) / weight**2
    # Fits of one shape that miss it scatter by how the samples lie.
    scatter = max(square / weight - mean**2 - white / weight, 0.0)
    part = variance / (variance + error)
    return min(max(part * mean, -FARTHEST), FARTHEST), part * error + scatter
