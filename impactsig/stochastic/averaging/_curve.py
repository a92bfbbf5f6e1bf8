"""Exponent of an averaged density over the energy, and integrals of the density."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from ...oscillators import Oscillator
from ._cycles import Orbits, exchange, orbits
from ._families import Family, families
from ._feeding import Band, band_of, fed
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
from ._well import Conservative, conservative

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
    turnover, memory : numpy.ndarray
        Share of its energy that an orbit exchanges in a cycle, and in a correlation time.
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
    memory: np.ndarray = field(repr=False)
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
        """Energy beyond which the density is negligible."""
        return float(self.ends[-1, 1]) if len(self.ends) else -math.inf

    @property
    def last(self) -> float:
        """The exponent at the greatest energy of the panels."""
        return float(self.exponent[-1].sum())

    def log_joint(self, energy: np.ndarray) -> np.ndarray:
        """Logarithm of the joint density."""
        found = evaluate(self.exponent, *self.grid.locate(energy))
        share = np.minimum(energy / self.grid.edges[0], 1.0)
        return found + self.rise * (share**self.growth - 1)

    def joint(self, energy: np.ndarray) -> np.ndarray:
        """Joint density at points of that energy; may be infinite."""
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
        if not len(self.ends):
            return np.zeros(energy.shape)
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
        """Probability between two positions in a panel."""
        return self.shares(panel, low, high).sum(axis=1)

    def mean(self, what: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
        """Mean of a function of panel and position, over the energies in the panels."""
        return float((self.share * what(self.panel[:, None], _places(self.low, self.high))).sum())

    def exchanged(self, share: np.ndarray | None = None) -> float:
        """Mean of what orbits exchange in a time, or of that times a share."""

        def rate(panel: np.ndarray, u: np.ndarray) -> np.ndarray:
            energy = evaluate(self.turnover, panel, u) * self.grid.energy(panel, u)
            found = energy / np.exp(evaluate(self.weight, panel, u))
            return found if share is None else found * evaluate(share, panel, u)

        return self.mean(rate)

    def shares(self, panel: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Probabilities at the points of a quadrature between two positions in a panel."""
        u, own = _places(low, high), panel[:, None]
        logarithm = evaluate(self.exponent, own, u) + evaluate(self.weight, own, u)
        return np.exp(logarithm) * self.grid.slope(own, u) * WEIGHTS * (high - low)[:, None] / 2

    def extrema(self) -> tuple[np.ndarray, np.ndarray]:
        """Energies of the extrema of the joint density, with 0, and whether each is a maximum."""
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
    def widest(self) -> float:
        """Energy distance over which the joint density varies little."""
        ends = self.ends
        high = self.log_joint(ends).max(axis=1)
        return float((ends[:, 1] - ends[:, 0])[high > high.max() - FAR / 2].max()) / 4

    @cached_property
    def even(self) -> np.ndarray:
        """Energies between which the joint density varies little, even when shifted."""
        needed = self.widest
        start = self.grid.edges[self.grid.edges < needed]
        count = math.ceil((self.greatest - start[-1]) / needed)
        return np.concatenate([[0.0], start[:-1], np.linspace(start[-1], self.greatest, count + 1)])


@lru_cache(maxsize=64)
def _grid(part: Conservative, which: int, least: float, greatest: float) -> tuple[Panels, Orbits]:
    """Panels, and orbits at their nodes, which do not depend on dissipation or noise."""
    family = families(part).walk()[which]
    grid = panels(least, greatest, grazings(part, family), family.foot, family.head)
    return grid, orbits(part, grid.nodes.ravel(), family=family)


@lru_cache(maxsize=64)
def _fed_grid(
    part: Conservative, which: int, least: float, greatest: float, band: Band
) -> np.ndarray:
    """What noise of intensity 1 feeds into the orbits of the panels."""
    along = _grid(part, which, least, greatest)[1]
    return fed(part, families(part).walk()[which], band, along.energy, along.area)


