"""Two trains in one figure: the intervals' densities and distributions, and both return maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import intervals
from ._kinds import checked
from .axes import (
    BLUE,
    VERMILLION,
    bins,
    delay_plane,
    explain,
    legend,
    panels,
    plain,
    points,
    seconds,
    span_of,
    title,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from ..comparison import Comparison, Train

COLOURS = (BLUE, VERMILLION)
MOST_BINS = 4096
LITTLE = 0.05  # of a bin


@checked
def comparison(result: Comparison, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw two trains of impacts side by side.

    The upper panels show the densities of the intervals, that of b upside down, with the wider of
    the bins chosen for each train, and the cumulative distributions with the position of their
    greatest difference. The lower panels show the return map of each train at the same scale.

    Parameters
    ----------
    result : Comparison
        From `impactsig.compare`.

    Returns
    -------
    ndarray of matplotlib Axes, shape (2, 2)
        Densities and distributions; return maps of a and b.

    See Also
    --------
    impactsig.compare

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, compare, plot
    >>> steady = Impacts.from_times(0.05 * np.arange(100))
    >>> late = Impacts.from_times(0.051 * np.arange(100))
    >>> axes = plot.comparison(compare(steady, late))
    """
    grid = panels(figure, 2, 2, (8.4, 7.6))
    trains = (result.a, result.b)
    values = [train.impacts.intervals() for train in trains]
    both = np.concatenate(values)
    if not both.any():
        for ax in grid.flat:
            explain(ax, "Neither train has two impacts at different instants: no intervals.")
        return grid
    labels = [
        plain(f"{one.name}: {len(v)} intervals") for one, v in zip(trains, values, strict=True)
    ]
    densities(grid[0, 0], values, labels)
    _distributions(grid[0, 1], values, labels, both)
    for ax, train, colour in zip(grid[1], trains, COLOURS, strict=True):
        _map(ax, train, colour, both)
    return grid


def densities(ax: Axes, values: list[np.ndarray], labels: list[str]) -> None:
    """The densities of two sets of intervals, that of the second upside down."""
    edges = _common_edges([sample for sample in values if len(sample)])
    highest = 0.0
    for sample, label, colour, side in zip(values, labels, COLOURS, (1, -1), strict=True):
        if len(sample):
            density = intervals.interval_histogram(sample, edges).density
            highest = max(highest, float(density.max()))
            bins(ax, side * density, edges, color=colour, label=label)
    ax.axhline(0, color="black", linewidth=0.8)
    ax.set(xlim=span_of(edges), ylabel="density $p(I)$ [1/s]")
    ax.set_ylim(-1.1 * highest, 1.45 * highest)
    ax.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    seconds(ax.xaxis, "interspike interval $I$", edges)
    legend(ax, "upper left", fontsize="small", borderaxespad=0)


def _common_edges(values: list[np.ndarray]) -> np.ndarray:
    """The wider of the bins that suit each, carried on over all values.

    Bins that suit all values together may be narrower than the step of a train that is rounded.
    """
    candidates = [intervals.interval_histogram(sample).edges for sample in values]
    edges = max(candidates, key=lambda edges: float(edges[1] - edges[0]))
    width = edges[1] - edges[0]
    low, high = min(each[0] for each in candidates), max(each[-1] for each in candidates)
    # What exceeds a bin a little widens it; a bin of its own would hold next to nothing.
    before = int(np.ceil((edges[0] - low) / width - LITTLE))
    after = int(np.ceil((high - edges[-1]) / width - LITTLE))
    if before + len(edges) + after > MOST_BINS:
        return np.linspace(low, high, MOST_BINS + 1)
    common = edges[0] + width * np.arange(-before, len(edges) + after)
    common[0], common[-1] = min(max(common[0], 0.0), low), max(common[-1], high)
    return common


def _distributions(ax: Axes, values: list[np.ndarray], labels: list[str], both: np.ndarray) -> None:
    span = span_of(both)
    # Where the two agree, the first still shows at either side of the second.
    for one, label, colour, width in zip(values, labels, COLOURS, (3.5, 1.2), strict=True):
        if len(one):
            steps = np.concatenate(([span[0]], np.sort(one), [span[1]]))
            share = np.concatenate((np.arange(len(one) + 1) / len(one), [1.0]))
            ax.step(steps, share, where="post", color=colour, linewidth=width, label=label)
    if all(len(one) for one in values):
        where = np.sort(both)
        low, high = (
            np.searchsorted(np.sort(one), where, side="right") / len(one) for one in values
        )
        widest = int(np.argmax(np.abs(low - high)))
        ax.vlines(where[widest], *sorted((low[widest], high[widest])), color="black", linewidth=1)
        ax.text(
            0.98,
            0.03,
            f"greatest difference {abs(low - high)[widest]:.3g}",
            transform=ax.transAxes,
            ha="right",
            fontsize="small",
        )
    ax.set(xlim=span, ylim=(0, 1.02), ylabel="share of intervals up to $I$")
    seconds(ax.xaxis, "interspike interval $I$", both)


def _map(ax: Axes, train: Train, colour: str, both: np.ndarray) -> None:
    title(ax, plain(train.name))
    first, later = intervals.return_map(train.impacts)
    if not len(first):
        explain(ax, "Too few intervals for a return map.")
        return
    delay_plane(ax, both)
    points(ax, first, later, color=colour)
