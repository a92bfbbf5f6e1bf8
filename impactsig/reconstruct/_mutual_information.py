"""Kernel for mutual information by nearest neighbours."""

from __future__ import annotations

import numpy as np

from .._compiling.compiled import njit


@njit(nogil=True)
def neighbor_counts(x, y, neighbors):
    """Number of points closer than e_i in x and in y, shape (2, n).

    e_i is the distance of (x_i, y_i) from the k-th nearest other pair, the larger difference of a
    coordinate. Pairs are gone through outwards from x_i until x alone is farther away.
    """
    n = len(x)
    order = np.argsort(x, kind="mergesort")
    first, second = x[order], y[order]
    ascending = np.sort(y)
    counts = np.empty((2, n), np.int64)
    distance = np.empty(neighbors)
    for place in range(n):
        low, high, held = place - 1, place + 1, 0
        while low >= 0 or high < n:
            below = first[place] - first[low] if low >= 0 else np.inf
            above = first[high] - first[place] if high < n else np.inf
            if held == neighbors and min(below, above) > distance[held - 1]:
                break
            if below <= above:
                apart = max(below, abs(second[place] - second[low]))
                low -= 1
            else:
                apart = max(above, abs(second[place] - second[high]))
                high += 1
            if held == neighbors:
                if apart >= distance[held - 1]:
                    continue
                held -= 1
            at = held
            while at > 0 and distance[at - 1] > apart:
                distance[at] = distance[at - 1]
                at -= 1
            distance[at] = apart
            held += 1
        reach = distance[held - 1]
        i = order[place]
        counts[0, i] = _nearer(first, first[place], reach)
        counts[1, i] = _nearer(ascending, second[place], reach)
    return counts


@njit(nogil=True)
def _nearer(ascending, value, reach):
    """Number of values closer to a value than `reach`, by rounded differences."""
    low = np.searchsorted(ascending, value - reach)
    while low < len(ascending) and value - ascending[low] >= reach:
        low += 1
    while low > 0 and value - ascending[low - 1] < reach:
        low -= 1
    high = np.searchsorted(ascending, value + reach)
    while high < len(ascending) and ascending[high] - value < reach:
        high += 1
    while high > 0 and ascending[high - 1] - value >= reach:
        high -= 1
    return high - low - 1
