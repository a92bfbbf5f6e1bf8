"""Kernels for what lies near a crest of sound: which are greatest, which of a rank, how many."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import inlined, kernel, njit
from ..signal.order_kernels import select
from ._kernels import GROUP

SIDE_BY_SIDE = 64  # frames that are checked in vector lanes
TOGETHER = 16  # places in an order, or groups of them, that are counted as one group


@njit(nogil=True)
def crests(rise, spacing, least, first, last, out):
    """Frames first <= j < last with a rise of at least `least` that is a local maximum.

    No rise within `spacing` frames is greater, nor one before it as great. Returns their number.
    """
    found = 0
    for begin in range(first, last, SIDE_BY_SIDE):
        end, some = min(begin + SIDE_BY_SIDE, last), 0
        for j in range(np.uint64(begin), np.uint64(end)):
            some += rise[j] >= least
        for j in range(begin, end if some else begin):
            if rise[j] >= least and rise[j] > 0.0 and stands_out(rise, j, spacing):
                out[found] = j
                found += 1
    return found


@njit(nogil=True)
def stands_out(rise, j, spacing):
    """Whether no rise within `spacing` frames is greater, nor one before it as great."""
    k = 1
    while k <= spacing and rise[j - k] < rise[j] and rise[j + k] <= rise[j]:
        k += 1
    return k > spacing


@njit(nogil=True)
def ends_about(places, at, before, after, first, last):
    """Index of the first of ascending places at least at[k] - before, and at least at[k] + after.

    Each is looked for from the one before, which is near if `at` ascends.
    """
    count, begin, end = len(places), 0, 0
    for k in range(len(at)):
        low, high = at[k] - before, at[k] + after
        while begin > 0 and places[begin - 1] >= low:
            begin -= 1
        while begin < count and places[begin] < low:
            begin += 1
        while end > 0 and places[end - 1] >= high:
            end -= 1
        while end < count and places[end] < high:
            end += 1
        first[k], last[k] = begin, end


@njit(nogil=True)
def greatest_between(values, first, last, out):
    """out[k]: index of the maximum of values[first[k] : last[k]]; -1 if empty."""
    for k in range(len(out)):
        out[k] = -1
        for i in range(first[k], last[k]):
            if out[k] < 0 or values[i] > values[out[k]]:
                out[k] = i


@njit(nogil=True)
def crests_apart(values, reach, least, out):
    """Indices of values above `least` that none within `reach` exceeds; the first of equal ones.

    Returns their number.
    """
    found, j = 0, 0
    while j < len(values):
        ahead = j + 1
        if values[j] > least:
            end = min(j + reach + 1, len(values))
            while ahead < end and values[ahead] <= values[j]:
                ahead += 1
            if ahead == end:  # else those until the one that exceeds it are no crests either
                k = max(j - reach, 0)
                while k < j and values[k] <= values[j]:
                    k += 1
                if k == j:
                    out[found] = j
                    found += 1
                else:
                    ahead = j + 1
        j = ahead
    return found


@inlined
def nearest(frame, count):
    """The GROUP, of so many, whose first frame is nearest to a frame."""
    return min(int(np.rint(frame / GROUP)), count - 1)


@inlined
def strongest_beside(values, at, reach):
    """Index of the greatest value at most `reach` from a place; the first of equal ones.

    A place beyond the ends is that of the first or the last value.
    """
    last = len(values) - 1
    place = min(max(at, 0), last)
    best = max(place - reach, 0)
    for i in range(best + 1, min(place + reach, last) + 1):
        if values[i] > values[best]:
            best = i
    return best


@inlined
def greatest_beside(values, at, reach):
    """The greatest value at most `reach` from a place."""
    return values[strongest_beside(values, at, reach)]


@kernel
def put_totals(values, out):
    """out[k]: sum of the values before the k-th."""
    out[0] = 0.0
    for k in range(len(values)):
        out[k + 1] = out[k] + values[k]


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


@kernel
def ranked_in_each(values, first, last, rank, room, out):
    """out[k]: the rank[k]-th least of values[first[k] : last[k]]; it stays if there is none.

    There is `room` for all values.
    """
    begin = end = 0  # of those in the room
    for k in range(len(out)):
        count = last[k] - first[k]
        if 0 <= rank[k] < count:
            if first[k] != begin or last[k] != end:
                begin, end = first[k], last[k]
                for i in range(count):
                    room[i] = values[begin + i]
            out[k] = select(room, 0, count - 1, rank[k])


@njit(nogil=True)
def ranked_between(order, first, last, rank, out):
    """out[k]: index of the rank[k]-th least of the values first[k] to last[k]; -1 if there is none.

    `order` sorts all values. Neither `first` nor `last` falls. Those in the window are counted by
    their place in the order, in groups of TOGETHER places, groups of these, and so on.
    """
    count, begin, end = len(order), 0, 0
    place = np.empty(count, np.int64)
    for r in range(count):
        place[order[r]] = r
    level, size, room = 1, count, count + 1
    while size > TOGETHER:
        size = size // TOGETHER + 1
        room += size + 1
        level += 1
    starts, counts = np.zeros(level, np.int64), np.zeros(room, np.int32)
    size = count
    for k in range(1, level):
        starts[k] = starts[k - 1] + size + 1
        size = size // TOGETHER + 1
    for k in range(len(out)):
        while end < last[k]:
            add_count(counts, starts, place[end], 1)
            end += 1
        while begin < min(first[k], end):
            add_count(counts, starts, place[begin], -1)
            begin += 1
        out[k] = -1
        if 0 <= rank[k] < end - begin:
            left, at = rank[k], 0
            for one in range(level - 1, -1, -1):
                at *= TOGETHER
                while counts[starts[one] + at] <= left:
                    left -= counts[starts[one] + at]
                    at += 1
            out[k] = order[at]


@njit(nogil=True)
def add_count(counts, starts, place, one):
    """Count a value more or less at this place."""
    for k in range(len(starts)):
        counts[starts[k] + place] += one
        place //= TOGETHER


@kernel
def number_as_high(height, k, first, last, share):
    """How many others of height[first:last] exceed share * height[k]."""
    own = height[k]
    level, near = share * own, height[first:last]
    count = 0
    for i in range(len(near)):  # without a branch: it runs in vector lanes
        count += near[i] > level
    return count - (own > level)
