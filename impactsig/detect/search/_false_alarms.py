"""Level that controls the false discovery rate."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import kernel
from ..signal.probability import excursions

LEAST_SIGMA = 5.0
FALSE_RATE = 0.02 / 60.0
"""False impacts a second, were the noise Gaussian; or, if that is more,"""
FALSE_SHARE = 0.0005
"""of the impacts found."""


def discovery_level(responses: np.ndarray, widths: float, seconds: float) -> float:
    """Level, in sigma, above which hardly any of the `responses` is noise.

    The lowest at which Gaussian noise would exceed it FALSE_RATE times a second, or once for
    1/FALSE_SHARE of the impacts that do, on average [Benjamini1995]_. The mean of white noise over
    a sliding window has the covariance 1 - |lag| / width, for which excursions above u begin
    u^2 Q(u) times a width, Q being the upper tail [Aldous1989]_.

    Parameters
    ----------
    responses : array (n,)
        In standard deviations of their noise.
    widths : float
        How many widths of a response the time holds, all widths taken together.
    seconds : float
        How long it is.
    """
    lowest = _level(float(widths), float(seconds))
    ordered = np.sort(responses[(responses >= LEAST_SIGMA) & (responses < lowest)])[::-1]
    higher = int(np.count_nonzero(responses >= lowest))
    return _lowered(np.ascontiguousarray(ordered), higher, float(widths), lowest)


@kernel
def _lowered(ordered: np.ndarray, rank: int, widths: float, lowest: float) -> float:
    """The level, with descending responses below it, above which are `rank`."""
    for k in range(len(ordered)):
        rank += 1
        if widths * excursions(ordered[k]) <= FALSE_SHARE * rank:
            lowest = ordered[k]
    return lowest


@kernel
def _level(widths: float, seconds: float) -> float:
    """The lowest level with FALSE_RATE exceedances per second."""
    rare = FALSE_RATE * seconds / max(widths, 1.0)
    low, high = LEAST_SIGMA, 40.0
    if excursions(low) <= rare:
        return low
    for _ in range(30):
        middle = 0.5 * (low + high)
        if excursions(middle) > rare:
            low = middle
        else:
            high = middle
    return high
