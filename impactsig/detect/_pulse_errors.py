"""Standard errors of what is measured of one pulse.

Of the fit: with J the derivatives of the samples by the parameters, in units of the noise that the
fit assumed, and P the information in the priors, N = J^T J + P. Noise of variance v in the same
units, and shapes as scattered as the priors say, give the parameters the covariance

    v N^-1 + (1 - v) N^-1 P N^-1   (v <= 1; v N^-1 for more).

An error of the baseline moves them by N^-1 J^T (its course). Two terms stand for shapes outside of
the family: what it leaves in the residuals moves the parameters by as much in each direction, and
the estimates are off by a step towards the minimum in a wider family, whose priors are weaker and
whose edges have a power each.

Of an edge: the noise of its samples over its slope.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._compiled import njit
from .._impact_flags import OPEN_END, OPEN_START, UNRESOLVED
from ._pulse_edges import Baseline, crossing
from ._pulse_fit import FLAT_MEAN, FLAT_SD, LENGTH_SD, POWER_SD, SKEW_SD

WIDER = 7  # parameters of the fit, and half the difference of the logarithms of the edges' powers
BINS = 12
"""Stretches of a pulse in which residuals are added up."""
FREEDOM = 4.0
"""Directions that what the family cannot follow is spread over."""
PROMISED, CHANCE = 0.3, 4.0
"""Of what the family cannot follow: the least that a wider one leaves. And what noise leaves now
and then, in its variances."""


class Priors(NamedTuple):
    """Standard deviations, and mean of the flatness, as in `_pulse_fit.py`."""

    skew: float
    flat_mean: float
    flat: float
    power: float
    length: float
    powers: float  # of half the difference of the logarithms


FITTED = Priors(SKEW_SD, FLAT_MEAN, FLAT_SD, POWER_SD, LENGTH_SD, 1e-4)
LOOSE = Priors(0.5, -3.0, 2.0, POWER_SD, LENGTH_SD, 0.2)


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


class _Linear(NamedTuple):
    """A fit about its minimum: products of derivatives J, residuals e, and a baseline's course."""

    square: np.ndarray  # J^T J
    residual: np.ndarray  # J^T e
    level: np.ndarray  # J^T 1
    slope: np.ndarray  # J^T (t - centre)
    sums: np.ndarray  # of e over stretches
    courses: np.ndarray  # of J over stretches
    counts: np.ndarray  # samples in each
    unfollowed: float  # square of the sums, beyond that of noise


