"""Radius at which a given share of the pairs of delay vectors recur."""

from __future__ import annotations

import numpy as np

from ._lines import histogram

BINS = 4096


def radius_of(x: np.ndarray, dimension: int, delay: int, theiler: int, pairs: int) -> float:
    """Least radius that contains a number of pairs outside the Theiler window.

    A histogram of all distances finds the bin that holds this distance, and is refined within it
    until its edges are neighbouring numbers or all distances in it are equal.
    """
    low, high = 0.0, float(np.nanmax(x)) - float(np.nanmin(x))
    if high == np.inf:
        return 2 * radius_of(x / 2, dimension, delay, theiler, pairs)
    while True:
        counts, below, least, most = histogram(x, dimension, delay, theiler, low, high, BINS)
        total = below + np.cumsum(counts)
        found = int(np.searchsorted(total, pairs))
        if found >= BINS or least[found] == most[found]:
            return float(most[min(found, BINS - 1)])
        low, high = float(least[found]), float(most[found])