def grazings(part: Conservative, family: Family) -> dict[float, float]:
    """Energies from which on a stop is met, or a soft one left, and the scale of what follows."""
    found: dict[float, float] = {}
    for k, own in ((0, family.wells[0].sides[0]), (-1, family.wells[-1].sides[1])):
        inside, ground = family.wells[k], family.grounds[k] - family.ground
        for piece in own.parts[1:]:
            pressed = float(inside.pull(own, np.array([piece.start]))[0])
            at = inside.bottom + own.sign * piece.start
            base = piece.base + ground
            scales = [
                max(touched.scale(pressed), 1e-12 * base)
                for touched in part.contacts
                if math.isclose(touched.place, at, rel_tol=1e-9, abs_tol=1e-9 * piece.start)
            ]
            found[base] = min([base, found.get(base, base), *scales])
        if own.stop and own.top + ground > 0:
            found[own.top + ground] = own.top + ground
    return found


def curve(oscillator: Oscillator, which: int, least: float, greatest: float, impact: str) -> Curve:
    """The density of a family over a range of energies, not normalised.

    Its exponent is 0 at the bottom, or at the saddle where the family begins.
    """
    assert oscillator.noise is not None
    intensity, mass = oscillator.noise.intensity, oscillator.mass
    part = conservative(oscillator)
    family = families(part).walk()[which]
    grid, along = _grid(part, which, least, greatest)

    def over_nodes(values: np.ndarray) -> np.ndarray:
        return values.reshape(len(grid.start), -1)

    gain, share = exchange(oscillator, along, impact)
    index = np.arange(len(grid.start))[:, None]
    band = band_of(oscillator.noise)
    rate = over_nodes(gain / _fed_grid(part, which, least, greatest, band)) / intensity
    # At the bottom area and balance are powers of the energy, so their integrals are known.
    bottom = orbits(part, np.array([least, 2 * least]), family=family)
    slopes = exchange(oscillator, bottom, impact).gain / intensity
    slopes /= fed(part, family, band, bottom.energy, bottom.area)
    known = slopes[0] * slopes[1] > 0 and not family.children
    growth = max(1 + math.log2(slopes[1] / slopes[0]), 0.25) if known else 1.0
    rise = 0.0 if family.children else float(slopes[0]) * least / growth
    power = 0.0
    if not family.children:
        power = float(least * bottom.period[0] / (mass * bottom.area[0])) - 1
    empty = np.zeros(0)
    return Curve(
        grid=grid, exponent=integrated(fitted(rate * grid.slope(index, NODES)), rise),
        balance=fitted(rate), weight=fitted(np.log(over_nodes(along.period / mass))),
        turnover=fitted(over_nodes(share)),
        memory=fitted(over_nodes(band.correlation_time / along.period * share)),
        error=np.array([along.energy, along.error]),
        below=0.0 if family.children else float(bottom.area[0]), power=power,
        rise=rise, growth=growth, panel=empty.astype(int), low=empty, high=empty,
        ends=np.zeros((0, 2)), share=np.zeros((0, 16)),
    )  # fmt: skip


def whole(curves: list[Curve], shifts: list[float]) -> list[Curve]:
    """Shift the exponents of densities, and normalise their sum to 1."""
    tops = []
    for own, shift in zip(curves, shifts, strict=True):
        at = roots(own.balance)
        places = np.array([k for k, _ in at], int), np.array([u for _, u in at])
        # The bottom, the orbits of no balance, and for what begins at a saddle both ends.
        ends = [0.0, own.rise, *evaluate(own.exponent, *places)]
        if len(curves) > 1:
            ends.append(own.last)
        tops += [end + shift for end in ends]
    most = max(tops)
    drafts = []
    for own, shift in zip(curves, shifts, strict=True):
        exponent = own.exponent.copy()
        exponent[:, 0] -= most - shift
        pieces = mesh(own.grid, lambda k, u, e=exponent: evaluate(e, k, u), -FAR)  # type: ignore[misc]
        panel, low, high, energy = pieces
        draft = replace(own, exponent=exponent, panel=panel, low=low, high=high, ends=energy)
        share = draft.shares(draft.panel, draft.low, draft.high)
        least = own.grid.edges[:1]
        below = own.below and own.below * math.exp(float(draft.log_joint(least)[0]))
        drafts.append(replace(draft, share=share, below=below))
    total = sum(float(own.share.sum()) + own.below for own in drafts)
    for own in drafts:
        own.exponent[:, 0] -= math.log(total)
    return [replace(own, below=own.below / total, share=own.share / total) for own in drafts]


def _places(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Quadrature points in each interval."""
    return (low + high)[:, None] / 2 + (high - low)[:, None] / 2 * POINTS
