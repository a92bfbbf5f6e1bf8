"""Kernels that pair two ascending sequences of instants."""

from __future__ import annotations

import numpy as np

from .._compiling.compiled import njit

SKIP_A, SKIP_B, PAIR = range(3)


@njit(nogil=True)
def windows(a, b, within):
    """For each a the first b at most `within` away, and the first one beyond that."""
    first, last = np.empty(len(a), np.int64), np.empty(len(a), np.int64)
    low = high = 0
    for i in range(len(a)):
        while low < len(b) and a[i] - b[low] > within:
            low += 1
        high = max(high, low)
        while high < len(b) and b[high] - a[i] <= within:
            high += 1
        first[i], last[i] = low, high
    return first, last


@njit(nogil=True)
def assign(a, b, within):
    """Pairs (i, j), |a[i] - b[j]| <= within, with the greatest sum of within - |a[i] - b[j]|.

    On a line no pairs of the best assignment cross, so it is found by going through both in
    order: best[j] is the greatest sum for the first j of b and the a so far. Only the b within
    reach of an a can change it.
    """
    first, last = windows(a, b, within)
    begin = np.zeros(len(a) + 1, np.int64)
    for i in range(len(a)):
        begin[i + 1] = begin[i] + last[i] - first[i]
    choice = np.empty(begin[-1], np.int8)
    best = np.zeros(len(b) + 1)
    reached = 0
    for i in range(len(a)):
        while reached < last[i]:
            best[reached + 1] = best[reached]
            reached += 1
        diagonal = best[first[i]]
        for j in range(first[i], last[i]):
            without_a, without_b = best[j + 1], best[j]
            paired = diagonal + (within - abs(a[i] - b[j]))
            diagonal = without_a
            if paired >= without_a and paired >= without_b:
                best[j + 1], made = paired, PAIR
            elif without_a >= without_b:
                made = SKIP_A
            else:
                best[j + 1], made = without_b, SKIP_B
            choice[begin[i] + j - first[i]] = made
    pairs = np.empty((min(len(a), len(b)), 2), np.int64)
    count, i, j = 0, len(a) - 1, len(b) - 1
    while i >= 0 and j >= 0:
        j = min(j, last[i] - 1)
        if j < first[i]:
            i -= 1
            continue
        made = choice[begin[i] + j - first[i]]
        if made == PAIR:
            pairs[count, 0], pairs[count, 1] = i, j
            count += 1
        i -= made != SKIP_B
        j -= made != SKIP_A
    return pairs[:count][::-1]