@njit(nogil=True)
def fit_errors(points, x, log_edge, p, per, unit, seen, keep):
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
    keep : array
        Takes the fit: columns as in `_shared_shape.py`, but for the first.
    """
    noise = seen.noise / (unit * math.sqrt(per))
    variance = noise * noise
    fit = _linear(points, x, p, seen.baseline.centre, variance)
    prior, _ = _information(p, log_edge, FITTED)
    inverse = np.linalg.inv(fit.square + prior)
    covariance = (variance + fit.unfollowed / FREEDOM) * inverse
    if variance < 1.0:
        covariance += (1.0 - variance) * (inverse @ prior @ inverse)
    loose, pull = _information(p, log_edge, LOOSE)
    beside = np.linalg.solve(fit.square + loose, fit.residual - pull)
    by_length = np.zeros(WIDER)
    by_length[2:5] = np.exp(p[2:5])
    level = (seen.baseline.level / unit) * (inverse @ fit.level)
    slope = (seen.baseline.slope / unit) * (inverse @ fit.slope)
    rest = 0.0
    for b in range(BINS):
        if fit.counts[b] > 0.0:
            off = fit.sums[b] - fit.courses[b] @ beside
            rest += off * off / fit.counts[b] - variance
    # The step is linear, and may leave more than it promises.
    rest = max(rest, PROMISED * fit.unfollowed) - CHANCE * variance
    keep[1] = max(rest, 0.0) / (FREEDOM * max(variance, 1.0))
    keep[2], keep[3] = unit, log_edge
    keep[4] = level[1] ** 2 + slope[1] ** 2
    keep[5] = (by_length @ level) ** 2 + (by_length @ slope) ** 2
    keep[6] = level[0] ** 2 + slope[0] ** 2 + beside[0] ** 2
    keep[7 : 6 + WIDER] = p
    keep[6 + WIDER : 6 + 2 * WIDER] = fit.residual / max(variance, 1.0)
    for i in range(WIDER):
        first = 6 + (2 + i) * WIDER
        keep[first : first + WIDER] = fit.square[i] / max(variance, 1.0)
    for i in range(WIDER):
        for j in range(WIDER):
            covariance[i, j] += beside[i] * beside[j] + level[i] * level[j] + slope[i] * slope[j]
    contact = by_length @ (covariance @ by_length)
    return Errors(
        math.sqrt(max(covariance[1, 1], 0.0)),
        math.sqrt(max(contact, 0.0)),
        math.sqrt(max(covariance[0, 0], 0.0)) * unit,
        0.0,
    )


@njit(nogil=True)
def _linear(points, x, p, centre, variance):
    amplitude, t0 = p[0], p[1]
    r, flat, d, q = math.exp(p[2]), math.exp(p[3]), math.exp(p[4]), math.exp(p[5])
    top, end = r + flat, r + flat + d
    rise, fall = 0.5 * math.pi / r, 0.5 * math.pi / d
    square = np.zeros((WIDER, WIDER))
    residual, level, slope = np.zeros(WIDER), np.zeros(WIDER), np.zeros(WIDER)
    sums, counts, courses = np.zeros(BINS), np.zeros(BINS), np.zeros((BINS, WIDER))
    j = np.zeros(WIDER)
    for k in range(len(points)):
        u = points[k] - t0
        if u <= 0.0 or u >= end:
            continue
        j[:] = 0.0
        j[0] = 1.0
        if u < r:
            angle = rise * u
            s = max(math.sin(angle), 1e-3)
            j[0] = s**q
            steep = amplitude * j[0] * q * math.cos(angle) / s
            j[1], j[2], j[5] = -steep * rise, -steep * angle, amplitude * j[0] * q * math.log(s)
            j[6] = j[5]
        elif u >= top:
            angle = fall * (u - top)
            c = max(math.cos(angle), 1e-3)
            j[0] = c**q
            j[1] = amplitude * j[0] * q * math.sin(angle) / c * fall
            j[2], j[3], j[4] = j[1] * r, j[1] * flat, j[1] * (u - top)
            j[5] = amplitude * j[0] * q * math.log(c)
            j[6] = -j[5]
        e = x[k] - amplitude * j[0]
        for m in range(WIDER):
            for n in range(m + 1):
                square[m, n] += j[m] * j[n]
            residual[m] += j[m] * e
            level[m] += j[m]
            slope[m] += j[m] * (points[k] - centre)
        b = int(BINS * u / end)
        sums[b] += e
        counts[b] += 1.0
        for m in range(WIDER):
            courses[b, m] += j[m]
    total = 0.0
    for b in range(BINS):
        if counts[b] > 0.0:
            total += sums[b] ** 2 / counts[b] - variance
    for m in range(WIDER):
        for n in range(m):
            square[n, m] = square[m, n]
    return _Linear(square, residual, level, slope, sums, courses, counts, max(total, 0.0))


@njit(nogil=True)
def _information(p, log_edge, priors):
    """Of the priors at `p`: second derivatives of half their cost, and first."""
    rows = np.zeros((5, WIDER))
    middle = 0.5 * (p[2] + p[4])
    rows[0, 2], rows[0, 4] = 1.0 / priors.skew, -1.0 / priors.skew
    rows[1, 2] = rows[1, 4] = -0.5 / priors.flat
    rows[1, 3] = 1.0 / priors.flat
    rows[2, 5] = 1.0 / priors.power
    rows[3, 2] = rows[3, 4] = 0.5 / priors.length
    rows[4, 6] = 1.0 / priors.powers
    off = np.array(
        [
            (p[2] - p[4]) / priors.skew,
            (p[3] - middle - priors.flat_mean) / priors.flat,
            p[5] / priors.power,
            (middle - log_edge) / priors.length,
            0.0,
        ]
    )
    square = rows.T @ rows
    for i in range(WIDER):
        square[i, i] += 1e-12  # what no sample shows has no error either
    return square, rows.T @ off


@njit(nogil=True)
def edge_errors(x, start, end, level, seen):
    """Standard errors of a pulse whose edges were extrapolated from `level`, and of its crest."""
    first = _touch_error(x, start, -1, seen.left_limit, level, seen)
    last = _touch_error(x, end, 1, seen.right_limit, level, seen)
    return with_crest(x, Errors(first, math.hypot(first, last), 0.0, 0.0), seen)


@njit(nogil=True)
def _touch_error(x, at, step, limit, level, seen):
    """Noise over slope, and half of what the edge's curve below the level may move its end by."""
    foot = crossing(x, seen.top, step, limit, level)
    higher = crossing(x, seen.top, step, limit, 2.0 * level)
    out, run = abs(at - foot), max(abs(foot - higher), 0.5)
    # Slope and bend come from three samples in a row; the end is kept within twice the line's.
    relative = seen.noise * run / max(level, 1e-300)
    noise = relative * min(math.hypot(1.0, math.sqrt(2.0) * out), (out + 1.0) / max(relative, 1e-9))
    beside = _level_error(seen.baseline, at) * run / max(level, 1e-300)
    return math.sqrt(noise**2 + beside**2 + 0.25 * (out - run) ** 2)


@njit(nogil=True)
def with_crest(x, errors, seen):
    """The errors with that of a peak read off its samples: the greatest of those near it."""
    near = 1
    for i in range(seen.left_limit, seen.right_limit + 1):
        near += x[i] > x[seen.top] - 3.0 * seen.noise
    noise = seen.noise * math.sqrt(1.0 + math.log(near))
    peak = math.hypot(noise, _level_error(seen.baseline, seen.top))
    return Errors(errors.start, errors.contact, peak, errors.impulse)


@njit(nogil=True)
def with_impulse(x, start, end, errors, seen):
    """The errors with that of the sum of the samples between start and end.

    An end that is off by an error misses slope error^2 / 2, whose mean square is 3 slope^2
    error^4 / 4. Where a straight edge begins between two samples, at a share f of the way, the
    line between them is too great by slope f (1 - f)^2 / 2, whose mean square is slope^2 / 420.
    """
    first, last = int(start) + 1, math.ceil(end) - 1
    slopes = 0.0
    if last - first >= 1:
        slopes = (x[first + 1] - x[first]) ** 2 + (x[last - 1] - x[last]) ** 2
    level = (end - start) * _level_error(seen.baseline, 0.5 * (start + end))
    late = math.sqrt(max(errors.contact**2 - errors.start**2, 0.0))
    steep = math.pi * x[seen.top] / (end - start)
    missed = 0.75 * steep**2 * (errors.start**4 + late**4)
    impulse = math.sqrt(seen.noise**2 * (end - start) + level**2 + slopes / 420.0 + missed)
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
