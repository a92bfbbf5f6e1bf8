"""Errors of interspike intervals, from those of the instants between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.sparse import dia_array

    from ..impacts import Impacts

TOGETHER = 1.0
"""For how long impacts are measured by one shape, whose error their instants share [s]."""


def interval_covariance(impacts: Impacts, first: np.ndarray, error: np.ndarray) -> dia_array:
    """Covariance of the intervals after the impacts `first` [s^2], as `Impacts.intervals` has it.

    Parameters
    ----------
    impacts : Impacts
    first : ndarray of int, shape (m,)
        The impacts that begin an interval.
    error : ndarray, shape (n,)
        Standard errors of all instants [s].
    """
    from scipy.sparse import dia_array

    square, follows = error**2, np.diff(first, prepend=-2) == 1
    # Two intervals in a row share an instant where no gap lies between them.
    common = np.where(follows, square[first], 0.0)
    variance = square[first] + square[first + 1]
    if impacts.shared_time_error is not None and len(first):
        shared = impacts.shared_time_error
        apart = _apart(impacts.time[first + 1] - impacts.time[first])
        both = shared[first] * shared[first + 1]
        variance -= 2.0 * both * (1.0 - apart)
        # Of three impacts within one second nothing is left of it.
        least = np.minimum(np.minimum(both, np.roll(both, 1)), shared[first] ** 2)
        left = least * np.maximum(apart + np.roll(apart, 1) - 1.0, 0.0)
        common = np.where(follows, square[first] - shared[first] ** 2 + left, 0.0)
    bands = np.stack([-np.append(common[1:], 0.0)[: len(variance)], variance, -common])
    return dia_array((bands, (-1, 0, 1)), shape=(len(variance), len(variance)))


def errors_in_intervals(impacts: Impacts, error: np.ndarray) -> np.ndarray:
    """Standard errors of instants [s] that count in the intervals beside them."""
    if impacts.shared_time_error is None or len(impacts) < 2:
        return error
    apart = _apart(np.diff(impacts.time))
    apart = 0.5 * (np.append(apart[:1], apart) + np.append(apart, apart[-1:]))
    with np.errstate(invalid="ignore"):
        square = error**2 - (1.0 - apart) * impacts.shared_time_error**2
    return np.sqrt(np.maximum(square, 0.0))


def _apart(intervals: np.ndarray) -> np.ndarray:
    """Share of the shared error that intervals have: seconds begin anywhere between impacts."""
    return np.minimum(intervals / TOGETHER, 1.0)
