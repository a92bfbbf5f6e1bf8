"""Potential wells of an oscillator: minimum, potential, and turning points."""

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
from ._contacts import Contact, contact

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(16)
POINTS, WEIGHTS = (POINTS + 1) / 2, WEIGHTS / 2
OCTAVES = 60  # in which distances from the bottom are tabled, below and above one
SHORTEST = 1e-9  # of the bottom's displacement: where a distance still has half of its digits
SCAN = np.geomspace(1e-12, 1e6, 541)  # where forces are looked at for equilibria
NEWTON = 60


class Conservative(NamedTuple):
    """The parameters that the conservative motion depends on."""

    mass: float
    stiffness: float
    load: float
    law: Callable[[float, float, float], float] | None
    lower: float
    upper: float
    contacts: tuple[Contact, ...] = ()


class Part(NamedTuple):
    """A piece of a side of a well, between points where a soft stop is touched or left.

    Its potential is tabled at octaves of the distance from its start, from 0 on, where it is 0 and
    that above the bottom is `base`.
    """

    start: float
    base: float
    distance: np.ndarray
    potential: np.ndarray

    @property
    def end(self) -> float:
        """Distance of its end from the minimum."""
        return self.start + float(self.distance[-1])

    @property
    def top(self) -> float:
        """Potential at its end, above the minimum."""
        return self.base + float(self.potential[-1])


@dataclass(frozen=True)
class Side:
    """One side of the well: its potential over the distance from the bottom.

    Attributes
    ----------
    sign : int
        Which way it lies.
    reach : float
        Distance of the rigid stop, or of the barrier or the end of what could be tabled.
    stop, saddle : bool
        Whether it ends at a rigid stop, or at a barrier with another well beyond.
    parts : tuple of Part
        From the bottom outwards; over each the force is smooth.
    """

    sign: int
    reach: float
    stop: bool
    saddle: bool
    parts: tuple[Part, ...] = field(repr=False)

    @property
    def top(self) -> float:
        """Potential at the stop, or the greatest at which a motion is known to turn."""
        return self.parts[-1].top


@dataclass(frozen=True)
class Well:
    """A potential well, with its forces as functions of arrays."""

    bottom: float
    sides: tuple[Side, Side]
    push: Callable[[np.ndarray], np.ndarray] = field(repr=False)

    def pull(self, side: Side, distance: np.ndarray) -> np.ndarray:
        """Restoring force, at least 0 within a well."""
        return -side.sign * self.push(self.bottom + side.sign * distance)

    def turn(self, side: Side, energy: np.ndarray) -> np.ndarray:
        """Turning point of a motion of an energy; the stop if it hits."""
        found = self.turn_in(side, side.parts[0], energy)
        for part in side.parts[1:]:
            beyond = energy > part.base
            found[beyond] = part.start + self.turn_in(side, part, energy[beyond])
        return found

    def turn_in(self, side: Side, part: Part, energy: np.ndarray) -> np.ndarray:
        """Turning point from the start of a part, for energies that get there."""
        above = energy - part.base
        cell, start, end = _cell(part.potential, part.distance, above)
        base = part.potential[cell]
        low, high = start.copy(), end.copy()
        # Over an octave a potential is nearly a power of the distance.
        over = np.clip(part.potential[np.minimum(cell + 1, len(part.potential) - 1)], 1e-300, None)
        under = np.clip(base, 1e-300, None)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.log(np.clip(above, 1e-300, None) / under) / np.log(over / under)
            where = start * (end / start) ** np.clip(share, 0.0, 1.0)
        where = np.where((start > 0) & np.isfinite(where), where, (start + end) / 2)
        for _ in range(NEWTON):
            short = base + self._work(side, part.start, start, where) - above
            low, high = np.where(short < 0, where, low), np.where(short < 0, high, where)
            slope = self.pull(side, part.start + where)
            with np.errstate(divide="ignore", invalid="ignore"):
                new = where - short / slope
            new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
            done = np.all(np.abs(new - where) <= 1e-14 * where)
            where = new
            if done:
                break
        return np.where(above >= part.potential[-1], part.distance[-1], where)

    def potential(self, x: np.ndarray) -> np.ndarray:
        """Potential above the minimum [J]; infinite beyond the stops and where unknown."""
        found = np.zeros(x.shape)
        for side in self.sides:
            own = side.sign * (x - self.bottom) > 0
            distance = np.abs(x[own] - self.bottom)
            within = distance <= side.reach * (1 + 1e-14)
            known = np.full(distance.shape, np.inf)
            starts = [part.start for part in side.parts]
            of = np.searchsorted(starts, distance, side="right") - 1
            for k, part in enumerate(side.parts):
                here = within & (of == k)
                if here.any():
                    beyond = distance[here] - part.start
                    cell, start, _ = _cell(part.distance, part.potential, beyond)
                    start = part.distance[cell]
                    work = part.potential[cell] + self._work(side, part.start, start, beyond)
                    known[here] = part.base + work
            found[own] = known
        return found

    def _work(self, side: Side, origin: float, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Work against the restoring force between two distances within an octave."""
        at = start[:, None] + (end - start)[:, None] * POINTS
        return (end - start) * (self.pull(side, origin + at) @ WEIGHTS)


def _cell(
    along: np.ndarray, other: np.ndarray, value: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Index of the cell of `along` that contains each value, with `other` at its ends."""
    cell = np.clip(np.searchsorted(along, value, side="right") - 1, 0, max(len(along) - 2, 0))
    return cell, other[cell], other[np.minimum(cell + 1, len(along) - 1)]


def conservative(oscillator: Oscillator) -> Conservative:
    """The conservative part of an oscillator; absent rigid stops are at infinity."""
    rigid = [stop for stop in oscillator.stops if stop.law.rigid]
    walls = {stop.side: stop.position for stop in rigid}
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
        walls.get("lower", -math.inf),
        walls.get("upper", math.inf),
        tuple(contact(stop) for stop in oscillator.stops if not stop.law.rigid),
    )


