"""Follow a motion past its transient, until its orbit has closed or is predicted to close."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....errors import InvalidInput
from ....oscillators import Oscillator
from ....simulation import Motion
from ....simulation.basis.contract import Moment
from ....simulation.basis.events import (
    COLUMNS,
    DONE,
    IMPACT_COUNT,
    LEG_COUNT,
    LOST,
    MODE,
    PHASE,
    STATUS,
    STROBE,
    TURNS,
    Q,
    V,
)
from ....simulation.basis.frame import base_motion, pace, reference_frequency
from ....simulation.exact.exact import ExactEngine, piecewise_linear
from ....simulation.run import Run
from ...tangents.tangent import tangent_map
from .cells import LEGS, NOTHING_KNOWN
from .closing import LONGEST, orbits_beside
from .strobing import closing, follow


def ground(oscillator: Oscillator, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """Origin and units of a run's displacement and velocity, relative to the ground."""
    at = base_motion(oscillator, pace(oscillator) * phase)
    return np.array([float(at[0]), float(at[1])]), np.array([1.0, reference_frequency(oscillator)])


@dataclass
class Settled:
    """State of a run.

    Attributes
    ----------
    oscillator : Oscillator
        The system.
    start : dict
        Where it started: `initial` and `phase`, as `simulate` takes them.
    strobes : numpy.ndarray
        Position and velocity in the engine's units once a period, impacts and energy lost in the
        period before; shape (periods followed + 1, 4).
    closed : int
        Periods of the orbit that it has closed, 0 if it has not, as where the forcing does not
        recur.
    status : str
        As that of a Motion.
    where : Moment
        Clock, state and counters of the engine at the end of what was followed.
    """

    oscillator: Oscillator
    start: dict[str, Any]
    strobes: np.ndarray
    closed: int
    status: str
    where: Moment

    def closing(self) -> Settled:
        """Move to the orbit that the motion converges to, if it has not closed yet."""
        if self.closed or self.status != STATUS[DONE] or not self.oscillator.forcing_recurs:
            return self
        oscillator, phase = self.oscillator, self.start["phase"]
        origin, unit = ground(oscillator, phase)
        again: list[Settled] = []

        def returned(
            _: np.ndarray, points: np.ndarray, periods: np.ndarray
        ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            start = origin + unit * points[0]
            try:
                found = tangent_map(
                    oscillator, periods=int(periods[0]), initial=tuple(start.tolist()), phase=phase
                )
            except InvalidInput:  # beyond a stop
                return points, np.zeros((1, 2, 2)), np.array([False])
            place = (found.final[:2] - origin) / unit
            return place[None], (found.matrix * unit / unit[:, None])[None], np.array([True])

        def strobed(
            _: np.ndarray, points: np.ndarray, periods: int
        ) -> tuple[np.ndarray, np.ndarray]:
            x, v = (origin + unit * points[0]).tolist()
            rule: dict[str, Any] = {"tolerance": 1e-2, "ends": False}
            found = settle(oscillator, periods, initial=(x, v), phase=phase, **rule)
            again[:] = [found]
            return found.strobes[None], np.array([found.status == STATUS[DONE]])

        last = np.array([len(self.strobes) - 1])
        orbits = orbits_beside(self.strobes[None], last, returned, strobed)
        return replace(again[0], closed=int(orbits.period[0])) if orbits.period[0] else self

    def motion(self, periods: int) -> Motion:
        """The motion over the next periods."""
        run = Run(self.oscillator, periods=1, **self.start)
        run.now = self.where
        run.before = float(len(self.strobes) - 1)
        run.status = self.status
        return run.motion(periods)


def settle(
    oscillator: Oscillator,
    periods: int,
    *,
    tolerance: float,
    ends: bool = True,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
) -> Settled:
    """Follow a motion for a number of forcing periods, or until its orbit closes if `ends`."""
    if not isinstance(oscillator, Oscillator):
        raise InvalidInput("scene", oscillator, "a function that makes an Oscillator")
    # Where the forcing does not recur, no motion closes.
    longest = LONGEST if oscillator.forcing_recurs else 0
    rule = float(tolerance), longest, ends, LEGS
    follower = _alone if piecewise_linear(oscillator) else _stepped
    return follower(oscillator, periods, rule, {"initial": initial, "phase": phase})


def _alone(oscillator: Oscillator, periods: int, rule: Any, start: dict[str, Any]) -> Settled:
    """One oscillator by the exact engine."""
    run = Run(oscillator, periods=1, **start)
    engine, where = run.engine, run.now
    assert isinstance(engine, ExactEngine)
    strobes = np.empty((periods + 1, STROBE))
    strobes[0] = engine.place(where.counts[MODE], where.state[Q]), where.state[V], 0, 0.0
    status, last, closed, _ = follow(
        engine.problem, engine.scratch, *engine.laws, *where, strobes, 1, rule, NOTHING_KNOWN
    )
    return Settled(oscillator, start, strobes[: last + 1], closed, STATUS[status], where)


def _stepped(oscillator: Oscillator, periods: int, rule: Any, start: dict[str, Any]) -> Settled:
    """One oscillator by the stepping engine."""
    tolerance, longest, ends, legs = rule
    run = Run(oscillator, periods=1, **start)
    engine, where = run.engine, run.now
    clock, state, count = where
    strobes = np.empty((periods + 1, STROBE))
    strobes[0] = engine.place(count[MODE], state[Q]), state[V], 0, 0.0
    none = np.empty((0, COLUMNS))
    closed = seen = 0
    for n in range(1, periods + 1):
        impacts, energy = count[IMPACT_COUNT], state[LOST]
        count[LEG_COUNT] = 0
        status = engine.run(where, none, (clock[TURNS] + 1.0, clock[PHASE]), legs)
        if status != DONE:
            return Settled(oscillator, start, strobes[:n], 0, STATUS[status], where)
        place = engine.place(count[MODE], state[Q])
        strobes[n] = place, state[V], count[IMPACT_COUNT] - impacts, state[LOST] - energy
        m = closing(strobes, n, tolerance, longest)
        if m and ends:
            return Settled(oscillator, start, strobes[: n + 1], m, STATUS[DONE], where)
        closed, seen = (m, n) if m else (closed, seen)
    closed = closed if periods - seen <= 3 * longest else 0
    return Settled(oscillator, start, strobes, closed, STATUS[DONE], where)
