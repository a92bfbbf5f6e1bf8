"""The correlation sum: C(r) of every dimension, and its local slopes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import frame, logarithmic, panels, shades

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from ...reconstruct.sums.correlation import CorrelationSum

SUM = "correlation sum $C_m(r)$"
SLOPE = r"local slope $\mathrm{d} \ln C_m / \mathrm{d} \ln r$"

LEAST_PAIRS = 100
"""Pairs within the smaller radius, from which on a local slope is drawn; fewer are only noise."""


@checked
def correlation_sum(result: CorrelationSum, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw the correlation sum of every dimension, and below it its local slopes.

    A common plateau of the slopes of several dimensions is the correlation dimension. If the slopes
    increase with every dimension, it is not determined. Slopes from fewer than 100 pairs are
    omitted.

    Parameters
    ----------
    result : CorrelationSum
        From `impactsig.correlation_sum`.

    Returns
    -------
    ndarray of matplotlib Axes, shape (2,)
        Correlation sums; local slopes.

    See Also
    --------
    impactsig.correlation_sum, impactsig.plot.geometry.dimension

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import correlation_sum, plot
    >>> axes = plot.correlation_sum(correlation_sum(np.random.default_rng(1).uniform(size=300), 3))
    >>> len(axes)
    2
    """
    grid = panels(figure, 2, 1, (6.4, 7.0), sharex=True)
    sums, slopes = grid
    colours = shades(len(result.dimensions))
    enough = result.counts[:, :-1] >= LEAST_PAIRS
    drawn = np.where(enough, result.local_slopes(), np.nan)
    for m, c, slope, colour in zip(result.dimensions, result.sums, drawn, colours, strict=True):
        style = {"color": colour, "marker": ".", "markersize": 4, "linewidth": 1.1}
        sums.plot(result.radii, np.where(c > 0, c, np.nan), label=f"$m = {m}$", **style)
        slopes.plot(result.slope_radii, slope, **style)
    for ax in grid:
        logarithmic(ax)
        ax.grid(alpha=0.25, linewidth=0.6)
    sums.set_yscale("log")
    frame(sums, None, SUM, "best", fontsize="small")
    frame(slopes, "radius $r$", SLOPE)
    most = np.nanmax(drawn, initial=0.0)
    slopes.set_ylim(0, max(1.1 * min(most, 1.5 * max(result.dimensions)), 1.0))
    if not np.isfinite(drawn).any():
        slopes.text(
            0.5, 0.5, f"No two radii hold {LEAST_PAIRS} pairs: no slopes to draw.",
            ha="center", va="center", transform=slopes.transAxes,
        )  # fmt: skip
    return grid
