"""Expected number of errors in the impacts of a sound record, from the probabilities of all rises.

Of the rises that are likely impacts, the sum of the probabilities is the expected number of
impacts, and the difference to their number that of false ones; the sum over the others is the
expected number of missed ones. Those below POSSIBLE are not counted: they are many, and noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

EVEN, POSSIBLE = 0.5, 0.1  # probabilities of a likely impact, and of one that counts
CLEAR = 0.9  # expected F1 of a record that leaves little doubt
LEAST = 5.0  # expected impacts of a record that has any
STEP = 1.5  # of the log-odds, in which crests nearly even are counted


@dataclass
class Doubt:
    """Expected numbers of right, false and missed impacts, and how many rises are nearly even.

    `improbable`, `below` and `above` are the numbers whose log-odds lie from -3 to -1.5, from there
    to 0, and from 0 to 1.5.
    """

    right: float = 0.0
    false: float = 0.0
    missed: float = 0.0
    improbable: int = 0
    below: int = 0
    above: int = 0

    def add(self, probability: np.ndarray, odds: np.ndarray) -> None:
        """Add rises with these probabilities, and the logarithms of their odds."""
        edges = -2.0 * STEP, -STEP, 0.0, STEP
        rare, unlikely, uneven, most = np.sort(odds).searchsorted(edges).tolist()
        self.improbable += unlikely - rare
        self.below += uneven - unlikely
        self.above += most - uneven
        likely = probability[probability >= EVEN]
        others = probability[(probability < EVEN) & (probability > POSSIBLE)]
        self.right += float(likely.sum())
        self.false += float((1.0 - likely).sum())
        self.missed += float(others.sum())

    def turn(self, before: np.ndarray, after: np.ndarray) -> None:
        """Account for likely rises whose probabilities fell since they were added."""
        gone = (before >= EVEN) & (after < EVEN)
        if not np.count_nonzero(gone):
            return
        self.right = max(self.right - float(before[gone].sum()), 0.0)
        self.false = max(self.false - float((1.0 - before[gone]).sum()), 0.0)
        self.missed += float(after[gone & (after > POSSIBLE)].sum())

    @property
    def f1(self) -> float:
        """Expected F1."""
        return 2.0 * self.right / max(2.0 * self.right + self.false + self.missed, 1e-300)

    def notes(self) -> tuple[str, ...]:
        """A note if much is expected to be missed or false."""
        if self.right < LEAST or self.f1 >= CLEAR:
            return ()
        return (
            "Impacts are hard to tell in this record: by their probabilities, about "
            f"{self.false:.0f} of {self.right + self.false:.0f} likely ones are none, and about "
            f"{self.missed:.0f} of the less likely ones are impacts. A higher least_probability "
            "finds fewer, a lower one more.",
        )
