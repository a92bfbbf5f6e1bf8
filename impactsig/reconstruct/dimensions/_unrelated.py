r"""Contribution of unrelated vectors to a correlation sum.

Two values drawn at random are near each other with the probability K_1(H), the sum in one
dimension; m of them, were they independent, with U(H) = K_1(H)^m. Of a motion that expands
distances beyond H within a vector such pairs are a share of K_m, though their states are not near:
with T the pairs of near states, K_m = T + U, and the slope is steeper than that of T by

.. math:: \frac{U}{K_m - U} \Big(\frac{d \ln U}{d \ln H} - \frac{d \ln K_m}{d \ln H}\Big) .

The share falls as H^(m - D): the largest scales are the ones to be left out.
"""

from __future__ import annotations

import numpy as np

PAIRS = 30_000

MOST = 0.9
"""Share of a sum that unrelated vectors may be, where it is freed of them."""


def unrelated(
    scales: np.ndarray, values: np.ndarray, m: int, theiler: int, variance: float
) -> np.ndarray:
    """U at each scale, shape (scales,).

    Parameters
    ----------
    scales : ndarray, shape (scales,)
        H.
    values : ndarray, shape (n,)
        The series, nan at gaps.
    m : int
        Embedding dimension.
    theiler : int
        Pairs no further apart in time are left out.
    variance : float
        Of the noise on a value.
    """
    rng = np.random.default_rng(0)
    i, j = rng.integers(len(values), size=(2, PAIRS))
    squares = (values[i] - values[j])[np.abs(i - j) > theiler] ** 2
    squares = squares[np.isfinite(squares)]
    width = scales**2 - variance
    near = np.exp(-squares / (4 * width[:, None])).mean(axis=1) * scales / np.sqrt(width)
    found: np.ndarray = np.maximum(near, 1 / PAIRS) ** m
    return found


def freed(sums: np.ndarray, chance: np.ndarray) -> np.ndarray:
    """T, the sums without those of unrelated vectors."""
    found: np.ndarray = sums - np.minimum(chance, MOST * sums)
    return found


def steepened(scales: np.ndarray, sums: np.ndarray, chance: np.ndarray) -> np.ndarray:
    """Increase of the slope at each of three scales or more by unrelated vectors."""
    logs = np.log(scales)
    steeper = np.gradient(np.log(chance), logs) - np.gradient(np.log(sums), logs)
    left = sums - chance
    found: np.ndarray = np.where(
        left > 0, chance * np.maximum(steeper, 0.0) / np.where(left > 0, left, 1.0), np.inf
    )
    return found
