"""Standard errors of a fitted pulse, and the data that are kept of a fit.

With J the derivatives of the samples by the parameters, in units of the noise that the fit
assumed, and P the information in the priors, N = J^T J + P. Noise of variance v in the same units,
and shapes as scattered as the priors say, give the parameters the covariance

    v N^-1 + (1 - v) N^-1 P N^-1   (v <= 1; v N^-1 for more).

An error of the baseline moves them by N^-1 J^T (its course). Shapes outside of the family are seen
in what the fit leaves; `shape/` makes errors of it, from all pulses of a span.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ._errors import Errors, Touch  # noqa: F401  (the type of an argument)
from ._fit import Fit  # noqa: F401  (the type of an argument)
from ._model import (
    AMPLITUDE,
    BY_POWER,
    BY_START,
    FLAT,
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

CLEAR = 12.0
"""Of the noise: higher pulses show their edges."""
BINS = 24
"""Stretches of a pulse in which residuals are added up."""
# Information on each parameter in the priors of the fit, which holds the powers' difference at 0.
FITTED = np.array([0, 0, SKEW_SD**-2, FLAT_SD**-2, POWER_SD**-2, LENGTH_SD**-2, 1e8])

# Columns of what is kept of a fit: its start, and of the rest in units of the noise; variances of
# start, contact and peak from the baseline; mean square of what is left over the height's, and
# its standard error; estimate, score and information; estimate as it
# stands now. Start of what was reported, which is another where the family does not fit; the place
# that the estimate counts from, first and last sample from there; what one is in units of the
# fit; the baseline at that place, its slope, and the noise of a sample; the length of a flat top
# that is less than none, which NOW cannot hold. Whether there is a fit or not: the start that was
# reported, NaN where the place, samples, baseline and noise are not kept, and the standard error of
# the baseline.
TAKEN, UNIT, EDGE, BESIDE, LEFT, LEFT_SD, ESTIMATE = 0, 1, 2, 3, 6, 7, 8
SCORE = ESTIMATE + WIDER
SQUARE = SCORE + WIDER
NOW = SQUARE + WIDER * WIDER
MADE = NOW + WIDER
ZERO, FROM, TO, SCALE, BASE, TILT, NOISE, SHORT, SEEN, LEVEL, KEPT = range(MADE + 1, MADE + 12)


class ErrorRoom(NamedTuple):
    """Room for the errors of a fit."""

    factors: np.ndarray
    bins: np.ndarray
    level: np.ndarray
    slope: np.ndarray
    along: np.ndarray
    shift: np.ndarray
    errors: np.ndarray


@allocating
def room_for_errors():
    """Room for the errors of a fit."""
    return ErrorRoom(
        np.empty((WIDER, WIDER)),
        np.empty((BINS, WIDER + 2)),
        np.empty(WIDER),
        np.empty(WIDER),
        np.empty((3, WIDER)),
        np.empty(WIDER),
        np.empty(3),
    )


@kernel
def fit_errors(points, log_edge, p, fit, per, unit, seen, keep, room):
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
    room : ErrorRoom
    """
    noise = seen.noise / (unit * math.sqrt(per))
    variance = noise * noise
    normal, factors = fit.normal, room.factors
    add_priors(p, log_edge, -1.0, normal)
    parts = parts_of(p)
    bins, level, slope = room.bins, room.level, room.slope
    bins[:], level[:], slope[:] = 0.0, 0.0, 0.0
    _add_up(p, parts, points, seen.baseline.centre, fit.curve, bins, level, slope, room.shift)
    left = within = 0.0
    for b in range(BINS):
        off, count = bins[b, WIDER], bins[b, WIDER + 1]
        if count > 0.0:
            left += off * off / count - variance
            within += count
    square = within * p[AMPLITUDE] ** 2 + 1e-12
    keep[LEFT], keep[LEFT_SD] = left / square, variance * math.sqrt(2.0 * BINS) / square

    _factor_with(normal, factors)
    for i in range(WIDER):
        level[i] *= seen.baseline.level / unit
        slope[i] *= seen.baseline.slope / unit
    along, shift, errors = room.along, room.shift, room.errors
    along[:] = 0.0
    along[0, START] = along[2, AMPLITUDE] = 1.0
    put_contact(parts, along[1])
    for m in range(3):
        for i in range(WIDER):
            shift[i] = along[m, i]
        solve(factors, shift)
        baseline = _product(shift, level) ** 2 + _product(shift, slope) ** 2
        total = variance * _product(along[m], shift) + baseline
        if variance < 1.0:
            for i in range(SKEW, WIDER):
                total += (1.0 - variance) * FITTED[i] * shift[i] * shift[i]
        errors[m] = math.sqrt(max(total, 0.0))
        keep[BESIDE + m] = baseline

    noise = max(variance, 1.0)
    keep[UNIT], keep[EDGE], keep[SHORT] = unit, log_edge, 0.0
    for i in range(WIDER):
        keep[ESTIMATE + i] = keep[NOW + i] = p[i] if i < PARAMETERS else 0.0
        keep[SCORE + i] = normal[i, WIDER] / noise
        for j in range(WIDER):
            keep[SQUARE + i * WIDER + j] = normal[max(i, j), min(i, j)] / noise
    return Errors(errors[0], errors[1], errors[2] * unit, 0.0)


@kernel
def put_contact(parts, along):
    """Write the derivatives of the contact time by the parameters into `along`."""
    along[SKEW], along[FLAT] = 0.5 * (parts.rise - parts.fall), parts.flat
    along[LENGTH] = parts.rise + parts.flat + parts.fall


@kernel
def _product(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@kernel
def _factor_with(normal, factors):
    """Factor the normal equations with the priors of the fit."""
    for i in range(WIDER):
        for j in range(i):
            factors[i, j] = normal[i, j]
        # What no sample shows has no error either.
        factors[i, i] = normal[i, i] + FITTED[i] + 1e-12
    factor(factors)


@kernel
def _add_up(p, parts, points, centre, curve, bins, level, slope, j):
    """Add up derivatives J, residuals and points in stretches; J^T 1, and J^T (t - centre)."""
    end = parts.rise + parts.flat + parts.fall
    turn = 0.5 * (2.0 * parts.rise + parts.flat)
    first, fall, last = inside(p, parts, points)
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
