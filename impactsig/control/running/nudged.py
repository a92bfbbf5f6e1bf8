"""Simulation of an oscillator under OGY control, period by period."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from ...oscillators import Oscillator
from ...simulation.basis.contract import Engine, Moment, run_on
from ...simulation.basis.events import (
    COLUMNS,
    DONE,
    MARK,
    MODE,
    PHASE,
    RELEASE,
    ROW_COUNT,
    START,
    STATUS,
    STICK,
    STUCK,
    TURN,
    TURNS,
    Q,
    V,
    row_of,
)
from ...simulation.basis.frame import base_motion, forcing_of_one, multiple, pace
from ...simulation.exact.starts import first_place
from ...simulation.motion import Motion, assemble
from ...simulation.run import CHUNK, LEGS_PER_PERIOD, after, engine_of
from ...simulation.stepping.runge_kutta import SteppingEngine
from ..ogy import OGY


class Nudged:
    """Engines of an oscillator whose parameter changes in spans; implements `Engine` and `Effort`.

    Parameters
    ----------
    oscillator, method, chatter, phase
        As for `simulate`.
    """

    def __init__(self, oscillator: Oscillator, method: Any, chatter: float, phase: float) -> None:
        self.oscillator = oscillator
        self.phase = phase
        self._options = (method, chatter, True)
        self.engine = self._made(oscillator)
        self.omega = self.engine.omega
        self.begins: list[tuple[float, float]] = []  # turns and phase at which each span began
        self.by: list[float] = []  # how far the parameter was moved in it
        self.how: list[Any] = []  # what moved it

    def _made(self, oscillator: Oscillator) -> Engine:
        engine = engine_of(oscillator, *self._options)
        if isinstance(engine, SteppingEngine):
            engine._problem = engine._problem._replace(start=float(self.phase))
        return engine

    def period(self, turns: float, phase: float, how: Any, by: float) -> Engine:
        """Begin a span with the parameter changed; returns its engine."""
        self.begins.append((turns, phase))
        self.by.append(by)
        self.how.append(how)
        return self._of(len(self.by) - 1)

    def _of(self, n: int) -> Engine:
        how = self.how[n]
        if how is None or self.by[n] == 0.0:
            return self.engine
        return self._made(how.nudged(self.oscillator, self.by[n]))

    def _which(self, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Index of the span that instants are in."""
        begins = np.array([turn * TURN + angle for turn, angle in self.begins])
        spans = np.searchsorted(begins, turns * TURN + phase, side="right") - 1
        return np.clip(spans, 0, len(self.by) - 1)

    def place(self, mode: Any, q: Any) -> Any:
        """As the engine; positions do not depend on the parameter."""
        return self.engine.place(mode, q)

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants, each by the engine of its span."""
        own = self._which(*rows[where, :2].T)
        own = np.where(np.array(self.by)[own] == 0.0, -1, own)
        q, v = np.empty(len(turns)), np.empty(len(turns))
        for n in np.unique(own):
            engine = self.engine if n < 0 else self._of(n)
            k = np.flatnonzero(own == n)
            q[k], v[k] = engine.sample(rows, where[k], turns[k], phase[k])
        return q, v

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, each by the engine of the span in which it began."""
        out = np.full(len(first), -np.inf)
        for n, (a, b) in enumerate(zip(first, last, strict=True)):
            out[n] = self._of(int(self._which(*rows[a : a + 1, :2].T)[0])).peaks(
                rows, np.array([a]), np.array([b]), end
            )[0]
        return out

    def force(self, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Control force at instants."""
        own = self._which(turns, phase)
        by = np.array(self.by)[own]
        waves = np.array([how is not None and how.parameter == "amplitude" for how in self.how])
        pulls = self._pace * phase + self._angle
        return by * np.where(waves[own], np.cos(pulls), 1.0)

    @property
    def _pace(self) -> float:
        """Frequency of the force whose amplitude is changed, over the reference frequency."""
        forces = self.oscillator.forces
        return multiple(self.oscillator, forces[0].angular_frequency) if forces else 1.0

    @property
    def _angle(self) -> float:
        return self.oscillator.forces[0].phase if self.oscillator.forces else 0.0

    def squared(self, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        """Integrals of the square of the control force between instants, over the phase."""
        begins = np.array([turn * TURN + angle for turn, angle in self.begins])
        edges = turns * TURN + phase
        out = np.zeros(len(edges) - 1)
        for m, (low, high) in enumerate(pairwise(edges)):
            first = max(int(np.searchsorted(begins, low + 1e-9, "right")) - 1, 0)
            for n in range(first, len(begins)):
                a = max(low, begins[n])
                b = min(high, begins[n + 1]) if n + 1 < len(begins) else high
                if a >= high:
                    break
                how, part = self.how[n], b - a
                if how is not None and how.parameter == "amplitude":
                    a = self._pace * (a % TURN) + self._angle
                    b = a + self._pace * part
                    part = part / 2 + (math.sin(2 * b) - math.sin(2 * a)) / (4 * self._pace)
                out[m] += self.by[n] ** 2 * part
        return out


class SpannedRun:
    """A run whose parameter changes in spans: engines, state and event rows.

    Parameters
    ----------
    oscillator, method, chatter, phase, initial
        As in `simulate`.
    phases : tuple of (float, controller or None)
        Which controller is on from when [forcing periods].
    """

    def __init__(
        self,
        oscillator: Oscillator,
        phases: tuple[tuple[float, Any], ...],
        *,
        initial: Any,
        phase: float,
        method: Any,
        chatter: float,
    ) -> None:
        self.oscillator, self.phase = oscillator, phase
        self.engines = Nudged(oscillator, method, chatter, phase)
        q, v = first_place(*forcing_of_one(oscillator), initial, phase)
        clock = np.array([0.0, phase, 0.0])
        self.now = Moment(clock, *self.engines.engine.begin(q, v, phase))
        self.first = row_of(START, *self.now)
        self._rows = [np.array([self.first])]
        self._phases = phases
        self._starts = np.array([start for start, _ in phases])

    def controller(self, time: float) -> Any:
        """The controller that is active at a time [forcing periods], or None."""
        k = int(np.searchsorted(self._starts, time, "right")) - 1
        return self._phases[k][1] if k >= 0 else None

    def span(self, how: Any, by: float, *, marked: bool) -> Engine:
        """Begin a span with the parameter changed, and a row to sample from; returns its engine."""
        clock, _state, count = self.now
        engine = self.engines.period(clock[TURNS], clock[PHASE], how, by)
        if marked:  # one that begins at rest ends a stick and begins one
            kinds = (RELEASE, STICK) if count[STUCK] else (MARK,)
            self._rows += [np.array([row_of(kind, *self.now)]) for kind in kinds]
        return engine

    def run(
        self, engine: Engine, buffer: np.ndarray, end: tuple[float, float], legs: int
    ) -> tuple[int, np.ndarray]:
        """Call the engine once, to the end or a full buffer: status and new rows."""
        found = engine.run(self.now, buffer, end, legs)
        self._rows.append(buffer[: self.now.counts[ROW_COUNT]].copy())
        return found, self._rows[-1]

    def run_on(
        self, engine: Engine, buffer: np.ndarray, end: tuple[float, float], legs: int
    ) -> int:
        """Call the engine until the end, however often the buffer fills: status."""

        def on(left: int) -> int:
            return engine.run(self.now, buffer, end, left)

        found, rows = run_on(on, self.now.counts, buffer, legs)
        self._rows += rows
        return found

    def motion(self, status: int) -> Motion:
        """The motion so far."""
        engines: Any = self.engines
        return assemble(
            self.oscillator, engines, self.phase, self.first, np.concatenate(self._rows),
            *self.now, STATUS[status],
        )  # fmt: skip


def run_nudged(
    oscillator: Oscillator,
    phases: tuple[tuple[float, Any], ...],
    length: float,
    *,
    phase: float,
    **options: Any,
) -> tuple[Motion, Nudged]:
    """Simulate an oscillator under OGY control."""
    going = SpannedRun(oscillator, phases, phase=phase, **options)
    engines, (_clock, state, count) = going.engines, going.now
    buffer, found = np.empty((CHUNK, COLUMNS)), DONE
    swing = pace(oscillator)
    for n in range(math.ceil(length - 1e-12)):
        how, by = going.controller(n), 0.0
        if how is not None:
            at, moving = base_motion(oscillator, swing * (TURN * n + phase))
            x = float(engines.place(count[MODE], state[Q]) + at)
            by, _ = nudge(how, np.array([x, float(state[V] * engines.omega + moving)]))
        engine = going.span(how, by, marked=n > 0)
        end = after(phase, min(n + 1.0, length))
        found = going.run_on(engine, buffer, end, LEGS_PER_PERIOD)
        if found != DONE:
            break
    return going.motion(found), engines


def nudge(how: OGY, state: np.ndarray) -> tuple[float, np.ndarray]:
    """The parameter change for a state at the section, and the deviation that it is based on."""
    scale = np.array([1.0, 1 / how.orbit.system.angular_forcing_frequency])
    k = int(np.argmin(np.hypot(*((how.points - state) * scale).T)))
    by = -float(how.gain[k] @ (state - how.points[k]))
    return (by, how.gain[k]) if abs(by) <= how.limit else (0.0, np.zeros(2))
