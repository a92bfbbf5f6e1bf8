"""The level above which hardly any response is noise."""

from __future__ import annotations

import functools
import math

import numpy as np

LEAST_SIGMA = 5.0
FALSE_RATE = 0.02 / 60.0
"""False impacts a second, were the noise Gaussian; or, if that is more,"""
FALSE_SHARE = 0.0005
"""of the impacts found."""


def discovery_level(
    responses: np.ndarray, widths: float, seconds: float, least: float = LEAST_SIGMA
) -> float:
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
    lowest = _level(round(math.log2(max(widths, 1.0) / (FALSE_RATE * seconds)), 2), least)
    ordered = np.sort(responses[(responses >= least) & (responses < lowest)])[::-1]
    above = int(np.count_nonzero(responses >= lowest))
    for rank, u in enumerate(ordered, start=above + 1):
        if widths * _excursions(u) <= FALSE_SHARE * rank:
            lowest = float(u)
    return lowest


def _excursions(u: float) -> float:
    """Above u, a width of a response, in Gaussian noise."""
    return u * u * 0.5 * math.erfc(u / math.sqrt(2))


@functools.lru_cache(maxsize=256)
def _level(octaves: float, least: float) -> float:
    """The lowest level that is exceeded once in 2**octaves widths."""
    low, high = least, 40.0
    if _excursions(low) <= 2.0**-octaves:
        return low
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _excursions(middle) > 2.0**-octaves else (low, middle)
    return high
