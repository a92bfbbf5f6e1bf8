"""Clipping of a sound record: how often its samples lie at the limits.

Between the limits a clipped sound still rises at an impact; while it stays at them it does not, and
where it leaves and reaches them it has edges, which are additional sound. Zero is not a limit: it
is digital silence in a record of magnitudes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ._core_kernels import count_equal

SOME = 16  # samples, one of which is checked
MUCH = 0.02  # share at the limits that a note is worth
ALL = 0.98  # share at the limits of a record of two values
FEWEST = 25  # checked samples that say something of the record


@dataclass
class Limits:
    """Least and greatest sample, and how many of some samples equal them."""

    least: float = math.inf
    greatest: float = -math.inf
    at_least: int = 0
    at_greatest: int = 0
    seen: int = 0

    def add(self, samples: np.ndarray, least: float, greatest: float) -> None:
        """Add the next samples, between their least and greatest."""
        if least < self.least:
            self.least, self.at_least = least, 0
        if greatest > self.greatest:
            self.greatest, self.at_greatest = greatest, 0
        at_least, at_greatest = count_equal(samples, SOME, self.least, self.greatest)
        self.seen += -(-len(samples) // SOME)
        self.at_least += at_least
        self.at_greatest += at_greatest

    @property
    def size(self) -> float:
        """Greatest magnitude; 0 if there are no samples."""
        return max(-self.least, self.greatest, 0.0) if self.seen else 0.0

    @property
    def share(self) -> float:
        """Fraction of the samples that lie at the limits."""
        limits = ((self.least, self.at_least), (self.greatest, self.at_greatest))
        return sum(count for limit, count in limits if limit) / max(self.seen, 1)

    @property
    def two_valued(self) -> bool:
        """Whether nearly all samples are the least or the greatest, and many are either."""
        seen, counts = self.seen, (self.at_least, self.at_greatest)
        return seen >= FEWEST and sum(counts) > ALL * seen and min(counts) > MUCH * seen

    def notes(self) -> tuple[str, ...]:
        """A note if the record has two values, or much of it is clipped."""
        if self.two_valued:
            return (
                f"Nearly all samples are {self.least:g} or {self.greatest:g}: the signal is a "
                "logic level, or it hardly exceeds a step of the converter. Record with a higher "
                "gain.",
            )
        if self.seen < FEWEST or self.share < MUCH:
            return ()
        return (
            f"{100 * self.share:.0f} % of the samples lie at the limits of the record, which is "
            "clipped: impacts may be missed while it stays there. Record with a lower gain.",
        )
