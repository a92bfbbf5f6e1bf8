"""Kernels that follow the gaps of neighbours in their newest coordinate."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit

LOWEST = -1000.0  # stands for the logarithm of 0, which has no differences


@njit(nogil=True)
def pair_gaps(newest, one, other, steps):
    """Logarithms of abs(newest[one + k] - newest[other + k]), shape (steps + 1, pairs)."""
    log = np.empty((steps + 1, len(one)))
    for k in range(steps + 1):
        for r in range(len(one)):
            gap = abs(newest[one[r] + k] - newest[other[r] + k])
            log[k, r] = np.log(gap) if gap > 0.0 else LOWEST
    return log


@njit(nogil=True)
def group_gaps(newest, one, start, who, steps):
    """Logarithms of the mean gap from each reference to all its neighbours, (steps + 1, n)."""
    log = np.empty((steps + 1, len(one)))
    for k in range(steps + 1):
        for r in range(len(one)):
            total = 0.0
            for at in range(start[r], start[r + 1]):
                total += abs(newest[one[r] + k] - newest[who[at] + k])
            gap = total / (start[r + 1] - start[r])
            log[k, r] = np.log(gap) if gap > 0.0 else LOWEST
    return log
