"""Autoregressive sieve: the linear Gaussian process behind a series, and its realisations.

Everything is done on normal scores: the value of rank k of n is replaced by the normal quantile of
(k - 1/2)/n, in the data and, by its own ranks, in every realisation. So nothing depends on the
monotone function through which the process is seen, and data and surrogates have one distribution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._autoregression import burg, levinson, linear_moments, realisation

PILOTS, ROUNDS = 40, 2
"""Realisations from which the bias of the coefficients is taken, and how often."""
SETTLING = 400
"""Values of a realisation that are thrown away."""
STEEPEST = 0.999
"""Greatest reflection coefficient; 1 is a process without a spectrum."""
EMPTY = 0.25
"""Share of the range from the 5 % to the 95 % quantile that, without a value in it, is a gap."""
APART = 2.0
"""Distance in normal scores by which values on both sides of a gap are moved apart."""


class Scores(NamedTuple):
    """Normal scores of the values of a series, by rank."""

    normal: np.ndarray  # of every rank, ascending; equal values share a score
    spread: np.ndarray  # the same, with values on both sides of a gap moved apart

    @classmethod
    def of(cls, x: np.ndarray) -> Scores:
        """The scores of a series."""
        from scipy.special import ndtri

        n = len(x)
        ascending = np.sort(x)
        level = np.concatenate(([0], np.cumsum(ascending[1:] > ascending[:-1])))
        quantile = ndtri((np.arange(n) + 0.5) / n)
        normal = (np.bincount(level, quantile) / np.bincount(level))[level]
        low, high = ascending[[int(0.05 * n), min(int(0.95 * n), n - 1)]]
        step = np.diff(ascending)
        empty = (step > EMPTY * (high - low)) & (ascending[1:] > low) & (ascending[:-1] < high)
        # A few values apart from the others are outliers, not a second group.
        empty[: int(0.05 * n)] = empty[n - 1 - int(0.05 * n) :] = False
        return cls(normal, normal + APART * np.concatenate(([0], np.cumsum(empty))))


def ranked(x: np.ndarray, ascending: np.ndarray) -> np.ndarray:
    """The series with its value of rank k replaced by ``ascending[k]``."""
    made = np.empty(len(x))
    made[np.argsort(x, kind="stable")] = ascending
    return made


def coefficients(x: np.ndarray, scores: Scores, rng: np.random.Generator) -> np.ndarray:
    """Autoregressive coefficients whose process has the autocorrelation of the scores.

    Burg's method, of the order up to 10 log10(n) with the least AIC. Its reflection coefficients
    are biased, and so is what scoring leaves of a correlation: both are found from realisations and
    taken out, by Fisher's transform of the coefficients.
    """
    n = len(x)
    reflection, left = burg(ranked(x, scores.normal), max(min(int(10 * np.log10(n)), n // 4), 1))
    information = n * np.log(np.maximum(left, 1e-300)) + 2 * np.arange(len(left))
    order = int(np.argmin(information))
    if not order:
        return np.zeros(0)
    wanted = _fisher(reflection[:order])
    given = wanted.copy()
    for _ in range(ROUNDS):
        process = levinson(np.tanh(given))
        found = [
            _fisher(burg(ranked(draw(process, n, rng), scores.normal), order)[0])
            for _ in range(PILOTS)
        ]
        given = np.clip(given + wanted - np.mean(found, axis=0), *_fisher([-STEEPEST, STEEPEST]))
    made: np.ndarray = levinson(np.tanh(given))
    return made


def draw(process: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """A realisation of n values."""
    made: np.ndarray = realisation(process, rng.standard_normal(SETTLING + n))[SETTLING:]
    return made


def linear_error(x: np.ndarray, order: int) -> float:
    """RMS error of the least-squares linear prediction from so many values."""
    matrix, right, power = linear_moments(x, order)
    left = power - right @ np.linalg.pinv(matrix, hermitian=True) @ right
    floor = 1e-12 * power  # what rounding leaves of a series that a recursion foretells
    return float(np.sqrt(max(left, floor) / (len(x) - order)))


def _fisher(reflection: np.ndarray | list[float]) -> np.ndarray:
    return np.arctanh(np.clip(reflection, -STEEPEST, STEEPEST))
