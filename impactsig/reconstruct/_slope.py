"""The slope of ln K against ln H between two scales, and its error by chance."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from . import _jackknife
from ._fits import Fit, least_squares
from ._kernel_sum import KernelSum

CHANGE = 1e-3
"""Of ln K, by which the weight of a scale in a slope is found."""


class Slope(NamedTuple):
    """A slope between two scales, and the local ones."""

    value: float
    error: float
    scales: tuple[float, float]
    local: np.ndarray  # (scales,), nan at both ends
    local_errors: np.ndarray

    @property
    def span(self) -> float:
        """W, the e-folds between the two scales."""
        return float(np.log(self.scales[1] / self.scales[0]))


def slope(found: KernelSum, fit: Fit = least_squares) -> Slope:
    """The slope over all scales, by any rule, and local ones between each scale's neighbours."""
    logs = np.log(found.scales)
    with np.errstate(divide="ignore"):
        values = np.log(_jackknife.without_each(found.parts) / _jackknife.without_each(found.pairs))
    value, error = _of(found, values, lambda y: np.array([fit(logs, y)]))
    local = np.full((2, len(logs)), np.nan)
    if len(logs) > 2:
        local[:, 1:-1] = _of(found, values, lambda y: (y[2:] - y[:-2]) / (logs[2:] - logs[:-2]))
    return Slope(
        float(value[0]),
        float(error[0]),
        (float(found.scales[0]), float(found.scales[-1])),
        local[0],
        local[1],
    )


def _of(
    found: KernelSum, values: np.ndarray, read: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """What `read` makes of ln K, and its standard errors by chance.

    Parameters
    ----------
    values : ndarray, shape (1 + blocks, scales)
        ln K of all vectors, and without each block.
    """
    of_all = read(values[0])
    # Without a block there may be scales without a pair.
    without = [read(one) if np.all(np.isfinite(one)) else of_all for one in values]
    # To first order; weights add up to 0, so that the numbers of pairs drop out.
    weights = np.array(
        [
            (read(values[0] + change) - read(values[0] - change)) / (2 * CHANGE)
            for change in CHANGE * np.eye(len(values[0]))
        ]
    )
    parts = (found.parts / found.parts.sum(axis=(0, 1))) @ weights
    return of_all, np.sqrt(_jackknife.variance(np.array(without), parts))
