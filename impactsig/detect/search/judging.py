"""Decision which events of a force record are impacts, from the seconds around them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..instrument.mains import BASES
from ..signal.grid import Grid
from ..signal.ladder import FACTOR, HALF_SINE_GAIN, MATCH
from ..signal.order_kernels import quantile
from ..signal.probability import LOWEST, probabilities, trials_about
from .events.width_kernels import EVENT
from .judging_kernels import (
    SEVERAL,
    UNLIKE,
    apart,
    certainty,
    levels,
    lobes,
    ringing,
    strong_enough,
)
from .span import Faint, Span

FAINT_FLOOR = 0.02
"""The same for fainter ones than are certain, which a sensor's ringing may be."""
FAINT, IN_STEP = 12.0, 0.98
"""Standard deviations of what may be interference, and how well it keeps the mains' phase."""
EACH = 1.5
"""Periods of the mains that it comes after, at most: a machine may be driven at a third of it."""
APART, BORDERS = 3.0, 0.75
"""Widths of an impact to either side in which no fainter one is looked for; half of its length, by
which it reaches into the flanks of a response, which it draws down."""
IN_FLANKS = 0.2
"""Crests of noise that still rise above LOWEST there, beside those elsewhere."""
DRAWING = 4.0
"""Standard deviations from which on so does what may be one."""
LITTLE, SOME = 1.5, 0.06
"""Times the level of certainty that a faint impact stands at most, and their least share of all."""
LEAST_WIDTH = 3.0
"""Samples: a faint pulse that is narrower cannot be told from a glitch, or from ringing."""
SURE = 1.5
"""Standard deviations less than counted, of crests of noise that go down."""
LEAST_FREE = 0.01
"""Share of the time in which crests of noise are looked for, at least."""
_NONE = np.empty(0)
LEAST_SAMPLES = 32
"""A shorter stretch shows no noise to tell an impact from."""


class Level(NamedTuple):
    """Threshold of a response: in the unit, in sigma, or as a probability."""

    unit: float | None = None
    sigma: float | None = None
    least_probability: float = 0.5

    @property
    def given(self) -> bool:
        """Whether it is a threshold of the response rather than a probability."""
        return self.unit is not None or self.sigma is not None


