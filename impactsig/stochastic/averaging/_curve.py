"""The exponent of an averaged density over the energy, and the integrals over the density."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from ...oscillators import Oscillator
from ._cycles import Orbits, exchange, orbits
from ._panels import (
    NODES,
    POINTS,
    WEIGHTS,
    Panels,
    evaluate,
    fitted,
    integrated,
    mesh,
    panels,
    roots,
)
from ._well import Conservative, conservative, well

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
        Share of its energy that a cycle exchanges.
    error : numpy.ndarray
        Energies of orbits, and relative errors of the integrals over them.
    below, power, rise, growth : float
        Probability of energies below the panels; the power of the energy that p(H) is there; by how
        much the exponent rises over them, and the power of the energy that this is.
    panel, low, high, ends, share : numpy.ndarray
        Pieces in which the exponent hardly varies: their panels, where they lie in them, their
        energies (n, 2) and the probabilities of the points in them (n, 16).
    """

    grid: Panels
    exponent: np.ndarray = field(repr=False)
    balance: np.ndarray = field(repr=False)
    weight: np.ndarray = field(repr=False)
    turnover: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)
    below: float
    power: float
    rise: float
    growth: float
    panel: np.ndarray = field(repr=False)
    low: np.ndarray = field(repr=False)
    high: np.ndarray = field(repr=False)
    ends: np.ndarray = field(repr=False)
    share: np.ndarray = field(repr=False)

    @property
    def greatest(self) -> float:
        """Energy beyond which the density counts as 0."""
        return float(self.ends[-1, 1])

    def log_joint(self, energy: np.ndarray) -> np.ndarray:
        """Logarithm of the joint density."""
        found = evaluate(self.exponent, *self.grid.locate(energy))
        share = np.minimum(energy / self.grid.edges[0], 1.0)
        return found + self.rise * (share**self.growth - 1)

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
        nearer = self.log_joint(energy[low]) - self.log_joint(least[None])
        with np.errstate(divide="ignore"):
            found[low] *= np.exp(nearer) * (energy[low] / least) ** power
        return np.where((energy < 0) | (energy > self.greatest), 0.0, found)

    def cumulative(self, energy: np.ndarray) -> np.ndarray:
        """Probability of an energy up to that one."""
        before = self.below + np.concatenate([[0.0], np.cumsum(self.share.sum(axis=1))])
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
        return self.shares(panel, low, high).sum(axis=1)

    def mean(self, what: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
        """Mean of a function of panel and place, over the energies in the panels."""
        return float((self.share * what(self.panel[:, None], _places(self.low, self.high))).sum())

    def shares(self, panel: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Probabilities that go to the points of a quadrature between two places in a panel."""
        u, own = _places(low, high), panel[:, None]
        logarithm = evaluate(self.exponent, own, u) + evaluate(self.weight, own, u)
        return np.exp(logarithm) * self.grid.slope(own, u) * WEIGHTS * (high - low)[:, None] / 2

    def extrema(self) -> tuple[np.ndarray, np.ndarray]:
        """Energies of the extrema of the joint density, 0 among them; whether each is a maximum."""
        at = roots(self.balance)
        found = self.grid.energy(np.array([k for k, _ in at], int), np.array([u for _, u in at]))
        between = np.concatenate([[self.grid.edges[0]], found, [self.grid.edges[-1]]])
        middle = np.sqrt(between[:-1] * between[1:])
        # A panel's ends may both have, or both miss, a root that is on them.
        slope = evaluate(self.balance, *self.grid.locate(middle))
        # Where nothing damps small orbits the density is level, up to where it falls or rises.
        falls = np.where(slope == 0, np.diff(self.log_joint(between)) < 0, slope < 0)
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


@lru_cache(maxsize=64)
def _grid(part: Conservative, least: float, greatest: float) -> tuple[Panels, Orbits]:
    """Panels, and the orbits at their nodes: the same for any damper, friction, loss and noise."""
    grid = panels(least, greatest, _breaks(part))
    return grid, orbits(part, grid.nodes.ravel())


def _breaks(part: Conservative) -> dict[float, float]:
    """Energies from which on a stop is met, or a soft one left, and the scale of what follows."""
    inside = well(part)
    found: dict[float, float] = {}
    for side in inside.sides:
        for own in side.parts[1:]:
            pressed = float(inside.pull(side, np.array([own.start]))[0])
            at = inside.bottom + side.sign * own.start
            scales = [
                max(touched.scale(pressed), 1e-12 * own.base)
                for touched in part.contacts
                if math.isclose(touched.place, at, rel_tol=1e-9, abs_tol=1e-9 * own.start)
            ]
            found[own.base] = min([own.base, found.get(own.base, own.base), *scales])
        if side.stop and side.top > 0:
            found[side.top] = min(side.top, found.get(side.top, side.top))
    return found


def curve(oscillator: Oscillator, least: float, greatest: float, impact: str) -> Curve:
    """The density of an oscillator over these energies, with a whole of 1."""
    assert oscillator.noise is not None
    intensity, mass = oscillator.noise.intensity, oscillator.mass
    part = conservative(oscillator)
    grid, along = _grid(part, least, greatest)

    def over_nodes(values: np.ndarray) -> np.ndarray:
        return values.reshape(len(grid.start), -1)

    gain, turnover = exchange(oscillator, along, impact)
    index = np.arange(len(grid.start))[:, None]
    rate = over_nodes(gain / along.area) / intensity
    # At the bottom area and balance are powers of the energy, so their integrals are known.
    bottom = orbits(part, np.array([least, 2 * least]))
    slopes = exchange(oscillator, bottom, impact).gain / bottom.area / intensity
    known = slopes[0] * slopes[1] > 0
    growth = max(1 + math.log2(slopes[1] / slopes[0]), 0.25) if known else 1.0
    rise = float(slopes[0]) * least / growth
    exponent = integrated(fitted(rate * grid.slope(index, NODES)), rise)
    balance = fitted(rate)
    at = roots(balance)
    tops = evaluate(exponent, np.array([k for k, _ in at], int), np.array([u for _, u in at]))
    exponent[:, 0] -= max([0.0, rise, *tops])
    panel, low, high, ends = mesh(grid, lambda k, u: evaluate(exponent, k, u), -FAR)
    weight = fitted(np.log(over_nodes(along.period / mass)))

    draft = Curve(
        grid=grid, exponent=exponent, balance=balance, weight=weight,
        turnover=fitted(over_nodes(turnover / along.energy)),
        error=np.array([along.energy, along.error]), below=0.0,
        power=float(least * bottom.period[0] / (mass * bottom.area[0])) - 1,
        rise=rise, growth=growth, panel=panel, low=low, high=high, ends=ends, share=np.zeros(0),
    )  # fmt: skip
    share = draft.shares(panel, low, high)
    below = float(bottom.area[0]) * math.exp(float(draft.log_joint(np.array([least]))[0]))
    total = float(share.sum()) + below
    exponent[:, 0] -= math.log(total)
    return replace(draft, below=below / total, share=share / total)


def _places(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Points of a quadrature in each piece."""
    return (low + high)[:, None] / 2 + (high - low)[:, None] / 2 * POINTS
