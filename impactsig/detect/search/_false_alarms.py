"""Level that controls the false discovery rate."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ..signal.order_kernels import put_in_order
from ..signal.probability import excursions

LEAST_SIGMA = 5.0
FALSE_RATE = 0.02 / 60.0
"""False impacts a second, were the noise Gaussian; or, if that is more,"""
FALSE_SHARE = 0.0005
"""of the impacts found."""


@allocating
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
    lowest = _level(widths, seconds)
    doubtful = np.empty(len(responses))
    count = higher = 0
    for u in responses:
        if u >= lowest:
            higher += 1
        elif u >= LEAST_SIGMA:
            doubtful[count] = -u
            count += 1
    order, room = np.empty(count, np.int64), np.empty(count, np.int64)
    put_in_order(doubtful[:count], order, room)
    for k in order:
        higher += 1
        if widths * excursions(-doubtful[k]) <= FALSE_SHARE * higher:
            lowest = -doubtful[k]
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
