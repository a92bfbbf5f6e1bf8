"""Slope of ln K against ln H between two scales, with its statistical error."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._fits import Fit, least_squares
from . import _jackknife
from ._kernel_sum import KernelSum

LEAST_CHANGE = 1e-3
"""Of ln K, by which the weight of a scale in a slope is found."""


class Slope(NamedTuple):
    """A slope between two scales, with the local slopes."""

    value: float
    error: float
    scales: tuple[float, float]
    local: np.ndarray  # (scales,), nan at both ends
    local_errors: np.ndarray

    @property
    def span(self) -> float:
        """Distance W of the two scales in e-folds."""
        return float(np.log(self.scales[1] / self.scales[0]))


def slope(found: KernelSum, fit: Fit = least_squares) -> Slope:
    """Slope over all scales by a fitting method, and local slopes."""
    logs, values = np.log(found.scales), np.log(found.sums)
    parts = found.parts / found.parts.sum(axis=(0, 1))
    # As far as chance may move each ln K, so that a rule that is not linear is seen over that.
    moved = np.maximum(np.sqrt(_jackknife.variance(parts - _shares(found))), LEAST_CHANGE)
    weights = np.array(
        [
            (fit(logs, values + change) - fit(logs, values - change)) / (2 * change.max())
            for change in np.diag(moved)
        ]
    )
    local = np.full((2, len(logs)), np.nan)
    if len(logs) > 2:
        steps = logs[2:] - logs[:-2]
        local[0, 1:-1] = (values[2:] - values[:-2]) / steps
        local[1, 1:-1] = np.sqrt(_jackknife.variance(parts[..., 2:] - parts[..., :-2])) / steps
    return Slope(
        float(fit(logs, values)),
        # The weights add up to 0, so that the numbers of pairs drop out.
        float(np.sqrt(_jackknife.variance(parts @ weights))),
        (float(found.scales[0]), float(found.scales[-1])),
        local[0],
        local[1],
    )


def _shares(found: KernelSum) -> np.ndarray:
    """Share of the pairs, by the blocks of both vectors."""
    shares: np.ndarray = found.pairs / found.pairs.sum(axis=(0, 1))
    return shares
