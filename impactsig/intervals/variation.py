"""Irregularity of a train: 0 for regular intervals, 1 for a Poisson process."""

from __future__ import annotations

import numpy as np

from ..errors import InvalidInput
from .pairs import Intervals, as_intervals, interval_pairs


def coefficient_of_variation(intervals: Intervals) -> float:
    """Coefficient of variation of the intervals, CV = sqrt(<I^2> - <I>^2) / <I>.

    Slow changes of the rate add to it; `cv2` and `local_variation` compare neighbours only.

    Parameters
    ----------
    intervals : array_like, shape (n,), or Impacts
        Interspike intervals [s], two or more.

    Returns
    -------
    float
        CV, without a unit: 0 for equal intervals, 1 for a long Poisson process.

    Raises
    ------
    InvalidInput
        If there are fewer than two, one is negative or not finite, or all are zero.

    See Also
    --------
    cv2, local_variation

    Examples
    --------
    >>> from impactsig import coefficient_of_variation
    >>> float(round(coefficient_of_variation([1.0, 3.0]), 6))
    0.5
    """
    values = as_intervals(intervals, least=2)
    if not values.any():
        raise InvalidInput("intervals", "all zero", "intervals of which one is positive")
    values = np.ldexp(values, -np.frexp(values.max())[1])  # can be squared, all digits as they were
    return float(values.std() / values.mean())


def cv2(intervals: Intervals) -> float:
    """CV2 of the intervals: mean of 2 abs(I_{k+1} - I_k) / (I_{k+1} + I_k) [Holt1996]_.

    Parameters
    ----------
    intervals : array_like, shape (n,), or Impacts
        Interspike intervals [s], two or more; of `Impacts`, pairs across a gap are left out.

    Returns
    -------
    float
        CV2, from 0 (equal intervals) to 2; 1 for a long Poisson process.

    Raises
    ------
    InvalidInput
        If there is no pair, an interval is negative or not finite, or both of a pair are zero.

    See Also
    --------
    coefficient_of_variation, local_variation

    Examples
    --------
    >>> from impactsig import cv2
    >>> float(round(cv2([1.0, 3.0, 1.0]), 6))
    1.0
    """
    return float(2 * np.mean(np.abs(_contrast(intervals))))


def local_variation(intervals: Intervals) -> float:
    """Local variation, mean of 3 ((I_k - I_{k+1}) / (I_k + I_{k+1}))^2 [Shinomoto2003]_.

    Parameters
    ----------
    intervals : array_like, shape (n,), or Impacts
        Interspike intervals [s], two or more; of `Impacts`, pairs across a gap are left out.

    Returns
    -------
    float
        LV, from 0 (equal intervals) to 3; 1 for a long Poisson process.

    Raises
    ------
    InvalidInput
        If there is no pair, an interval is negative or not finite, or both of a pair are zero.

    See Also
    --------
    cv2, coefficient_of_variation

    Examples
    --------
    >>> from impactsig import local_variation
    >>> float(round(local_variation([1.0, 3.0, 1.0]), 6))
    0.75
    """
    return float(3 * np.mean(_contrast(intervals) ** 2))


def _contrast(intervals: Intervals) -> np.ndarray:
    first, later = interval_pairs(intervals, 1, least=1)
    total = first + later
    if not total.all():
        raise InvalidInput(
            "intervals",
            "two successive intervals of 0 s",
            "positive intervals",
            "Merge impacts at one instant first",
        )
    return (later - first) / total
