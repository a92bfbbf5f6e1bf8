"""The slope of ln K against ln H between two scales, and its error by chance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from . import _jackknife
from ._kernel_sum import KernelSum


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


def slope(found: KernelSum) -> Slope:
    """The least-squares slope over all scales, weighted evenly in ln H."""
    logs = np.log(found.scales)
    centred = logs - logs.mean()
    weights = (centred / (centred @ centred))[:, None]
    value, error = _weighted(found, weights)
    local = np.full((2, len(logs)), np.nan)
    if len(logs) > 2:
        around = np.zeros((len(logs), len(logs) - 2))
        at = np.arange(len(logs) - 2)
        around[at, at], around[at + 2, at] = -1, 1
        local[:, 1:-1] = _weighted(found, around / (logs[2:] - logs[:-2]))
    return Slope(
        float(value[0]),
        float(error[0]),
        (float(found.scales[0]), float(found.scales[-1])),
        local[0],
        local[1],
    )


def _weighted(found: KernelSum, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums of ln K with such weights, shape (scales, sums), and their standard errors."""
    sums = _jackknife.without_each(found.parts) / _jackknife.without_each(found.pairs)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.log(sums) @ weights
    # To first order; the weights add up to 0, so that the numbers of pairs drop out.
    parts = (found.parts / found.parts.sum(axis=(0, 1))) @ weights
    known = np.where(np.isfinite(values), values, values[:1])
    return values[0], np.sqrt(_jackknife.variance(known, parts))
