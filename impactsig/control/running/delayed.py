"""Simulation of an oscillator under delayed feedback: calls of the kernels, and the result."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...oscillators import Oscillator
from ...simulation.basis.contract import run_on
from ...simulation.basis.events import (
    COLUMNS,
    FULL,
    LINE_FULL,
    PHASE,
    START,
    STATUS,
    TURN,
    TURNS,
    row_of,
)
from ...simulation.basis.frame import forcing_of_one
from ...simulation.basis.tableau import DEGREE
from ...simulation.exact.exact import piecewise_linear
from ...simulation.exact.starts import first_place
from ...simulation.motion import Motion, assemble
from ...simulation.run import CHUNK, after, work
from ...simulation.stepping.runge_kutta import RungeKutta, SteppingEngine
from ..feedback import DelayedFeedback, check_signal
from ..schedule import Phase
from .delays.delay_line import DelayLine, basis
from .delays.series import ORDER as SERIES
from .delays.series import series_laps, series_room

if TYPE_CHECKING:
    from ...simulation.basis.delay import Feedback, Line
    from .delays.force import Room

ROWS = 4096  # of the delay line, to begin with
PER_PERIOD, MOST_ROWS = 16, 65_536  # of a long run: what is not written to takes no memory
TOLERANCE = 1e-12  # of the method, unless told otherwise
ORDER = 8  # of the method: what is smoother than that it takes no notice of


class LineRun(ABC):
    """Part of a run under delayed feedback: its delay line, and the phases of a schedule."""

    line: Line
    count: np.ndarray
    clock: np.ndarray
    status: str

    @abstractmethod
    def new_line(self, rows: int) -> Line:
        """Allocate a delay line."""

    @abstractmethod
    def to(self, until: float, feedback: Any) -> None:
        """Advance to a time with a feedback, or None, that begins now."""

    def through(self, phases: tuple[Phase, ...], length: float) -> None:
        """Run through the phases of a schedule."""
        starts = [start for start, _ in phases]
        if starts[0] > 0:
            self.to(starts[0], None)
        for (_, feedback), end in zip(phases, [*starts[1:], length], strict=True):
            self.to(end, feedback)

    def begin(self, fb: Feedback, laps: np.ndarray) -> None:
        """Begin a feedback: nothing is smooth here, and what is fed back comes from elsewhere."""
        from .delays.line import locate
        from .delays.rows import AT, EDGE, FIRST, LAPS

        count = self.count
        count[LAPS], count[EDGE] = max(count[LAPS], laps.max()), 0
        count[FIRST] = self.number
        turns, phase = self.clock[TURNS] - fb.turns, self.clock[PHASE] - fb.phase
        count[AT] = locate(self.line, self.number, turns, phase)

    def lengthen(self) -> None:
        """Double the size of the delay line."""
        number, longer = self.number, self.new_line(2 * self.number)
        longer.when[:number] = self.line.when[:number]
        longer.course[:number] = self.line.course[:number]
        longer.laps[:number] = self.line.laps[:number]
        self.line = longer

    def written(self) -> Line:
        """The rows of the delay line that are written."""
        line, number = self.line, self.number
        return line._replace(
            when=line.when[:number], course=line.course[:number], laps=line.laps[:number]
        )

    @property
    def number(self) -> int:
        """Number of rows of the delay line."""
        from .delays.rows import ROWS as NUMBER

        return int(self.count[NUMBER])


class DelayedRun(LineRun):
    """A run from t = 0 through the phases of a schedule.

    Parameters
    ----------
    oscillator, initial, phase, method, chatter
        As for `simulate`; without a method a piecewise linear oscillator moves by power series.
    feedbacks : sequence of DelayedFeedback or None
        All that will be on: what happens before one is on is fed back as well.
    rows : int
        Of the delay line, to begin with.
    """

    def __init__(
        self,
        oscillator: Oscillator,
        feedbacks: Sequence[Any],
        initial: Any,
        phase: float,
        method: RungeKutta | None,
        chatter: float,
        rows: int = ROWS,
    ) -> None:
        from .delays.rows import COUNTS

        self.oscillator = oscillator
        self.phase = phase
        self.engine = SteppingEngine(oscillator, method or RungeKutta(TOLERANCE), chatter)
        self._by_series = method is None and piecewise_linear(oscillator)
        q, v = first_place(*forcing_of_one(oscillator), initial, phase)
        self.state, count = self.engine.begin(q, v, phase)
        self.count = np.zeros(COUNTS, np.int64)
        self.count[: len(count)] = count
        self.clock = np.array([0.0, phase, 0.0])
        self._laps = np.max([self._laps_of(own) for own in feedbacks], axis=0)
        self.first = row_of(START, self.clock, self.state, count)
        self.line = self.new_line(rows)
        self._room = None if self._by_series else new_room()
        self._series = series_room() if self._by_series else None
        self.rows: list[np.ndarray] = []
        self.status = "complete"
        self._buffer = np.empty((CHUNK, COLUMNS))

    def to(self, until: float, feedback: Any) -> None:
        """Advance to `until` forcing periods with a feedback that begins now."""
        from .delays.run import run

        if self.status != "complete":
            return
        fb, laps = self.feedback(feedback), self._laps
        count, clock = self.count, self.clock
        self.begin(fb, laps)
        end = after(self.phase, until)
        legs = int(work(end[0] - clock[TURNS]))
        engine = self.engine
        tableau = None if self._by_series else engine._tableau

        def on(left: int) -> int:
            found = run(
                engine._problem, tableau, engine._functions, engine._scratch, fb, self.line,
                self._room, self._series, laps, clock, self.state, count, self._buffer, *end, left,
            )  # fmt: skip
            if found != LINE_FULL:
                return found
            self.lengthen()
            return FULL

        found, rows = run_on(on, count, self._buffer, legs)
        self.rows += rows
        self.status = STATUS[found]

    def feedback(self, feedback: DelayedFeedback | None) -> Feedback:
        """The feedback in the engine's units."""
        from ...simulation.basis.delay import DISPLACEMENT, VELOCITY, Feedback

        if feedback is None:
            return Feedback(False, 0.0, 0.0, 0.0, math.inf, math.inf, DISPLACEMENT, 0.0)
        of_velocity = feedback.signal == "velocity"
        omega, mass = self.engine.omega, self.oscillator.mass
        turns = math.floor(feedback.delay)
        phase = TURN * (feedback.delay - turns)
        inertia = mass * omega**2
        return Feedback(
            on=feedback.gain != 0.0,
            gain=feedback.gain / (mass * omega if of_velocity else inertia),
            turns=float(turns),
            phase=phase,
            delay=TURN * turns + phase,
            limit=math.inf if feedback.limit is None else feedback.limit / inertia,
            signal=VELOCITY if of_velocity else DISPLACEMENT,
            memory=feedback.memory,
        )

    def _laps_of(self, feedback: DelayedFeedback | None) -> np.ndarray:
        """`laps_of` for the kernel in use."""
        if not self._by_series or feedback is None:
            return laps_of(feedback)
        return series_laps(self.feedback(feedback))

    def new_line(self, rows: int) -> Line:
        """Allocate a delay line."""
        return new_line(rows, 2, SERIES if self._by_series else None)

    def motion(self) -> tuple[Motion, DelayLine]:
        """The motion from t = 0 to the present, with its delay line."""
        line: Any = DelayLine(self.engine, self.written())
        rows = np.concatenate([[self.first], *self.rows])
        return assemble(
            self.oscillator, line, self.phase, self.first, rows, self.clock, self.state,
            self.count, self.status,
        ), line  # fmt: skip


