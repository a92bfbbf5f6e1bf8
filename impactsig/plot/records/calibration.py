"""Whether probabilities hold: what was predicted against what was observed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..axes import BLUE, GREY, axes, frame
from ._calibration_bins import calibration_bins

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def calibration_curve(
    probability: Any,
    outcome: Any,
    ax: Axes | None = None,
    *,
    bins: int = 5,
    color: str = BLUE,
    label: str | None = None,
) -> Axes:
    """Draw observed shares over predicted probabilities, bin by bin.

    The bins are equal, from 0 to 1. Each point is at the mean of the probabilities in its bin, with
    Wilson's 95 % interval of the observed fraction and the number of values. For correct
    probabilities the points lie on the diagonal. The legend has the Brier score, the mean square of
    probability minus outcome, and that of the best constant prediction.

    Parameters
    ----------
    probability : array_like, shape (n,)
        Predicted probabilities, for example `Impacts.probability`.
    outcome : array_like of bool, shape (n,)
        Outcomes; for impacts, whether `match_impacts` finds a true one for each.
    bins : int, optional
        How many.
    color, label : str, optional
        Of the curve, where there are several on the same axes.

    Raises
    ------
    InvalidInput
        If a probability is not between 0 and 1, or outcomes are not booleans, one for each.

    See Also
    --------
    impactsig.fit_calibration, impactsig.detect_impacts

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import plot
    >>> rng = np.random.default_rng(1)
    >>> probability = rng.uniform(size=200)
    >>> ax = plot.calibration_curve(probability, rng.uniform(size=200) < probability)
    """
    found = calibration_bins(probability, outcome, bins)
    ax = axes(ax, width=4.4, height=4.2)
    if not ax.lines:
        ax.plot([0, 1], [0, 1], color=GREY, linewidth=0.8, linestyle=":", zorder=1)
    some = found.size > 0
    x, y = found.predicted[some], found.observed[some]
    whiskers = np.stack([y - found.low[some], found.high[some] - y])
    # At a share of 0 or 1 rounding may put an end on the wrong side of it.
    score = f"Brier {found.brier:.3f} (constant {found.constant:.3f}), {found.size.sum()}"
    ax.errorbar(
        x, y, np.maximum(whiskers, 0.0), fmt="o-", markersize=4, linewidth=1.0, capsize=2,
        color=color, label=f"{label}: {score}" if label else score,
    )  # fmt: skip
    ax.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
    return frame(ax, "predicted probability", "observed share", "lower right", fontsize="small")
