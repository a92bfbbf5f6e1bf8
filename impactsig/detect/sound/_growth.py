"""How far instants of attacks scatter because the sounds of a record begin gradually.

Where power grows at a rate g [1/s], an impact whose power is a factor exp(v) above that of another
is found v / g earlier. Attacks do not show this one by one, but the mean over a record does. With
A and B the mean powers in the first and the second of two equal times t after the attack, beyond
the noise, each sound divided by its energy, g = max_t ln(B / A) / t. The standard deviation of
instants is VARIED / g; and none where the first sound is hardly weaker than any later one, as then
it began at once: with G the logarithm of the greatest power over the first, 1 - exp(-G^2) of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ._growth_kernels import AFTER, NOISE, SLICE, add_powers, spread_of

LEAST = 5  # sounds that show it


@dataclass
class Growth:
    """Mean power of the sounds of a record about their attacks, which lie at `before`."""

    rate: float
    before: int
    lead: int = field(init=False)  # samples before the attack that are kept
    total: np.ndarray = field(init=False)
    count: int = 0

    def __post_init__(self) -> None:
        quiet, heard = (round(SLICE * self.rate * slices) + 1 for slices in (NOISE[1], AFTER))
        self.lead = min(quiet, self.before)
        self.total = np.zeros(self.lead + heard)

    def add(self, sounds: np.ndarray, likely: np.ndarray) -> None:
        """Add the `likely` ones of sounds (n, length); those of hardly any energy do not count."""
        first = np.where(likely, self.before - self.lead, -1)
        self.count += add_powers(sounds, first, self.lead, self.total)

    def spread(self) -> float:
        """Standard deviation of the instants that comes of it [samples]."""
        return spread_of(self.total, self.lead, self.rate) if self.count >= LEAST else 0.0
