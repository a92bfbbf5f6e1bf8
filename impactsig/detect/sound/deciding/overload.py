"""Sound that an overload had pushed aside, distinguished from impacts.

While an overloaded microphone, amplifier or converter is near its limit it passes nothing else, so
each time a loud low tone (a bass drum, a resonating panel) leaves the limit, whatever else sounds
returns at once: narrow bands rise as they do at an impact, but only to what they had before. With
P_b the greatest power of a narrow band from 2 to 26 ms after the attack, and Q_b the greatest of
the band and its neighbours from 45 to 12 ms before it,

    N = 1/m sum_b max(0, ln(P_b / Q_b))

is what is new. If at least 5 % of the samples from 30 ms before the attack to 15 ms after it are
beyond 0.8 of the record's limits, and the evidence from octaves (`_octave_evidence.py`) is below
0.35, the log-odds of an impact are at most

    4 ln((N + 0.02) / 0.07).

Limits are soft as well as hard, so it does not matter whether samples are equal to them. Where
likely rises come 20 a second and more, they are not asked: the last impact is as loud as the next.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .._kernels import GROUP, Scale
from .._nearby import places_about
from ..powers.bands import Spectrum
from ._overload_kernels import newness, number_beyond

NEAR_LIMIT, LOADED = 0.8, 0.05  # of half the range, and share of samples beyond it
LOADED_WITHIN = 30e-3, 15e-3  # [s], before and after the attack
CROWD_WITHIN, CROWD = 0.25, 10  # [s], and others within it on either side that are not asked
OCTAVES = 0.35  # evidence of impacts that do not depend on narrow bands
BEFORE, SINCE, AFTER = (45e-3, 12e-3), 2e-3, 26e-3  # [s]
TOGETHER = 32  # stretches whose frames are transformed side by side
SLOPE, NONE, EVEN = 4.0, 0.02, 0.07  # of the log-odds, N of nothing, and N + NONE of even odds


def may_be_edges(instant: np.ndarray, by_octaves: np.ndarray) -> np.ndarray:
    """Which rises at these instants [s], in order, are sparse and little shown by octaves."""
    first, last = places_about(instant, instant, CROWD_WITHIN, CROWD_WITHIN)
    return np.asarray((by_octaves < OCTAVES) & (last - first <= CROWD))


@dataclass
class Overload:
    """Greatest log-odds that the rises of a record may have, as edges of an overload.

    `limits` are the least and the greatest sample of the record. Stretches about rises wait until
    TOGETHER of them are there, since many frames are transformed side by side.
    """

    limits: tuple[float, float]
    spectrum: Spectrum
    scale: Scale
    rate: float
    found: list[np.ndarray] = field(default_factory=list)
    waiting: list[tuple[np.ndarray, int]] = field(default_factory=list)  # where their odds belong

    def __post_init__(self) -> None:
        hop, size = GROUP * self.scale.hop, len(self.spectrum.bands.window)
        first = -(-round(BEFORE[0] * self.rate) // hop)
        frames = first + round(AFTER * self.rate) // hop + 1
        past = first - round(BEFORE[1] * self.rate) // hop + 1
        fresh = first + -(-round(SINCE * self.rate) // hop)
        self.frames = past, fresh, frames
        self.lead, self.rest = first * hop + size // 2, (frames - first) * hop + size // 2
        self.wide = frames - 1 + -(-size // hop)  # frames that begin in a stretch
        self.stretches = np.empty((TOGETHER, self.wide * hop))  # those that wait

    def add(self, x: np.ndarray, attack: np.ndarray, asked: np.ndarray) -> None:
        """Add rises with these attacks, places in x; `asked` is which of them `may_be_edges`."""
        odds = np.full(len(attack), np.inf)
        self.found.append(odds)
        if not asked.any():
            return
        place = np.ceil(attack).astype(np.int64)
        which = np.flatnonzero(asked & (place >= self.lead) & (place + self.rest < len(x)))
        if not len(which):
            return
        low, high = self.limits
        early, late = (round(t * self.rate) for t in LOADED_WITHIN)
        beyond = np.empty(len(which), np.int64)
        away = NEAR_LIMIT * 0.5 * (high - low)
        number_beyond(x, place[which] - early, early + late, 0.5 * (low + high), away, beyond)
        for k in which[beyond >= LOADED * (early + late)]:
            begin = place[k] - self.lead
            self.stretches[len(self.waiting)] = x[begin : begin + self.stretches.shape[1]]
            self.waiting.append((odds, k))
            if len(self.waiting) == TOGETHER:
                self._settle()

    def odds(self) -> np.ndarray:
        """The greatest log-odds of all rises; infinite if they were not asked for."""
        self._settle()
        return np.concatenate([np.empty(0), *self.found])

    def _settle(self) -> None:
        """Determine the odds of the rises whose stretches wait."""
        count = len(self.waiting)
        if not count:
            return
        past, fresh, frames = self.frames
        begins = self.wide * np.arange(count)
        half = len(self.spectrum.bands.window) // 2
        power = self.spectrum.powers(self.stretches[:count].ravel(), half, int(begins[-1]) + frames)
        new = np.empty(count)
        newness(power, begins, past, fresh, frames, new)
        for (odds, k), most in zip(self.waiting, SLOPE * np.log((new + NONE) / EVEN), strict=True):
            odds[k] = most
        self.waiting = []