def run_delayed(
    oscillator: Oscillator, phases: tuple[Phase, ...], length: float, **options: Any
) -> tuple[Motion, DelayLine]:
    """Simulate an oscillator under a schedule of delayed feedbacks.

    Raises
    ------
    InvalidInput
        If one feeds back what is no signal of an oscillator, however late it begins.
    """
    for _, own in phases:
        if isinstance(own, DelayedFeedback):
            check_signal(own)
    rows = max(ROWS, int(min(PER_PERIOD * length, MOST_ROWS)))
    going = DelayedRun(oscillator, [own for _, own in phases], **options, rows=rows)
    going.through(phases, length)
    return going.motion()


def laps_of(feedback: DelayedFeedback | None) -> np.ndarray:
    """Number of delays after which an event or a limit still makes the force not smooth.

    A jump of the velocity is one of the force a delay later, so of the acceleration, then of the
    first derivative of that ... The limit bends the force. Of displacements all this comes one
    order later, and two with each delay. A memory keeps a jump as a jump, but shrinks it.
    """
    if feedback is None:
        return np.ones(2, np.int64)
    twice = feedback.signal == "displacement"
    laps = np.array([ORDER // 2, ORDER // 2 - 1] if twice else [ORDER + 1, ORDER - 1])
    memory = feedback.memory
    return laps + (math.ceil(math.log(1e-16) / math.log(memory)) if memory > 0 else 0)


def new_line(rows: int, coordinates: int, degree: int | None = None) -> Line:
    """Allocate a delay line, of polynomials in Bernstein form or in powers of a degree."""
    from ...simulation.basis.delay import Line

    return Line(
        np.zeros((rows, 3)),
        np.empty((rows, 2 + coordinates, (DEGREE if degree is None else degree) + 1)),
        np.zeros(rows, np.int64),
        None if degree is None else True,
    )


def new_room() -> Room:
    """Allocate work arrays for the force over a step."""
    from .delays.force import Room

    nodes = (1 - np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)) / 2
    return Room(
        nodes=nodes,
        fit=np.ascontiguousarray(np.linalg.inv(basis(nodes))),
        values=np.zeros(DEGREE + 1),
        gap=np.zeros(DEGREE + 1),
        stack=np.zeros((64, DEGREE + 3)),
    )
