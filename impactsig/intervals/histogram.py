"""Histogram p(I) of interspike intervals, with a bin width that suits narrow clusters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arguments import one_or_several, reals, whole
from .._showing import Shown, drawn_by
from ..errors import InvalidInput
from .pairs import Intervals, as_intervals

MOST_BINS = 4096
LEAST_INTERVAL = 1e-290
"""Seconds that the longest interval must have for densities to be numbers."""


@dataclass(frozen=True, eq=False)
class IntervalHistogram(Shown):
    """Density of interspike intervals in equal bins.

    Attributes
    ----------
    density : ndarray, shape (bins,)
        p(I) [1/s]; its integral over the bins is 1.
    edges : ndarray, shape (bins + 1,)
        Edges of the bins [s].
    count : ndarray of int, shape (bins,)
        Number of intervals in each bin.
    rule : str
        How the bins were chosen.

    See Also
    --------
    interval_histogram, plot.histogram

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import interval_histogram
    >>> found = interval_histogram([1.0, 1.1, 1.1, 1.9], bins=2)
    >>> found.count, float(np.sum(found.density * np.diff(found.edges)).round(6))
    (array([3, 1]), 1.0)
    """

    density: np.ndarray
    edges: np.ndarray
    count: np.ndarray
    rule: str

    plot = drawn_by("histogram", "the histogram")


def interval_histogram(
    intervals: Intervals, bins: int | Sequence[float] | np.ndarray | None = None
) -> IntervalHistogram:
    """Histogram of interspike intervals, normalised to a density p(I).

    Without `bins` the width h is chosen by least-squares cross-validation [Rudemo1982]_: with at
    most 4096 equal bins with counts c, it minimises

        J(h) = 2 / ((n - 1) h) - (n + 1) / ((n - 1) h n^2) sum(c^2).

    Unlike rules for unimodal densities (Scott, Freedman-Diaconis) it resolves the narrow, widely
    spaced clusters of a periodic train and stays broad for a chaotic one. If the intervals are
    rounded (many are tied), the width is a multiple of the rounding step; if all are equal, there
    is one bin with a width of 1 % of their length.

    Parameters
    ----------
    intervals : array_like, shape (n,), or Impacts
        Interspike intervals [s], one or more.
    bins : int or array_like, optional
        Number of equal bins from the least to the greatest interval, or their edges [s]; intervals
        outside the edges are left out.

    Returns
    -------
    IntervalHistogram
        `density` p(I) [1/s] and `count`, shape (bins,), with the `edges` [s], shape (bins + 1,).

    Raises
    ------
    InvalidInput
        If there are no intervals (inside the edges), one is negative or not finite, or the bins
        are not a positive number or ascending edges.

    See Also
    --------
    return_map, plot.histogram

    Examples
    --------
    >>> from impactsig import interval_histogram
    >>> found = interval_histogram([1.0, 1.1, 1.1, 1.9], bins=2)
    >>> found.count
    array([3, 1])
    """
    values = as_intervals(intervals, least=1)
    low, high = float(values.min()), float(values.max())
    if 0 < high < LEAST_INTERVAL:
        raise InvalidInput(
            "intervals",
            f"intervals up to {high:g} s",
            f"some of {LEAST_INTERVAL:g} s or more, so that densities are not beyond float64",
            "Give them in another unit",
        )
    required = "a positive whole number, or ascending edges [s]"
    several, single = ((), True) if bins is None else one_or_several("bins", bins, required)
    equal = whole("bins", bins, 1, 10**7) if single and several else None
    if not single:
        edges, rule = _given_edges(several, required), "given edges"
    elif high - low <= 1e-9 * high:
        half = 0.005 * high or 0.5e-9
        edges = np.linspace(low - half, high + half, (equal or 1) + 1)
        rule = "all intervals equal"
    elif equal is not None:
        edges, rule = np.linspace(low, high, equal + 1), "given number of bins"
    else:
        power = int(np.frexp(high)[1])  # near 1 all products are numbers, and no digit changes
        scaled = np.ldexp(values, -power)
        edges = np.ldexp(_best_edges(scaled, float(scaled.min()), float(scaled.max())), power)
        rule = "least-squares cross-validation"
    count, edges = np.histogram(values, edges)
    if not count.sum():
        raise InvalidInput(
            "bins",
            f"edges from {edges[0]:g} to {edges[-1]:g} s",
            f"bins that hold some of the intervals, {low:g} to {high:g} s",
        )
    return IntervalHistogram(count / count.sum() / np.diff(edges), edges, count, rule)


def _given_edges(bins: tuple[Any, ...], required: str) -> np.ndarray:
    edges = reals("bins", bins, required)
    if edges.ndim != 1 or len(edges) < 2 or not np.all(np.diff(edges) > 0):
        raise InvalidInput("bins", bins, required)
    return edges


def _best_edges(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Equal bins from `low` to `high` with the least Rudemo score."""
    step = _rounding_step(values)
    if step:
        # whole steps, with the edges halfway between them: no interval lies on an edge
        most = round((high - low) / step) + 1
        widths = step * np.unique(np.geomspace(1, most, 80).astype(int))
        low -= step / 2
    else:
        widths = (high - low) / np.unique(np.geomspace(1, MOST_BINS, 80).astype(int))
    n = len(values)
    best, least = high - low, np.inf
    for width in widths[widths * MOST_BINS >= (high - low) * (1 - 1e-9)].tolist():
        which = ((values - low) * ((1 - 1e-12) / width)).astype(np.intp)
        squares = float(np.sum(np.bincount(which).astype(float) ** 2))
        score = (2 - (n + 1) / n**2 * squares) / width
        if score < least:
            best, least = width, score
    number = max(int(np.ceil((high - low) / best * (1 - 1e-12))), 1)
    return low + best * np.arange(number + 1) if step else np.linspace(low, high, number + 1)


def _rounding_step(values: np.ndarray) -> float:
    """Step to which intervals are rounded, found from ties; else bins would be ever finer."""
    resolution = 1e-9 * float(values.max())  # below it equal intervals differ by arithmetic alone
    distinct, count = np.unique(np.round(values / resolution), return_counts=True)
    return resolution * float(np.min(np.diff(distinct))) if np.mean(count > 1) > 0.1 else 0.0
