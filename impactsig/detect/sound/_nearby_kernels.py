"""Kernels for what lies near a crest of sound: which are greatest, which of a rank, how many."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import njit


@njit(nogil=True)
def crests(rise, spacing, least, first, last, out):
    """Frames first <= j < last with a rise of at least `least` that is a local maximum.

    No rise within `spacing` frames is greater, nor one before it as great. Returns their number.
    """
    found = 0
    for j in range(first, last):
        if rise[j] < least or rise[j] == 0.0:
            continue
        greatest = True
        for k in range(1, spacing + 1):
            if rise[j - k] >= rise[j] or rise[j + k] > rise[j]:
                greatest = False
                break
        if greatest:
            out[found] = j
            found += 1
    return found


@njit(nogil=True)
def greatest_between(values, first, last, out):
    """out[k]: index of the maximum of values[first[k] : last[k]]; -1 if empty."""
    for k in range(len(out)):
        out[k] = -1
        for i in range(first[k], last[k]):
            if out[k] < 0 or values[i] > values[out[k]]:
                out[k] = i


@njit(nogil=True)
def greatest_about(place, height, reach, queue, out):
    """out[k]: the greatest height from place[k] - reach to before place[k] + reach, and at it.

    Places ascend. `queue`, with room for all, holds those ahead that no later one exceeds.
    """
    first = last = end = 0
    for k in range(len(place)):
        while end < len(place) and (place[end] < place[k] + reach or end == k):
            while last > first and height[queue[last - 1]] <= height[end]:
                last -= 1
            queue[last] = end
            last += 1
            end += 1
        while place[queue[first]] < place[k] - reach:
            first += 1
        out[k] = height[queue[first]]


@njit(nogil=True)
def ranked_between(order, first, last, rank, tree, out):
    """out[k]: index of the rank[k]-th least of the values first[k] to last[k]; -1 if there is none.

    `order` sorts all values. Neither `first` nor `last` falls. `tree`, zeros, one more than there
    are values, counts those in the window by their place in the order (a binary indexed tree).
    """
    count, begin, end = len(order), 0, 0
    place = np.empty(count, np.int64)
    for r in range(count):
        place[order[r]] = r
    top = 1
    while 2 * top <= count:
        top *= 2
    for k in range(len(out)):
        while end < last[k]:
            add_count(tree, place[end], 1)
            end += 1
        while begin < min(first[k], end):
            add_count(tree, place[begin], -1)
            begin += 1
        out[k] = -1
        if 0 <= rank[k] < end - begin:
            left, at, step = rank[k], 0, top
            while step > 0:
                if at + step <= count and tree[at + step] <= left:
                    at += step
                    left -= tree[at]
                step //= 2
            out[k] = order[at]


@njit(nogil=True)
def add_count(tree, place, one):
    """Count a value more or less at this place."""
    k = place + 1
    while k < len(tree):
        tree[k] += one
        k += k & -k


@njit(nogil=True)
def as_high_near(height, asked, first, last, share, out):
    """out[k]: how many others of height[first[k] : last[k]] exceed share * height[asked[k]]."""
    for k in range(len(asked)):
        own = height[asked[k]]
        level, near = share * own, height[first[k] : last[k]]
        count = 0
        for i in range(len(near)):  # without a branch: it runs in vector lanes
            count += near[i] > level
        out[k] = count - (own > level)