class Judge:
    """Decides which events are impacts, from those of the seconds around.

    Parameters
    ----------
    near : array (n, EVENT)
        All events of these seconds.
    """

    def __init__(
        self, near: np.ndarray, seconds: float, grid: Grid, level: Level, shortest: float
    ) -> None:
        self.grid, self.longest = grid, grid.longest
        self.widest = MATCH * grid.longest
        self.shortest = shortest * grid.rate
        self.level = level
        self.events, self.samples = near, seconds * grid.rate
        self.fits = near[:, 1] <= self.widest
        fitting = near[self.fits]
        self.usual, self.height, self.usual_level, level_else = levels(
            fitting, self.samples, seconds
        )
        self.probability = np.empty(len(near))
        certainty(near, self.usual, self.usual_level, level_else, self.probability)
        self.strong = np.empty(len(near), np.bool_)
        strong_enough(near, self.usual, self.usual_level, self.height, self.strong)
        self.certain = (self.probability >= 0.5) & self.strong
        self._choose(self.certain if not level.given else self._given())
        self.faint, self.faint_probability = np.empty((0, EVENT)), np.empty(0)

    def _given(self) -> np.ndarray:
        if self.level.sigma is not None:
            return self.events[:, 3] >= self.level.sigma
        return np.ones(len(self.events), bool)  # the search went by the level

    def _choose(self, high: np.ndarray) -> None:
        """Select possible impacts among the events that are high enough."""
        self.high, events = high, self.events
        self.near = events[self.fits & high]
        self.in_step = not self.level.given and in_step_with_mains(self.near, self.grid.rate)
        self.passing = self.fits & high & (not self.in_step)
        if self.usual >= 4.0:
            self.passing &= events[:, 1] > 1.0  # one sample among pulses of many: a glitch
        elif self.usual < 3.0:
            self.passing &= ~self._lobes(events)
        self.passing &= ~self._rings(events)

    @property
    def too_wide(self) -> np.ndarray:
        """Mask of the events that are longer than a contact."""
        return self.high & ~self.fits

    def _rings(self, events: np.ndarray) -> np.ndarray:
        """Mask of ringing events: narrower and far weaker than one just before."""
        rings = np.empty(len(events), np.bool_)
        ringing(events, self.near, rings)
        return rings

    def _lobes(self, events: np.ndarray) -> np.ndarray:
        """Mask of possible side lobes of a filter beside a greater event."""
        beside = np.empty(len(events), np.bool_)
        lobes(events, self.near, beside)
        return beside

    def rung(self) -> int | None:
        """Width at which to search for fainter impacts; None if there is no sign of any.

        Several impacts show which width, and that some stand little above the level of certainty
        shows that others may lie below it.
        """
        group = self.passing & self.certain
        heights = self.events[group, 3]
        little = np.count_nonzero(heights < LITTLE * self.usual_level)
        if len(heights) < SEVERAL:
            return None
        width = quantile(self.events[group, 1], 0.5)
        if little < SOME * len(heights) or width < LEAST_WIDTH:
            self._weigh_found(width, bool(little))
            return None
        return int(np.argmin(np.abs(np.log(self.grid.rungs.width / width))))

    def look_again(self, rung: int, seen: list[Faint]) -> None:
        """Add crests of one width, and assign probabilities to all events."""
        events, width = self.events, float(self.grid.rungs.width[rung])
        taken = events[self.certain | self.passing]
        taken = taken[np.argsort(taken[:, 0], kind="stable")]
        taken[:, 1] = np.maximum(taken[:, 1], width)  # a glitch is in responses as wide as they are
        upward = self._apart(np.concatenate([up for up, _ in seen]), taken, APART)
        self.faint = np.zeros((len(upward), EVENT))
        self.faint[:, (0, 2, 3)] = upward[:, (0, 2, 3)]
        self.faint[:, 1] = width
        drawing = np.concatenate((taken, self.faint[upward[:, 3] >= DRAWING]))
        drawing = drawing[np.argsort(drawing[:, 0], kind="stable")]
        flanks = self._flanks(rung)
        every = np.concatenate([down for _, down in seen])
        downward = self._apart(every, drawing, flanks)
        chance = self._weigh(
            width,
            upward[:, 3],
            downward[:, 3],
            IN_FLANKS * self._free(taken, APART) + (1.0 - IN_FLANKS) * self._free(taken, flanks),
            self._free(drawing, flanks),
        )
        every = self._apart(every, taken, flanks)
        chance = np.minimum(chance, _not_as_deep(upward[:, 3], every[:, 3]))
        like = np.abs(np.log(events[:, 1] / width)) < UNLIKE
        self.probability[like & ~self.certain] = 0.0  # their crests at this width speak for them
        bad = self._rings(self.faint) | (upward[:, 3] >= self.usual_level)
        bad |= upward[:, 2] < FAINT_FLOOR * self.height
        if self.usual < 3.0:
            bad |= self._lobes(self.faint)
        self.faint_probability = np.where(bad, 0.0, chance)

    def _weigh_found(self, width: float, little: bool) -> None:
        """Assign probabilities to events of a width at which no fainter ones are looked for.

        What is not certain is seen among the certain ones: many of these just above the level are
        no evidence of noise just below it.
        """
        like = np.abs(np.log(self.events[:, 1] / width)) < UNLIKE
        doubtful = like & ~self.certain & self.strong & (self.events[:, 3] > LOWEST)
        if not little and not doubtful.any():
            return
        heights = self.events[doubtful, 3]
        chance = self._weigh(width, heights, _NONE, self.samples, 0.0, trials_about(width))
        self.probability[doubtful] = np.maximum(self.probability[doubtful], chance)

    def _weigh(
        self,
        width: float,
        upward: np.ndarray,
        downward: np.ndarray,
        up: float,
        down: float,
        trials: float = 1.0,
    ) -> np.ndarray:
        """Assign probabilities to the certain events of a width; returns those of upward crests.

        The crests are those of so many samples; noise has so many trials to make an upward one.
        """
        like = np.abs(np.log(self.events[:, 1] / width)) < UNLIKE
        several = self.passing & self.certain & like
        heights = self.events[several, 3]
        n = len(upward)
        out = np.empty(n + len(heights))
        crests = map(np.ascontiguousarray, (upward, downward))  # one layout, compiled once
        probabilities(*crests, heights, up / width, down / width, trials, trials_about(width), out)
        self.probability[several] = np.maximum(self.probability[several], out[n:])
        return out[:n]

    def _flanks(self, rung: int) -> float:
        """Widths to either side of an impact in which it lies in the flanks of a response."""
        rungs = self.grid.rungs
        block = FACTOR ** int(rungs.level[rung])
        return float(rungs.far[rung]) * block / float(rungs.width[rung]) + BORDERS

    def decide(self) -> None:
        """Keep the events that are probable enough."""
        if self.level.given:
            return
        least = self.level.least_probability
        high = (self.probability >= least) & self.strong
        if not np.array_equal(high, self.high):
            self._choose(high)
        if not len(self.faint):
            return
        likely = self.faint_probability >= least
        chosen = self.events[self.passing]
        chosen = chosen[np.argsort(chosen[:, 0], kind="stable")]
        alone = np.empty(len(likely), np.bool_)
        apart(self.faint, chosen, APART, alone)
        likely &= alone
        if in_step_with_mains(self.faint[likely], self.grid.rate):
            likely[:] = False
        self.faint, self.faint_probability = self.faint[likely], self.faint_probability[likely]

    def _free(self, events: np.ndarray, reach: float) -> float:
        """Number of samples farther than `reach` widths from any event."""
        ends = np.maximum.accumulate(events[:, 0] + reach * events[:, 1])
        starts = events[:, 0] - reach * events[:, 1]
        starts[1:] = np.maximum(starts[1:], ends[:-1])
        taken = np.maximum(ends - starts, 0.0).sum()
        return float(max(self.samples - taken, LEAST_FREE * self.samples))

    def _apart(self, crests: np.ndarray, events: np.ndarray, reach: float) -> np.ndarray:
        """Crests farther than `reach` widths from any event, in order of time."""
        crests = crests[np.argsort(crests[:, 0], kind="stable")]
        alone = np.empty(len(crests), np.bool_)
        apart(crests, events, reach, alone)
        return crests[alone]


