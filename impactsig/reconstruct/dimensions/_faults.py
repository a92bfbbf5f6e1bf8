"""Effect of missed and spurious impacts on intervals, by adding more of them."""

from __future__ import annotations

import numpy as np


def with_faults(x: np.ndarray, missed: float, spurious: float, seed: int) -> np.ndarray:
    """Intervals after removing and inserting impacts at random.

    Parameters
    ----------
    x : ndarray, shape (n,)
        As `series` returns it; nothing is joined across the nan of a gap.
    missed, spurious : float
        As shares of the impacts.
    """
    rng = np.random.default_rng(seed)
    parts, start = [], 0
    for end in np.append(np.flatnonzero(np.isnan(x)), len(x)):
        part = x[start:end]
        if len(part):
            instants = np.cumsum(np.concatenate(([0.0], part)))
            kept = rng.random(len(instants)) >= missed
            kept[[0, -1]] = True
            count = rng.poisson(spurious * len(instants))
            extra = rng.uniform(0.0, instants[-1], count)
            parts.append(np.diff(np.sort(np.concatenate((instants[kept], extra)))))
        if end < len(x):
            parts.append(x[end : end + 1])
        start = end + 1
    return np.concatenate(parts)
