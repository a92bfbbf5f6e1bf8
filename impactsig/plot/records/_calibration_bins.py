"""Calibration of predicted probabilities: observed shares in bins, and the Brier score."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..._arguments import whole
from ..._trains.impact_columns import column, vector
from ...errors import InvalidInput

Z = 1.959963984540054
"""Standard deviations of a normal variable to either side that hold 95 %."""


class CalibrationBins(NamedTuple):
    """Predicted probabilities in equal bins, and the shares observed; NaN in empty bins.

    `low` and `high` are the 95 % intervals of Wilson for the shares [Wilson1927]_. The Brier score
    is the mean square of probability less outcome; `constant` is that of the overall share.
    """

    edges: np.ndarray
    size: np.ndarray
    predicted: np.ndarray
    observed: np.ndarray
    low: np.ndarray
    high: np.ndarray
    brier: float
    constant: float


def calibration_bins(probability: Any, outcome: Any, bins: int = 5) -> CalibrationBins:
    """Sort probabilities into equal bins from 0 to 1, and count the outcomes in each.

    Raises
    ------
    InvalidInput
        If a probability is not between 0 and 1, an outcome neither true nor false, or there are
        not as many of each.
    """
    p = vector("probability", probability)
    p = column("probability", p, len(p))
    came = np.asarray(outcome)
    if came.dtype != bool or came.shape != p.shape:
        raise InvalidInput("outcome", f"{came.dtype} of shape {came.shape}", f"bool, {p.shape}")
    bins = whole("bins", bins, 1)
    edges = np.linspace(0.0, 1.0, bins + 1)
    place = np.clip(np.searchsorted(edges, p, side="right") - 1, 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    with np.errstate(invalid="ignore", divide="ignore"):
        predicted = np.bincount(place, p, bins) / count
        observed = np.bincount(place, came, bins) / count
        middle = (observed + Z**2 / (2 * count)) / (1 + Z**2 / count)
        half = np.sqrt(observed * (1 - observed) / count + Z**2 / (4.0 * count**2))
        half *= Z / (1 + Z**2 / count)
    share = came.mean() if len(came) else math.nan
    return CalibrationBins(
        edges, count, predicted, observed, np.maximum(middle - half, 0.0),
        np.minimum(middle + half, 1.0),
        float(np.mean((p - came) ** 2)) if len(p) else math.nan,
        float(share * (1 - share)),
    )  # fmt: skip
