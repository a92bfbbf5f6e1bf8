"""Determinism: a statistic among its surrogates, and the prediction error against the horizon."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from .._kinds import checked
from ..axes import GREY, VERMILLION, axes, curve, frame, level

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...reconstruct.testing.prediction import PredictionError
    from ...reconstruct.testing.surrogate_testing import SurrogateTest


@checked
def surrogate_test(result: SurrogateTest, ax: Axes | None = None) -> Axes:
    """Draw the statistic of the surrogates as a histogram, and that of the data as a line.

    Parameters
    ----------
    result : SurrogateTest
        From `impactsig.surrogate_test`.

    See Also
    --------
    impactsig.surrogate_test, impactsig.plot.prediction_error

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import plot, surrogate_test
    >>> noise = np.random.default_rng(1).standard_normal(200)
    >>> found = surrogate_test(noise, "time_reversal_asymmetry", count=19, seed=1)
    >>> ax = plot.surrogate_test(found)
    """
    ax = axes(ax, width=5.0, height=3.0)
    others = result.surrogates
    bins = np.histogram_bin_edges(others, bins=max(6, int(np.sqrt(len(others)))))
    ax.hist(
        others,
        bins=bins.tolist(),
        color=GREY,
        alpha=0.6,
        label=f"{len(others)} {result.method} surrogates",
    )
    ax.axvline(
        result.statistic, color=VERMILLION, linewidth=2, label=f"data, p = {result.p_value:.2g}"
    )
    low, high = min(others.min(), result.statistic), max(others.max(), result.statistic)
    room = 0.06 * (high - low) or 0.06 * abs(high) or 1.0
    ax.set_xlim(low - room, high + room)
    ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
    return frame(ax, result.name, "surrogates", "above")  # the line may stand at either side


@checked
def prediction_error(result: PredictionError, ax: Axes | None = None) -> Axes:
    """Draw the prediction error against the horizon; 1 is no better than the mean.

    Parameters
    ----------
    result : PredictionError
        From `impactsig.prediction_error`.

    See Also
    --------
    impactsig.prediction_error, impactsig.plot.surrogate_test

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import plot, prediction_error
    >>> ax = plot.prediction_error(prediction_error(np.sin(0.3 * np.arange(500)), dimension=3))
    """
    ax = axes(ax, width=5.0, height=3.0)
    order = np.argsort(result.horizon)
    level(ax, 1.0, "mean as predictor")
    label = f"{result.neighbors} neighbours, m = {result.dimension}"
    curve(ax, result.horizon[order], result.error[order], label)
    ax.set_ylim(0, 1.1 * max(1.0, float(result.error.max())))
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    return frame(ax, "horizon [steps]", "prediction error / sd", "lower right")
