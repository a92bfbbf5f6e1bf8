"""Kernels for the slots of a fold: jitter, peaks of phases, impacts at due instants."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import njit
from ..._numerics.spread import DEVIATION_BY_MEDIAN

kernel = njit(nogil=True, error_model="numpy")

REACH = 4.0  # a slot reaches this many standard deviations to either side
LEAST_RECURRING = 3  # impacts near a later one, from which the noise is read
NEAR = 0.25  # [cycles] of it
TURNS = np.array([1, 2, 3, 8, 25])
ROUNDS = 10
NORMAL = DEVIATION_BY_MEDIAN / math.sqrt(2.0)  # of one value, by differences of two


@kernel
def recurrence_jitter(cycles, fold, floor, widest):
    """Robust estimate of the timing noise, from the recurrence of impacts after some folds.

    The greatest of what 1 to 25 folds say: what changes slowly shows little after one.
    """
    if len(cycles) < LEAST_RECURRING:
        return widest
    greatest = floor
    miss = np.empty(len(cycles))
    for k in range(len(TURNS)):
        count, after = 0, 1
        for instant in cycles:
            due = instant + TURNS[k] * fold
            while after < len(cycles) - 1 and cycles[after] < due:
                after += 1
            nearest = after - 1 if due - cycles[after - 1] < cycles[after] - due else after
            if abs(cycles[nearest] - due) < NEAR:
                miss[count] = cycles[nearest] - due
                count += 1
        if count < LEAST_RECURRING:
            if k == 0:
                greatest = widest
            break
        near = miss[:count]
        if not _is_below(near, greatest / NORMAL):
            deviation = NORMAL * np.median(np.abs(near - np.median(near)))
            greatest = max(greatest, deviation)
    return min(greatest, widest)


@kernel
def _is_below(values, limit):
    """Whether the median deviation is certainly below a limit, which takes no median to see.

    If more than half of the values lie within half the limit of any place, so does their median,
    and they are within the limit of it.
    """
    mean = 0.0
    for value in values:
        mean += value
    mean /= len(values)
    close = 0
    for value in values:
        close += abs(value - mean) < 0.499 * limit
    return 2 * close > len(values) + 1


@kernel
def peel(phase, fold, width, least):
    """Centres of clusters of sorted phases, the largest first, down to `least` impacts.

    An impact counts its neighbours within one standard deviation, two thirds of its heap: a wider
    window would sit astride two heaps that touch.
    """
    phase = phase.copy()
    n = len(phase)
    ring = np.empty(3 * n)  # the phases of the fold before, of the fold, and of the one after
    centre = np.empty(n)
    found = 0
    while n >= max(least, 1.0):
        for k in range(n):
            ring[k], ring[n + k], ring[2 * n + k] = phase[k] - fold, phase[k], phase[k] + fold
        low = high = first = last = 0
        for k in range(n):
            while low < 3 * n and ring[low] < phase[k] - width:
                low += 1
            while high < 3 * n and ring[high] <= phase[k] + width:
                high += 1
            if high - low > last - first:
                first, last = low, high
        if last - first < least:
            break
        total = 0.0
        for k in range(first, last):
            total += ring[k]
        middle = total / (last - first) % fold
        centre[found] = middle
        found += 1
        kept = 0
        for k in range(n):
            if abs((phase[k] - middle + fold / 2) % fold - fold / 2) > 2.5 * width:
                phase[kept] = phase[k]
                kept += 1
        n = kept
    centre = centre[:found]
    _put_in_order(centre)
    return centre


@kernel
def _put_in_order(values):
    """Sort a few values in place; numba takes half a second to compile `numpy.sort`."""
    for k in range(1, len(values)):
        value, at = values[k], k
        while at > 0 and values[at - 1] > value:
            values[at] = values[at - 1]
            at -= 1
        values[at] = value


@kernel
def remainder(value, fold):
    """The same as ``value % fold``, without fmod, which takes several times as long."""
    turn = np.floor(value / fold)
    phase = value - turn * fold
    return phase if phase >= 0.0 else value - (turn - 1.0) * fold


@kernel
def assign(cycles, centre, fold, reach, instant, slot, offset, hit):
    """Assign impacts to due instants: the nearest one, its slot, the offset, whether it is a hit.

    Instants are numbered in the order of time: of m slots, number k belongs to slot k modulo m. Of
    the impacts within reach of one instant the nearest hits it. `cycles` ascend.
    """
    m = len(centre)
    last = -1  # impact that hits the instant reached so far
    for k in range(len(cycles)):
        phase = remainder(cycles[k], fold)
        # on the circle the last slot comes before the first, and the first after the last
        here, place = m - 1, centre[m - 1] - fold
        for following in range(m + 1):
            ahead = centre[following] if following < m else centre[0] + fold
            if phase <= 0.5 * (place + ahead):
                break
            here, place = (following if following < m else 0), ahead
        offset[k], slot[k] = phase - place, here
        turn = np.int64(np.rint((cycles[k] - offset[k] - centre[here]) / fold))
        instant[k] = turn * m + here
        hit[k] = abs(offset[k]) <= reach
        if hit[k]:
            if last >= 0 and instant[last] == instant[k]:
                if abs(offset[last]) <= abs(offset[k]):
                    hit[k] = False
                    continue
                hit[last] = False
            last = k


@kernel
def settle(cycles, fold, gaps, floor, widest, least, centre, width):
    """Remove weak slots, and refine rate, centres and width alternately.

    Returns the impacts at the refined rate, the centres and the width of the slots, hits and
    instants due of each slot, and what `assign` fills in for each impact. A slot is weak that is
    hit at less than the share `least` of the instants when it is due.
    """
    n = len(cycles)
    instant, offset, hit = np.empty(n, np.int64), np.empty(n), np.empty(n, np.bool_)
    slot = np.empty(n, np.int64)
    cycles = cycles.copy()
    hits, due = np.zeros(0, np.int64), np.zeros(0, np.int64)
    for turn in range(ROUNDS):
        m = len(centre)
        if m == 0:
            break
        assign(cycles, centre, fold, REACH * width, instant, slot, offset, hit)
        hits, mean = np.zeros(m, np.int64), np.zeros(m)
        for k in range(n):
            if hit[k]:
                hits[slot[k]] += 1
                mean[slot[k]] += offset[k]
        mean /= np.maximum(hits, 1)
        due = np.maximum(_due(centre, fold, cycles, gaps, REACH * width), hits)
        squares, total, middle = 0.0, 0, 0.0
        for k in range(n):
            if hit[k]:
                squares += (offset[k] - mean[slot[k]]) ** 2
                middle += cycles[k]
                total += 1
        jitter = math.sqrt(squares / max(total, 1))
        strong = hits >= least * due
        settled = turn > 1 and strong.all() and abs(jitter - width) < 1e-3 * width
        if settled or turn == ROUNDS - 1:
            break
        middle /= max(total, 1)
        along = across = 0.0
        for k in range(n):
            if hit[k]:
                along += (offset[k] - mean[slot[k]]) * (cycles[k] - middle)
                across += (cycles[k] - middle) ** 2
        centre = (centre + mean)[strong] % fold
        _put_in_order(centre)
        width = min(max(jitter, floor), widest)
        slope = along / max(across, 1e-300)
        for k in range(n):
            cycles[k] -= slope * (cycles[k] - middle)
    return cycles, centre, width, hits, due, instant, offset, hit


@kernel
def _due(centre, fold, cycles, gaps, margin):
    """Number of due instants of each slot from the first impact to the last, without gaps."""
    due = np.empty(len(centre), np.int64)
    for k in range(len(centre)):
        total = _count(centre[k], fold, cycles[0] - margin, cycles[-1] + margin)
        for j in range(len(gaps)):
            total -= _count(centre[k], fold, gaps[j, 0], gaps[j, 1])
        due[k] = total
    return due


@kernel
def _count(centre, fold, low, high):
    return np.int64(math.floor((high - centre) / fold) - math.floor((low - centre) / fold))
