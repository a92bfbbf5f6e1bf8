"""Kernels of the shape that impacts share: its mean and spread of greatest likelihood.

The information H of a pulse is that on height and start (a) and on its shape (s). Freed from the
former, that on the shape alone is M = Hss - Hsa Haa^-1 Has, and the score b = gs - Hsa Haa^-1 ga.
With mean mu and weights W = 1 / spread^2 of the shapes, a pulse fitted at the shape s moves by

    C (b - W (s - mu)),    C = (M + W)^-1.

With g = 1 - W C of each, the variance of a shape parameter moves by Fisher's step,

    (sum (moved)^2 - spread^2 (sum g - sum g^2 / sum g)) / sum g^2,

each sum with that of WEIGHT pulses that differ by SPREAD. The last term is what the mean follows of
them (restricted maximum likelihood). A span of few pulses cannot tell no spread from a small one,
so what the spans before tell of the variance counts as a normal prior on it, while the span agrees.
Pulses are measured with the expected variance of the shapes, given the estimate L with standard
error e and a flat prior: nearly (L + sqrt(L^2 + e^2)) / 2, which is L where e is small, and e/2
where L is 0.

The flat top counts by ln(1 + p/(BRIEF m)) here, not by ln p/m as in the fit: a pulse is linear in
the length of a brief one, whose logarithm has no bound.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel, njit
from .._model import FLAT, SKEW, WIDER
from .._small_matrices import factor, invert, solve
from ..edges import FIT
from ..fit_errors import ESTIMATE, SCORE, SQUARE

SHAPES = WIDER - SKEW
ROUNDS, AGAIN = 8, 4
"""Steps, from no shape and from one that was estimated before."""
BRIEF = 0.3
"""Flat tops over edges that count as brief."""
APART = np.array([0.5, 1.0, 0.3, 0.7, 0.15])
"""Standard deviation of the mean shape about where it is expected."""
ALONE = 2
"""First of the rows in which a span tells what it shows by itself."""
FORGOTTEN, AGREES = 0.1, 3.0
"""Share of what the spans before tell that each new one takes off; standard errors within which a
span agrees with them."""
SPREAD, WEIGHT = np.array([0.0005, 0.002, 0.00025, 0.0005, 0.00025]), 1.0
"""Standard deviation of shapes that is expected, and how many pulses it counts as."""
LEAST = SPREAD * np.array([1.0, 0.2, 0.5, 0.2, 1.0])
"""No less is it taken to be. Pulses of infinite slope are not linear in the others, and need it."""


class Fits(NamedTuple):
    """Fits of pulses; the last axis is the pulse."""

    own: np.ndarray  # (2, 2, n), Haa^-1
    pull: np.ndarray  # (2, n), Haa^-1 ga
    along: np.ndarray  # (2, s, n), Haa^-1 Has
    information: np.ndarray  # (s, s, n), M
    score: np.ndarray  # (s, n), b
    shape: np.ndarray  # (s, n), that was fitted
    step: np.ndarray  # (2 + s, n), from the fit to what the shared shape makes of it
    covariance: np.ndarray  # (s, s, n), C


class Shape(NamedTuple):
    """The shared shape."""

    mean: np.ndarray  # (s,), mu
    spread: np.ndarray  # (s,), W^-1/2
    common: np.ndarray  # (s, s), W (covariance of the mean) W
    told: np.ndarray  # (4, s + 1), as `nothing_told` describes it


@allocating
def set_free(rows, alike):
    """The fits of some rows, with shapes freed from height and start."""
    n, s = len(alike), SHAPES
    fits = Fits(
        np.empty((SKEW, SKEW, n)),
        np.empty((SKEW, n)),
        np.empty((SKEW, s, n)),
        np.empty((s, s, n)),
        np.empty((s, n)),
        np.empty((s, n)),
        np.empty((WIDER, n)),
        np.empty((s, s, n)),
    )
    square, score = np.empty((WIDER, WIDER)), np.empty(WIDER)
    for i in range(n):
        kept = rows[alike[i], FIT:]
        flat = np.exp(kept[ESTIMATE + FLAT])
        longer = 1.0 + BRIEF / flat
        for m in range(WIDER):
            score[m] = kept[SCORE + m] * (longer if m == FLAT else 1.0)
            for k in range(WIDER):
                square[m, k] = kept[SQUARE + m * WIDER + k]
        for m in range(WIDER):
            square[FLAT, m] *= longer
            square[m, FLAT] *= longer
        first, second = square[0, 0] + 1e-9, square[1, 1] + 1e-9
        cross = square[1, 0]
        determinant = first * second - cross * cross
        own, along, pull = fits.own, fits.along, fits.pull
        own[0, 0, i], own[1, 1, i] = second / determinant, first / determinant
        own[0, 1, i] = own[1, 0, i] = -cross / determinant
        for m in range(SKEW):
            pull[m, i] = own[m, 0, i] * score[0] + own[m, 1, i] * score[1]
            for a in range(s):
                along[m, a, i] = (
                    own[m, 0, i] * square[0, SKEW + a] + own[m, 1, i] * square[1, SKEW + a]
                )
        for a in range(s):
            fits.shape[a, i] = kept[ESTIMATE + SKEW + a]
            fits.score[a, i] = (
                score[SKEW + a]
                - square[SKEW + a, 0] * pull[0, i]
                - square[SKEW + a, 1] * pull[1, i]
            )
            for b in range(s):
                fits.information[a, b, i] = (
                    square[SKEW + a, SKEW + b]
                    - square[SKEW + a, 0] * along[0, b, i]
                    - square[SKEW + a, 1] * along[1, b, i]
                )
            fits.information[a, a, i] += 1e-9
        fits.shape[FLAT - SKEW, i] = np.log(1.0 + flat / BRIEF)
    return fits


# reassoc: sums over the pulses run in lanes.
@njit(nogil=True, error_model="numpy", fastmath={"reassoc", "nsz", "contract"})
def estimate_shape(fits, about, told, before, rounds):
    """Estimate the shape that fits share; fills in their steps and covariances.

    It is looked for from the shape `before`, in so many rounds; `about` (2, s) is where its mean is
    expected, and how far from there, `told` what the spans before tell of its spread.
    """
    n, s = fits.score.shape[1], SHAPES
    told = told.copy()
    told[ALONE:, :s] = 0.0
    mean, spread = before.mean.copy(), before.spread.copy()
    mode = spread.copy()
    weight, towards = np.empty(s), np.empty(s)
    information, uncertain, factors = np.empty((s, s)), np.empty((s, s)), np.empty((s, s))
    pull, room, covariance = np.empty((s, n)), np.empty(n), fits.covariance
    for turn in range(rounds):
        for a in range(s):
            weight[a] = spread[a] ** -2.0
        for a in range(s):
            for b in range(a + 1):
                here, known = covariance[a, b], fits.information[a, b]
                more = weight[a] if a == b else 0.0
                for i in range(n):
                    here[i] = known[i] + more
            here, score, shape = pull[a], fits.score[a], fits.shape[a]
            for i in range(n):
                here[i] = score[i] - weight[a] * (shape[i] - mean[a])
        _invert_all(covariance, room)
        for a in range(s):
            step = fits.step[SKEW + a]
            step[:] = 0.0
            for b in range(s):
                column, along = covariance[max(a, b), min(a, b)], pull[b]
                total = 0.0
                for i in range(n):
                    step[i] += column[i] * along[i]
                for i in range(n):
                    total += column[i]
                information[a, b] = -weight[a] * total * weight[b]
            shape = fits.shape[a]
            moved = own = shown = square = 0.0
            column = covariance[a, a]
            for i in range(n):
                off = shape[i] - mean[a] + step[i]
                share = 1.0 - weight[a] * column[i]
                moved += off
                own += off * off
                shown += share
                square += share * share
            information[a, a] += n * weight[a] + about[1, a] ** -2.0
            towards[a] = (about[0, a] - mean[a]) / about[1, a] ** 2 + weight[a] * moved
            if turn == rounds - 1:
                continue
            variance = spread[a] ** 2
            followed = square / (shown + variance / about[1, a] ** 2 + 1e-12)
            gain, double = own - variance * (shown - followed), 2.0 * variance * variance
            seen, likely = square / double, variance + gain / max(square, 1e-12)
            apart = likely * told[1, a] - told[0, a]
            if apart * apart * seen > AGREES**2 * told[1, a] * (told[1, a] + seen):
                told[:ALONE, a] = 0.0
            known = max(seen + told[1, a], 1e-300)
            level = (seen * likely + told[0, a]) / known
            gain += WEIGHT * (SPREAD[a] ** 2 - variance)
            gain += double * (told[0, a] - told[1, a] * variance)
            square += double * told[1, a]
            variance += max(gain / (square + WEIGHT), -0.9 * variance)
            if turn == rounds - 2 and abs(seen * likely) < np.inf:
                told[ALONE, a], told[ALONE + 1, a] = seen * likely, seen
            mode[a] = np.sqrt(variance)
            # The last round allows for what is not known of it.
            if turn == rounds - 2 and abs(level) < np.inf:
                expected = 0.5 * (level + np.sqrt(level * level + 1.0 / known))
                expected = min(expected, variance + about[1, a] ** 2)
                variance = max(expected, LEAST[a] ** 2)
            spread[a] = np.sqrt(variance)
        for a in range(s):
            for b in range(s):
                factors[a, b] = information[a, b]
        factor(factors)
        invert(factors, uncertain)
        solve(factors, towards)
        for a in range(s):
            mean[a] += towards[a]
    for a in range(s):
        for b in range(a):
            covariance[b, a] = covariance[a, b]
        for b in range(s):
            uncertain[a, b] *= weight[a] * weight[b]
    for m in range(SKEW):
        step, alone = fits.step[m], fits.pull[m]
        for i in range(n):
            step[i] = alone[i]
        for a in range(s):
            along, turned = fits.along[m, a], fits.step[SKEW + a]
            for i in range(n):
                step[i] -= along[i] * turned[i]
    return Shape(mean, mode, uncertain, told)


@kernel
def _invert_all(a, room):
    """Put the inverses of positive definite matrices, lower triangles (s, s, n), in their place.

    Gauss and Jordan's elimination, which leaves the negative inverse; `room` is (n,).
    """
    s, n = a.shape[0], a.shape[2]
    for p in range(s):
        pivot = a[p, p]
        for k in range(n):
            room[k] = 1.0 / pivot[k]
        for i in range(s):
            if i == p:
                continue
            row = a[max(i, p), min(i, p)]
            for j in range(i + 1):
                if j == p:
                    continue
                column, here = a[max(j, p), min(j, p)], a[i, j]
                for k in range(n):
                    here[k] -= row[k] * column[k] * room[k]
        for i in range(s):
            if i != p:
                row = a[max(i, p), min(i, p)]
                for k in range(n):
                    row[k] *= room[k]
        for k in range(n):
            pivot[k] = -room[k]
    for i in range(s):
        for j in range(i + 1):
            here = a[i, j]
            for k in range(n):
                here[k] = -here[k]


@kernel
def variance_along(direction, i, fits, shape, seen, moved):
    """Variances of a linear function of the parameters of pulse i: its own, and the mean shape's.

    `seen` and `moved` are room to work in, a number for each parameter of the shape.
    """
    s = SHAPES
    total = 0.0
    for m in range(SKEW):
        for k in range(SKEW):
            total += direction[m] * fits.own[m, k, i] * direction[k]
    for a in range(s):
        seen[a] = direction[SKEW + a]
        for m in range(SKEW):
            seen[a] -= direction[m] * fits.along[m, a, i]
    for a in range(s):
        moved[a] = 0.0
        for b in range(s):
            moved[a] += fits.covariance[a, b, i] * seen[b]
        total += seen[a] * moved[a]
    common = 0.0
    for a in range(s):
        for b in range(s):
            common += moved[a] * shape.common[a, b] * moved[b]
    return total, common
