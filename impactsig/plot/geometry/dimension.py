"""The correlation dimension: K(H) between its scales, and the local slopes with their band."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import GREY, VERMILLION, explain, frame, logarithmic, panels, title

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from ...reconstruct.dimensions.dimension import CorrelationDimension

BLUE = "#0072B2"


@checked
def dimension(result: CorrelationDimension, figure: Figure | SubFigure | None = None) -> np.ndarray:
    """Draw the correlation sum and its slopes with the estimate of the dimension.

    The correlation sum K(H) of the Gaussian kernel with the line that was fitted, and its local
    slopes D(H) with their 95 % band. The slope between the two scales is a horizontal line with its
    interval. If a dimension is determined, its wider interval is drawn lighter. Scales below the
    floor are grey.

    Parameters
    ----------
    result : CorrelationDimension
        From `impactsig.correlation_dimension`.

    Returns
    -------
    ndarray of matplotlib Axes, shape (2,)
        Correlation sum; local slopes.

    See Also
    --------
    impactsig.correlation_dimension, impactsig.plot.correlation_sum

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import correlation_dimension, plot
    >>> axes = plot.dimension(correlation_dimension(np.random.default_rng(1).uniform(size=300)))
    """
    grid = panels(figure, 1, 2, (9.0, 3.9))
    sums, slopes = grid
    found = result.slope
    if found is None:
        slopes.set_axis_off()
        explain(sums, result.describe())
        return grid
    logs = np.log(result.scales)
    line = np.log(result.sums).mean() + found.value * (logs - logs.mean())
    sums.plot(result.scales, np.exp(line), color=VERMILLION, linewidth=1)
    sums.plot(result.scales, result.sums, color=BLUE, marker=".", linewidth=0)
    low, high = result.slopes - result.slope_errors, result.slopes + result.slope_errors
    slopes.fill_between(result.scales, low, high, color=BLUE, alpha=0.18, linewidth=0)
    slopes.plot(result.scales, result.slopes, color=BLUE, marker=".", linewidth=1.3)
    if result.interval is not None:
        slopes.axhspan(*result.interval, color=VERMILLION, alpha=0.1, linewidth=0)
    slopes.fill_between(found.scales, *found.interval, color=VERMILLION, alpha=0.25, linewidth=0)
    slopes.plot(found.scales, 2 * [found.value], color=VERMILLION, linewidth=1.3)
    for ax in grid:
        logarithmic(ax)
        ax.set_xlim(found.scales[0] / 1.5, found.scales[1] * 1.5)
        if result.floor > ax.get_xlim()[0]:
            ax.axvspan(ax.get_xlim()[0], result.floor, color=GREY, alpha=0.18, linewidth=0)
    sums.set_yscale("log")
    frame(sums, "scale $H$", "correlation sum $K(H)$")
    frame(slopes, "scale $H$", r"local slope $\mathrm{d} \ln K / \mathrm{d} \ln H$")
    slopes.set_ylim(0, 1.3 * max(np.nanmax(high, initial=0.0), found.interval[1]))
    words = f"slope {found.value:.2f} ({found.interval[0]:.2f} to {found.interval[1]:.2f})"
    if result.dimension is not None and result.interval is not None:
        low_end, high_end = result.interval
        words += f"; $D_2$ {low_end:.2f} to {high_end:.2f}"
    title(slopes, words, loc="center")
    return grid
