"""Choosing an embedding: dependence over lags, false neighbours over dimensions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import BLUE, ORANGE, SKY, axes, chosen, curve, frame, level

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...reconstruct.delays import DelayChoice
    from ...reconstruct.neighbors import AveragedFalseNeighbors, FalseNeighbors


@checked
def delay_choice(result: DelayChoice, ax: Axes | None = None) -> Axes:
    """Draw the autocorrelation or mutual information over the lag, with the delay chosen.

    Parameters
    ----------
    result : DelayChoice
        From `embedding_delay`.

    See Also
    --------
    impactsig.embedding_delay

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import embedding_delay, plot
    >>> ax = plot.delay_choice(embedding_delay(np.sin(0.1 * np.arange(500)), "1/e"))
    """
    ax = axes(ax, width=5.2, height=3.4)
    # Far beyond the choice there is nothing to see.
    last = len(result.curve) if result.delay is None else max(6 * result.delay, 30) + 1
    # An information at lag 0 is that of the bins alone.
    first = 1 if result.method == "mutual information" else 0
    lags = np.arange(first, min(len(result.curve), last))
    curve(ax, lags, result.curve[lags], markersize=3)
    if result.level is not None:
        level(ax, result.level, f"{result.level:.2g}")
    chosen(ax, "delay", result.delay)
    if result.method == "autocorrelation":
        return frame(ax, "lag", "autocorrelation", "upper right")
    ax.set_ylim(min(0, float(result.curve[lags].min())), None)
    return frame(ax, "lag", "mutual information [nat]", "upper right")


@checked
def false_neighbors(result: FalseNeighbors, ax: Axes | None = None) -> Axes:
    """Draw the shares of false nearest neighbours over the dimension, with the one chosen.

    Parameters
    ----------
    result : FalseNeighbors
        From `false_nearest_neighbors`.

    See Also
    --------
    impactsig.false_nearest_neighbors, impactsig.plot.averaged_false_neighbors

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import false_nearest_neighbors, plot
    >>> ax = plot.false_neighbors(false_nearest_neighbors(np.sin(np.arange(300)), dimensions=4))
    """
    ax = axes(ax, width=5.2, height=3.4)
    for share, label, colour, style in (
        (result.by_growth, "by growth", SKY, "--"),
        (result.by_size, "by size", ORANGE, "--"),
        (result.share, "by either", BLUE, "-"),
    ):
        curve(ax, result.dimensions, 100 * share, label, color=colour, linestyle=style)
    level(ax, 100 * result.tolerance, f"{result.tolerance:.0%}")
    chosen(ax, "dimension", result.dimension)
    ax.set(ylim=(-2, 102), xticks=result.dimensions)
    return frame(ax, "dimension $m$", "false nearest neighbours [%]", "upper right")


@checked
def averaged_false_neighbors(result: AveragedFalseNeighbors, ax: Axes | None = None) -> Axes:
    """Draw Cao's E1 and E2 over the dimension, with the one chosen.

    Parameters
    ----------
    result : AveragedFalseNeighbors
        From `averaged_false_neighbors`.

    See Also
    --------
    impactsig.averaged_false_neighbors, impactsig.plot.false_neighbors

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import averaged_false_neighbors, plot
    >>> found = averaged_false_neighbors(np.sin(np.arange(300)), dimensions=4)
    >>> ax = plot.averaged_false_neighbors(found)
    """
    ax = axes(ax, width=5.2, height=3.4)
    level(ax, 1)
    curve(ax, result.dimensions, result.e1, "$E_1$")
    curve(ax, result.dimensions, result.e2, "$E_2$", color=ORANGE)
    chosen(ax, "dimension", result.dimension)
    most = max(1, float(result.e1.max()), float(result.e2.max()))
    ax.set(ylim=(0, 1.08 * most), xticks=result.dimensions)
    return frame(ax, "dimension $m$", "$E_1$, $E_2$", "lower right")
