"""The exponent of an averaged density over the energy, and the integrals over the density."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..oscillators import Oscillator
from ._averaging_cycles import cycles
from ._averaging_panels import (
    NODES, POINTS, WEIGHTS, Panels, evaluate, fitted, integrated, mesh, panels, roots,
)  # fmt: skip
from ._averaging_well import Well

FAR = 50.0  # exponent below its greatest, from where on the density is left out


@dataclass(frozen=True)
class Curve:
    """An averaged density as a function of the energy.

    Attributes
    ----------
    grid : Panels
        Of the functions below, which are Chebyshev coefficients.
    exponent : numpy.ndarray
        Logarithm of the joint density.
    balance : numpy.ndarray
        Its derivative by the energy.
    weight : numpy.ndarray
        Logarithm of dA/dH, by which p(H) differs from the joint density.
    turnover : numpy.ndarray
        Logarithm of the share of its energy that a cycle exchanges.
    accuracy : float
        As of `AveragedDensity`.
    below, power : float
        Probability of energies below the panels, and the power of the energy that p(H) is there.
    panel, low, high, ends, mass : numpy.ndarray
        Pieces in which the exponent hardly varies: their panels, where they lie in them, their
        energies (n, 2) and their probabilities.
    """

    grid: Panels
    exponent: np.ndarray = field(repr=False)
    balance: np.ndarray = field(repr=False)
    weight: np.ndarray = field(repr=False)
    turnover: np.ndarray = field(repr=False)
    accuracy: float
    below: float
    power: float
    panel: np.ndarray = field(repr=False)
    low: np.ndarray = field(repr=False)
    high: np.ndarray = field(repr=False)
    ends: np.ndarray = field(repr=False)
    mass: np.ndarray = field(repr=False)

    @property
    def greatest(self) -> float:
        """Energy beyond which the density counts as 0."""
        return float(self.ends[-1, 1])

    def log_joint(self, energy: np.ndarray) -> np.ndarray:
        """Logarithm of the joint density."""
        return evaluate(self.exponent, *self.grid.locate(energy))

    def joint(self, energy: np.ndarray) -> np.ndarray:
        """The joint density at points of that energy, which may be infinite."""
        within = energy <= self.greatest
        return np.where(within, np.exp(self.log_joint(np.where(within, energy, 0.0))), 0.0)

    def density(self, energy: np.ndarray) -> np.ndarray:
        """p(H)."""
        least = self.grid.edges[0]
        inside = np.clip(energy, least, self.greatest)
        panel, u = self.grid.locate(inside)
        found = np.exp(evaluate(self.exponent, panel, u) + evaluate(self.weight, panel, u))
        low = (energy >= 0) & (energy < least)
        # At the bottom 1/T may be any power; that of a parabola is known but for rounding.
        power = 0.0 if abs(self.power) < 1e-6 else self.power
        with np.errstate(divide="ignore"):
            found[low] *= (energy[low] / least) ** power
        return np.where((energy < 0) | (energy > self.greatest), 0.0, found)

    def cumulative(self, energy: np.ndarray) -> np.ndarray:
        """Probability of an energy up to that one."""
        before = self.below + np.concatenate([[0.0], np.cumsum(self.mass)])
        piece = np.searchsorted(self.ends[:, 0], energy, side="right") - 1
        inside = np.clip(piece, 0, None)
        found, u = self.grid.locate(energy)
        # What lies beyond its piece, where nothing was counted, is the whole piece.
        beyond = (found != self.panel[inside]) | (energy >= self.ends[inside, 1])
        to = np.where(beyond, self.high[inside], np.maximum(u, self.low[inside]))
        part = self.between(self.panel[inside], self.low[inside], to)
        return np.where(piece < 0, 0.0, np.minimum(before[inside] + part, 1.0))

    def between(self, panel: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Probability from one place in a panel to another."""
        u = (low + high)[:, None] / 2 + (high - low)[:, None] / 2 * POINTS
        return (self._share(panel[:, None], u) @ WEIGHTS) * (high - low) / 2

    def mean(self, what: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
        """Mean of a function of panel and place, over the energies in the panels."""
        panel, low, high = self.panel[:, None], self.low[:, None], self.high[:, None]
        u = (low + high) / 2 + (high - low) / 2 * POINTS
        return float(((self._share(panel, u) * what(panel, u)) @ WEIGHTS @ (high - low)[:, 0]) / 2)

    def _share(self, panel: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Density by place in the panel."""
        logarithm = evaluate(self.exponent, panel, u) + evaluate(self.weight, panel, u)
        return np.exp(logarithm) * self.grid.slope(panel, u)

    def extrema(self) -> tuple[np.ndarray, np.ndarray]:
        """Energies of the extrema of the joint density, 0 among them; whether each is a maximum."""
        at = roots(self.balance)
        found = self.grid.energy(np.array([k for k, _ in at], int), np.array([u for _, u in at]))
        between = np.concatenate([[self.grid.edges[0]], found, [self.grid.edges[-1]]])
        middle = np.sqrt(between[:-1] * between[1:])
        # A panel's ends may both have, or both miss, a root that is on them.
        falls = evaluate(self.balance, *self.grid.locate(middle)) < 0
        turns = np.concatenate([[True], falls[1:] != falls[:-1]])
        return np.concatenate([[0.0], found])[turns], falls[turns]

    @cached_property
    def even(self) -> np.ndarray:
        """Energies between which the joint density varies little, even if they are shifted."""
        ends = self.ends
        high = self.log_joint(ends).max(axis=1)
        needed = float((ends[:, 1] - ends[:, 0])[high > high.max() - FAR / 2].max()) / 4
        start = self.grid.edges[self.grid.edges < needed]
        count = math.ceil((self.greatest - start[-1]) / needed)
        return np.concatenate([[0.0], start[:-1], np.linspace(start[-1], self.greatest, count + 1)])


def curve(
    oscillator: Oscillator, well: Well, least: float, greatest: float, impact: str
) -> Curve:
    """The density of an oscillator in its well, with a whole of 1."""
    assert oscillator.noise is not None
    intensity, mass = oscillator.noise.intensity, oscillator.mass
    starts = [side.top for side in well.sides if side.restitution and side.top > 0]
    grid = panels(least, greatest, starts)
    nodes = grid.nodes
    every = cycles(oscillator, well, nodes.ravel(), impact)

    def over_nodes(values: np.ndarray) -> np.ndarray:
        return values.reshape(nodes.shape)

    index = np.arange(len(nodes))[:, None]
    rate = over_nodes(every.balance) / intensity
    # At the bottom area and balance are powers of the energy, so their integrals are known.
    bottom = cycles(oscillator, well, np.array([least, 2 * least]), impact)
    slopes = bottom.balance / intensity
    power = math.log2(slopes[1] / slopes[0]) if slopes[0] * slopes[1] > 0 else 0.0
    start = float(slopes[0]) * least / max(1 + power, 0.1)
    exponent = integrated(fitted(rate * grid.slope(index, NODES)), start)
    highest = float(evaluate(exponent, index, np.linspace(-1, 1, 65)).max())
    exponent[:, 0] -= highest
    panel, low, high, ends = mesh(grid, lambda k, u: evaluate(exponent, k, u), -FAR)
    weight = fitted(np.log(over_nodes(every.period / mass)))

    def made(below: float, pieces: np.ndarray) -> Curve:
        return Curve(
            grid=grid, exponent=exponent, balance=fitted(rate), weight=weight,
            turnover=fitted(np.log(over_nodes(every.turnover / every.energy))),
            accuracy=every.error, below=below,
            power=float(least * bottom.period[0] / (mass * bottom.area[0])) - 1,
            panel=panel, low=low, high=high, ends=ends, mass=pieces,
        )  # fmt: skip

    draft = made(0.0, np.zeros(len(panel)))
    pieces = draft.between(panel, low, high)
    below = float(bottom.area[0]) * math.exp(float(draft.log_joint(np.array([least]))[0]))
    total = float(pieces.sum()) + below
    exponent[:, 0] -= math.log(total)
    return made(below / total, pieces / total)
