"""Echoes: instants that follow impacts of all trains after the same delay."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._numerics.spread import DEVIATION_BY_MEDIAN
from ...simulation.batches.trains import Impacting
from .partition import Train

FOLLOWING = 4  # impacts after each, among which its echo is
LONGEST = 0.5  # forcing periods of the fastest train
SAME = 0.02  # of these, within which delays agree at first
AROUND = 5.0  # of this: where other delays are counted for comparison
FEWEST = 0.05  # of the impacts, that have one
ROUNDS, REACH, WIDEST = 10, 2.5, 2.0  # of the spread: standard deviations, or windows, about it
BEYOND = 25.0  # logarithm of the likelihood that so many agree by chance
ROUNDED = 1e-8  # of a forcing period: delays nearer than that are the same
GOLDEN = (math.sqrt(5) - 1) / 2  # multiples of it fill a turn evenly
FARTHEST = 3.5  # standard deviations of the delay


class Echoes(NamedTuple):
    """The echoes of many trains."""

    delay: float  # s
    spread: float  # standard deviation [s]
    which: list[np.ndarray]  # of each train, bool
    share: float  # of the impacts that have one

    def again(self, truth: Impacting, frequency: float, rng: np.random.Generator) -> Impacting:
        """Simulated impacts, before any is missed, with echoes of as many and at that delay."""
        owner = np.repeat(np.arange(len(truth.starts)), np.diff(truth.starts, append=len(truth.x)))
        own = np.flatnonzero(rng.random(len(owner)) < self.share)
        late = truth.x[own] + self.delay * frequency
        order = np.lexsort((np.concatenate((truth.x, late)), np.concatenate((owner, owner[own]))))
        every = np.concatenate((np.arange(len(owner)), own))[order]
        return Impacting(
            np.concatenate((truth.x, late))[order],
            truth.approach[every],
            np.searchsorted(owner[every], np.arange(len(truth.starts))),
            truth.stop[every],
        )

    def taken_out(self, train: Train, frequency: float) -> Train:
        """Trains less what passes for an echo in each."""
        reach = FARTHEST * self.spread
        which = [_which(one.x / frequency, self.delay, reach) for one in train.split()]
        return without(train, np.concatenate(which))

    def cost(self, k: int, frequency: float) -> float:
        """Less the logarithm of the likelihood of those of a train, as `Joint.score` counts it."""
        echoes = int(self.which[k].sum())
        others = len(self.which[k]) - echoes
        own = math.log(self.spread * frequency) - math.log(self.share) + 0.5
        return echoes * own - max(others - echoes, 0) * math.log1p(-self.share)


def echoes(trains: list[Train], frequencies: list[float]) -> Echoes | None:
    """Find the delay that most impacts of all trains have in common; None if there is none."""
    period = 1 / max(frequencies)
    parts = []
    for train, frequency in zip(trains, frequencies, strict=True):
        time = train.x / frequency
        late = np.concatenate([time[lag:] - time[:-lag] for lag in range(1, FOLLOWING + 1)])
        parts.append(_dithered(late[(late > 0) & (late < LONGEST * period)], ROUNDED * period))
    late = np.sort(np.concatenate(parts))
    window, impacts = SAME * period, sum(len(train.x) for train in trains)
    if len(late) < FEWEST * impacts:
        return None
    inside = np.searchsorted(late, late + window) - np.arange(len(late))
    middle = late + window / 2
    wide = AROUND * window
    around = np.searchsorted(late, middle + wide) - np.searchsorted(late, middle - wide)
    usual = np.maximum((around - inside) * window / (2 * wide - window), 1.0)
    beyond = inside * np.log(inside / usual) - (inside - usual)
    beyond[(inside < usual) | (late < window)] = 0.0  # nearer ones are impacts that chatter
    best = int(np.argmax(beyond))
    if beyond[best] < BEYOND or inside[best] < FEWEST * impacts:
        return None
    alike = late[best : best + inside[best]]
    delay = float(np.median(alike))
    spread = max(_spread(late, delay, window), 1e-4 * period)
    which = [
        _which(train.x / frequency, delay, FARTHEST * spread)
        for train, frequency in zip(trains, frequencies, strict=True)
    ]
    found = sum(int(one.sum()) for one in which)
    share = min(max(found / max(impacts - found, 1), 1e-3), 1 - 1e-3)
    return Echoes(delay, spread, which, share)


def _dithered(late: np.ndarray, rounded: float) -> np.ndarray:
    """Delays of a clock with ticks, spread evenly over these; others unchanged.

    On a coarse clock most delays are the same number of ticks, about which their median deviation
    is 0. It has ticks if there are few numbers for many delays.
    """
    apart = np.diff(np.sort(late))
    apart = apart[apart > rounded]
    if not len(apart) or 2 * len(apart) > len(late):
        return late
    return late + apart.min() * ((np.arange(len(late)) * GOLDEN) % 1.0 - 0.5)


def _spread(late: np.ndarray, delay: float, window: float) -> float:
    """Standard deviation of the delays about their median, which the window may not hold."""
    reach, spread = window / 2, window
    for _ in range(ROUNDS):
        near = np.abs(late - delay)
        before, spread = spread, DEVIATION_BY_MEDIAN * float(np.median(near[near <= reach]))
        if abs(spread - before) < 0.02 * before:
            break
        reach = min(REACH * spread, WIDEST * window)
    return spread


def _which(time: np.ndarray, delay: float, reach: float) -> np.ndarray:
    """Instants that come so long after one that is no echo itself."""
    echo = np.zeros(len(time), bool)
    for k, instant in enumerate(time):
        if echo[k]:
            continue
        first, last = np.searchsorted(time, [instant + delay - reach, instant + delay + reach])
        if last > first:
            place = first + int(np.argmin(np.abs(time[first:last] - instant - delay)))
            echo[place] = place > k
    return echo


def without(train: Train, echo: np.ndarray) -> Train:
    """Trains less their echoes."""
    kept = ~echo
    stretch = np.concatenate(([0], np.cumsum(~train.joined)))
    left = np.concatenate(([0], np.cumsum(kept)))
    return Train(train.x[kept], None, np.diff(stretch[kept]) == 0, left[train.starts])
