"""An engine driven by hand: what it writes, in the oscillator's own unit of time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from impactsig.simulation.basis.contract import Moment
from impactsig.simulation.basis.events import COLUMNS, FULL, START
from impactsig.simulation.stepping.runge_kutta import SteppingEngine

TURN = 2 * np.pi


class Driven(NamedTuple):
    engine: Any
    status: int
    rows: np.ndarray  # with the start
    time: np.ndarray
    kind: np.ndarray
    stop: np.ndarray
    x: np.ndarray  # in the coordinates of the stops
    v: np.ndarray
    approach: np.ndarray
    state: np.ndarray
    count: np.ndarray
    clock: np.ndarray
    phase: float

    def of(self, kind):
        """Where that kind of event is."""
        return np.flatnonzero(self.kind == kind)

    def at(self, time):
        """Position and velocity at times, sampled."""
        time = np.asarray(time, float)
        passed = time * self.engine.omega + self.phase
        turns = np.floor(passed / TURN)
        where = np.searchsorted(self.time, time, side="right") - 1
        q, v = self.engine.sample(self.rows, where, turns, passed - TURN * turns)
        return q, v * self.engine.omega

    @property
    def end(self):
        """Position and velocity at the end."""
        q = self.engine.place(self.count[0], self.state[0])
        return float(q), float(self.state[1] * self.engine.omega)


def drive(oscillator, method, duration, x=0.0, v=0.0, *, phase=0.0, room=4096, legs=10**7):
    """Run an oscillator whose stops rest, or whose start is given in their coordinates."""
    engine = SteppingEngine(oscillator, method)
    state, count = engine.begin(x, v / engine.omega, phase)
    clock = np.array([0.0, phase, 0.0])
    now = Moment(clock, state, count)
    first = [0.0, phase, START, -1.0, count[0], state[0], state[1], 0.0]
    passed = duration * engine.omega + phase
    turns = np.floor(passed / TURN)
    buffer = np.empty((room, COLUMNS))
    parts, status = [[first]], FULL
    while status == FULL:
        status = engine.run(now, buffer, (turns, passed - TURN * turns), legs)
        parts.append(buffer[: count[5]].copy())
    rows = np.concatenate(parts)
    return Driven(
        engine,
        status,
        rows,
        (rows[:, 0] * TURN + (rows[:, 1] - phase)) / engine.omega,
        rows[:, 2].astype(int),
        rows[:, 3].astype(int),
        engine.place(rows[:, 4], rows[:, 5]),
        rows[:, 6] * engine.omega,
        rows[:, 7] * engine.omega,
        state,
        count,
        clock,
        phase,
    )
