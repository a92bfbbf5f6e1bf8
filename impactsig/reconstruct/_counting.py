"""Exact counts of pairs: which kernel, in how many threads, never with what result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from .._arguments import thread_count
from . import _boxes, _pairs
from ._series import known
from ._threads import in_threads

Kernel = Literal["pairs", "boxes"]

# Nanoseconds a pair, measured: of all pairs (binning, and every dimension more), of those that the
# sweep looks at, of those that are looked up in order to sort. Only the ratios matter.
OF_ALL, PER_DIMENSION, OF_NEAR = 0.8, 0.25, 10.0
PARTS = 64
"""Parts of the sweep: many more than threads, as they take unequal times."""


def count_pairs(
    x: np.ndarray,
    dimensions: Sequence[int],
    delay: int,
    theiler: int,
    radii: np.ndarray,
    workers: int | None = None,
    kernel: Kernel | None = None,
) -> np.ndarray:
    """Pairs i < j of delay vectors with j - i > theiler and a distance of r or less.

    Parameters
    ----------
    x : ndarray of float64, shape (n,)
        As `series` returns it; each gap at least as many nan wide as the delay. Differences from
        nan are within no radius, and so no kernel asks for gaps.
    dimensions : sequence of int
        Ascending.
    radii : ndarray of float64, shape (r,)
        Positive, ascending.
    workers : int, optional
        Threads; as many as there are cores unless given. The counts do not depend on it.
    kernel : {"pairs", "boxes"}, optional
        Whether to look at all pairs or at near ones; unless given, the one expected to be faster.
        The counts do not depend on it.

    Returns
    -------
    ndarray of int64, shape (dimensions, radii)
    """
    counts = [
        _count(x, dimensions, delay, theiler, part, workers, kernel) for part in _parts_of(radii)
    ]
    return np.concatenate(counts, axis=-1)


def _parts_of(radii: np.ndarray) -> list[np.ndarray]:
    return [radii[k : k + _pairs.MOST_RADII] for k in range(0, len(radii), _pairs.MOST_RADII)]


def _count(
    x: np.ndarray,
    dimensions: Sequence[int],
    delay: int,
    theiler: int,
    radii: np.ndarray,
    workers: int | None,
    kernel: Kernel | None,
) -> np.ndarray:
    """Counts, shape (dimensions, radii)."""
    # Of one dimension the sorted values tell how many lie within each radius without any pair.
    sort = dimensions[0] == 1 and (len(dimensions) > 1 or kernel != "pairs")
    rest = tuple(dimensions[1:]) if sort else tuple(dimensions)
    if sort and not rest:
        return _sorted(x, theiler, radii, workers)
    strips = _strips_if_faster(x, rest, delay, theiler, float(radii[-1]), kernel)
    if strips is None:
        return _full(x, dimensions, delay, theiler, radii, workers)
    counts = _near(strips, rest, theiler, radii, workers)
    if sort:
        counts = np.concatenate((_sorted(x, theiler, radii, workers), counts))
    return counts


def _strips_if_faster(
    x: np.ndarray,
    dimensions: Sequence[int],
    delay: int,
    theiler: int,
    radius: float,
    kernel: Kernel | None,
) -> _boxes.Strips | None:
    """The vectors made ready for the sweep, or None where to look at all pairs costs less."""
    with np.errstate(over="ignore"):
        span = float(np.ptp(known(x)))
    if kernel == "pairs" or not np.isfinite(span) or (kernel is None and 4 * radius > span):
        return None
    strips = _boxes.strips_of(x, dimensions[0], dimensions[-1], delay, radius)
    if kernel is None:
        far = max(len(strips.order) - theiler - 1, 0)
        cost = (OF_ALL + PER_DIMENSION * len(dimensions)) * far * (far + 1) / 2
        if OF_NEAR * _boxes.candidates(strips, radius) > cost:
            return None
    return strips


def _full(
    x: np.ndarray,
    dimensions: Sequence[int],
    delay: int,
    theiler: int,
    radii: np.ndarray,
    workers: int | None,
) -> np.ndarray:
    bins = _pairs.bins_of(radii)
    n = len(x) - (dimensions[0] - 1) * delay
    row_of = _rows(dimensions)
    parts = 4 * thread_count(workers)

    def part(k: int) -> np.ndarray:
        counts = np.zeros((len(dimensions), len(radii) + 1), np.int64)
        _pairs.count_diagonals(x, theiler + 1 + k, n, parts, delay, row_of, bins, counts)
        return counts

    return _within(in_threads(part, parts, workers))


def _near(
    strips: _boxes.Strips,
    dimensions: Sequence[int],
    theiler: int,
    radii: np.ndarray,
    workers: int | None,
) -> np.ndarray:
    bins, n, row_of = _pairs.bins_of(radii), len(strips.order), _rows(dimensions)

    def part(k: int) -> np.ndarray:
        counts = np.zeros((len(dimensions), len(radii) + 1), np.int64)
        ends = n * k // PARTS, n * (k + 1) // PARTS
        _boxes.count_near(strips, *ends, theiler, row_of, bins, counts)
        return counts

    return _within(in_threads(part, PARTS, workers))


def _sorted(x: np.ndarray, theiler: int, radii: np.ndarray, workers: int | None) -> np.ndarray:
    """Counts of dimension 1: of all pairs by sorting, less those within the Theiler window."""
    values = np.sort(known(x))
    parts = thread_count(workers)

    def part(k: int) -> np.ndarray:
        within = np.zeros(len(radii[k::parts]), np.int64)
        _boxes.count_sorted(values, radii[k::parts], within)
        return within

    counts = np.empty(len(radii), np.int64)
    for k, within in enumerate(in_threads(part, parts, workers)):
        counts[k::parts] = within
    close = np.zeros((1, len(radii) + 1), np.int64)
    bins = _pairs.bins_of(radii)
    _pairs.count_diagonals(x, 1, min(theiler + 1, len(x)), 1, 1, _rows((1,)), bins, close)
    return (counts - np.cumsum(close[0])[:-1])[None]


def _rows(dimensions: Sequence[int]) -> np.ndarray:
    row_of = np.full(dimensions[-1], -1)
    row_of[np.array(dimensions) - 1] = np.arange(len(dimensions))
    return row_of


def _within(binned: list[np.ndarray]) -> np.ndarray:
    """The sum of the parts' counts per bin, as counts of all pairs within each radius."""
    return np.cumsum(np.sum(binned, axis=0), axis=-1)[..., :-1]
