"""The well in which an oscillator swings: its bottom, its potential, where a motion turns."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...errors import InvalidInput
from ...oscillators import Oscillator

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(16)
POINTS, WEIGHTS = (POINTS + 1) / 2, WEIGHTS / 2
OCTAVES = 60  # in which distances from the bottom are tabled, below and above one
SHORTEST = 1e-9  # of the bottom's displacement: where a distance still has half of its digits
SCAN = np.geomspace(1e-12, 1e6, 541)  # where forces are looked at for equilibria
NEWTON = 60


class Conservative(NamedTuple):
    """What the conservative motion of an oscillator depends on, and nothing else."""

    mass: float
    stiffness: float
    load: float
    law: Callable[[float, float, float], float] | None
    lower: float
    upper: float


@dataclass(frozen=True)
class Side:
    """One side of the well: its potential over the distance from the bottom.

    Attributes
    ----------
    sign : int
        Which way it lies.
    reach : float
        Distance of the stop, or of the barrier or the end of what could be tabled.
    stop : bool
        Whether it ends at a stop.
    distance, potential : numpy.ndarray, shape (n,)
        The potential at octaves of the distance, from 0 on.
    """

    sign: int
    reach: float
    stop: bool
    distance: np.ndarray = field(repr=False)
    potential: np.ndarray = field(repr=False)

    @property
    def top(self) -> float:
        """Potential at the stop, or the greatest at which a motion is known to turn."""
        return float(self.potential[-1])


@dataclass(frozen=True)
class Well:
    """What an oscillator's energy is measured from, and the forces as functions of arrays."""

    bottom: float
    sides: tuple[Side, Side]
    push: Callable[[np.ndarray], np.ndarray] = field(repr=False)

    def pull(self, side: Side, distance: np.ndarray) -> np.ndarray:
        """The force back to the bottom, at least 0 within a well."""
        return -side.sign * self.push(self.bottom + side.sign * distance)

    def turn(self, side: Side, energy: np.ndarray) -> np.ndarray:
        """Distance at which a motion of that energy turns; that of the stop where it hits."""
        cell, start, end = _cell(side.potential, side.distance, energy)
        base = side.potential[cell]
        low, high = start.copy(), end.copy()
        # Over an octave a potential is nearly a power of the distance.
        over = np.clip(side.potential[np.minimum(cell + 1, len(side.potential) - 1)], 1e-300, None)
        under = np.clip(base, 1e-300, None)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.log(np.clip(energy, 1e-300, None) / under) / np.log(over / under)
            where = start * (end / start) ** np.clip(share, 0.0, 1.0)
        where = np.where((start > 0) & np.isfinite(where), where, (start + end) / 2)
        for _ in range(NEWTON):
            short = base + self._work(side, start, where) - energy
            low, high = np.where(short < 0, where, low), np.where(short < 0, high, where)
            slope = self.pull(side, where)
            with np.errstate(divide="ignore", invalid="ignore"):
                new = where - short / slope
            new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
            done = np.all(np.abs(new - where) <= 1e-14 * where)
            where = new
            if done:
                break
        return np.where(energy >= side.top, side.distance[-1], where)

    def potential(self, x: np.ndarray) -> np.ndarray:
        """Potential above the bottom [J]; infinite beyond the stops and where none is known."""
        found = np.zeros(x.shape)
        for side in self.sides:
            own = side.sign * (x - self.bottom) > 0
            distance = np.abs(x[own] - self.bottom)
            within = distance <= side.distance[-1] * (1 + 1e-14)
            part = np.full(distance.shape, np.inf)
            if within.any():
                cell, start, _ = _cell(side.distance, side.potential, distance[within])
                start = side.distance[cell]
                part[within] = side.potential[cell] + self._work(side, start, distance[within])
            found[own] = part
        return found

    def _work(self, side: Side, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Work against the pull from one distance to another, within an octave."""
        at = start[:, None] + (end - start)[:, None] * POINTS
        return (end - start) * (self.pull(side, at) @ WEIGHTS)


def _cell(
    along: np.ndarray, other: np.ndarray, value: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """In which cell of `along` the values lie, with `other` at its ends."""
    cell = np.clip(np.searchsorted(along, value, side="right") - 1, 0, max(len(along) - 2, 0))
    return cell, other[cell], other[np.minimum(cell + 1, len(along) - 1)]


def conservative(oscillator: Oscillator) -> Conservative:
    """That part of an oscillator; stops are infinitely far where there is none."""
    upper, lower = oscillator.stops_on("upper"), oscillator.stops_on("lower")
    law = oscillator.law
    try:
        hash(law)
    except TypeError:
        unhashable = law
        law = lambda t, x, v: unhashable(t, x, v)  # type: ignore[misc]  # noqa: E731
    return Conservative(
        oscillator.mass,
        oscillator.stiffness,
        oscillator.load,
        law,
        lower[0].position if lower else -math.inf,
        upper[0].position if upper else math.inf,
    )


@lru_cache(maxsize=16)
def well(part: Conservative) -> Well:
    """The one well of an oscillator between its stops.

    Raises
    ------
    InvalidInput
        If there is none, or more than one.
    """
    push = _push(part)
    low, high = part.lower, part.upper
    bottom, before, beyond = _equilibrium(push, low, high)
    # Pressed against a stop, the mass feels a force there that no rounding can hide.
    shortest = 0.0 if bottom in (low, high) else SHORTEST * abs(bottom)
    sides = []
    for sign, position, barrier in ((-1, low, before), (1, high, beyond)):
        stop = math.isfinite(position)
        distance = _octaves(shortest, abs((position if stop else barrier) - bottom))
        start = distance[:-1, None]
        at = start + np.diff(distance)[:, None] * POINTS
        with np.errstate(all="ignore"):
            steps = np.diff(distance) * (-sign * push(bottom + sign * at) @ WEIGHTS)
            potential = np.concatenate([[0.0], np.cumsum(steps)])
        known = np.isfinite(potential)
        count = len(known) if known.all() else int(np.argmin(known))
        reach = float(distance[count - 1])
        whole = count == len(known)
        sides.append(Side(sign, reach, stop and whole, distance[:count], potential[:count]))
    return Well(bottom, (sides[0], sides[1]), push)


def _push(part: Conservative) -> Callable[[np.ndarray], np.ndarray]:
    """The force of spring, load and law on a mass that stands, over arrays of displacements."""
    if part.law is None:
        return lambda x: part.load - part.stiffness * x
    law = on_arrays(part.law)
    return lambda x: part.load - part.stiffness * x + law(0.0, x, np.zeros(x.shape))


def on_arrays(law: Callable[..., Any]) -> Callable[[float, np.ndarray, np.ndarray], np.ndarray]:
    """A law of numbers as one of arrays; where it raises it is NaN.

    Called with arrays if its arithmetic takes them: what branches on a number, or uses `math`,
    raises then, and is called point by point.
    """
    function = getattr(law, "py_func", law)

    def one(t: float, x: float, v: float) -> float:
        try:
            return float(function(t, x, v))
        except ArithmeticError:
            return math.nan

    pointwise = np.vectorize(one, otypes=[float])

    def called(t: float, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        if not x.size:
            return np.zeros(x.shape)
        with np.errstate(all="ignore"):
            try:
                found = np.asarray(function(t, x, v), float)
            except (TypeError, ValueError, ArithmeticError):
                found = pointwise(t, x, v)
        return np.broadcast_to(found, x.shape)

    return called


def _octaves(shortest: float, reach: float) -> np.ndarray:
    """0, and distances from the shortest on, each twice the last, up to the reach."""
    if reach == 0:
        return np.zeros(1)
    if math.isfinite(reach):
        found = reach * 2.0 ** np.arange(-2 * OCTAVES, 1)
    else:
        found = 2.0 ** np.arange(-OCTAVES, OCTAVES + 1)
    found = found[found >= shortest]
    return np.concatenate([[0.0], found])


def _equilibrium(
    push: Callable[[np.ndarray], np.ndarray], low: float, high: float
) -> tuple[float, float, float]:
    """The stable equilibrium, and the barriers on either side of it or infinities.

    Raises
    ------
    InvalidInput
        If there is none, or another.
    """
    x = np.concatenate([-SCAN[::-1], [0.0], SCAN])
    for stop, inwards in ((low, 1), (high, -1)):
        if math.isfinite(stop):
            x = np.concatenate([x, [stop], stop + inwards * SCAN * max(abs(stop), 1e-6)])
    if math.isfinite(high - low):
        x = np.concatenate([x, np.linspace(low, high, 257)])
    x = np.unique(x[(x >= low) & (x <= high)])
    force = push(x)
    x, force = x[np.isfinite(force)], force[np.isfinite(force)]
    sign = np.sign(force)
    held = np.flatnonzero(sign)
    stable, barriers = [], []
    if held.size:
        if math.isfinite(low) and sign[held[0]] < 0:
            stable.append(low)
        for i, j in pairwise(held):
            if sign[i] > sign[j]:
                stable.append(_zero(push, x[i : j + 1], sign[i : j + 1]))
            elif sign[i] < sign[j]:
                barriers.append(_zero(push, x[i : j + 1], sign[i : j + 1]))
        if math.isfinite(high) and sign[held[-1]] > 0:
            stable.append(high)
    elif math.isfinite(high - low):
        stable.append((low + high) / 2)
    if len(stable) != 1:
        found = "no place" if not stable else "places " + ", ".join(f"{at:.6g}" for at in stable)
        raise InvalidInput(
            "oscillator",
            f"{found} of stable rest" if stable else "no place of stable rest",
            "one well between the stops",
            "Averaging follows one family of orbits about one bottom",
        )
    (bottom,) = stable
    before = max((at for at in barriers if at < bottom), default=-math.inf)
    beyond = min((at for at in barriers if at > bottom), default=math.inf)
    return bottom, before, beyond


def _zero(push: Callable[[np.ndarray], np.ndarray], x: np.ndarray, sign: np.ndarray) -> float:
    """Where the force changes sign between the ends of these points."""
    from scipy.optimize import brentq

    flat = x[sign == 0]
    if flat.size:
        return float((flat[0] + flat[-1]) / 2)
    tight = 4 * np.finfo(float).eps
    return float(brentq(lambda at: push(np.array([at]))[0], x[0], x[1], xtol=1e-300, rtol=tight))
