"""How neighbours part: gaps of the newest coordinate after k steps, followed in compiled code."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def pair_gaps(newest, one, other, steps):
    """Logarithms of abs(newest[one + k] - newest[other + k]), shape (steps + 1, pairs)."""
    log = np.empty((steps + 1, len(one)))
    for k in range(steps + 1):
        for r in range(len(one)):
            log[k, r] = np.log(abs(newest[one[r] + k] - newest[other[r] + k]))
    return log


@njit(cache=True, nogil=True)
def group_gaps(newest, one, start, who, steps):
    """Logarithms of the mean gap from each reference to all its neighbours, (steps + 1, n)."""
    log = np.empty((steps + 1, len(one)))
    for k in range(steps + 1):
        for r in range(len(one)):
            total = 0.0
            for at in range(start[r], start[r + 1]):
                total += abs(newest[one[r] + k] - newest[who[at] + k])
            log[k, r] = np.log(total / (start[r + 1] - start[r]))
    return log
