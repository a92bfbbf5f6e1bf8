"""The interspike intervals: return map and density."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import intervals
from ..impacts import Impacts
from ._axes import BLUE, GREY, axes, explain, points, seconds, span_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from matplotlib.axes import Axes

    from ..intervals import IntervalHistogram


def return_map(impacts: Impacts | Iterable[float], lag: int = 1, ax: Axes | None = None) -> Axes:
    """Draw each interspike interval against the one `lag` before it, with the diagonal.

    A periodic motion is a set of points, chaos a curve or a cloud with structure.

    Parameters
    ----------
    impacts : Impacts or array_like, shape (n,)
        Measured or simulated; an array holds intervals [s].
    lag : int, optional
        Distance between the two intervals, in intervals.
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    InvalidInput
        If an interval is negative or not finite, or `lag` is not a positive whole number.
    """
    first, later = intervals.return_map(impacts, lag)
    ax = axes(ax, width=4.2, height=4.0)
    if not len(first):
        return explain(ax, f"Too few intervals for a return map at lag {lag}.")
    both = np.concatenate((first, later))
    span = span_of(both)
    ax.plot(span, span, color=GREY, linewidth=0.8, linestyle=":", zorder=1)
    points(ax, first, later)
    ax.set(xlim=span, ylim=span, aspect="equal")
    seconds(ax.xaxis, "interval $I_k$", both)
    seconds(ax.yaxis, f"interval $I_{{k+{lag}}}$", both)
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
    ax : matplotlib Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    InvalidInput
        If an interval is negative or not finite.
    """
    if not isinstance(result, intervals.IntervalHistogram):
        found = result.intervals() if isinstance(result, Impacts) else np.asarray(result)
        if not len(found):
            return explain(axes(ax, width=4.2, height=3.6), "No intervals to bin.")
        result = intervals.interval_histogram(found)
    ax = axes(ax, width=4.2, height=3.6)
    ax.stairs(result.density, result.edges, fill=True, color=BLUE, alpha=0.6)
    # The outline keeps bins in sight that are narrower than a pixel.
    ax.stairs(result.density, result.edges, color=BLUE, linewidth=0.8)
    ax.set_xlim(span_of(result.edges))
    seconds(ax.xaxis, "interspike interval $I$", result.edges)
    ax.set_ylabel("density $p(I)$ [1/s]")
    ax.set_ylim(0, None)
    return ax
