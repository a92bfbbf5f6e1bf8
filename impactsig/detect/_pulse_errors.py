"""Standard errors of what is measured of one pulse.

Of the fit: with J the derivatives of the samples by the parameters, in units of the noise that the
fit assumed, and P the information in the priors, N = J^T J + P. Noise of variance v in the same
units, and shapes as scattered as the priors say, give the parameters the covariance

    v N^-1 + (1 - v) N^-1 P N^-1   (v <= 1; v N^-1 for more),

an error of the baseline moves them by N^-1 J^T (its course), and what the family cannot follow
moves them by as much in each direction as it leaves in the residuals.

Of an edge: the noise of its samples over its slope.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._compiled import njit
from ..impacts import OPEN_END, OPEN_START, UNRESOLVED
from ._pulse_edges import Baseline, crossing
from ._pulse_fit import PARAMETERS, model

BINS = 12
"""Stretches of a pulse in which residuals are added up."""
FREEDOM = 4.0
"""Directions that what the family cannot follow is spread over."""


class Errors(NamedTuple):
    """Standard errors of start, contact [samples], peak and impulse."""

    start: float
    contact: float
    peak: float
    impulse: float


UNKNOWN = Errors(np.inf, np.inf, np.inf, np.inf)


class Seen(NamedTuple):
    """The samples that a pulse was measured in: its top, how far it goes, noise and baseline."""

    top: int
    left_limit: int
    right_limit: int
    noise: float  # of a sample, as large as that over the pulse would be if white
    baseline: Baseline


@njit(nogil=True)
def fit_errors(points, x, log_edge, p, per, unit, seen):
    """Standard errors of start, contact and peak of a fit.

    Parameters
    ----------
    points, x, log_edge, p
        As `fit_pulse` took them, and left `p`.
    per : int
        Samples in the mean that each of x is.
    unit : float
        Unit of x.
    seen : Seen
        What the pulse was measured in.
    """
    noise, baseline = seen.noise / (unit * math.sqrt(per)), seen.baseline
    normal = np.empty((PARAMETERS, PARAMETERS + 1))
    priors = np.empty((PARAMETERS, PARAMETERS + 1))
    shifted = np.empty((PARAMETERS, PARAMETERS + 1))
    model(p, points[:0], x[:0], log_edge, priors)
    model(p, points, x, log_edge, normal)
    full = np.empty((PARAMETERS, PARAMETERS))
    prior = np.empty((PARAMETERS, PARAMETERS))
    for i in range(PARAMETERS):
        for j in range(i + 1):
            full[i, j] = full[j, i] = normal[i, j]
            prior[i, j] = prior[j, i] = priors[i, j]
    # The amplitude's unit is the noise, so its scale differs; an all but exact 0 stays one.
    for i in range(PARAMETERS):
        full[i, i] += 1e-12 * full[i, i] + 1e-12
    inverse = np.linalg.inv(full)
    r, flat, d = math.exp(p[2]), math.exp(p[3]), math.exp(p[4])
    variance = noise * noise
    left = misfit_left(points, x, p, noise)
    covariance = (variance + left / FREEDOM) * inverse
    if variance < 1.0:
        covariance += (1.0 - variance) * (inverse @ prior @ inverse)
    # J^T e is linear in the samples: a baseline adds J^T (its course).
    for kind in range(2):
        course = np.ones(len(points)) if kind == 0 else points - baseline.centre
        model(p, points, x + course, log_edge, shifted)
        size = (baseline.level if kind == 0 else baseline.slope) / unit
        moved = size * (inverse @ (shifted[:, PARAMETERS] - normal[:, PARAMETERS]))
        for i in range(PARAMETERS):
            for j in range(PARAMETERS):
                covariance[i, j] += moved[i] * moved[j]
    by_length = np.array([0.0, 0.0, r, flat, d, 0.0])
    contact = 0.0
    for i in range(PARAMETERS):
        for j in range(PARAMETERS):
            contact += by_length[i] * covariance[i, j] * by_length[j]
    start, peak = math.sqrt(max(covariance[1, 1], 0.0)), math.sqrt(max(covariance[0, 0], 0.0))
    return Errors(start, math.sqrt(max(contact, 0.0)), peak * unit, 0.0)


@njit(nogil=True)
def misfit_left(points, x, p, noise):
    """Square of what the family cannot follow: of residuals summed over stretches, beyond noise."""
    r, flat, d, q = math.exp(p[2]), math.exp(p[3]), math.exp(p[4]), math.exp(p[5])
    length = r + flat + d
    sums, counts = np.zeros(BINS), np.zeros(BINS)
    for k in range(len(points)):
        u = points[k] - p[1]
        if u <= 0.0 or u >= length:
            continue
        f = 1.0
        if u < r:
            f = math.sin(0.5 * math.pi * u / r) ** q
        elif u > r + flat:
            f = math.cos(0.5 * math.pi * (u - r - flat) / d) ** q
        b = min(int(BINS * u / length), BINS - 1)
        sums[b] += x[k] - p[0] * f
        counts[b] += 1.0
    total = expected = 0.0
    for b in range(BINS):
        if counts[b] > 0.0:
            total += sums[b] ** 2 / counts[b]
            expected += noise * noise
    return max(total - expected, 0.0)


@njit(nogil=True)
def edge_errors(x, start, end, level, seen):
    """Standard errors of a pulse whose edges were extrapolated from `level`, and of its crest."""
    first = _touch_error(x, start, -1, seen.left_limit, level, seen)
    last = _touch_error(x, end, 1, seen.right_limit, level, seen)
    return with_crest(Errors(first, math.hypot(first, last), 0.0, 0.0), seen)


@njit(nogil=True)
def _touch_error(x, at, step, limit, level, seen):
    """Noise over slope, and half of what the edge's curve below the level may move its end by."""
    foot = crossing(x, seen.top, step, limit, level)
    higher = crossing(x, seen.top, step, limit, 2.0 * level)
    out, run = abs(at - foot), max(abs(foot - higher), 0.5)
    noise = math.sqrt(2.0) * seen.noise * max(1.0, out / run)
    error = math.hypot(noise, _level_error(seen.baseline, at)) * run / max(level, 1e-300)
    return math.hypot(error, 0.5 * abs(out - run))


