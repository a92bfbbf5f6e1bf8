"""One cycle of the conservative motion: period, area, and work of the forces along it.

A quarter of the cycle, from the bottom to where the motion turns, is integrated in
``tau = sqrt(turn - distance)``, in which the velocity has no root singularity; where a stop ends it
before, the turn is the one that the force at the stop foretells. The kinetic energy along it is the
work from the end inwards and not a difference of potentials, so that no digits cancel. Where a soft
stop is touched or left a new piece begins, as its force does, with whatever power of the depth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ...oscillators import Oscillator
from ._contacts import Contact
from ._families import Family, families
from ._well import Conservative, Part, Side, Well, on_arrays

NODES = (24, 48, 96, 192, 384)
IMPACTS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "logarithmic": lambda r: -2 * np.log(r),
    "exact": lambda r: 1 - r**2,
    "linearised": lambda r: 2 * (1 - r),
}
"""What an impact takes of the kinetic energy, over the restitution coefficient."""

SHORT_POINTS, SHORT_WEIGHTS = np.polynomial.legendre.leggauss(8)  # from one node to the next
SHORT_POINTS, SHORT_WEIGHTS = (SHORT_POINTS + 1) / 2, SHORT_WEIGHTS / 2
AGREED = 1e-11  # relative change of the integrals at which the nodes are not doubled again


@dataclass(frozen=True)
class Orbits:
    """Integrals over a conservative cycle, for each energy [J above the minimum].

    Attributes
    ----------
    area : numpy.ndarray, shape (n,)
        Integral of v dx.
    period : numpy.ndarray, shape (n,)
    work : numpy.ndarray, shape (n,)
        Work of the law beyond what it does on a mass that stands, and of soft stops beyond their
        springs' [J].
    gross : numpy.ndarray, shape (n,)
        The sum of the sizes of what the law gives and takes [J].
    struck : numpy.ndarray, shape (n,)
        What each contact with a soft stop takes by the kinetic energy with which it is touched,
        summed; where the mass is pressed to it, by the energy.
    span : numpy.ndarray, shape (n,)
        From where to where the mass goes.
    spare : numpy.ndarray, shape (2, n)
        Kinetic energy at the lower and the upper rigid stop [J].
    error : numpy.ndarray, shape (n,)
        Greatest relative change of an integral when the nodes were doubled last.
    """

    energy: np.ndarray = field(repr=False)
    area: np.ndarray = field(repr=False)
    period: np.ndarray = field(repr=False)
    work: np.ndarray = field(repr=False)
    gross: np.ndarray = field(repr=False)
    struck: np.ndarray = field(repr=False)
    span: np.ndarray = field(repr=False)
    spare: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)


class Exchange(NamedTuple):
    """What a cycle does without noise.

    Attributes
    ----------
    gain : numpy.ndarray
        What it gains [J].
    share : numpy.ndarray
        The sum of the sizes of all gains and losses, by the energy that there is: at a stop that is
        what it is met with.
    """

    gain: np.ndarray
    share: np.ndarray


def exchange(oscillator: Oscillator, along: Orbits, impact: str) -> Exchange:
    """Work of damping, friction and stops along orbits."""
    damped = oscillator.damping * along.area
    if oscillator.friction:
        damped = damped + 2 * oscillator.friction.kinetic * along.span
    lost, struck = np.zeros((2, len(along.energy)))
    for spare, side in zip(along.spare, ("lower", "upper"), strict=True):
        for stop in oscillator.stops_on(side):
            if not stop.law.rigid:
                continue  # its loss is in the work along the orbit
            r = _restitution(stop.law, np.sqrt(2 * spare / oscillator.mass), impact)
            taken = IMPACTS[impact](r)
            lost += spare * taken
            struck += np.where(spare > 0, taken, 0.0)
    share = (along.gross + damped) / along.energy + along.struck + struck
    return Exchange(along.work - damped - lost, share)


def _restitution(law: Any, approach: np.ndarray, impact: str) -> np.ndarray:
    """Restitution coefficients at approach velocities; NaN if a user's function returns none."""
    if not callable(law.restitution):
        return np.asarray(law.restitution)
    function = np.vectorize(getattr(law.restitution, "py_func", law.restitution), otypes=[float])
    found = function(approach)
    possible = (found > 0 if impact == "logarithmic" else found >= 0) & (found <= 1)
    return np.where(possible, found, np.nan)


