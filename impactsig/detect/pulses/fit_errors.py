"""Standard errors of a fitted pulse, and what is kept of a fit.

With J the derivatives of the samples by the parameters, in units of the noise that the fit
assumed, and P the information in the priors, N = J^T J + P. Noise of variance v in the same units,
and shapes as scattered as the priors say, give the parameters the covariance

    v N^-1 + (1 - v) N^-1 P N^-1   (v <= 1; v N^-1 for more).

An error of the baseline moves them by N^-1 J^T (its course). Two terms stand for shapes outside of
the family: what it leaves in the residuals moves the parameters by as much in each direction, and
the estimates are off by a step towards the minimum in a wider family, whose priors are weaker and
whose edges have a power each.
"""

from __future__ import annotations

import math

import numpy as np

from ..._compiled import allocating, inner
from ._errors import Errors
from ._fit import Fit  # noqa: F401  (the type of an argument)
from ._model import (
    AMPLITUDE,
    BY_POWER,
    BY_START,
    FLAT,
    FLAT_MEAN,
    FLAT_SD,
    LENGTH,
    LENGTH_SD,
    PARAMETERS,
    POWER_SD,
    REST,
    SKEW,
    SKEW_SD,
    START,
    VALUE,
    WIDER,
    add_priors,
    inside,
    parts_of,
)
from ._small_matrices import factor, solve

BINS = 12
"""Stretches of a pulse in which residuals are added up."""
FREEDOM = 4.0
"""Directions that what the family cannot follow is spread over."""
PROMISED, CHANCE = 0.3, 4.0
"""Of what the family cannot follow: the least that a wider one leaves. And what noise leaves now
and then, in its variances."""
# Information on each parameter: in the priors of the fit, and in those of the wider family.
FITTED = np.array([0, 0, SKEW_SD**-2, FLAT_SD**-2, POWER_SD**-2, LENGTH_SD**-2, 1e8])
LOOSE = np.array([0, 0, 0.5**-2, 2.0**-2, POWER_SD**-2, LENGTH_SD**-2, 0.2**-2])
LOOSE_FLAT = FLAT_MEAN - 1.0

# Columns of what is kept of a fit: its start, and of the rest in units of the noise; variances of
# start, contact and peak from the baseline; estimate, score and information.
TAKEN, MISFIT, UNIT, EDGE, BESIDE, ESTIMATE = 0, 1, 2, 3, 4, 7
SCORE = ESTIMATE + WIDER
SQUARE = SCORE + WIDER
KEPT = SQUARE + WIDER * WIDER