@njit(nogil=True)
def with_crest(errors, seen):
    """The errors with that of a peak read off its samples by a parabola."""
    peak = math.hypot(seen.noise, _level_error(seen.baseline, seen.top))
    return Errors(errors.start, errors.contact, peak, errors.impulse)


@njit(nogil=True)
def with_impulse(x, start, end, errors, seen):
    """The errors with that of the sum of the samples between start and end.

    Where a straight edge begins between two samples, at a share f of the way, the line between
    them is too great by slope f (1 - f)^2 / 2, whose mean square is slope^2 / 420.
    """
    first, last = int(start) + 1, int(math.ceil(end)) - 1
    slopes = 0.0
    if last - first >= 1:
        slopes = (x[first + 1] - x[first]) ** 2 + (x[last - 1] - x[last]) ** 2
    level = (end - start) * _level_error(seen.baseline, 0.5 * (start + end))
    impulse = math.sqrt(seen.noise**2 * (end - start) + level**2 + slopes / 420.0)
    return Errors(errors.start, errors.contact, errors.peak, impulse)


@njit(nogil=True)
def with_level(x, level, share, errors, seen):
    """The errors with that of the contact time between the crossings of `level`.

    `share` of the peak, whose error moves the level as that of the baseline does.
    """
    if x[seen.top] <= level:
        known = x[seen.top] + 3.0 * errors.peak < level
        return Errors(errors.start, 0.0 if known else np.inf, errors.peak, errors.impulse)
    beside = math.hypot(_level_error(seen.baseline, seen.top), share * errors.peak)
    early = _steepness(x, -1, seen.left_limit, level, seen)
    late = _steepness(x, 1, seen.right_limit, level, seen)
    # Between two samples their noise counts by (1 - f)^2 + f^2, 2/3 in the mean.
    noise = math.sqrt(2.0 / 3.0) * seen.noise * math.hypot(early, late)
    contact = math.hypot(noise, beside * (early + late))
    return Errors(errors.start, contact, errors.peak, errors.impulse)


@njit(nogil=True)
def _steepness(x, step, limit, level, seen):
    """Samples that an edge takes a unit of height, about a level."""
    wide = min(max(2.0 * seen.noise, 0.05 * level), 0.5 * level)
    low = crossing(x, seen.top, step, limit, level - wide)
    high = crossing(x, seen.top, step, limit, min(level + wide, 0.5 * (level + x[seen.top])))
    return abs(low - high) / (wide + min(wide, 0.5 * (x[seen.top] - level)))


@njit(nogil=True)
def unless_flagged(x, errors, flags, start, contact, seen):
    """The errors, infinite for what the record does not hold.

    A pulse that is measured as far as the valley to a neighbour may begin or end half its way
    from there to its crest off, and what lies under the neighbour is missing from its impulse.
    """
    first, length, peak, impulse = errors.start, errors.contact, errors.peak, errors.impulse
    if flags & UNRESOLVED:
        for at in (start, start + contact):
            value = x[int(at + 0.5)]
            if value > 0.2 * x[seen.top]:
                off = 0.5 * abs(seen.top - at)
                first = math.hypot(first, off) if at == start else first
                length = math.hypot(length, off)
                impulse = math.hypot(impulse, value * off)
    if flags & (OPEN_START | OPEN_END):
        length = impulse = np.inf
        first = np.inf if flags & OPEN_START else first
        if seen.top in (0, len(x) - 1):
            peak = np.inf
    return Errors(first, length, peak, impulse)


@njit(nogil=True)
def _level_error(baseline, at):
    """Standard error of the baseline at a sample."""
    return math.hypot(baseline.level, baseline.slope * (at - baseline.centre))