def one_sided_noise(span: Span, width: float) -> float:
    """Standard deviation of the response with one flank, which includes slow changes."""
    sums = np.concatenate(([0.0], np.cumsum(span.clean)))
    wide = int(width)
    start = np.arange(0, len(span.clean) - 7 * wide, max(1, wide // 4))
    if len(start) < LEAST_SAMPLES:
        return 0.0
    centre = (sums[start + wide] - sums[start]) / wide
    flank = (sums[start + 6 * wide] - sums[start + 2 * wide]) / (4 * wide)
    return HALF_SINE_GAIN * float(np.quantile(np.abs(centre - flank), 0.9)) / 1.645


def in_step_with_mains(events: np.ndarray, rate: float) -> bool:
    """Whether weak events recur once per mains period, as switching does."""
    if len(events) < SEVERAL or events[:, 3].max() > FAINT:
        return False
    usual = float(np.median(np.diff(np.sort(events[:, 0])))) / rate
    for mains in BASES:
        if usual * mains > EACH:
            continue
        turns = np.exp(2j * np.pi * mains * events[:, 0] / rate)
        if abs(turns.mean()) > IN_STEP:
            return True
    return False


def _not_as_deep(upward: np.ndarray, downward: np.ndarray) -> np.ndarray:
    """Greatest probabilities of upward crests, by how many downward ones are at least as high.

    Noise goes as far down as up, also where it swells and has more high crests than Gaussian noise.
    """
    higher = len(downward) - np.searchsorted(np.sort(downward), upward)
    least = np.maximum(higher - SURE * np.sqrt(higher) - 1.0, 0.0)
    all_higher = len(upward) - np.searchsorted(np.sort(upward), upward)
    return np.asarray(np.maximum(1.0 - least / all_higher, 0.0))
