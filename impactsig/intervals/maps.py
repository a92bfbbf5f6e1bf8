"""The return map (delay plot) of interspike intervals."""

from __future__ import annotations

import numpy as np

from .pairs import Intervals, interval_pairs


def return_map(intervals: Intervals, lag: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return map of intervals: the points (I_k, I_{k+lag}) [Karpodinis]_.

    For a periodic train there are as many points as different pairs in its period, and each
    spurious or missed spike adds a few other points. For chaos the points form a curve or a cloud.

    Parameters
    ----------
    intervals : array_like, shape (n,), or Impacts
        Interspike intervals [s]. Of `Impacts`, pairs that reach across a gap are left out.
    lag : int
        Number of intervals between the two.

    Returns
    -------
    x, y : ndarray, shape (pairs,)
        I_k and I_{k+lag} [s]; n - lag pairs where there are no gaps, none where n <= lag.

    Raises
    ------
    InvalidInput
        If an interval is negative or not finite, or `lag` is not a positive whole number.

    See Also
    --------
    interval_histogram, return_map_determinism, plot.return_map

    Examples
    --------
    >>> from impactsig import return_map
    >>> x, y = return_map([1.0, 2.0, 3.0, 5.0], lag=2)
    >>> x.tolist(), y.tolist()
    ([1.0, 2.0], [3.0, 5.0])
    """
    return interval_pairs(intervals, lag, least=0)
