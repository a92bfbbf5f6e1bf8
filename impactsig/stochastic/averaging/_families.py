"""Families of orbits: within one well, or over several wells above their saddles.

Two saddles of the height at which an orbit passes both bound no family: it begins above them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise

import numpy as np

from ._well import Conservative, Well, wells

SAME = 1e-9  # relative difference of saddles that count as equally high


@dataclass(frozen=True)
class Family:
    """Orbits that pass through the same wells.

    Attributes
    ----------
    wells : tuple of Well
        Which these are, from left to right.
    grounds : tuple of float
        Energies of their bottoms [J above the lowest of all].
    ground : float
        That from which energies of the family are measured: of the bottom of its one well, and of
        the lowest of all where it has several.
    foot : float
        The highest saddle within it, or the bottom; its orbits are above.
    head : float
        Energy of the lowest saddle beside it, infinite where there is none.
    children : tuple of Family
        What it is made of below its foot.
    """

    wells: tuple[Well, ...] = field(repr=False)
    grounds: tuple[float, ...]
    ground: float
    foot: float
    head: float
    children: tuple[Family, ...] = field(repr=False)

    @property
    def ends(self) -> tuple[float, float]:
        """Displacements that bound its wells, as far as they are known."""
        (left, _), (_, right) = self.wells[0].sides, self.wells[-1].sides
        return self.wells[0].bottom - left.reach, self.wells[-1].bottom + right.reach

    @property
    def edge(self) -> float:
        """Least energy at which an orbit escapes over an outer barrier."""
        outer = zip(
            (self.wells[0].sides[0], self.wells[-1].sides[1]),
            (self.grounds[0], self.grounds[-1]),
            strict=True,
        )
        open_ends = (
            side.top + ground - self.ground
            for side, ground in outer
            if not (side.stop or side.saddle)
        )
        return min(open_ends, default=math.inf)

    def potential(self, x: np.ndarray) -> np.ndarray:
        """Potential on the family's energy scale; infinite beyond its wells."""
        found = np.full(x.shape, np.inf)
        for well, ground in zip(self.wells, self.grounds, strict=True):
            found = np.minimum(found, well.potential(x) + (ground - self.ground))
        return found

    def walk(self) -> list[Family]:
        """The family and all families below it."""
        return [self, *(each for child in self.children for each in child.walk())]


@lru_cache(maxsize=16)
def families(part: Conservative) -> Family:
    """All orbits of an oscillator, as a tree whose leaves are its wells.

    Raises
    ------
    InvalidInput
        If there is no well.
    """
    found = wells(part)
    heights = [0.0]
    for here, there in pairwise(found):
        heights.append(heights[-1] + here.sides[1].top - there.sides[0].top)
    grounds = tuple(height - min(heights) for height in heights)
    saddles = tuple(
        well.sides[1].top + ground for well, ground in zip(found[:-1], grounds[:-1], strict=True)
    )
    return _family(found, grounds, saddles, math.inf)


def _family(
    wells: tuple[Well, ...], grounds: tuple[float, ...], saddles: tuple[float, ...], head: float
) -> Family:
    """The family of these wells up to an energy."""
    if len(wells) == 1:
        return Family(wells, grounds, grounds[0], 0.0, head - grounds[0], ())
    foot = max(saddles)
    cuts = [k + 1 for k, saddle in enumerate(saddles) if saddle >= foot * (1 - SAME)]
    children = tuple(
        _family(wells[a:b], grounds[a:b], saddles[a : b - 1], foot)
        for a, b in pairwise([0, *cuts, len(wells)])
    )
    return Family(wells, grounds, 0.0, foot, head, children)
