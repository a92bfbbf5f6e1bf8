"""How far instants of attacks scatter because the sounds of a record begin gradually.

Where power grows at a rate g [1/s], an impact whose power is a factor exp(v) above that of another
is found v / g earlier. Attacks do not show this one by one, but the mean over a record does. With
A and B the mean powers in the first and the second of two equal times t after the attack, beyond
the noise, each sound divided by its energy, g = max_t ln(B / A) / t. The standard deviation of
instants is VARIED / g; and none where the first sound is hardly weaker than any later one, as then
it began at once: with G the logarithm of the greatest power over the first, 1 - exp(-G^2) of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ._growth_kernels import add_powers

SLICE = 0.125e-3  # [s]
SPANS = 1, 2, 4  # slices in each of the two times
NOISE = 2, 8  # slices before the attack in which noise is measured
PEAK = 2  # slices of the greatest power
AFTER = 24  # slices after the attack in which that is looked for
VARIED = 0.5  # standard deviation of the logarithm of the power of sounds at the same age
FAINTEST = 1e-300  # energy whose reciprocal is finite
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
        first = self.before - self.lead
        self.count += add_powers(sounds, likely, first, self.lead, FAINTEST, self.total)

    def spread(self) -> float:
        """Standard deviation of the instants that comes of it [samples]."""
        return spread_of(self.total, self.lead, self.rate) if self.count >= LEAST else 0.0


def spread_of(total: np.ndarray, before: int, rate: float) -> float:
    """Standard deviation [samples] of instants about which sounds have this power in `total`.

    It is 0 where the rate is too low, or `total` too short before `before`, to tell.
    """
    size = SLICE * rate
    last = min(AFTER, int((len(total) - before) / size))
    edges = before + np.rint(size * np.arange(-NOISE[1], last + 1)).astype(int)
    if size < 1.0 or edges[0] < 0:
        return 0.0
    slices, widths = np.diff(np.concatenate(([0.0], np.cumsum(total)))[edges]), np.diff(edges)
    quiet = slice(0, NOISE[1] - NOISE[0])
    noise = slices[quiet].sum() / widths[quiet].sum()
    power = (slices / widths - noise)[NOISE[1] :]
    growth = 0.0
    for span in SPANS:
        first, second = power[:span].mean(), power[span : 2 * span].mean()
        if second > first > 0.0:
            growth = max(growth, math.log(second / first) / (span * size))
    level = np.convolve(power, np.full(PEAK, 1.0 / PEAK), mode="valid")
    at, greatest = int(level.argmax()), level.max()
    if not (greatest > level[0] > 0.0 and growth > 0.0):
        return 0.0
    rise = math.log(greatest / level[0])
    growth = max(growth, rise / (at * size))  # as it is until then on the mean
    return -VARIED / growth * math.expm1(-(rise**2))
