"""The linearised motion about an orbit under delayed feedback, lap by lap.

Between events it is a linear equation with a delay, solved by collocation at Chebyshev's nodes; a
delay is so many laps of the orbit, so that pieces meet pieces. At an event differences jump by the
saltation matrix. There, what is fed back makes no difference of first order in a derivative, but
in a pulse: an impact that comes ds later than the delayed one leaves a force of finite height,
``gain * jump of the velocity`` or the limit, for a time ds. What it gives to the velocity is linear
in ds, but not with the same factor for either sign: before the impact it loses by the restitution.
So under feedback of the velocity at a rigid stop the map of a lap is linear only in cones; it is
positively homogeneous.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..dynamics.orbits import PeriodicOrbit
from ..errors import InvalidInput
from ..oscillators import Hertz, KelvinVoigt, Rigid
from ..simulate._events import IMPACT, PART, TOUCH
from ..simulate._frame import base_motion, forcing, pace
from ..simulate.motion import TURN
from .feedback import DelayedFeedback

NODES = 28
LONGEST = TURN / 2  # of a piece
FAINT = 1e-15  # share of a memory


@dataclass(frozen=True)
class Piece:
    """From one event to the next."""

    end: np.ndarray  # (2, 2) of the difference at the end by that at the beginning
    driven: np.ndarray  # (2, nodes) of the end by what is fed back
    course: np.ndarray  # (nodes, 2) of the signal at the nodes by the difference at the beginning
    echo: np.ndarray  # (nodes, nodes) and by what is fed back
    jump: np.ndarray  # (2, 2) saltation at its end
    lag: np.ndarray  # (2,) how much later the event is, by the difference just before it
    height: float  # of the pulse of control force per unit of what is late, before the limit
    kept: float  # what an impact makes of a velocity


class Variation:
    """The map of the differences from an orbit over one lap of it.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Without friction or rest.
    feedback : DelayedFeedback
        Its delay a multiple of the orbit's period.

    Raises
    ------
    InvalidInput
        If the orbit is of another kind, or the delay is none of its multiples.
    """

    def __init__(self, orbit: PeriodicOrbit, feedback: DelayedFeedback) -> None:
        laps = round(feedback.delay / orbit.periods)
        if laps < 1 or abs(feedback.delay - laps * orbit.periods) > 1e-12 * feedback.delay:
            raise InvalidInput(
                "delay", feedback.delay, f"a multiple of the orbit's {orbit.periods} periods",
                "With another the orbit is not one of the controlled oscillator",
            )  # fmt: skip
        if feedback.signal not in ("velocity", "displacement"):
            raise InvalidInput("signal", feedback.signal, '"velocity" or "displacement"')
        oscillator = self.oscillator = orbit.oscillator
        motion = orbit.motion()
        if oscillator.friction is not None or motion.stick_count:
            raise InvalidInput("orbit", orbit, "an orbit without friction or rest")
        self.laps = laps
        self.memory = feedback.memory
        self.of_velocity = feedback.signal == "velocity"
        omega: float = motion._engine.omega
        inertia = oscillator.mass * omega**2
        self.gain = feedback.gain / (oscillator.mass * omega if self.of_velocity else inertia)
        self.limit = np.inf if feedback.limit is None else feedback.limit / inertia
        self.omega = omega
        self.waves = forcing(oscillator)
        self.pieces = self._pieces(motion)
        self.linear = not (
            self.gain and self.of_velocity and any(piece.height for piece in self.pieces)
        )

    def _pieces(self, motion: Any) -> list[Piece]:
        rows = motion._segments
        which = np.isin(rows[:, 2], (IMPACT, TOUCH, PART))
        begins = rows[:, 0] * TURN + rows[:, 1]
        start = begins[0]
        stop = motion._last[0] * TURN + motion._last[1]
        edges = [start, *begins[which], stop]
        events = [*rows[which], None]
        out = []
        for low, high, row in zip(edges[:-1], edges[1:], events, strict=True):
            if high - low <= 0:
                continue
            parts = max(1, int(np.ceil((high - low) / LONGEST)))
            cuts = np.linspace(low, high, parts + 1)
            middle = self._relative(motion, np.array([(low + high) / 2]))[0][0]
            pressed = [
                stop for stop in self.oscillator.stops
                if not isinstance(stop.law, Rigid)
                and (1 if stop.side == "upper" else -1) * (middle - stop.position) > 0
            ]  # fmt: skip
            for k in range(parts):
                event = row if k == parts - 1 else None
                out.append(self._piece(motion, cuts[k], cuts[k + 1], pressed, event))
        return out

    def _relative(self, motion: Any, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity of the orbit against the stops, in the engine's units."""
        turns = np.floor(angle / TURN)
        x, v = motion._at(turns, angle - TURN * turns)
        at, moving = base_motion(self.oscillator, pace(self.oscillator) * angle)
        return x - at, (v - moving) / self.omega

    def acceleration(self, angle: Any, q: Any, v: Any, pressed: Any) -> Any:
        """Of the oscillator, against the stops, with these soft stops pressed on."""
        own, omega = self.oscillator, self.omega
        inertia = own.mass * omega**2
        a = (own.load - own.stiffness * q) / inertia - own.damping / (own.mass * omega) * v
        for ratio, force in self.waves:
            a = a + (force * np.exp(1j * ratio * angle)).real
        for stop in pressed:
            side, law = (1 if stop.side == "upper" else -1), stop.law
            depth, inward = side * (q - stop.position), side * v * omega
            if isinstance(law, KelvinVoigt):
                push = law.stiffness * depth + law.damping * inward
            else:
                assert isinstance(law, Hertz)
                push = law.stiffness * np.maximum(depth, 0.0) ** law.exponent
                push = push * (1 + law.damping * inward)
            a = a - side * push / inertia
        if own.law is not None:
            at, moving = base_motion(own, pace(own) * angle)
            law_of = getattr(own.law, "py_func", own.law)
            seen = np.broadcast_arrays(angle / omega, q + at, v * omega + moving)
            rows = zip(*seen, strict=True)
            a = a + np.array([law_of(*row) for row in rows]) / inertia
        return a

    def _piece(self, motion: Any, low: float, high: float, pressed: Any, row: Any) -> Piece:
        """Collocation from `low` to `high`, and the event in `row` (None: there is none)."""
        nodes, slope = chebyshev(NODES)
        h = high - low
        angle = low + h * nodes
        q, v = self._relative(motion, np.clip(angle, low, high))
        # At an event's very instant the motion is sampled after it: the last node is before.
        if row is not None:
            k = int(row[3])
            stop = self.oscillator.stops[k]
            side = 1 if stop.side == "upper" else -1
            q[-1] = stop.position
            v[-1] = side * row[7] if row[2] == IMPACT else row[6]
        small = 1e-6 * max(np.abs(q).max(), np.abs(v).max())

        def rate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
            return self.acceleration(angle, q, v, pressed)

        of_q = (rate(q + small, v) - rate(q - small, v)) / (2 * small)
        of_v = (rate(q, v + small) - rate(q, v - small)) / (2 * small)
        if self.of_velocity:
            of_v = of_v - self.gain
        else:
            of_q = of_q - self.gain
        n, eye, zero = NODES, np.eye(NODES), np.zeros((NODES, NODES))
        system = np.block([[slope / h, -eye], [-np.diag(of_q), slope / h - np.diag(of_v)]])
        right = np.block([[np.zeros((n, 2)), zero], [np.zeros((n, 2)), self.gain * eye]])
        for equation, unknown in ((0, 0), (n, n)):
            system[equation], right[equation] = 0.0, 0.0
            system[equation, unknown] = 1.0
            right[equation, equation // n] = 1.0
        solved = np.linalg.solve(system, right)
        own = solved[n:] if self.of_velocity else solved[:n]
        last = np.stack([solved[n - 1], solved[-1]])
        jump, lag, height, kept = self._event(row, angle[-1], q[-1], v[-1], pressed)
        return Piece(
            last[:, :2], last[:, 2:], own[:, :2], own[:, 2:], jump, lag, height, kept
        )  # fmt: skip

    def _event(self, row: Any, angle: float, q: float, v: float, pressed: Any) -> Any:
        """Saltation, how late the event is, height of the pulse, and what is kept of a velocity."""
        jump, lag, none = np.eye(2), np.zeros(2), (0.0, 1.0)
        if row is None or v == 0.0:
            return jump, lag, *none
        stop = self.oscillator.stops[int(row[3])]
        lag = np.array([-1 / v, 0.0])

        def pull(q: float, v: float, pressed: Any) -> float:
            here = (np.array([angle]), np.array([q]), np.array([v]))
            return float(self.acceleration(here[0], here[1], here[2], pressed)[0])

        before = pull(q, v, pressed)
        if row[2] == IMPACT:
            after, slope = self._returned(stop.law, v)
            gained = pull(q, after, pressed)
            jump = np.array([[after / v, 0.0], [(gained - slope * before) / v, slope]])
            return jump, lag, v - after if self.of_velocity else 0.0, slope
        others = [own for own in pressed if own is not stop]
        then = others if row[2] == PART else [*pressed, stop]
        gained = pull(q, row[6], then)
        jump = np.array([[1.0, 0.0], [(gained - before) / v, 1.0]])
        return jump, lag, *none

    def _returned(self, law: Any, v: float) -> tuple[float, float]:
        """Velocity after an impact, and its derivative by that before."""
        r = law.restitution
        if not callable(r):
            return -r * v, -r
        r = getattr(r, "py_func", r)
        speed, h = abs(v) * self.omega, 1e-6 * abs(v) * self.omega
        slope = r(speed) + speed * (r(speed + h) - r(speed - h)) / (2 * h)
        return -r(speed) * v, -slope

    # -- going round ---------------------------------------------------------------------------

    def start(self, rng: np.random.Generator, count: int) -> State:
        """Some differences at random, `count` of them side by side."""
        size = len(self.pieces)
        return State(
            rng.standard_normal((2, count)),
            [rng.standard_normal((size, NODES, count)) for _ in range(self.laps)],
            [np.zeros((size, 1, count)) for _ in range(self.laps)],
        )

    def lap(self, state: State) -> State:
        """The differences one lap later."""
        z = state.now
        late, came = state.late[0], state.came[0]
        count = z.shape[1]
        fed = np.empty((len(self.pieces), NODES, count))
        lags = np.zeros((len(self.pieces), 1, count))
        for j, piece in enumerate(self.pieces):
            own = piece.course @ z + piece.echo @ late[j]
            fed[j] = (1 - self.memory) * own + self.memory * late[j]
            before = piece.end @ z + piece.driven @ late[j]
            lags[j, 0] = piece.lag @ before
            z = piece.jump @ before
            if piece.height and self.gain:
                z[1] += self._pulse(piece, lags[j, 0], came[j])
        kept = lags
        if self.memory > 0:
            room = 1 + int(np.ceil(np.log(FAINT) / np.log(self.memory)))
            kept = np.concatenate([lags, came], axis=1)[:, :room]
        return State(z, [*state.late[1:], fed], [*state.came[1:], kept])

    def _pulse(self, piece: Piece, own: np.ndarray, others: np.ndarray) -> np.ndarray:
        """What the velocity after an impact gains from the force between it and the delayed.

        `others` are how late the delayed impacts were, a row for each delay.
        """
        shares = (1 - self.memory) * self.memory ** np.arange(len(others))
        shares[-1] = self.memory ** (len(others) - 1)
        edges = np.sort(np.concatenate([others, own[None]]), axis=0)
        middle = (edges[1:] + edges[:-1]) / 2
        early = middle < own  # than the impact itself
        ahead = np.einsum("m,mei->ei", shares, others[:, None] > middle) - early
        force = np.clip(self.gain * piece.height * ahead, -self.limit, self.limit)
        return np.sum(force * np.diff(edges, axis=0) * np.where(early, piece.kept, 1.0), axis=0)


@dataclass(frozen=True)
class State:
    """Differences from the orbit: now, and as what is fed back in the laps to come."""

    now: np.ndarray  # (2, count)
    late: list[np.ndarray]  # for each lap of the delay: (pieces, nodes, count)
    came: list[np.ndarray]  # how late its impacts were: (pieces, remembered, count)

    def size(self) -> np.ndarray:
        """Of the differences, shape (count,)."""
        parts = [np.abs(self.now).max(axis=0)]
        parts += [np.abs(late).max(axis=(0, 1)) for late in self.late]
        return np.max(parts, axis=0)

    def divided(self, by: np.ndarray) -> State:
        """All of it divided."""
        late, came = [own / by for own in self.late], [own / by for own in self.came]
        return State(self.now / by, late, came)


def chebyshev(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on [0, 1], ascending, and the matrix of differentiation [Trefethen2000]_, chapter 6."""
    k = np.arange(n)
    x = np.cos(np.pi * k / (n - 1))
    c = np.where((k == 0) | (k == n - 1), 2.0, 1.0) * (-1.0) ** k
    apart = x[:, None] - x[None, :]
    d = np.outer(c, 1 / c) / (apart + np.eye(n))
    d -= np.diag(d.sum(axis=1))
    return (1 - x) / 2, -2 * d
