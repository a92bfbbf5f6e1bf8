"""Several trains in one figure: their return maps at one scale, and p(I) against a parameter."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import intervals
from ...errors import InvalidInput
from ...impacts import Impacts
from ...intervals.pairs import as_intervals
from ..axes import axes, delay_plane, explain, panels, plain, points, seconds, span_of, title

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

COLUMNS = 4
MOST_BINS = 4096
SHOWN_FROM = 1e-3  # share of the greatest bin of a column at which the colours begin


def return_maps(
    trains: Mapping[str, Impacts | Iterable[float]],
    lag: int = 1,
    figure: Figure | SubFigure | None = None,
) -> np.ndarray:
    """Draw the return maps (delay plots) of several trains side by side, at one scale.

    Parameters
    ----------
    trains : mapping of str to Impacts or array_like, shape (n,)
        Each by the title of its panel; arrays hold intervals [s].
    lag : int, optional
        Distance between the two intervals, in intervals.

    Returns
    -------
    ndarray of matplotlib Axes, shape (len(trains),)
        Four in a row.

    Raises
    ------
    InvalidInput
        If there are no trains, an interval is negative or not finite, or `lag` is not a positive
        whole number.

    See Also
    --------
    impactsig.return_map, impactsig.plot.interval_densities

    Examples
    --------
    >>> from impactsig import flows, integrate_and_fire, plot
    >>> flow = flows.rossler()
    >>> trains = {f"C = {c}": integrate_and_fire(flow, c, count=100) for c in (20, 40)}
    >>> axes = plot.return_maps(trains)
    """
    if not isinstance(trains, Mapping) or not trains:
        raise InvalidInput("trains", trains, "a mapping from titles to trains, not empty")
    pairs = {name: intervals.return_map(train, lag) for name, train in trains.items()}
    columns = min(len(pairs), COLUMNS)
    rows = math.ceil(len(pairs) / columns)
    size = (2.9 * columns, 3.2 * rows)
    grid = panels(figure, rows, columns, size, "compressed", squeeze=False).ravel()
    for ax in grid[len(pairs) :]:
        ax.remove()
    grid = grid[: len(pairs)]
    both = np.concatenate([value for pair in pairs.values() for value in pair])
    for number, (ax, (name, (first, later))) in enumerate(zip(grid, pairs.items(), strict=True)):
        title(ax, plain(name))
        if not len(first):
            explain(ax, f"Too few intervals for a return map at lag {lag}.")
            continue
        delay_plane(ax, both, lag=lag)
        points(ax, first, later)
        if number % columns:
            ax.set_ylabel("")
    return grid


def interval_densities(
    trains: Iterable[Impacts | Iterable[float]],
    parameter: Any,
    label: str = "parameter",
    ax: Axes | None = None,
) -> Axes:
    """Draw the interval densities p(I) of many trains as an image, one column per train.

    All have the same bins, as wide as the median of what `impactsig.interval_histogram` chooses for
    each. A column is relative to its own greatest bin, on a logarithmic scale; columns meet halfway
    between the values of the parameter.

    Parameters
    ----------
    trains : sequence of Impacts or array_like, shape (n,)
        Arrays hold intervals [s]. A train without intervals leaves its column empty.
    parameter : array_like, shape (len(trains),)
        What was varied from train to train, ascending.
    label : str, optional
        What to call it.

    Raises
    ------
    InvalidInput
        If there are fewer than two trains, not as many values of the parameter, or these are not
        finite and ascending.

    See Also
    --------
    impactsig.interval_histogram, impactsig.plot.return_maps

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import plot
    >>> rng = np.random.default_rng(1)
    >>> trains = [rng.normal(mean, 0.01, 100) for mean in (0.05, 0.06)]
    >>> ax = plot.interval_densities(trains, [20.0, 21.0], label="frequency [Hz]")
    """
    if not isinstance(trains, Iterable) or isinstance(trains, (str, Impacts)):
        raise InvalidInput("trains", trains, "several trains, each Impacts or intervals")
    values = [as_intervals(train, least=0) for train in trains]
    if len(values) < 2:
        raise InvalidInput("trains", f"{len(values)} of them", "two or more")
    at = np.asarray(parameter, float)
    if at.shape != (len(values),) or not (np.isfinite(at).all() and np.all(np.diff(at) > 0)):
        raise InvalidInput("parameter", parameter, f"{len(values)} finite values, ascending")
    ax = axes(ax, width=6.4, height=4.0)
    both = np.concatenate(values)
    if not both.any():
        return explain(ax, "No intervals to bin.")
    edges = _common_edges([train for train in values if len(train)])
    image = np.zeros((len(edges) - 1, len(values)))
    for column, train in enumerate(values):
        if len(train):
            density = intervals.interval_histogram(train, edges).density
            image[:, column] = density / density.max()
    between = 0.5 * (at[1:] + at[:-1])
    sides = np.concatenate(([1.5 * at[0] - 0.5 * at[1]], between, [1.5 * at[-1] - 0.5 * at[-2]]))
    # Only here: the colour scale is the one thing that needs more than Axes.
    from matplotlib.colors import LogNorm

    mesh = ax.pcolormesh(
        sides,
        edges,
        np.ma.masked_equal(image, 0),
        norm=LogNorm(SHOWN_FROM, 1),
        cmap="viridis_r",
        rasterized=True,
    )
    bar = ax.figure.colorbar(mesh, ax=ax, label="density over the greatest of its column")
    bar.outline.set_visible(False)
    ax.set(xlim=(sides[0], sides[-1]), ylim=span_of(edges))
    ax.set_xlabel(plain(label))
    seconds(ax.yaxis, "interspike interval $I$", edges)
    return ax


def _common_edges(values: list[np.ndarray]) -> np.ndarray:
    """Equal bins over all values, of the median of the widths that suit each."""
    both = np.concatenate(values)
    low, high = float(both.min()), float(both.max())
    width = np.median([np.diff(intervals.interval_histogram(train).edges)[0] for train in values])
    if high - low < width:
        low, high = 0.5 * (low + high - width), 0.5 * (low + high + width)
    return np.linspace(low, high, min(math.ceil((high - low) / width), MOST_BINS) + 1)
