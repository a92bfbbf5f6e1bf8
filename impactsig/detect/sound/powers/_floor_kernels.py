"""Kernels for `floor.py` and `holes.py`: low quantiles and falls of powers."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import njit
from ...signal.order_kernels import select

SAMPLE, QUARTER = 32, 4  # powers of a band, and the share of these below which quantiles nearly lie


@njit(nogil=True)
def low_quantiles(means, sounding, spans, share, hole, bias, out):
    """out[b, k]: the quantile of the means of band b that are `sounding`, over its bias.

    Of those from spans[0, k] to before spans[1, k], neither of which falls; 0 without any. What is
    below `hole` times the strongest of these is left out. Only about the lowest quarter of a band
    is looked at for each window, unless it has too few.
    """
    first, last, windows = spans[0], spans[1], spans.shape[1]
    begins, ends = (first[0], last[-1]) if windows else (0, 0)
    columns = ends - begins
    step = max(columns // SAMPLE, 1)
    low, place, room = np.empty(columns + 1), np.empty(columns + 1, np.int64), np.empty(columns + 1)
    heard = np.empty(windows, np.int64)
    for k in range(windows):
        heard[k] = 0
        for j in range(first[k], last[k]):
            heard[k] += sounding[j]
    for b in range(len(means)):
        row, few, count = means[b], 0, np.uint64(0)
        for j in range(begins, ends, step):
            room[few] = row[j]
            few += sounding[j]
        level = select(room, 0, few - 1, few // QUARTER) if few else np.inf
        for j in range(np.uint64(begins), np.uint64(ends)):
            low[count], place[count] = row[j], j
            count += np.uint64(sounding[j] & (row[j] <= level))
        begin = end = 0
        for k in range(windows):
            while begin < count and place[begin] < first[k]:
                begin += 1
            while end < count and place[end] < last[k]:
                end += 1
            rank, some = int(share * heard[k]), end - begin
            if hole == 0.0 and some > rank:
                for i in range(some):
                    room[i] = low[begin + i]
                out[b, k] = select(room, 0, some - 1, rank) / bias[b]
                continue
            some, empty, greatest = 0, 0, 0.0
            for j in range(first[k], last[k]):
                room[some] = row[j]
                some += sounding[j]
            for i in range(some):
                greatest = max(greatest, room[i])
            for i in range(some):
                empty += room[i] < hole * greatest
            rank = empty + int(share * (some - empty))
            out[b, k] = select(room, 0, some - 1, rank) / bias[b] if some else 0.0


@njit(nogil=True)
def count_falls(means, sounding, fall, step, least):
    """Pairs of neighbours in time, falls below `fall` of the one before, and falls beside rises.

    The latter are the lesser number, at each time, of bands that fall below `step` and of those
    that rise as much, in every other band. Only pairs that are `sounding` count. Where no more
    than a share `least` of all falls below `fall`, there are no falls.
    """
    steps = max(means.shape[1] - 1, 0)
    together, deep = np.empty(steps, np.bool_), 0
    for t in range(steps):
        together[t] = sounding[t] & sounding[t + 1]
    rows = (len(means) + 1) // 2
    for b in range(rows):
        row = means[2 * b]
        for t in range(steps):
            deep += row[t + 1] < fall * row[t]
    if deep <= least * (rows * steps):  # as nearly always
        return rows * steps, 0, 0
    falls, rises, deep, pairs, beside = np.zeros(steps), np.zeros(steps), 0, 0, 0
    for b in range(rows):
        row = means[2 * b]
        for t in range(steps):
            deep += together[t] & (row[t + 1] < fall * row[t])
            falls[t] += row[t + 1] < step * row[t]
            rises[t] += row[t] < step * row[t + 1]
    for t in range(steps):
        if together[t]:
            pairs += rows
            beside += int(min(falls[t], rises[t]))
    return pairs, deep, beside