@lru_cache(maxsize=16)
def wells(part: Conservative) -> tuple[Well, ...]:
    """The wells of an oscillator between its stops, from left to right.

    Raises
    ------
    InvalidInput
        If there is none.
    """
    push = _push(part)
    stable, barriers = _equilibria(part, push)
    found = []
    for bottom in stable:
        sides = []
        for sign, wall in ((-1, part.lower), (1, part.upper)):
            beyond = [at for at in barriers if sign * (at - bottom) > 0]
            end = sign * min((sign * at for at in beyond), default=math.inf)
            saddle = any(sign * (other - end) > 0 for other in stable)
            stop = math.isfinite(wall) and not saddle
            sides.append(_side(part, push, bottom, sign, wall if stop else end, stop, saddle))
        found.append(Well(bottom, (sides[0], sides[1]), push))
    return tuple(found)


def _side(
    part: Conservative,
    push: Callable[[np.ndarray], np.ndarray],
    bottom: float,
    sign: int,
    end: float,
    stop: bool,
    saddle: bool,
) -> Side:
    """A side of a well, tabulated as far as the potential is known."""
    # Pressed against a stop, the mass feels a force there that no rounding can hide.
    shortest = 0.0 if bottom in (part.lower, part.upper) else SHORTEST * abs(bottom)
    reach = abs(end - bottom)
    touched = (sign * (own.place - bottom) for own in part.contacts)
    starts = [0.0, *sorted({at for at in touched if 0 < at < reach})]
    parts: list[Part] = []
    base, whole = 0.0, True
    for start, until in pairwise([*starts, reach]):
        distance = _octaves(shortest if start == 0 else SHORTEST * abs(bottom + start),
                            until - start)  # fmt: skip
        first = distance[:-1, None]
        at = first + np.diff(distance)[:, None] * POINTS
        with np.errstate(all="ignore"):
            steps = np.diff(distance) * (-sign * push(bottom + sign * (start + at)) @ WEIGHTS)
            potential = np.concatenate([[0.0], np.cumsum(steps)])
        known = np.isfinite(potential)
        count = len(known) if known.all() else int(np.argmin(known))
        parts.append(Part(start, base, distance[:count], potential[:count]))
        base, whole = parts[-1].top, count == len(known)
        if not whole:
            break
    return Side(sign, parts[-1].end, stop and whole, saddle and whole, tuple(parts))


def _push(part: Conservative) -> Callable[[np.ndarray], np.ndarray]:
    """Static force of spring, load and law, over arrays of displacements."""
    law = None if part.law is None else on_arrays(part.law)

    def push(x: np.ndarray) -> np.ndarray:
        force = part.load - part.stiffness * x
        if law is not None:
            force = force + law(0.0, x, np.zeros(x.shape))
        for own in part.contacts:
            force = force - own.side * own.push(x)
        return force

    return push


def on_arrays(law: Callable[..., Any]) -> Callable[[float, np.ndarray, np.ndarray], np.ndarray]:
    """A user's law as a function of arrays; NaN where it raises.

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
    """Distances from 0 and the shortest on, each doubled, up to the reach."""
    if reach == 0:
        return np.zeros(1)
    if math.isfinite(reach):
        found = reach * 2.0 ** np.arange(-2 * OCTAVES, 1)
    else:
        found = 2.0 ** np.arange(-OCTAVES, OCTAVES + 1)
    found = found[found >= shortest]
    return np.concatenate([[0.0], found])


def _equilibria(
    part: Conservative, push: Callable[[np.ndarray], np.ndarray]
) -> tuple[list[float], list[float]]:
    """Stable equilibria and the barriers between them.

    Raises
    ------
    InvalidInput
        If it can rest nowhere, or the force is no number.
    """
    low, high = part.lower, part.upper
    x = np.concatenate([-SCAN[::-1], [0.0], SCAN])
    for own in part.contacts:
        near = SCAN * max(abs(own.place), 1e-6)
        x = np.concatenate([x, own.place - near, [own.place], own.place + near])
    for stop, inwards in ((low, 1), (high, -1)):
        if math.isfinite(stop):
            x = np.concatenate([x, [stop], stop + inwards * SCAN * max(abs(stop), 1e-6)])
    if math.isfinite(high - low):
        x = np.concatenate([x, np.linspace(low, high, 257)])
    x = np.unique(x[(x >= low) & (x <= high)])
    force = push(x)
    x, force = x[np.isfinite(force)], force[np.isfinite(force)]
    if not x.size:
        raise InvalidInput(
            "oscillator", "a force that is finite nowhere",
            "a law with finite values on a mass at rest",
        )  # fmt: skip
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
    if not stable:
        raise InvalidInput(
            "oscillator", "no place of stable rest", "a well between the stops",
            "Without one there are no orbits to average over",
        )  # fmt: skip
    return stable, barriers


def _zero(push: Callable[[np.ndarray], np.ndarray], x: np.ndarray, sign: np.ndarray) -> float:
    """Position at which the force changes sign between these points."""
    from scipy.optimize import brentq

    flat = x[sign == 0]
    if flat.size:
        return float((flat[0] + flat[-1]) / 2)
    tight = 4 * np.finfo(float).eps
    return float(brentq(lambda at: push(np.array([at]))[0], x[0], x[1], xtol=1e-300, rtol=tight))
