"""Figures of the motion through a run: probabilities over time, changes, speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import axes, frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...intervals import PeriodTrack

COLORS = ("#0072B2", "#56B4E9", "#009E73", "#F0E442", "#D55E00", "#999999")
SHORTEST = 0.08  # share of the run below which a stretch is not named


@checked
def period_track(result: PeriodTrack, ax: Axes | None = None) -> Axes:
    """Draw the probabilities of the kinds of motion over time, and where the motion changes.

    Parameters
    ----------
    result : PeriodTrack
        From `impactsig.track_period`.

    See Also
    --------
    impactsig.track_period

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, plot, track_period
    >>> ax = plot.period_track(track_period(Impacts.from_times(0.05 * np.arange(120)), 0.05))
    """
    ax = axes(ax, width=8.0, height=3.2)
    ax.stackplot(
        result.time,
        *np.ascontiguousarray(result.probability.T),
        colors=COLORS,
        labels=list(result.kinds),
        alpha=0.8,
    )
    start, stop = result.stretches[0].start, result.stretches[-1].stop
    for change in result.changes:
        ax.axvline(float(change), color="black", linestyle="--", linewidth=1)
    for stretch in result.stretches:
        if stretch.stop - stretch.start > SHORTEST * (stop - start):
            ax.text(
                0.5 * (stretch.start + stretch.stop),
                0.5,
                stretch.period.name or stretch.period.kind,
                ha="center",
                va="center",
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8},
            )
    ax.set_ylim(0, 1)
    ax.set_xlim(start, stop)
    return frame(ax, "time [s]", "probability", "above")
