"""The stretch curve of a Lyapunov exponent."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._kinds import checked
from ..axes import GREY, SKY, VERMILLION, axes, curve, explain, frame, level, unanswered, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...reconstruct.divergence.exponents import LyapunovExponent


@checked
def stretch_curve(result: LyapunovExponent, ax: Axes | None = None) -> Axes:
    """Draw the mean divergence of neighbours, S(k), with the fitted line.

    The time axis is in seconds where the time between values is known.

    Parameters
    ----------
    result : LyapunovExponent
        From `lyapunov_exponent`.

    See Also
    --------
    impactsig.lyapunov_exponent

    Examples
    --------
    >>> from impactsig import lyapunov_exponent, plot
    >>> x = [0.4]
    >>> for _ in range(999):
    ...     x.append(4 * x[-1] * (1 - x[-1]))
    >>> ax = plot.stretch_curve(lyapunov_exponent(x, dimension=2))
    """
    ax = axes(ax, width=5.6, height=3.8)
    if not len(result.stretch):
        return explain(ax, result.describe())
    scale = result.step or 1.0
    k = np.arange(len(result.stretch))
    shown = np.isfinite(result.stretch)
    marks = 3 if len(k) < 60 else 0
    curve(ax, scale * k, result.mean_stretch, "mean", color=SKY, marker=None)
    curve(ax, scale * k[shown], result.stretch[shown], "median, $S(k)$", markersize=marks)
    level(ax, result.far, "any two values")
    if result.region is not None and result.exponent is not None:
        first, last = result.region
        ax.axvspan(scale * first, scale * last, color=GREY, alpha=0.12, linewidth=0)
        ends = np.array([first, last])
        rate = result.exponent / scale
        label = f"slope {rate:.4g} {'per second' if result.step else 'per value'}"
        line = result.intercept + result.exponent * ends
        ax.plot(scale * ends, line, color=VERMILLION, linewidth=1.6, label=label, zorder=3)
    else:
        unanswered(ax, result.verdict)
    along = with_unit("time", "s") if result.step else "steps $k$"
    return frame(ax, along, "logarithm of the gap", "lower right")
