"""Kernels that fit two pulses of a known shape, and read that shape off pulses that stand alone.

    f(t) = b + sum over both of A s((t - t0) / T)

The shape s is piecewise linear, with KNOTS values at equal distances from BEFORE knots before the
start to as many after the end, and zero beyond.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._damped_step import FIRST, MOST, UNBOUND, damped_step, factor_damped, more_damped
from .._knots import add_bend, add_sample, copy_of, solve_knots
from .._small_matrices import invert
from ..edges import FIT
from ..fit_errors import BASE, TILT, ZERO

PER_CONTACT, BEFORE = 64, 3
KNOTS = PER_CONTACT + 2 * BEFORE + 1
BOTH = 7  # A, t0, ln T of the first, then of the second, and the baseline
STIFF = 0.02  # weight of a knot's bend, over that of its samples
LONGEST = np.array([np.inf, 0.3, 0.3, np.inf, 0.3, 0.3, np.inf])
"""Longest step; of starts, in contact times."""
STEPS, GAIN = 30, 1e-2
"""Steps, and what each gains at least, in the noise's variance."""


@allocating
def add_to_shape(rows, chosen, x, origin, knots):
    """Add the samples of the chosen pulses to the normal equations of their mean shape.

    Parameters
    ----------
    rows : array
        As `impactsig.detect.pulses.pulse.measure_all` fills them.
    chosen : array of int
        Those that stand alone.
    x, origin : array, int
        The samples, and the place of the first.
    knots : Knots
    """
    for k in chosen:
        start, length, height, kept = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, FIT:]
        # Where the shape goes with the height, the highest are not the mean.
        weight = 1.0 / length
        margin = BEFORE * length / PER_CONTACT
        first = max(math.ceil(start - margin), origin)
        last = min(int(start + length + margin), origin + len(x) - 1)
        for i in range(first, last + 1):
            place = (i - start) / length * PER_CONTACT + BEFORE
            j = int(place)
            if place < 0.0 or j >= KNOTS - 1:
                continue
            value = (x[i - origin] - kept[BASE] - kept[TILT] * (i - kept[ZERO])) / height
            add_sample(knots, j, place - j, weight, value)


@allocating
def solve_shape(knots, shape):
    """Put the mean shape into `shape`, from its normal equations; whether they determine it."""
    bound = copy_of(knots)
    weight = 0.0
    for j in range(KNOTS):
        weight += knots.own[j]
    for j in range(1, KNOTS - 1):
        add_bend(bound, j, STIFF * weight / KNOTS)
    return solve_knots(bound, shape)


@kernel
def _cost(p, points, x, shape, length, spread, normal):
    """Sum of squares that is left, with the prior of the lengths; fills the normal equations."""
    normal[:] = 0.0
    left = 0.0
    j = normal[BOTH]
    for k in range(len(points)):
        e = x[k] - p[BOTH - 1]
        j[BOTH - 1] = 1.0
        for m in range(0, BOTH - 1, 3):
            pace = PER_CONTACT / math.exp(p[m + 2])
            place = (points[k] - p[m + 1]) * pace + BEFORE
            j[m] = j[m + 1] = j[m + 2] = 0.0
            if 0.0 <= place < KNOTS - 1:
                at = int(place)
                bend = shape[at + 1] - shape[at]
                value = shape[at] + (place - at) * bend
                e -= p[m] * value
                j[m], j[m + 1] = value, -p[m] * bend * pace
                j[m + 2] = -p[m] * bend * (place - BEFORE)
        left += e * e
        for a in range(BOTH):
            normal[a, BOTH] += j[a] * e
            for b in range(a + 1):
                normal[a, b] += j[a] * j[b]
    for m in range(2, BOTH, 3):
        off = (length - p[m]) / spread
        normal[m, m] += spread**-2.0
        normal[m, BOTH] += off / spread
        left += off * off
    return left


@allocating
def fit_two(points, x, shape, length, spread, p, covariance):
    """Fit two pulses from `p`, in place; returns the residual variance over the noise's, or inf.

    Parameters
    ----------
    points, x : array
        Places at equal distances, and the samples there in units of their noise.
    shape : array (KNOTS,)
    length, spread : float
        Expected logarithm of a contact time, and its standard deviation.
    p : array (BOTH,)
    covariance : array (BOTH, BOTH), filled
        Of the parameters, for noise as assumed.
    """
    normals = np.empty((2, BOTH + 1, BOTH + 1))
    low, step, trial = np.empty((BOTH, BOTH)), np.empty(BOTH), np.empty(BOTH)
    now, damping = 0, FIRST
    cost = _cost(p, points, x, shape, length, spread, normals[0])
    for _ in range(STEPS):
        here = normals[now]
        if damped_step(here, damping, UNBOUND, low, step):
            for a in range(BOTH):
                most = LONGEST[a] * (math.exp(length) if a % 3 == 1 else 1.0)
                trial[a] = p[a] + min(max(step[a], -most), most)
            other = _cost(trial, points, x, shape, length, spread, normals[1 - now])
            if other < cost:
                gain, cost, now = cost - other, other, 1 - now
                for a in range(BOTH):
                    p[a] = trial[a]
                if gain < GAIN:
                    break
                damping *= 0.1
                continue
        damping = more_damped(damping)
        if damping > MOST:
            break
    if not factor_damped(normals[now], 1e-9, UNBOUND, low):
        return np.inf
    invert(low, covariance)
    return cost / max(len(points) - BOTH, 1)