def orbits(
    part: Conservative, energy: np.ndarray, coarse: bool = False, family: Family | None = None
) -> Orbits:
    """The integrals, with nodes doubled until converged; `coarse` takes the fewest nodes."""
    family = family or families(part)
    pieces = pieces_of(part, family, energy)
    drag = _drag(part)
    found = _integrals(part.mass, drag, pieces, NODES[0], len(energy))
    error = np.zeros(energy.shape)
    if not coarse:
        # Near a bottom that is not at 0, forces are known to what rounding leaves of them.
        nearest = np.min([piece.distance for piece in pieces if piece.part.start == 0], axis=0)
        furthest = max(abs(inside.bottom) for inside in family.wells)
        rounding = 16 * np.finfo(float).eps * furthest / nearest
        enough = np.maximum(AGREED, rounding)
        left = np.arange(len(energy))
        for nodes in NODES[1:]:
            some = [piece.only(left) for piece in pieces]
            finer = _integrals(part.mass, drag, some, nodes, len(left))
            # Gains and losses may cancel; the sum of their sizes has kinks, and is but an estimate.
            scale = np.abs([finer[0], finer[1], finer[3] + finer[5]])
            with np.errstate(invalid="ignore", divide="ignore"):
                change = np.abs(finer - found[:, left])[:3] / scale
            error[left] = np.nan_to_num(change).max(axis=0)
            found[:, left] = finer
            left = left[error[left] > enough[left]]
            if not left.size:
                break
    for contact in part.contacts:
        if contact.only_pushes:
            kept, met = _not_pulled(part, family, contact, energy)
            found[2] += kept
            found[4] -= kept / met
            found[5] -= kept
    area, period, work, gross, struck, _ = found
    low, high = (
        (inside, side, energy + (family.ground - ground))
        for inside, side, ground in (
            (family.wells[0], family.wells[0].sides[0], family.grounds[0]),
            (family.wells[-1], family.wells[-1].sides[1], family.grounds[-1]),
        )
    )
    reached = [inside.turn(side, own) for inside, side, own in (low, high)]
    span = reached[0] + reached[1] + (high[0].bottom - low[0].bottom)
    spare = [
        np.maximum(own - side.top, 0.0) if side.stop else np.zeros(energy.shape)
        for _, side, own in (low, high)
    ]
    return Orbits(energy, area, period, work, gross, struck, span, np.array(spare), error)


def pieces_of(part: Conservative, family: Family, energy: np.ndarray) -> list[Piece]:
    """The ways through all parts of half an orbit, in the order of displacements."""
    return [
        _piece(part, family, ground - family.ground, inside, side, own, energy)
        for inside, ground in zip(family.wells, family.grounds, strict=True)
        for side in inside.sides
        for own in side.parts[:: side.sign]
        if side.reach
    ]


