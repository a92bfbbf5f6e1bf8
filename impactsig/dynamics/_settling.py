"""A run past its transient, which ends where its orbit has closed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..oscillators import Oscillator
from ..simulate import Motion
from ..simulate._events import COLUMNS, DONE, STATUS
from ..simulate._exact import ExactEngine
from ..simulate._run import Run
from ._strobing import closing, follow

LONGEST = 32  # periods of an orbit that are told
LEGS = 100_000  # work in one forcing period after which a motion is given up

NOTHING_KNOWN = np.empty((0, 2)), np.empty(0, np.int64), np.empty(0)


@dataclass
class Settled:
    """Where a run is.

    Attributes
    ----------
    run : Run
        At the end of what was followed.
    strobes : numpy.ndarray
        Position and velocity in the engine's units once a period, impacts and energy lost in the
        period before; shape (periods followed + 1, 4).
    closed : int
        Periods of the orbit that it has closed, 0 if it has not.
    status : str
        As that of a Motion.
    """

    run: Run
    strobes: np.ndarray
    closed: int
    status: str

    def motion(self, periods: int) -> Motion:
        """The next so many periods."""
        run = self.run
        run.before = float(len(self.strobes) - 1)
        run.status = self.status
        return run.motion(periods)


def settle(
    oscillator: Oscillator,
    periods: int,
    *,
    tolerance: float,
    longest: int = LONGEST,
    ends: bool = True,
    **start: Any,
) -> Settled:
    """Follow a motion for so many forcing periods, or until its orbit has closed if that `ends`."""
    run = Run(oscillator, periods=1, **start)
    engine, clock, state, count = run.engine, run.clock, run.state, run.count
    strobes = np.empty((periods + 1, 4))
    strobes[0] = engine.place(count[0], state[0]), state[1], 0, 0.0
    if isinstance(engine, ExactEngine):
        status, last, closed, _ = follow(
            engine.problem, engine.scratch, *engine.laws, clock, state, count, strobes,
            (float(tolerance), longest, ends, LEGS), NOTHING_KNOWN,
        )  # fmt: skip
        return Settled(run, strobes[: last + 1], closed, STATUS[status])
    none = np.empty((0, COLUMNS))
    closed = seen = 0
    for n in range(1, periods + 1):
        impacts, energy = count[2], state[3]
        count[6] = 0
        status = engine.run(clock, state, count, none, clock[0] + 1.0, clock[1], LEGS)
        if status != DONE:
            return Settled(run, strobes[:n], 0, STATUS[status])
        place = engine.place(count[0], state[0])
        strobes[n] = place, state[1], count[2] - impacts, state[3] - energy
        m = closing(strobes, n, float(tolerance), longest)
        if m and ends:
            return Settled(run, strobes[: n + 1], m, STATUS[DONE])
        closed, seen = (m, n) if m else (closed, seen)
    return Settled(run, strobes, closed if periods - seen <= 3 * longest else 0, STATUS[DONE])
