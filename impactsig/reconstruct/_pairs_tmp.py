"""Pair counts by blocks of time: stands in for the exact counting until that is merged."""

import numpy as np
from numba import njit


def pair_counts_by_block(x, dimensions, delay, theiler, radii, blocks):
    """Pairs of delay vectors with max-norm distance d <= r, int64 (m, block, block, radii)."""
    counts = _count(x, np.asarray(dimensions), delay, theiler, radii, blocks)
    return counts.cumsum(axis=-1)[..., : len(radii)]


@njit(cache=True, nogil=True)
def _count(x, dimensions, delay, theiler, radii, blocks):
    size, most, last = len(x), dimensions[-1], len(radii)
    counts = np.zeros((len(dimensions), blocks, blocks, last + 1), np.int64)
    row_of = np.full(most, -1)
    block = np.zeros((most, size), np.int64)
    for row, m in enumerate(dimensions):
        row_of[m - 1] = row
        n = size - (m - 1) * delay
        for i in range(n):
            block[m - 1, i] = i * blocks // n
    log_first = np.log(radii[0])
    per = (last - 1) / (np.log(radii[-1]) - log_first)
    for lag in range(theiler + 1, size):
        for i in range(size - lag):
            d = 0.0
            k = 0
            for m in range(most):
                j = i + lag + m * delay
                if j >= size:
                    break
                apart = abs(x[i + m * delay] - x[j])
                if apart > d:
                    d = apart
                    k = min(max(int((np.log(d) - log_first) * per), 0), last)
                    while k > 0 and d <= radii[k - 1]:
                        k -= 1
                    while k < last and d > radii[k]:
                        k += 1
                if row_of[m] >= 0:
                    counts[row_of[m], block[m, i], block[m, i + lag], k] += 1
    return counts
