"""Correlation sums of single vectors, for any norm and kernel, over all pairs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from ..._compiling.compiled import njit
from ..._running.threads import in_threads
from ._boxes import bin_of
from ._pairs import MOST_RADII, bins_of

Norm = Literal["max", "euclidean"]
Kernel = Literal["step", "gaussian"]

NEGLIGIBLE = 40.0
"""Exponent of the Gaussian kernel beyond which it adds nothing to a sum: exp(-40) is 4e-18."""

PARTS = 64
"""Parts of the vectors, for threads."""


@njit(nogil=True)
def _distance(columns, i, j, euclidean):
    """Distance of two vectors."""
    found = 0.0
    for d in range(len(columns)):
        gap = abs(columns[d, i] - columns[d, j])
        found = found + gap * gap if euclidean else max(found, gap)
    return np.sqrt(found) if euclidean else found


@njit(nogil=True)
def _count(columns, times, first, last, theiler, euclidean, bins, counts):
    """counts[i, k] += vectors in bin k about vector i."""
    radii, cells, least, shift, offset = bins
    for i in range(first, last):
        for j in range(len(times)):
            if abs(times[i] - times[j]) > theiler:
                distance = _distance(columns, i, j, euclidean)
                counts[i, bin_of(distance, cells, least, radii, shift, offset)] += 1


@njit(nogil=True)
def _weigh(columns, times, first, last, theiler, euclidean, radii, sums):
    """sums[i, k] += exp(-(d / 2 radii[k])^2) of the distance to each vector."""
    for i in range(first, last):
        for j in range(len(times)):
            if abs(times[i] - times[j]) > theiler:
                distance = _distance(columns, i, j, euclidean)
                for k in range(len(radii) - 1, -1, -1):
                    exponent = (distance / (2 * radii[k])) ** 2
                    if exponent > NEGLIGIBLE:
                        break
                    sums[i, k] += np.exp(-exponent)


def point_sums(
    vectors: np.ndarray,
    times: np.ndarray,
    theiler: int,
    radii: np.ndarray,
    norm: Norm,
    kernel: Kernel,
    workers: int | None = None,
) -> np.ndarray:
    """Kernel summed over the partners of each vector, shape (n, radii)."""
    columns, n = np.ascontiguousarray(vectors.T), len(vectors)
    euclidean = norm == "euclidean"

    def in_parts(part: Callable[..., None], *rest: object) -> None:
        in_threads(
            lambda k: part(
                columns, times, n * k // PARTS, n * (k + 1) // PARTS, theiler, euclidean, *rest
            ),
            range(PARTS),
            workers,
        )

    if kernel == "gaussian":
        sums = np.zeros((n, len(radii)))
        in_parts(_weigh, radii, sums)
        return sums
    found = []
    for at in range(0, len(radii), MOST_RADII):
        some = radii[at : at + MOST_RADII]
        counts = np.zeros((n, len(some) + 1), np.int64)
        in_parts(_count, bins_of(some), counts)
        found.append(np.cumsum(counts, axis=1)[:, :-1])
    return np.concatenate(found, axis=1)


def generalized(shares: np.ndarray, q: float) -> np.ndarray:
    """C_q from the correlation sums C_i of single vectors: their mean of order q - 1."""
    with np.errstate(divide="ignore"):
        logs = np.log(shares)
    if q == 1:
        found: np.ndarray = np.exp(logs.mean(axis=0))
        return found
    # From the greatest on, so that no power overflows.
    top = logs.max(axis=0) if q > 1 else logs.min(axis=0)
    top = np.where(np.isfinite(top), top, 0)
    mean = np.exp((q - 1) * (logs - top)).mean(axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.exp(top + np.log(mean) / (q - 1)))
