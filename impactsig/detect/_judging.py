"""Which events of a force record are impacts, by what was found in the seconds around them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._compiled import njit
from ..impacts import OPEN_END, OPEN_START, UNRESOLVED
from ._false_alarms import discovery_level
from ._ladder import HALF_SINE_GAIN, MATCH
from ._mains import BASES
from ._neighbor_kernels import lobes, ringing
from ._order_kernels import quantile
from ._pulse import NO_PULSE
from ._spans import LEAST, Grid, Span

FLOOR = 0.005
"""Of the height of the strong ones around: the least automatic threshold."""
SEVERAL = 5
"""Events that tell what width is usual."""
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
        self.widest = MATCH * grid.longest
        self.shortest = shortest * grid.rate
        self.level = level
        near = near[near[:, 1] <= self.widest]
        samples = seconds * grid.rate
        clear = near[near[:, 3] >= 2 * LEAST]
        clear = clear if len(clear) else near
        self.usual = float(quantile(clear[:, 1], 0.5)) if len(clear) else 1.0
        self.height = float(quantile(clear[:, 2], 0.97))
        alike = self._alike(near) & (len(clear) >= SEVERAL)
        self.level_else = discovery_level(near[~alike, 3], 2.0 * samples, seconds)
        self.usual_level = self.level_else
        if alike.any():
            usual = discovery_level(near[alike, 3], 4.0 * samples / self.usual, seconds)
            self.usual_level = min(usual, self.level_else)
        self.near = near[self._high(near)]
        self.in_step = in_step_with_mains(self.near, grid.rate)

    def _alike(self, events: np.ndarray) -> np.ndarray:
        """Whether their widths are about the usual one, as far as noise lets it be seen."""
        return np.abs(np.log(events[:, 1] / self.usual)) < math.log(3.0)

    def _high(self, events: np.ndarray) -> np.ndarray:
        if self.level.unit is not None:
            return np.ones(len(events), bool)  # the search went by it
        if self.level.sigma is not None:
            return events[:, 3] >= self.level.sigma
        levels = np.where(self._alike(events), self.usual_level, self.level_else)
        return (events[:, 3] >= levels) & (events[:, 2] >= FLOOR * self.height)

    def too_wide(self, events: np.ndarray) -> np.ndarray:
        """Events that no contact is as long as."""
        return (events[:, 1] > self.widest) & self._high(events)

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


@njit(nogil=True)
def consistent(rows, total, shortest):
    """Measured pulses about as long and as high as their responses say, and not too short.

    A neighbour in the flanks makes the width too narrow, seldom too wide. At an end of the
    stretch, where a response has one flank only, a pulse is under way or there is none.
    """
    kept = at_end(rows, total)
    for k in range(len(rows)):
        contact, peak, flags = rows[k, 1], rows[k, 2], int(rows[k, 5])
        length, height = rows[k, 7] / MATCH, rows[k, 9]
        longest = (3.0 if flags & UNRESOLVED else 10.0) * length + 4.0
        whole = 0.25 * length < contact < longest and contact >= shortest
        whole = whole and 0.4 * height < peak < 2.5 * height
        under_way = flags != NO_PULSE and (flags & (OPEN_START | OPEN_END)) > 0
        if kept[k]:
            kept[k] = under_way or (whole and flags == 0)
        else:
            kept[k] = flags != NO_PULSE and whole and not under_way
    return kept


@njit(nogil=True)
def drawn_together(events, group):
    """Widths of events, drawn to those around them by how well either is known.

    The logarithm of a width is uncertain by about 4 over the height in standard deviations of the
    noise (measured on half-sines in white noise).
    """
    drawn = events[:, 1].copy()
    if len(group) == 0:
        return drawn
    logs = np.log(group[:, 1])
    clear = logs[group[:, 3] > 2 * LEAST]
    if len(clear) < 5:
        clear = logs
    middle = quantile(clear, 0.5)
    spread = max(0.05, 1.4826 * quantile(np.abs(clear - middle), 0.5))
    for k in range(len(drawn)):
        own, error = np.log(drawn[k]), 4.0 / events[k, 3]
        if abs(own - middle) < 3 * np.hypot(spread, error):
            weight = spread**2 / (spread**2 + error**2)
            drawn[k] = np.exp(weight * own + (1 - weight) * middle)
    return drawn


@njit(nogil=True)
def worst(bad, sure):
    """The bad ones that are no surer than a bad one beside them, which may be bad for them."""
    out = bad.copy()
    for k in range(len(bad)):
        for beside in (k - 1, k + 1):
            if 0 <= beside < len(bad) and bad[beside] and sure[k] > sure[beside]:
                out[k] = False
    return out


@njit(nogil=True)
def alone(rows):
    """Which pulses are the higher ones where two share half of the first one's contact."""
    kept = np.ones(len(rows), np.bool_)
    for i in range(1, len(rows)):
        if rows[i, 0] < rows[i - 1, 0] + 0.5 * rows[i - 1, 1]:
            kept[i if rows[i, 2] <= rows[i - 1, 2] else i - 1] = False
    return kept


@njit(nogil=True)
def at_end(rows, total):
    """Measured pulses so near to an end of their stretch that they have one flank only."""
    middle = rows[:, 0] + 0.5 * rows[:, 1]
    return np.minimum(middle, total - middle) < 2.5 * rows[:, 7] + 3.0


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
