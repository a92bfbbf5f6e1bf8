"""How far the intervals of simulated trains are from measured ones."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit

kernel = njit(nogil=True, error_model="numpy")

CAP = 0.15  # forcing periods, from which pairs of intervals are as far apart as can be
FEWEST = 10  # pairs of a train


@kernel
def distances(seen, x, ends, apart):
    """Mean squared distance of pairs of intervals from the nearest of the others, both ways."""
    m, cap = len(seen), CAP * CAP
    nearest = np.empty(m)
    for machine in range(len(apart)):
        begin, end = ends[machine], ends[machine + 1] - 2
        nearest[:] = cap
        total = 0.0
        for i in range(begin, end):
            first, second = x[i + 1] - x[i], x[i + 2] - x[i + 1]
            least = cap
            for j in range(m):
                square = (seen[j, 0] - first) ** 2 + (seen[j, 1] - second) ** 2
                least = min(least, square)
                nearest[j] = min(nearest[j], square)
            total += least
        apart[machine] = 2 * cap
        if end - begin >= FEWEST:
            apart[machine] = total / (end - begin) + nearest.sum() / m