@allocating
def fit_errors(points, log_edge, p, fit, per, unit, seen, keep):
    """Standard errors of start, contact and peak of a fit.

    Parameters
    ----------
    points, log_edge, p
        As `fit_pulse` took them, and left `p`.
    fit : Fit
        What it returned; the priors are taken out of its normal equations.
    per : int
        Samples in the mean that each of x is.
    unit : float
        Unit of what was fitted to.
    seen : Seen
        What the pulse was measured in.
    keep : array (KEPT,)
        Takes the fit, but for the first column.
    """
    noise = seen.noise / (unit * math.sqrt(per))
    variance = noise * noise
    normal, factors = fit.normal, np.empty((WIDER, WIDER))
    add_priors(p, log_edge, -1.0, normal)
    parts = parts_of(p)
    bins, level, slope = np.zeros((BINS, WIDER + 2)), np.zeros(WIDER), np.zeros(WIDER)
    _add_up(p, parts, points, seen.baseline.centre, fit.curve, bins, level, slope)
    beside = np.empty(WIDER)
    for i in range(WIDER):
        beside[i] = normal[i, WIDER]
    for i in range(SKEW, PARAMETERS):
        beside[i] -= LOOSE[i] * p[i]
    beside[FLAT] += LOOSE[FLAT] * LOOSE_FLAT
    beside[LENGTH] += LOOSE[LENGTH] * log_edge
    _factor_with(LOOSE, normal, factors)
    solve(factors, beside)
    unfollowed = rest = 0.0
    for b in range(BINS):
        count = bins[b, WIDER + 1]
        if count > 0.0:
            off = bins[b, WIDER]
            unfollowed += off * off / count - variance
            for i in range(WIDER):
                off -= bins[b, i] * beside[i]
            rest += off * off / count - variance
    unfollowed = max(unfollowed, 0.0)
    # The step is linear, and may leave more than it promises.
    rest = max(rest, PROMISED * unfollowed) - CHANCE * variance

    _factor_with(FITTED, normal, factors)
    for i in range(WIDER):
        level[i] *= seen.baseline.level / unit
        slope[i] *= seen.baseline.slope / unit
    spread = variance + unfollowed / FREEDOM
    along = np.zeros((3, WIDER))
    along[0, START] = along[2, AMPLITUDE] = 1.0
    put_contact(parts, along[1])
    errors = np.empty(3)
    for m in range(3):
        stepped = _product(along[m], beside)
        shift = along[m].copy()
        solve(factors, shift)
        baseline = _product(shift, level) ** 2 + _product(shift, slope) ** 2
        total = spread * _product(along[m], shift) + stepped * stepped + baseline
        if variance < 1.0:
            for i in range(SKEW, WIDER):
                total += (1.0 - variance) * FITTED[i] * shift[i] * shift[i]
        errors[m] = math.sqrt(max(total, 0.0))
        keep[BESIDE + m] = baseline
    keep[BESIDE + 2] += beside[AMPLITUDE] ** 2

    noise = max(variance, 1.0)
    keep[MISFIT], keep[UNIT], keep[EDGE] = max(rest, 0.0) / (FREEDOM * noise), unit, log_edge
    for i in range(WIDER):
        keep[ESTIMATE + i] = p[i] if i < PARAMETERS else 0.0
        keep[SCORE + i] = normal[i, WIDER] / noise
        for j in range(WIDER):
            keep[SQUARE + i * WIDER + j] = normal[max(i, j), min(i, j)] / noise
    return Errors(errors[0], errors[1], errors[2] * unit, 0.0)


@inner
def put_contact(parts, along):
    """Put the derivatives of the contact time by the parameters into `along`."""
    along[SKEW], along[FLAT] = 0.5 * (parts.rise - parts.fall), parts.flat
    along[LENGTH] = parts.rise + parts.flat + parts.fall


@inner
def _product(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@inner
def _factor_with(information, normal, factors):
    """Put the factors of the normal equations with priors into `factors`."""
    for i in range(WIDER):
        for j in range(i):
            factors[i, j] = normal[i, j]
        # What no sample shows has no error either.
        factors[i, i] = normal[i, i] + information[i] + 1e-12
    factor(factors)


@allocating
def _add_up(p, parts, points, centre, curve, bins, level, slope):
    """Add up derivatives J, residuals and points in stretches; J^T 1, and J^T (t - centre)."""
    end = parts.rise + parts.flat + parts.fall
    turn = 0.5 * (2.0 * parts.rise + parts.flat)
    first, fall, last = inside(p, parts, points)
    j = np.zeros(WIDER)
    for k in range(last - first):
        at = points[first + k]
        u = at - p[START]
        by_start = curve[BY_START, k]
        j[0], j[1], j[4], j[5] = curve[VALUE, k], by_start, curve[BY_POWER, k], by_start * u
        if first + k < fall:
            j[2], j[3], j[6] = 0.5 * j[5], 0.0, j[4]
        else:
            j[2], j[3], j[6] = turn * by_start - 0.5 * j[5], parts.flat * by_start, -j[4]
        b = min(max(int(BINS * u / end), 0), BINS - 1)
        for m in range(WIDER):
            bins[b, m] += j[m]
            slope[m] += j[m] * (at - centre)
        bins[b, WIDER] += curve[REST, k]
        bins[b, WIDER + 1] += 1.0
    for b in range(BINS):
        for m in range(WIDER):
            level[m] += bins[b, m]