class Piece(NamedTuple):
    """The path through one part of a side of a well, for each energy.

    Attributes
    ----------
    well, side, part : Well, Side, Part
        Where it lies.
    contacts : tuple
        The soft stops that are pressed there, with the speed of their last touch for each energy,
        and the energy that they have to take from.
    distance : numpy.ndarray, shape (n,)
        How far a motion gets in it, 0 where it does not come there.
    spare : numpy.ndarray, shape (n,)
        What is left of its kinetic energy at the far end.
    ahead : numpy.ndarray, shape (n,)
        How far that is from where it would turn; before a saddle, from the saddle where it turns,
        and where it passes how far from there its kinetic energy is twice what it is on the top.
    """

    well: Well
    side: Side
    part: Part
    contacts: tuple[tuple[Contact, np.ndarray, np.ndarray], ...]
    distance: np.ndarray
    spare: np.ndarray
    ahead: np.ndarray

    @property
    def saddle(self) -> bool:
        """Whether the path ends at a saddle."""
        return self.side.saddle and self.part is self.side.parts[-1]

    def nodes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances from the far end inwards, and their derivative by the points in (0, 1)."""
        distance, ahead = self.distance[:, None], self.ahead[:, None]
        if not self.saddle:
            first = np.sqrt(ahead)
            width = distance / (np.sqrt(distance + ahead) + first)
            tau = first + width * points
            return width * points * (2 * first + width * points), 2 * tau * width
        # The speed is the root of y^2 - ahead^2 or y^2 + ahead^2, y the distance from the saddle.
        passes = self.spare[:, None] > 0
        far = np.where(
            passes, np.arcsinh(distance / ahead), 2 * np.arcsinh(np.sqrt(distance / (2 * ahead)))
        )
        u = far * points
        inwards = np.where(passes, ahead * np.sinh(u), 2 * ahead * np.sinh(u / 2) ** 2)
        return inwards, far * ahead * np.where(passes, np.cosh(u), np.sinh(u))

    @property
    def rough(self) -> bool:
        """Whether a force here begins or ends as a root of the depth."""
        return any(contact.exponent % 1 != 0 for contact, *_ in self.contacts)

    def crowding(self) -> list[tuple[str, np.ndarray]]:
        """Which energies come here, by where the nodes are to crowd; see `rule`."""
        there = np.flatnonzero(self.distance > 0)
        if not self.rough:
            return [("", there)] if there.size else []
        turns = self.spare[there] == 0
        # A force that begins with a root does so where its stop is touched or left.
        both = (("start", there[turns]), ("both", there[~turns]))
        return [(crowded, which) for crowded, which in both if which.size]

    def course(
        self, mass: float, rule: tuple[np.ndarray, np.ndarray, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacements from the bottom, speeds, and derivatives of the way at a rule's nodes."""
        points, _, cumulative = rule
        inwards, step = self.nodes(points)
        at = self.part.start + np.maximum(self.distance[:, None] - inwards, 0.0)
        if self.saddle:
            kinetic = self.spare[:, None] + self.work(inwards)
        else:
            kinetic = self.spare[:, None] + (self.well.pull(self.side, at) * step) @ cumulative.T
        v = np.sqrt(2 * np.maximum(kinetic, 0.0) / mass)
        return self.side.sign * at, v, step

    def only(self, which: np.ndarray) -> Piece:
        """Select some of the energies."""
        return self._replace(
            contacts=tuple(
                (own, approach[which], met[which]) for own, approach, met in self.contacts
            ),
            distance=self.distance[which],
            spare=self.spare[which],
            ahead=self.ahead[which],
        )

    def work(self, inwards: np.ndarray) -> np.ndarray:
        """Work from the far end to given distances, node by node.

        Near a saddle it goes over so many powers of ten that the digits of a sum with signs are
        not enough.
        """
        before = np.concatenate([np.zeros((len(inwards), 1)), inwards[:, :-1]], axis=1)
        width = inwards - before
        far = self.part.start + self.distance[:, None, None]
        at = far - (before[..., None] + width[..., None] * SHORT_POINTS)
        work = width * (self.well.pull(self.side, at) @ SHORT_WEIGHTS)
        return np.cumsum(work, axis=1)


def _piece(
    part: Conservative,
    family: Family,
    ground: float,
    inside: Well,
    side: Side,
    own: Part,
    energy: np.ndarray,
) -> Piece:
    """The path through one part of a side of a well, for energies of a family."""
    energy = energy - ground
    comes = energy > own.base
    distance = np.where(comes, inside.turn_in(side, own, np.maximum(energy, own.base)), 0.0)
    last = own is side.parts[-1]
    passes = side.stop or side.saddle or not last
    spare = np.maximum(energy - own.top, 0.0) if passes else np.zeros(energy.shape)
    ahead = np.zeros(energy.shape)
    hits = spare > 0
    if last and side.saddle:
        mirrored = inside.turn_in(side, own, np.maximum(own.top - spare, own.base))
        ahead = np.maximum(own.distance[-1] - np.where(hits, mirrored, distance), 1e-300)
    elif hits.any() and own.end > own.start:
        slope = float(inside.pull(side, np.array([own.end]))[0])
        # Far from turning the path is covered evenly, as it is where the force is none.
        ahead[hits] = np.minimum(spare[hits] / max(slope, 1e-300), 1e3 * side.reach)
    pressed = []
    if part.contacts:
        middle = own.start + (min(own.end, own.start + 1.0) - own.start) / 2
        x = inside.bottom + side.sign * middle
        for contact in part.contacts:
            if contact.side * (x - contact.place) > 0:
                touch = float(family.potential(np.array([contact.place]))[0]) - ground
                met = np.maximum(energy - touch, 0.0)
                resting = contact.side * (inside.bottom - contact.place) > 0
                speed = np.sqrt(2 * met / part.mass)
                pressed.append((contact, speed, energy if resting else met))
    return Piece(inside, side, own, tuple(pressed), distance, spare, ahead)


