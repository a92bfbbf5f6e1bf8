"""The interspike intervals: return map and density."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ... import intervals
from ...impacts import Impacts
from ...intervals.pairs import unbroken_pairs
from ..axes import axes, bins, delay_plane, explain, frame, points, seconds, span_of
from ..stops import scatter_by_stop

if TYPE_CHECKING:
    from collections.abc import Iterable

    from matplotlib.axes import Axes

    from ...intervals import IntervalHistogram


def return_map(impacts: Impacts | Iterable[float], lag: int = 1, ax: Axes | None = None) -> Axes:
    """Draw each interspike interval against the one `lag` before it, with the diagonal.

    A periodic motion gives a set of points, chaos a curve or a structured cloud. With several
    stops, a point has the colour of the stop that was hit at the end of its first interval.

    Parameters
    ----------
    impacts : Impacts or array_like, shape (n,)
        Measured or simulated; an array holds intervals [s].
    lag : int, optional
        Distance between the two intervals, in intervals.

    Raises
    ------
    InvalidInput
        If an interval is negative or not finite, or `lag` is not a positive whole number.

    See Also
    --------
    impactsig.return_map, impactsig.plot.histogram

    Examples
    --------
    >>> from impactsig import plot
    >>> ax = plot.return_map([1.0, 2.0, 3.0, 5.0])
    """
    first, later = intervals.return_map(impacts, lag)
    ax = axes(ax, width=4.2, height=4.0)
    if not len(first):
        return explain(ax, f"Too few intervals for a return map at lag {lag}.")
    both = np.concatenate((first, later))
    delay_plane(ax, both, lag=lag)
    if not isinstance(impacts, Impacts):
        points(ax, first, later)
        return ax
    between = 1 + np.flatnonzero(unbroken_pairs(impacts, lag))
    scatter_by_stop(ax, impacts, between, first, later)
    return ax


def histogram(
    result: IntervalHistogram | Impacts | Iterable[float], ax: Axes | None = None
) -> Axes:
    """Draw the density p(I) of the interspike intervals.

    Parameters
    ----------
    result : IntervalHistogram, Impacts or array_like, shape (n,)
        Impacts, and arrays of intervals [s], are binned by `impactsig.interval_histogram` with its
        automatic width.

    Raises
    ------
    InvalidInput
        If an interval is negative or not finite.

    See Also
    --------
    impactsig.interval_histogram, impactsig.plot.return_map

    Examples
    --------
    >>> from impactsig import plot
    >>> ax = plot.histogram([1.0, 1.1, 1.1, 1.9])
    """
    if not isinstance(result, intervals.IntervalHistogram):
        found = result.intervals() if isinstance(result, Impacts) else np.asarray(result)
        if not found.size:
            return explain(axes(ax, width=4.2, height=3.6), "No intervals to bin.")
        result = intervals.interval_histogram(found)
    ax = axes(ax, width=4.2, height=3.6)
    bins(ax, result.density, result.edges)
    ax.set_xlim(span_of(result.edges))
    seconds(ax.xaxis, "interspike interval $I$", result.edges)
    ax.set_ylim(0, None)
    return frame(ax, None, "density $p(I)$ [1/s]")
