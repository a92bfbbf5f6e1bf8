"""Functions of the energy on Chebyshev panels, graded towards the minimum and where stops begin.

Below the energy at which the first stop is met, a panel is even in the logarithm of the energy:
powers of any exponent, as wells and forces at their bottoms have, are entire there. Above, it is
even in the square root of what is left at the stop, in which all is analytic again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev

DEGREE = 16
NODES = np.cos(np.pi * (np.arange(DEGREE) + 0.5) / DEGREE)
_TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(NODES, DEGREE - 1))
DECADE = 2.0  # width of a panel in the logarithm of the energy
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(16)
STEP = 3.0  # of the exponent, over which its exponential is integrated by 16 points
TINY = np.finfo(float).tiny
HALVINGS = 52  # of a panel


@dataclass(frozen=True)
class Panels:
    """The panels: panel k holds ``origin[k] + sign[k] g(z)``, z from start[k] to end[k].

    g is exp where `logarithmic`, and the square elsewhere; the sign is -1 below a saddle.
    """

    origin: np.ndarray
    start: np.ndarray
    end: np.ndarray
    logarithmic: np.ndarray
    sign: np.ndarray
    edges: np.ndarray = field(repr=False)

    @property
    def nodes(self) -> np.ndarray:
        """Energies of the nodes, shape (panels, DEGREE)."""
        every = np.arange(len(self.start))[:, None]
        return self.energy(every, NODES)

    def _z(self, panel: np.ndarray, u: np.ndarray) -> np.ndarray:
        return (self.start[panel] + self.end[panel]) / 2 + self._half(panel) * u

    def _half(self, panel: np.ndarray) -> np.ndarray:
        return (self.end[panel] - self.start[panel]) / 2

    def energy(self, panel: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Energies at u from -1 to 1 of the panels."""
        z = self._z(panel, u)
        return self.origin[panel] + self.sign[panel] * np.where(
            self.logarithmic[panel], np.exp(np.where(self.logarithmic[panel], z, 0)), z * z
        )

    def slope(self, panel: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Derivative of the energy by u."""
        z = self._z(panel, u)
        exponential = np.exp(np.where(self.logarithmic[panel], z, 0))
        return (
            self.sign[panel]
            * self._half(panel)
            * np.where(self.logarithmic[panel], exponential, 2 * z)
        )

    def locate(self, energy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Panel of each energy, and the position in it from -1 to 1."""
        panel = np.clip(np.searchsorted(self.edges, energy, side="right") - 1, 0, len(self.end) - 1)
        above = np.maximum(self.sign[panel] * (energy - self.origin[panel]), 0.0)
        logarithmic = self.logarithmic[panel]
        z = np.where(logarithmic, np.log(np.maximum(above, TINY)), np.sqrt(above))
        u = (z - (self.start[panel] + self.end[panel]) / 2) / self._half(panel)
        return panel, np.clip(u, -1.0, 1.0)


def panels(
    least: float,
    greatest: float,
    breaks: dict[float, float],
    foot: float = 0.0,
    head: float = math.inf,
) -> Panels:
    """Panels from the least to the greatest energy, with breaks between.

    To each of these belongs an energy above it, over which functions change that change fastest.
    The first panels are even in the logarithm of the energy above the foot, a bottom or a saddle,
    and where there is a saddle at the head the last in that of the energy below it.
    """
    bounds = [*(at for at in sorted(breaks) if least < at < greatest), greatest]
    if head < math.inf:
        bounds.insert(-1, (max([least, *bounds[:-1]]) + greatest) / 2)
    count = max(1, int(np.ceil(np.log((bounds[0] - foot) / (least - foot)) / DECADE)))
    z = np.linspace(np.log(least - foot), np.log(bounds[0] - foot), count + 1)
    rows = [(foot, a, b, True, 1) for a, b in pairwise(z)]
    for low, high in pairwise(bounds):
        if head < math.inf and high == greatest:
            count = max(1, int(np.ceil(np.log((head - low) / (head - high)) / DECADE)))
            z = np.linspace(np.log(head - low), np.log(head - high), count + 1)
            rows += [(head, a, b, True, -1) for a, b in pairwise(z)]
            continue
        widest = np.sqrt(high - low)
        first = min(np.sqrt(breaks[low]) / 2, widest)
        doublings = int(np.ceil(np.log2(widest / first)))
        z = np.concatenate([[0.0], np.geomspace(first, widest, doublings + 1)])
        rows += [(low, a, b, False, 1) for a, b in pairwise(z)]
    origins, start, end, logarithmic, sign = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    made = Panels(origins, start, end, logarithmic, sign, np.zeros(0))
    edges = np.append(made.energy(np.arange(len(start)), np.array(-1.0)), greatest)
    return Panels(origins, start, end, logarithmic, sign, edges)


def fitted(values: np.ndarray) -> np.ndarray:
    """Chebyshev coefficients of functions given at the nodes, shape (panels, DEGREE)."""
    return values @ _TO_COEFFICIENTS.T


def integrated(coefficients: np.ndarray, start: float) -> np.ndarray:
    """Coefficients of the integral over u through all panels, one degree higher."""
    whole = chebyshev.chebint(coefficients, lbnd=-1, axis=1)
    ends = whole.sum(axis=1)
    whole[:, 0] += start + np.concatenate([[0.0], np.cumsum(ends)[:-1]])
    return whole


def evaluate(coefficients: np.ndarray, panel: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Evaluate at u in the panels, by Clenshaw's recurrence."""
    own = coefficients.T
    later = later_still = np.zeros(u.shape)
    for k in range(len(own) - 1, 0, -1):
        later, later_still = 2 * u * later - later_still + own[k][panel], later
    return u * later - later_still + own[0][panel]


def roots(coefficients: np.ndarray) -> list[tuple[int, float]]:
    """Panels and positions of all roots, in order; panels without a root are skipped."""
    found = []
    bound = np.abs(coefficients[:, 1:]).sum(axis=1)
    for k in np.flatnonzero((np.abs(coefficients[:, 0]) <= bound) & (bound > 0)):
        row = coefficients[k] / np.abs(coefficients[k]).max()
        every = chebyshev.chebroots(row)
        real = every[(np.abs(every.imag) < 1e-9) & (np.abs(every.real) <= 1)].real
        found += [(int(k), float(u)) for u in np.sort(real)]
    return found


def mesh(
    grid: Panels, exponent: Callable[[np.ndarray, np.ndarray], np.ndarray], floor: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Pieces of the panels in which the exponent hardly varies, above a floor.

    Returns
    -------
    panel, low, high, energy : ndarray
        Panel of each piece, where it begins and ends in it, and the energies of its ends (n, 2).
    """
    panel = np.arange(len(grid.start))
    low, high = np.full(len(panel), -1.0), np.full(len(panel), 1.0)
    look = np.linspace(0, 1, 2 * DEGREE + 1)
    kept = []
    for _ in range(HALVINGS):
        u = low[:, None] + (high - low)[:, None] * look
        seen = exponent(panel[:, None], u)
        most = seen.max(axis=1)
        varies = most - seen.min(axis=1)
        # Between the points looked at it may be higher, by no more than it varies over them.
        counts = most + varies > floor
        fine = varies <= STEP
        kept.append(np.array([panel, low, high])[:, counts & fine])
        left = counts & ~fine
        if not left.any():
            break
        middle = (low + high)[left] / 2
        panel = np.tile(panel[left], 2)
        low, high = np.concatenate([low[left], middle]), np.concatenate([middle, high[left]])
        look = np.linspace(0, 1, 5)  # halves of what was looked at closely
    pieces = np.concatenate(kept, axis=1)
    panels_of, low, high = pieces[:, np.lexsort((pieces[1], pieces[0]))]
    panel = panels_of.astype(int)
    return panel, low, high, np.stack([grid.energy(panel, low), grid.energy(panel, high)], axis=1)
