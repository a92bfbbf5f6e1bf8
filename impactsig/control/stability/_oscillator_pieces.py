"""Linearisation of an oscillator about a periodic orbit, under delayed feedback."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...dynamics.periodic.collocation import NODES, chebyshev
from ...dynamics.periodic.orbits import PeriodicOrbit
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation.basis.events import (
    IMPACT,
    PART,
    PHASE,
    RELEASE,
    REVERSE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_Q,
    ROW_STOP,
    ROW_V,
    STICK,
    TOUCH,
    TURN,
    TURNS,
)
from ...simulation.basis.frame import base_motion, forcing, pace
from ..feedback import DelayedFeedback, check_signal
from ._variation import Piece, Variation, laps_in, moving

LONGEST = TURN / 2  # of a piece


class Leg(NamedTuple):
    """The contacts and the direction of sliding between two events."""

    pressed: list[Any]  # soft stops that are pressed on
    way: int  # in which the mass slides, 1 or -1; 0 where it rests
    held: str  # "": it moves; "stop" or "friction"


def of_oscillator(orbit: PeriodicOrbit, feedback: DelayedFeedback) -> Variation:
    """The linearised map of deviations from an orbit of an oscillator.

    Raises
    ------
    InvalidInput
        If the delay is no multiple of the orbit's period, or the signal is another.
    """
    laps = laps_in(feedback, orbit.periods, f"the orbit's {orbit.periods} periods")
    check_signal(feedback)
    if any(stop.law.by_approach is not None for stop in orbit.system.stops):
        raise InvalidInput(
            "orbit", orbit, "an orbit without Lankarani-Nikravesh stops",
            "Their loss depends on the approach velocity; use Hertz(stiffness, damping=...)",
        )  # fmt: skip
    motion = orbit.motion()
    friction = orbit.system.friction
    sticks = friction is not None and friction.static != friction.kinetic and motion.stick_count
    if sticks and feedback.signal == "velocity" and feedback.gain:
        raise InvalidInput(
            "signal", feedback.signal, '"displacement" for an orbit that sticks under friction '
            "greater at rest than in motion",
            "A release that comes later than the delayed one is held back by what that feeds back, "
            "one that comes sooner is not: there is no linear map",
        )  # fmt: skip
    pieces = Pieces(motion, feedback)
    inertia = orbit.system.mass * motion._engine.omega**2
    limit = np.inf if feedback.limit is None else feedback.limit / inertia
    return Variation(pieces.all(), laps, feedback.memory, pieces.gain, limit)


class Pieces:
    """The pieces of an orbit between events, in the engine's units, relative to the stops."""

    def __init__(self, motion: Any, feedback: DelayedFeedback) -> None:
        self.motion = motion
        self.oscillator: Oscillator = motion.system
        self.omega: float = motion._engine.omega
        self.of_velocity = feedback.signal == "velocity"
        mass = self.oscillator.mass
        self.inertia = mass * self.omega**2
        self.gain = feedback.gain / (mass * self.omega if self.of_velocity else self.inertia)
        self.waves = forcing(self.oscillator)
        friction = self.oscillator.friction
        self.kinetic = friction.kinetic / self.inertia if friction else 0.0

    def all(self) -> list[Piece]:
        """The pieces from section to section."""
        motion = self.motion
        rows = motion._segments
        events = rows[np.isin(rows[:, ROW_KIND], (IMPACT, TOUCH, PART, REVERSE, STICK, RELEASE))]
        begins = rows[:, TURNS] * TURN + rows[:, PHASE]
        stop = motion._last[0] * TURN + motion._last[1]
        edges = [begins[0], *(events[:, TURNS] * TURN + events[:, PHASE]), stop]
        held, pressed = "", self._pressed(edges[0])
        legs = []
        for low, high, row in zip(edges[:-1], edges[1:], [None, *events], strict=True):
            if row is not None:
                if row[ROW_KIND] in (STICK, RELEASE):
                    held = "" if row[ROW_KIND] == RELEASE else self._holder(low)
                elif row[ROW_KIND] == TOUCH:
                    pressed = {*pressed, int(row[ROW_STOP])}
                elif row[ROW_KIND] == PART:
                    pressed = pressed - {int(row[ROW_STOP])}
            legs.append(self._leg(low, high, held, pressed))
        out = []
        for n, ((low, high), leg) in enumerate(zip(pairwise(edges), legs, strict=True)):
            row, after = (events[n], legs[n + 1]) if n < len(events) else (None, leg)
            if high - low <= 0 and row is None:
                continue
            parts = max(1, int(np.ceil((high - low) / LONGEST)))
            cuts = np.linspace(low, high, parts + 1)
            for k, (a, b) in enumerate(pairwise(cuts)):
                out.append(self._piece(a, b, leg, row if k == parts - 1 else None, after))
        return out

    def _relative(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity of the orbit relative to the stops."""
        turns = np.floor(angle / TURN)
        x, v = self.motion._at(turns, angle - TURN * turns)
        at, moving = base_motion(self.oscillator, pace(self.oscillator) * angle)
        return x - at, (v - moving) / self.omega

    def _holder(self, angle: float) -> str:
        """The stop or friction that holds a mass at rest."""
        if self.oscillator.friction is None:
            return "stop"
        q = self._relative(np.array([angle]))[0][0]
        near = 1e-9 * np.abs(self.motion._segments[:, ROW_Q : ROW_V + 1]).max()
        rigid = [stop.position for stop in self.oscillator.stops if stop.law.rigid]
        return "stop" if any(abs(q - at) <= near for at in rigid) else "friction"

    def _pressed(self, angle: float) -> set[int]:
        """Indices of the soft stops in contact where the orbit begins."""
        q, v = (own[0] for own in self._relative(np.array([angle])))
        found = set()
        for k, stop in enumerate(self.oscillator.stops):
            depth, inward = stop.sign * (q - stop.position), stop.sign * v * self.omega
            law = stop.law
            if law.rigid or depth <= 0 or (law.only_pushes and law.push(depth, inward) <= 0):
                continue
            found.add(k)
        return found

    def _leg(self, low: float, high: float, held: str, pressed: set[int]) -> Leg:
        v = self._relative(np.array([(low + high) / 2]))[1][0]
        stops = [self.oscillator.stops[k] for k in sorted(pressed)]
        return Leg(stops, 0 if held else int(np.sign(v)), held)

    def acceleration(self, angle: Any, q: Any, v: Any, pressed: Any, way: int) -> Any:
        """Acceleration with these soft stops in contact and this direction of sliding."""
        own, omega, inertia = self.oscillator, self.omega, self.inertia
        a = (own.load - own.stiffness * q) / inertia - own.damping / (own.mass * omega) * v
        a = a - way * self.kinetic
        for ratio, force in self.waves:
            a = a + (force * np.exp(1j * ratio * angle)).real
        for stop in pressed:
            depth, inward = stop.sign * (q - stop.position), stop.sign * v * omega
            a = a - stop.sign * stop.law.push(depth, inward) / inertia
        if own.law is not None:
            at, moving = base_motion(own, pace(own) * angle)
            law_of = getattr(own.law, "py_func", own.law)
            seen = np.broadcast_arrays(angle / omega, q + at, v * omega + moving)
            rows = zip(*seen, strict=True)
            a = a + np.array([law_of(*row) for row in rows]) / inertia
        return a

    def _piece(self, low: float, high: float, leg: Leg, row: Any, after: Leg) -> Piece:
        """The piece from `low` to `high`, with the event in `row` (None: none)."""
        if leg.held:
            return self._resting(high, leg, row, after)
        nodes, _ = chebyshev()
        angle = low + (high - low) * nodes
        q, v = self._relative(np.clip(angle, low, high))
        # At an event's very instant the motion is sampled after it: the last node is before.
        if row is not None:
            kind, k = row[ROW_KIND], int(row[ROW_STOP])
            if kind in (IMPACT, TOUCH, PART):
                stop = self.oscillator.stops[k]
                if kind != PART or not stop.law.only_pushes:
                    q[-1] = stop.position
                v[-1] = stop.sign * row[ROW_APPROACH] if kind == IMPACT else row[ROW_V]
            else:
                v[-1] = 0.0
        small = 1e-6 * max(np.abs(q).max(), np.abs(v).max())

        def rate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
            return self.acceleration(angle, q, v, leg.pressed, leg.way)

        slopes = np.zeros((NODES, 2, 2))
        slopes[:, 0, 1] = 1.0
        slopes[:, 1, 0] = (rate(q + small, v) - rate(q - small, v)) / (2 * small)
        slopes[:, 1, 1] = (rate(q, v + small) - rate(q, v - small)) / (2 * small)
        if high > low:
            piece = moving(high - low, slopes, 1, int(self.of_velocity), self.gain)
        else:  # two events at one instant
            piece = moving(1.0, np.zeros_like(slopes), 1, 0, 0.0)
        return self._ended(piece, leg, row, angle[-1], q[-1], v[-1], after)

    def _resting(self, high: float, leg: Leg, row: Any, after: Leg) -> Piece:
        """A piece in which the mass is held, up to its release.

        Held by a stop, no difference is left. Held by friction, that of the position is; it and
        what is fed back change when the force reaches what friction holds, which matters where the
        mass sets off with an acceleration.
        """
        end, driven = np.zeros((2, 2)), np.zeros((2, NODES))
        course = np.zeros((NODES, 2))
        if leg.held == "friction":
            end[0, 0] = 1.0
            if not self.of_velocity:
                course[:, 0] = 1.0
            friction = self.oscillator.friction
            if row is not None and friction is not None and friction.static != friction.kinetic:
                q = self._relative(np.array([high]))[0][0]

                def force(angle: float, q: float) -> float:
                    at = np.array([angle])
                    still = np.zeros(1)
                    return float(self.acceleration(at, q + still, still, leg.pressed, 0)[0])

                h = 1e-5
                rise = (force(high + h, q) - force(high - h, q)) / (2 * h)
                of_q = (force(high, q + h) - force(high, q - h)) / (2 * h)
                a = force(high, q) - after.way * self.kinetic
                end[1, 0] = a * (of_q - (0.0 if self.of_velocity else self.gain)) / rise
                driven[1, -1] = a * self.gain / rise
        echo = np.zeros((NODES, NODES))
        return Piece(end, driven, course, echo, np.eye(2), np.zeros(2))

    def _ended(
        self, piece: Piece, leg: Leg, row: Any, angle: float, q: float, v: float, after: Leg
    ) -> Piece:
        """Add the event to a piece: saltation, delay, height of the pulse."""
        if row is None or row[ROW_KIND] == RELEASE:
            return piece
        kind = row[ROW_KIND]
        if kind == STICK:
            left = np.diag([1.0 if after.held == "friction" else 0.0, 0.0])
            return _with(piece, left)

        def pull(q: float, v: float, pressed: Any, way: int) -> float:
            here = np.array([angle]), np.array([q]), np.array([v])
            return float(self.acceleration(*here, pressed, way)[0])

        before = pull(q, v, leg.pressed, leg.way)
        if kind == REVERSE:
            return _with(piece, np.diag([1.0, pull(q, 0.0, leg.pressed, -leg.way) / before]))
        if v == 0.0:
            return piece
        stop = self.oscillator.stops[int(row[ROW_STOP])]
        lag = np.array([-1 / v, 0.0])
        if kind == IMPACT:
            came, slope = self._returned(stop.law, v)
            gained = pull(q, came, leg.pressed, -leg.way)
            jump = np.array([[came / v, 0.0], [(gained - slope * before) / v, slope]])
            return _with(piece, jump, lag, v - came if self.of_velocity else 0.0, slope)
        others = [own for own in leg.pressed if own is not stop]
        then = others if kind == PART else [*leg.pressed, stop]
        gained = pull(q, row[ROW_V], then, leg.way)
        return _with(piece, np.array([[1.0, 0.0], [(gained - before) / v, 1.0]]), lag)

    def _returned(self, law: Any, v: float) -> tuple[float, float]:
        """Velocity after an impact, and its derivative by the velocity before."""
        r = law.restitution
        if not callable(r):
            return -r * v, -r
        r = getattr(r, "py_func", r)
        speed, h = abs(v) * self.omega, 1e-6 * abs(v) * self.omega
        slope = r(speed) + speed * (r(speed + h) - r(speed - h)) / (2 * h)
        return -r(speed) * v, -slope


def _with(
    piece: Piece, jump: np.ndarray, lag: Any = None, height: float = 0.0, kept: float = 1.0
) -> Piece:
    lag = np.zeros(2) if lag is None else lag
    return Piece(piece.end, piece.driven, piece.course, piece.echo, jump, lag, height, kept)
