"""Order statistics by selection, in linear time."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import kernel, njit


@kernel
def select(values, low, high, wanted):
    """The value that sorting would place at `wanted`; low <= wanted <= high.

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
    """Upper median of the first `count` values, which are reordered."""
    return select(values, 0, count - 1, count // 2)


@kernel
def centre_of(values, count):
    """Median of the first `count` values, which are reordered."""
    upper = select(values, 0, count - 1, count // 2)
    if count % 2:
        return upper
    lower = values[0]
    for i in range(1, count // 2):
        lower = max(lower, values[i])
    return (lower + upper) / 2


@kernel
def put_in_order(keys, order, room):
    """Stable argsort of the keys into `order`.

    By merging; numba takes a second to compile each `argsort`. `room` is as long as `order`.
    """
    n = len(keys)
    for i in range(n):
        order[i] = i
    length = 1
    while length < n:
        for first in range(0, n, 2 * length):
            left, right = first, min(first + length, n)
            middle_place, last = right, min(first + 2 * length, n)
            for k in range(first, last):
                from_left = left < middle_place
                if from_left and right < last:
                    from_left = not keys[order[right]] < keys[order[left]]
                if from_left:
                    room[k] = order[left]
                    left += 1
                else:
                    room[k] = order[right]
                    right += 1
        for i in range(n):
            order[i] = room[i]
        length *= 2


@kernel
def value_at(x, places, values):
    """Linear interpolation at x, constant beyond the ends.

    As `numpy.interp`, which takes numba two seconds to compile.
    """
    last = len(places) - 1
    if x < places[0]:
        return values[0]
    if x >= places[last]:
        return values[last]
    k = 0
    while places[k + 1] <= x:
        k += 1
    if places[k] == x or values[k] == values[k + 1]:
        return values[k]
    return (values[k + 1] - values[k]) / (places[k + 1] - places[k]) * (x - places[k]) + values[k]


@njit(nogil=True)
def middle(rows, out):
    """Upper median of each column of a few rows."""
    values = np.empty(len(rows))
    for j in range(rows.shape[1]):
        for i in range(len(rows)):
            values[i] = rows[i, j]
        out[j] = median_of(values, len(rows))


@njit(nogil=True)
def quantile(values, share):
    """Quantile of values, which are not changed; 0 of none."""
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
