"""Which impacts of a record are the bounces of one drop."""

from __future__ import annotations

import numpy as np

from ..impacts import Impacts

STRAY = 0.12
"""By which the logarithm of a ratio may be off the usual one before an impact is no bounce."""
OVER = 2
"""Impacts that are no bounces, over which one flight may lead."""


def bouncing(impacts: Impacts, contacts: np.ndarray) -> np.ndarray:
    """The impacts of the longest chain of flights that shrink by nearly the same ratio.

    A flight may lead over impacts that are no bounces, each of which costs as much as a flight.
    """
    if len(impacts) <= 2:  # which make one flight
        return np.arange(len(impacts))
    gaps = np.concatenate(([0], np.cumsum(impacts.interval_spans_gap())))
    begin: np.ndarray = np.repeat(np.arange(len(impacts) - 1), OVER + 1)
    end = begin + np.tile(np.arange(OVER + 1), len(impacts) - 1) + 1
    begin, end = begin[end < len(impacts)], end[end < len(impacts)]
    flight = impacts.time[end] - impacts.time[begin] - contacts[begin]
    usable = (flight > 0) & (gaps[begin] == gaps[end])
    begin, end, flight = begin[usable], end[usable], np.log(flight[usable])
    first, second = _follow(begin, end)
    steps = flight[second] - flight[first]
    first, second, steps = first[steps < 0], second[steps < 0], steps[steps < 0]
    best: tuple[float, list[int]] = (0.0, [])
    for centre in np.unique(np.rint(steps / (STRAY / 4))) * (STRAY / 4):
        off = ((steps - centre) / STRAY) ** 2
        near = off < 1
        worth, before = begin - end + 1.0, np.full(len(flight), -1)
        alone = worth.copy()
        for one, other, cost in zip(first[near], second[near], off[near], strict=True):
            longer = worth[one] + alone[other] + 1 - cost / 2
            if longer > worth[other]:
                worth[other], before[other] = longer, one
        last = int(np.argmax(worth)) if len(worth) else -1
        if last >= 0 and worth[last] > best[0]:
            chain = [int(end[last])]
            while last >= 0:
                chain.append(int(begin[last]))
                last = int(before[last])
            best = (float(worth.max()), chain[::-1])
    return np.array(best[1], int)


def _follow(begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of flights of which the second begins where the first ends, in their order."""
    low = np.asarray(np.searchsorted(begin, end))
    high = np.asarray(np.searchsorted(begin, end, side="right"))
    first: np.ndarray = np.repeat(np.arange(len(begin)), high - low)
    within = np.arange(len(first)) - np.repeat(np.cumsum(high - low) - (high - low), high - low)
    return first, low[first] + within
