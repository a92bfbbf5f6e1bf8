"""Which events of a force record are impacts, by what was found in the seconds around them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ._grid import Grid
from ._judging_kernels import SEVERAL, high, levels, lobes, ringing
from ._ladder import HALF_SINE_GAIN, MATCH
from ._mains import BASES
from ._spans import Span

FLOOR = 0.005
"""Of the height of the strong ones around: the least automatic threshold."""
FAINT, IN_STEP = 12.0, 0.98
"""Standard deviations of what may be interference, and how well it keeps the mains' phase."""
LEAST_SAMPLES = 32
"""A shorter stretch shows no noise to tell an impact from."""


class Level(NamedTuple):
    """What a response must reach: in the unit, or in its own noise; None for either."""

    unit: float | None = None
    sigma: float | None = None


class Judge:
    """Which events are impacts, from the events of the seconds around."""

    def __init__(
        self, near: np.ndarray, seconds: float, grid: Grid, level: Level, shortest: float
    ) -> None:
        self.longest = grid.longest
        self.widest = MATCH * grid.longest
        self.shortest = shortest * grid.rate
        self.level = level
        near = near[near[:, 1] <= self.widest]
        samples = seconds * grid.rate
        self.usual, self.height, self.usual_level, self.level_else = levels(near, samples, seconds)
        self.near = near[self._high(near)]
        self.in_step = in_step_with_mains(self.near, grid.rate)

    def _high(self, events: np.ndarray) -> np.ndarray:
        if self.level.unit is not None:
            return np.ones(len(events), bool)  # the search went by it
        if self.level.sigma is not None:
            return events[:, 3] >= self.level.sigma
        return high(events, self.usual, self.usual_level, self.level_else, FLOOR * self.height)

    def too_wide(self, events: np.ndarray) -> np.ndarray:
        """Events that no contact is as long as."""
        wide = events[:, 1] > self.widest
        return wide & self._high(events) if wide.any() else wide

    def passes(self, events: np.ndarray) -> np.ndarray:
        """Events that may be impacts."""
        right = (events[:, 1] <= self.widest) & self._high(events) & (not self.in_step)
        if self.usual >= 4.0:
            right &= events[:, 1] > 1.0  # one sample among pulses of many: a glitch
        elif self.usual < 3.0:
            right &= ~self._lobes(events)
        return right & ~self._rings(events)

    def _rings(self, events: np.ndarray) -> np.ndarray:
        """Events that are the ringing of a sensor: narrower and far weaker than one just before."""
        rings = np.empty(len(events), np.bool_)
        ringing(events, self.near, self.widest, rings)
        return rings

    def _lobes(self, events: np.ndarray) -> np.ndarray:
        """Events that may be the ringing of a filter beside a greater one."""
        beside = np.empty(len(events), np.bool_)
        lobes(events, self.near, beside)
        return beside


def one_sided_noise(span: Span, width: float) -> float:
    """Standard deviation of the response with one flank, which slow changes are seen in."""
    sums = np.concatenate(([0.0], np.cumsum(span.clean)))
    wide = int(width)
    start = np.arange(0, len(span.clean) - 7 * wide, max(1, wide // 4))
    if len(start) < LEAST_SAMPLES:
        return 0.0
    centre = (sums[start + wide] - sums[start]) / wide
    flank = (sums[start + 6 * wide] - sums[start + 2 * wide]) / (4 * wide)
    return HALF_SINE_GAIN * float(np.quantile(np.abs(centre - flank), 0.9)) / 1.645


def in_step_with_mains(events: np.ndarray, rate: float) -> bool:
    """Whether weak events come with the mains, once a period: what switches, not what hits."""
    if len(events) < SEVERAL or events[:, 3].max() > FAINT:
        return False
    for mains in BASES:
        turns = np.exp(2j * np.pi * mains * events[:, 0] / rate)
        if abs(turns.mean()) > IN_STEP:
            return True
    return False
