"""Run an engine together with the tangent map of its motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...simulation.basis.events import APPROACH, COLUMNS, MODE, PHASE, START, Q, V, row_of
from ...simulation.exact.exact import ExactEngine
from ...simulation.run import Run, after
from ...simulation.stepping.runge_kutta import FixedStep
from .growth import forget

ROOM = 8192  # events that are held at a time
TURNS_AT_A_TIME = 1024.0  # of the reference: bounds what is held however long the run is
LISTED = 10_000  # collapses that are written down


class Follower:
    """A run together with the two columns of its tangent map.

    Parameters
    ----------
    oscillator : Oscillator
        The system.
    orthonormal : bool
        Make the columns orthonormal after every event, and add up how they grow; or multiply all
        maps.
    **options
        As for `simulate`, but for the transient: call `to` and `forget`.

    Raises
    ------
    InvalidInput
        As `simulate` does; and if the method is `FixedStep`, whose steps have no tangent map here.
    """

    def __init__(self, oscillator: Oscillator, orthonormal: bool, **options: Any) -> None:
        from .columns import IN_MODE, LAST, TOTALS

        if isinstance(options.get("method"), FixedStep):
            raise InvalidInput("method", options["method"], "RungeKutta(...) or None")
        run = self.run = Run(oscillator, transient=0.0, **options)
        self.orthonormal = orthonormal
        self.columns = np.eye(2)
        self.totals = np.zeros(TOTALS)
        self.collapses = np.empty((LISTED, 3))
        self.place = np.zeros(6)
        self.place[PHASE], self.place[IN_MODE] = run.phase, run.now.counts[MODE]
        self.place[LAST] = 0
        self._buffer = np.empty((ROOM, COLUMNS))
        self._at = 0.0
        self._tangent: _Exact | _Stepped = (
            _Exact(run.engine) if isinstance(run.engine, ExactEngine) else _Stepped(run, self.place)
        )

    @property
    def omega(self) -> float:
        """Ratio of the engine's unit of time to the oscillator's."""
        return self.run.engine.omega

    def to(
        self, until: float, edges: Sequence[float] | np.ndarray = ()
    ) -> tuple[str, np.ndarray, np.ndarray]:
        """Advance to `until`; returns a status, and instants and totals at the edges.

        Both count as the run does, in periods or seconds; instants are turns and phases.
        """
        from .columns import NEXT

        run, status = self.run, self.run.status
        instants = np.stack(after(run.phase, np.array(edges) * run.per_turn), axis=1)
        taken = np.empty((len(instants), len(self.totals)))
        self.place[NEXT] = 0
        piece = TURNS_AT_A_TIME / run.per_turn
        while self._at < until and status == "complete":
            self._at = min(self._at + piece, until)
            status, rows = run._move(self._at, self._buffer)
            self._tangent.carry(
                rows, run.now.clock[:2], instants, taken, self.place, self.columns, self.totals,
                self.collapses, self.orthonormal,
            )  # fmt: skip
        passed = int(self.place[NEXT])
        return status, instants[:passed], taken[:passed]

    def forget(self) -> None:
        """Reset the totals; the columns stay, and a stick in progress counts."""
        from .columns import BY_FRICTION, FREE, HELD

        forget(self.totals, self.place)
        if self.place[HELD] != FREE:
            self.collapses[0] = *self.place[:2], self.place[HELD] == BY_FRICTION

    def seconds(self, turns: Any, phase: Any) -> Any:
        """Time since the start of the run [s]."""
        unit = self.run.oscillator.time_unit / self.omega
        return (turns * (2 * np.pi) + (phase - self.run.phase)) * unit


class _Exact:
    """The kernels of `_tangent`, for an exact engine."""

    def __init__(self, engine: ExactEngine) -> None:
        self.engine = engine

    def carry(self, *tangent: Any) -> None:
        from ._tangent import carry

        carry(self.engine.problem, *tangent, *self.engine.laws)


class _Stepped:
    """The kernels of `_stepped_tangent`, which repeat the steps of a stepping engine."""

    def __init__(self, run: Run, place: np.ndarray) -> None:
        from ...simulation.stepping.retrace import mode_of
        from ._stepped_variation import STOPS
        from .columns import IN_MODE

        engine: Any = run.engine
        stops = len(run.oscillator.stops)
        self.problem: Any = engine._problem, engine._tableau, engine._functions, engine._scratch
        self.motion = np.zeros(STOPS + 3 * stops)
        self.motion[Q], self.motion[V] = run.now.state[:2]
        self.motion[STOPS : STOPS + stops] = run.now.state[APPROACH:]
        start = np.array(row_of(START, *run.now))
        problem, _tableau, functions, scratch = self.problem
        place[IN_MODE] = mode_of(problem, functions, scratch, start, self.motion[STOPS:])
        self.room: Any = np.empty((13, 4)), np.empty(stops), np.empty(3), np.empty((2, 2))

    def carry(self, *tangent: Any) -> None:
        from ._stepped_tangent import carry

        *before, columns, totals, collapses, orthonormal = tangent
        rest = columns, totals, collapses, orthonormal
        carry(*(*self.problem, *before, self.motion, *rest, *self.room))
