"""Slow, readable twins of the slots of a fold."""

from __future__ import annotations

import numpy as np


def recurrence_jitter(cycles, fold, floor, widest):
    """Greatest robust deviation of the impacts nearest to where others recur after some folds."""
    greatest = None
    for turns in (1, 2, 3, 8, 25):
        miss = []
        for instant in cycles:
            off = [other - (instant + turns * fold) for other in cycles]
            nearest = min(off, key=abs)
            if abs(nearest) < 0.25:
                miss.append(nearest)
        if len(miss) < 3:
            break
        deviation = np.median([abs(one - np.median(miss)) for one in miss]) * 1.4826 / np.sqrt(2)
        greatest = deviation if greatest is None else max(greatest, deviation)
    return min(max(widest if greatest is None else greatest, floor), widest)


def peel(phase, fold, width, least):
    """The mean of the phases around the one with most neighbours, then of what is away from it."""
    left, centre = sorted(phase), []
    while len(left) >= max(least, 1):
        around = [[_turned(one - at, fold) for one in left] for at in left]
        near = [
            [at + off for off in offs if abs(off) <= width]
            for at, offs in zip(left, around, strict=True)
        ]
        heap = max(near, key=len)
        if len(heap) < least:
            break
        centre.append(float(np.mean(heap)) % fold)
        left = [one for one in left if abs(_turned(one - centre[-1], fold)) > 2.5 * width]
    return sorted(centre)


def assign(cycles, centre, fold, reach):
    """Instant due nearest each impact, the offset from it, and which hit: the nearest of each."""
    turns = range(int(min(cycles) // fold) - 1, int(max(cycles) // fold) + 2)
    due = {turn * len(centre) + k: turn * fold + c for turn in turns for k, c in enumerate(centre)}
    instant = [min(due, key=lambda one: abs(u - due[one])) for u in cycles]
    offset = [u - due[one] for u, one in zip(cycles, instant, strict=True)]
    both = list(zip(offset, instant, strict=True))
    nearest = {one: min(abs(off) for off, other in both if other == one) for one in instant}
    hit = [abs(off) <= reach and abs(off) == nearest[one] for off, one in both]
    return instant, offset, hit


def _turned(apart, fold):
    """A difference of phases, from minus half a fold to half a fold."""
    return (apart + fold / 2) % fold - fold / 2