def _not_pulled(
    part: Conservative, family: Family, contact: Contact, energy: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What a stop that only pushes does not take, for each energy, and what it has to take from."""
    touch = family.potential(np.array([contact.place]))
    hits = np.flatnonzero(energy > touch)
    kept = np.zeros(energy.shape)
    if contact.damping and hits.size:
        lowest = min(family.grounds) - family.ground
        kept[hits] = contact.not_pulled(
            lambda x: family.potential(x) - touch,
            part.mass,
            energy[hits] - touch,
            energy[hits] - lowest,
        )
    resting = any(contact.side * (inside.bottom - contact.place) > 0 for inside in family.wells)
    return kept, energy if resting else np.where(energy > touch, energy - touch, 1.0)


def _integrals(
    mass: float,
    drag: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
    pieces: Sequence[Piece],
    nodes: int,
    count: int,
) -> np.ndarray:
    """Integrals over whole cycles.

    Returns
    -------
    ndarray, shape (6, count)
        Area, period, work of the law and the soft stops, the sum of the sizes of the law's parts;
        of soft stops the sum of the shares that they take, and what they take.
    """
    found = np.zeros((6, count))
    for piece in pieces:
        for crowded, which in piece.crowding():
            part = piece if which.size == count else piece.only(which)
            found[:, which] += _through(mass, drag, part, rule(nodes, crowded))
    return found


def _through(
    mass: float,
    drag: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
    piece: Piece,
    rule: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> np.ndarray:
    """The same integrals through one part, there and back."""
    weights = rule[1]
    found = np.zeros((6, len(piece.distance)))
    away, v, step = piece.course(mass, rule)
    x = piece.well.bottom + away
    found[0] = 2 * (v * step) @ weights
    with np.errstate(divide="ignore", invalid="ignore"):
        found[1] = 2 * (step / v) @ weights
    if drag is not None:
        work = drag(x, v) * step
        found[2] = work @ weights
        found[3] = np.abs(work) @ weights
    for contact, approach, met in piece.contacts:
        lost = (contact.lost(x, v, approach[:, None]) * step) @ weights
        found[2] -= lost
        found[4] += lost / met
        found[5] += lost
    return found


def _drag(part: Conservative) -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
    """Dissipative part of the law: its force on the way out minus that on the way back."""
    if part.law is None:
        return None
    law = on_arrays(part.law)
    return lambda x, v: law(0.0, x, v) - law(0.0, x, -v)


@lru_cache(maxsize=16)
def rule(nodes: int, crowded: str = "") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss-Legendre points and weights on (0, 1), and integrals from 0 to each point.

    Points run from the far end inwards. Crowded at the start, which is 1, they are those of
    2 s - s^2 in place of s, and at both ends of 3 s^2 - 2 s^3, so that roots there are smooth.
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    # Through the values at the points goes sum_k c_k P_k, c_k = (k + 1/2) sum_j w_j P_k(x_j) f_j.
    legendre = np.polynomial.legendre.legvander(points, nodes)
    order = np.arange(nodes)
    coefficients = (order[:, None] + 0.5) * legendre[:, :nodes].T * weights
    integral = np.empty((nodes, nodes))
    integral[:, 0] = points + 1
    k = order[1:]
    integral[:, 1:] = (legendre[:, 2:] - legendre[:, : nodes - 1]) / (2 * k + 1)
    points, weights, integral = (points + 1) / 2, weights / 2, integral @ coefficients / 2
    if crowded == "start":
        slope, points = 2 * (1 - points), points * (2 - points)
    elif crowded == "both":
        slope, points = 6 * points * (1 - points), points**2 * (3 - 2 * points)
    else:
        return points, weights, integral
    return points, weights * slope, integral * slope
