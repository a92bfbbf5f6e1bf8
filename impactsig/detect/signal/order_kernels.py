"""Order statistics by selection: what sorting would tell, in time proportional to the number."""

from __future__ import annotations

import numpy as np

from ..._compiled import kernel, njit


@kernel
def select(values, low, high, wanted):
    """The value that sorting would put at `wanted`; low <= wanted <= high.

    Values [low, high] are put out of order: lower ones come before it, higher ones after it.
    """
    while low < high:
        between = (low + high) // 2
        first, last, other = values[low], values[high], values[between]
        pivot = max(min(first, last), min(max(first, last), other))
        at = low if first == pivot else (high if last == pivot else between)
        values[at], values[high] = values[high], pivot
        k = low  # values that are to the left go there; without a branch, which would be a guess
        for i in range(low, high):
            value = values[i]
            values[i] = values[k]
            values[k] = value
            k += value < pivot
        values[high], values[k] = values[k], pivot
        if wanted == k:
            return pivot
        if wanted < k:
            high = k - 1
            continue
        few = k - low < (high - low) // 8  # as where many are equal to it
        low = k + 1
        if not few:
            continue
        k = low
        for i in range(low, high + 1):
            value = values[i]
            values[i] = values[k]
            values[k] = value
            k += value <= pivot
        if wanted < k:
            return pivot
        low = k
    return values[wanted]


@kernel
def median_of(values, count):
    """Median of the first `count` values, which are put out of order; the upper of two."""
    return select(values, 0, count - 1, count // 2)


@njit(nogil=True)
def middle(rows, out):
    """Median of each column of a few rows; the upper of two."""
    values = np.empty(len(rows))
    for j in range(rows.shape[1]):
        for i in range(len(rows)):
            values[i] = rows[i, j]
        out[j] = median_of(values, len(rows))


@njit(nogil=True)
def quantile(values, share):
    """Quantile of some values, which stay as they are; linear between two, 0 of none."""
    count = len(values)
    if count == 0:
        return 0.0
    mixed = values.copy()
    place = share * (count - 1)
    k = min(int(place), count - 1)
    lower = select(mixed, 0, count - 1, k)
    if k == count - 1:
        return lower
    return lower + (place - k) * (select(mixed, k + 1, count - 1, k + 1) - lower)
