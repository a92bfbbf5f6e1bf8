"""The correlation dimension: C(r) with the scaling region, local slopes, and D over m."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._axes import GREY, VERMILLION, explain, frame, panels, shades, title
from ._kinds import checked
from .correlation import SLOPE, SUM

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from ..reconstruct import CorrelationDimension

LEAST_PAIRS = 30
"""Pairs from which on C(r) is drawn as a line rather than not at all."""


@checked
def dimension(result: CorrelationDimension, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw what a correlation dimension was read from.

    Correlation sums of every embedding dimension m with the scaling region shaded; their local
    slopes, each with its standard error, with the dimension and its 95 % interval; and the estimate
    over m, which levels off at the dimension of an attractor and keeps rising for noise.

    Parameters
    ----------
    result : CorrelationDimension
        What `impactsig.correlation_dimension` found.

    Returns
    -------
    ndarray of matplotlib Axes, shape (3,)
        Correlation sums; local slopes; estimate over m.
    """
    grid = panels(figure, 1, 3, (11.0, 3.9), width_ratios=(1, 1, 0.75))
    sums, slopes, over = grid
    if result.correlation is None:
        for ax in (slopes, over):
            ax.set_axis_off()
        explain(sums, result.describe())
        return grid
    found = result.correlation
    colours = shades(len(found.dimensions))
    enough = found.counts >= LEAST_PAIRS
    for row, (one, colour) in enumerate(zip(result.by_dimension, colours, strict=True)):
        shown = enough[row] & (found.counts[row] < found.pairs[row])
        r = found.radii[shown]
        label = f"$m = {one.embedding}$"
        sums.plot(r, found.sums[row][shown], color=colour, linewidth=1.3, label=label)
        slope, error = one.slopes[shown], np.nan_to_num(one.slope_errors[shown])
        slopes.plot(r, slope, color=colour, linewidth=1.3)
        slopes.fill_between(r, slope - error, slope + error, color=colour, alpha=0.18, linewidth=0)
        if one.value is not None and one.interval is not None:
            low, high = one.interval
            over.errorbar(
                one.embedding, one.value, [[one.value - low], [high - one.value]],
                color=colour, marker="o", capsize=3,
            )  # fmt: skip
    shown = enough.any(axis=0) & (found.counts < found.pairs[:, None]).any(axis=0)
    if shown.any():
        slopes.set_xlim(found.radii[shown][0], found.radii[shown][-1])
        sums.set_xlim(slopes.get_xlim())
    for ax in (sums, slopes):
        ax.set_xscale("log")
        ax.set_xlabel("radius $r$")
        if result.floor > ax.get_xlim()[0]:
            ax.axvspan(ax.get_xlim()[0], result.floor, color=GREY, alpha=0.18, linewidth=0)
        if result.region is not None:
            ax.axvspan(*result.region, color=VERMILLION, alpha=0.09, linewidth=0)
    sums.set_yscale("log")
    frame(sums, None, SUM, "best", fontsize="small")
    frame(slopes, None, SLOPE)
    top = 1.15 * max([one.interval[1] for one in result.by_dimension if one.interval] or [1.0])
    slopes.set_ylim(0, top)
    over.set_ylim(0, top)
    m = np.array(found.dimensions)
    over.plot(m, m, color=GREY, linestyle=":", linewidth=1)
    over.set_xlim(m[0] - 0.5, m[-1] + 0.5)
    over.set_xticks(m)
    frame(over, "embedding dimension $m$", "estimate $D_2$, 95 % interval")
    over.annotate("noise", (0.9 * top, 0.9 * top), color=GREY, fontsize="small", ha="right")
    told = "no plateau"
    if result.value is not None and result.interval is not None:
        for ax in (slopes, over):
            ax.axhspan(*result.interval, color=VERMILLION, alpha=0.18, linewidth=0)
            ax.axhline(result.value, color=VERMILLION, linewidth=1)
        told = f"$D_2$ = {result.value:.2f} ({result.interval[0]:.2f} to {result.interval[1]:.2f})"
    title(slopes, told, loc="center")
    return grid
