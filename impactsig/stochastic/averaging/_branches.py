"""The averaged density of an oscillator over its families of orbits, which form a tree.

No probability flows along any of them, as the tree has no loops; so the joint density is
continuous at each saddle, where the exponents of the families that meet are equal.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...oscillators import Oscillator
from ._curve import Curve, curve, whole
from ._families import Family, families
from ._scope import SADDLE, greatest_of, least_of, rates
from ._well import conservative


@dataclass(frozen=True)
class Branches:
    """Densities over the energies of all families, measured from the lowest minimum.

    Attributes
    ----------
    families : tuple of Family
        The tree, its root first.
    curves : tuple of Curve
        The density of each.
    """

    families: tuple[Family, ...]
    curves: tuple[Curve, ...] = field(repr=False)

    @property
    def root(self) -> Family:
        """The family of the highest energies."""
        return self.families[0]

    @property
    def leaves(self) -> list[tuple[Family, Curve]]:
        """The wells, from left to right, and their densities."""
        both = zip(self.families, self.curves, strict=True)
        return sorted(
            (each for each in both if not each[0].children),
            key=lambda each: each[0].wells[0].bottom,
        )

    @property
    def greatest(self) -> float:
        """Energy beyond which the density is negligible."""
        return max(
            own.greatest + family.ground
            for family, own in zip(self.families, self.curves, strict=True)
        )

    @property
    def saddles(self) -> list[float]:
        """Energies at which families meet."""
        return sorted({family.foot for family in self.families if family.children})

    def density(self, energy: np.ndarray) -> np.ndarray:
        """p(H)."""
        found = np.zeros(energy.shape)
        for family, own in zip(self.families, self.curves, strict=True):
            above = energy - family.ground
            here = (above >= family.foot) & (above < family.head)
            found = found + np.where(here, own.density(above), 0.0)
        return found

    def cumulative(self, energy: np.ndarray) -> np.ndarray:
        """Probability of an energy up to that one."""
        found = sum(
            own.cumulative(energy - family.ground)
            for family, own in zip(self.families, self.curves, strict=True)
        )
        return np.minimum(found, 1.0)

    def mean(self, what: Callable[[np.ndarray], np.ndarray]) -> float:
        """Mean of a function of the energy."""
        found = 0.0
        for family, own in zip(self.families, self.curves, strict=True):
            found += own.mean(_of_energy(what, own, family.ground))
            if family.ground > 0:
                found += own.below * float(what(np.array(family.ground)))
        return found

    @property
    def exchange(self) -> float:
        """Share of its energy that a cycle exchanges, the mean over all that is exchanged."""
        return self._mean_share([own.turnover for own in self.curves])

    @property
    def memory(self) -> float:
        """The same within the correlation time of the noise."""
        return self._mean_share([own.memory for own in self.curves])

    def _mean_share(self, shares: list[np.ndarray]) -> float:
        both = zip(self.curves, shares, strict=True)
        return sum(own.exchanged(one) for own, one in both) / sum(
            own.exchanged() for own in self.curves
        )

    def accuracy(self, mean: float) -> float:
        """Greatest relative error of the integrals over a cycle."""
        errors = (own.error for own in self.curves)
        return max(float((error * np.minimum(at / mean, 1.0)).max()) for at, error in errors)

    def joint(self, x: np.ndarray, kinetic: np.ndarray) -> np.ndarray:
        """Joint density at displacements and kinetic energies, broadcast together."""
        x, kinetic = np.broadcast_arrays(x, kinetic)
        total = self.potential(x) + kinetic
        if len(self.families) == 1:
            return self.curves[0].joint(total)
        found = np.zeros(total.shape)
        for family, own in zip(self.families, self.curves, strict=True):
            low, high = family.ends
            above = total - family.ground
            here = (x >= low) & (x <= high) & (above >= family.foot) & (above < family.head)
            found[here] = own.joint(above[here])
        return found

    def potential(self, x: np.ndarray) -> np.ndarray:
        """Potential energy above the lowest minimum."""
        return self.root.potential(x.ravel()).reshape(x.shape) + self.root.ground


def _of_energy(
    what: Callable[[np.ndarray], np.ndarray], own: Curve, ground: float
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """A function of the energy as a function of panel and position."""
    return lambda panel, u: what(own.grid.energy(panel, u) + ground)


def branches(oscillator: Oscillator, impact: str) -> Branches:
    """The densities of all families of an oscillator.

    Raises
    ------
    InvalidInput
        If there is no stationary density.
    """
    tree = families(conservative(oscillator)).walk()
    number = {id(family): k for k, family in enumerate(tree)}
    rough = [rates(oscillator, k, impact) for k in range(len(tree))]

    def highest(k: int) -> float:
        """The exponent's greatest below a family's foot, from that of its foot."""
        most = 0.0
        for child in tree[k].children:
            j = number[id(child)]
            exponent = rough[j][2]
            most = max(most, float((exponent - exponent[-1]).max()), highest(j) - exponent[-1])
        return most

    curves = []
    for k, (family, (energy, rate, exponent)) in enumerate(zip(tree, rough, strict=True)):
        if math.isfinite(family.head):
            greatest = family.head - SADDLE * (family.head - family.foot)
        else:
            greatest = greatest_of(oscillator, energy, rate, exponent, highest(k))
        least = float(energy[0]) if family.children else least_of(energy, rate, greatest)
        curves.append(curve(oscillator, k, least, greatest, impact))
    shifts = [0.0] * len(tree)
    for k, family in enumerate(tree):
        for child in family.children:
            j = number[id(child)]
            shifts[j] = shifts[k] - curves[j].last
    return Branches(tuple(tree), tuple(whole(curves, shifts)))
