"""Soft stops in averaging: a spring in the potential, and a loss in each cycle."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...oscillators import Stop

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(32)
POINTS, WEIGHTS = (POINTS + 1) / 2, WEIGHTS / 2
HALVINGS = 52


class Contact(NamedTuple):
    """A soft stop with the force ``stiffness depth^exponent`` and a velocity-dependent part.

    That is ``damping depth'`` of Kelvin and Voigt's, which may end where the force does, and
    ``stiffness depth^exponent loss depth'`` of Hertz's, the loss given or found from the approach
    velocity.
    """

    place: float
    side: int
    stiffness: float
    exponent: float
    damping: float
    loss: float
    by_approach: float | None
    only_pushes: bool

    def push(self, x: np.ndarray) -> np.ndarray:
        """Force of the spring."""
        depth = np.maximum(self.side * (x - self.place), 0.0)
        return self.stiffness * (depth if self.exponent == 1 else depth**self.exponent)

    def lost(self, x: np.ndarray, v: np.ndarray, approach: np.ndarray) -> np.ndarray:
        """Sum of the dissipative forces on the way in and on the way out, at speeds v."""
        if self.by_approach is None:
            return 2 * (self.damping + self.push(x) * self.loss) * v
        with np.errstate(divide="ignore", invalid="ignore"):
            loss = np.where(approach > 0, logarithmic_loss(self.by_approach) / approach, 0.0)
        return 2 * self.push(x) * loss * v

    def not_pulled(
        self,
        potential: Callable[[np.ndarray], np.ndarray],
        mass: float,
        energy: np.ndarray,
        greatest: np.ndarray,
    ) -> np.ndarray:
        """Work [J] that a damper would do by pulling, which a stop that only pushes cannot.

        The stop lets go where ``damping v = stiffness depth``, v the speed on the way out.

        Parameters
        ----------
        potential : callable
            Over displacements, above that at the touch.
        mass : float
        energy, greatest : numpy.ndarray
            Kinetic energies at the touch, positive, and at the bottom.
        """

        def pulling(depth: np.ndarray) -> np.ndarray:
            place = (self.place + self.side * depth).ravel()
            left = (energy - potential(place).reshape(depth.shape).T).T
            v = np.sqrt(2 * np.maximum(left, 0.0) / mass)
            return self.damping * v - self.stiffness * depth

        low = np.zeros(energy.shape)
        high = self.damping * np.sqrt(2 * greatest / mass) / self.stiffness
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            pulls = pulling(middle) > 0
            low, high = np.where(pulls, middle, low), np.where(pulls, high, middle)
        share = POINTS * (2 - POINTS)  # to the root that the speed has where the motion turns
        width = 2 * (1 - POINTS) * WEIGHTS
        return low * (pulling(low[:, None] * share) @ width)

    def scale(self, pressed: float) -> float:
        """Energy above touching at which the spring force equals the preload."""
        return pressed * (pressed / self.stiffness) ** (1 / self.exponent)


@lru_cache(maxsize=64)
def logarithmic_loss(a: float) -> float:
    """Of a loss a by the approach velocity, times that velocity, so that a contact is exact.

    Along the conservative motion the share of the energy 4 a / 3 is lost. What a contact leaves
    follows from ``a - ln(1 + a) = -e a - ln(1 - e a)`` [HuntCrossley1975]_, and
    -2 ln(e) is the rate under which the energy falls to that in a cycle.
    """
    from scipy.optimize import brentq

    if a < 1e-6:
        return a
    spring = a - math.log1p(a)
    left = float(brentq(lambda y: -y - math.log1p(-y) - spring, 0.0, a, xtol=1e-15))
    return -1.5 * math.log(left / a)


def contact(stop: Stop) -> Contact:
    """The contact of a soft stop."""
    law, row = stop.law, stop.law.row()
    damping, loss = (row.loss, 0.0) if law.linear else (0.0, row.loss)
    return Contact(
        stop.position, stop.sign, row.stiffness, row.exponent, damping, loss, law.by_approach,
        law.only_pushes,
    )  # fmt: skip
