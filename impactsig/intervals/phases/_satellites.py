"""Satellites: second impacts at a fixed delay after others, such as echoes and ringing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LONGEST = 0.125  # [cycles]
SAME = 0.016  # [cycles] within which delays agree
FEWEST = 8  # satellites, and
LEAST_SHARE = 0.06  # of the impacts that they must be
MOST_SHARE = 0.75  # of the others that have one; a second impact that nearly always comes is a slot


class Satellites(NamedTuple):
    """Which impacts are satellites of the one before."""

    which: np.ndarray  # (n,) bool
    delay: float  # [cycles]
    spread: float  # [cycles] standard deviation of the delay

    @property
    def share(self) -> float:
        """Share of the other impacts that have a satellite."""
        return float(self.which.sum() / max((~self.which).sum(), 1))

    def score(self, floor: float) -> float:
        """Their log-likelihood, less a penalty for share, delay and spread."""
        count, others = int(self.which.sum()), int((~self.which).sum())
        spread = max(self.spread, floor)
        value = -count * (np.log(spread * np.sqrt(2 * np.pi)) + 0.5 * (self.spread / spread) ** 2)
        value += count * np.log(self.share) + (others - count) * np.log1p(-self.share)
        return float(value - 1.5 * np.log(len(self.which)))


def satellites(cycles: np.ndarray) -> Satellites | None:
    """Find the second impacts of close pairs, if many have the same delay."""
    step = np.diff(cycles)
    close = np.flatnonzero((step > 0) & (step < LONGEST))
    least = max(FEWEST, LEAST_SHARE * len(cycles))
    if len(close) < least:
        return None
    delay = np.sort(step[close])
    inside = np.searchsorted(delay, delay + 2 * SAME, side="right") - np.arange(len(delay))
    first = int(np.argmax(inside))
    middle = float(np.median(delay[first : first + inside[first]]))
    alike = close[np.abs(step[close] - middle) <= SAME]
    if len(alike) < least:
        return None
    which = np.zeros(len(cycles), bool)
    which[alike + 1] = True
    found = Satellites(which, middle, float(step[alike].std()))
    return found if found.share <= MOST_SHARE else None
