"""Kernels of the shape that impacts share: mean and spread by expectation and maximisation.

The information H of a pulse is that on height and start (a) and on its shape (s). Freed from the
former, that on the shape alone is M = Hss - Hsa Haa^-1 Has, and the score b = gs - Hsa Haa^-1 ga.
With mean mu and weights W = 1 / spread^2 of the shapes, a pulse fitted at the shape s moves by

    C (b - W (s - mu)),    C = (M + W)^-1.

The flat top counts by ln(1 + p/(BRIEF m)) here, not by ln p/m as in the fit: a pulse is linear in
the length of a brief one, whose logarithm has no bound.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._compiled import njit
from ._fit_errors import ESTIMATE, MISFIT, SCORE, SQUARE
from ._pulse_model import FLAT, SKEW, WIDER
from ._small_matrices import factor, invert, solve

SHAPES = WIDER - SKEW
ROUNDS = 8
BRIEF = 0.3
"""Flat tops over edges that count as brief."""
APART = np.array([0.5, 1.7, 0.25, 0.7, 0.3])
"""Standard deviation of the mean shape about where it is expected."""
SPREAD, WEIGHT = np.array([0.05, 0.17, 0.025, 0.02, 0.025]), 2.0
"""Standard deviation of shapes to begin with, and how many pulses it counts as."""


class Fits(NamedTuple):
    """Fits of pulses, an entry each."""

    own: np.ndarray  # (n, 2, 2), Haa^-1
    pull: np.ndarray  # (n, 2), Haa^-1 ga
    along: np.ndarray  # (n, 2, s), Haa^-1 Has
    information: np.ndarray  # (n, s, s), M
    score: np.ndarray  # (n, s), b
    shape: np.ndarray  # (n, s), that was fitted
    step: np.ndarray  # (n, 2 + s), from the fit to what the shared shape makes of it
    covariance: np.ndarray  # (n, s, s), C


class Shape(NamedTuple):
    """The shared shape."""

    weight: np.ndarray  # (s,), W
    uncertain: np.ndarray  # (s, s), covariance of the mean


@njit(nogil=True)
def set_free(kept):
    """The fits, of what is kept of each, with shapes freed from height and start."""
    n, s = len(kept), SHAPES
    fits = Fits(
        np.empty((n, SKEW, SKEW)),
        np.empty((n, SKEW)),
        np.empty((n, SKEW, s)),
        np.empty((n, s, s)),
        np.empty((n, s)),
        np.empty((n, s)),
        np.empty((n, WIDER)),
        np.empty((n, s, s)),
    )
    for i in range(n):
        # Misfit makes a pulse count for less.
        part = 1.0 / (1.0 + kept[i, MISFIT])
        square = kept[i, SQUARE:].copy().reshape((WIDER, WIDER))
        score = kept[i, SCORE:SQUARE].copy()
        flat = np.exp(kept[i, ESTIMATE + FLAT])
        longer = 1.0 + BRIEF / flat
        score[FLAT] *= longer
        for m in range(WIDER):
            square[FLAT, m] *= longer
            square[m, FLAT] *= longer
        first, second = square[0, 0] * part + 1e-9, square[1, 1] * part + 1e-9
        cross = square[1, 0] * part
        determinant = first * second - cross * cross
        own = fits.own[i]
        own[0, 0], own[1, 1] = second / determinant, first / determinant
        own[0, 1] = own[1, 0] = -cross / determinant
        for m in range(SKEW):
            fits.pull[i, m] = part * (own[m, 0] * score[0] + own[m, 1] * score[1])
            for a in range(s):
                fits.along[i, m, a] = part * (
                    own[m, 0] * square[0, SKEW + a] + own[m, 1] * square[1, SKEW + a]
                )
        for a in range(s):
            fits.shape[i, a] = kept[i, ESTIMATE + SKEW + a]
            fits.score[i, a] = part * (
                score[SKEW + a]
                - square[SKEW + a, 0] * fits.pull[i, 0]
                - square[SKEW + a, 1] * fits.pull[i, 1]
            )
            for b in range(s):
                fits.information[i, a, b] = part * (
                    square[SKEW + a, SKEW + b]
                    - square[SKEW + a, 0] * fits.along[i, 0, b]
                    - square[SKEW + a, 1] * fits.along[i, 1, b]
                )
            fits.information[i, a, a] += 1e-9
        fits.shape[i, FLAT - SKEW] = np.log(1.0 + flat / BRIEF)
    return fits


@njit(nogil=True)
def estimate_shape(fits, about):
    """The shape that fits share, expected near `about`; fills in their steps and covariances."""
    n, s = len(fits.score), SHAPES
    mean, spread = about.copy(), APART.copy()
    weight, towards, own, shown = np.empty(s), np.empty(s), np.empty(s), np.empty(s)
    information, uncertain, factors = np.empty((s, s)), np.empty((s, s)), np.empty((s, s))
    pull = np.empty(s)
    for _ in range(ROUNDS):
        for a in range(s):
            weight[a] = spread[a] ** -2.0
            towards[a] = (about[a] - mean[a]) / APART[a] ** 2
            own[a] = shown[a] = 0.0
            information[a, :] = 0.0
            information[a, a] = n * weight[a] + APART[a] ** -2.0
        for i in range(n):
            covariance = fits.covariance[i]
            for a in range(s):
                for b in range(a):
                    factors[a, b] = fits.information[i, a, b]
                factors[a, a] = fits.information[i, a, a] + weight[a]
            factor(factors)
            invert(factors, covariance)
            for a in range(s):
                pull[a] = fits.score[i, a] - weight[a] * (fits.shape[i, a] - mean[a])
            for a in range(s):
                step = 0.0
                for b in range(s):
                    step += covariance[a, b] * pull[b]
                    information[a, b] -= weight[a] * covariance[a, b] * weight[b]
                fits.step[i, SKEW + a] = step
                off = fits.shape[i, a] - mean[a] + step
                towards[a] += off * weight[a]
                own[a] += off * off
                shown[a] += 1.0 - covariance[a, a] * weight[a]
        for a in range(s):
            for b in range(s):
                factors[a, b] = information[a, b]
            spread[a] = np.sqrt((own[a] + WEIGHT * SPREAD[a] ** 2) / (max(shown[a], 0.0) + WEIGHT))
        factor(factors)
        invert(factors, uncertain)
        solve(factors, towards)
        for a in range(s):
            mean[a] += towards[a]
    for i in range(n):
        for m in range(SKEW):
            fits.step[i, m] = fits.pull[i, m]
            for a in range(s):
                fits.step[i, m] -= fits.along[i, m, a] * fits.step[i, SKEW + a]
    return Shape(weight, uncertain)


@njit(nogil=True)
def variance_along(direction, i, fits, shape):
    """Variance of a linear function of the parameters of pulse i: its own, and the mean shape's."""
    s = SHAPES
    total = 0.0
    for m in range(SKEW):
        for k in range(SKEW):
            total += direction[m] * fits.own[i, m, k] * direction[k]
    seen, moved = np.empty(s), np.empty(s)
    for a in range(s):
        seen[a] = direction[SKEW + a]
        for m in range(SKEW):
            seen[a] -= direction[m] * fits.along[i, m, a]
    for a in range(s):
        moved[a] = 0.0
        for b in range(s):
            moved[a] += fits.covariance[i, a, b] * seen[b]
        total += seen[a] * moved[a]
    for a in range(s):
        for b in range(s):
            common = shape.weight[a] * shape.uncertain[a, b] * shape.weight[b]
            total += moved[a] * common * moved[b]
    return total
