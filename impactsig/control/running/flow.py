"""Simulation of a flow under delayed feedback."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np

from ..._arguments import times_within
from ..._showing import drawn_by
from ...errors import InvalidInput
from ...impacts import Impacts
from ...oscillators.flows import Flow
from ...simulation.basis.events import LINE_FULL, PHASE, STATUS, TURN, TURNS
from ...simulation.basis.tableau import tableau
from ...simulation.flows.course import STEPS, Running, coordinate_of
from ...simulation.moved import Moved
from ..feedback import DelayedFeedback
from .delayed import ROWS, LineRun, laps_of, new_line, new_room

if TYPE_CHECKING:
    from ...simulation.basis.delay import Feedback, Line

AT_LEAST, PER_TIME = 200_000, 2_000  # steps after which a run is given up


class Kept(Protocol):
    """Protocol of the stored trajectory of a controlled flow."""

    def states(self, time: np.ndarray) -> np.ndarray:
        """States at times, shape (n, d)."""

    def force(self, time: np.ndarray) -> np.ndarray:
        """Control term at times, shape (n,)."""


class KeptLine(NamedTuple):
    """A trajectory stored in a delay line."""

    line: Line
    dimension: int
    status: str

    def states(self, time: np.ndarray) -> np.ndarray:
        """States at times, shape (n, d)."""
        from .delays.flow_run import COORDINATES

        own = [self._course(COORDINATES + k, time) for k in range(self.dimension)]
        return np.stack(own, axis=-1)

    def force(self, time: np.ndarray) -> np.ndarray:
        """Term added to the rate of the coordinate that is fed back."""
        from ...simulation.basis.delay import FORCE

        return self._course(FORCE, time)

    def _course(self, which: int, time: np.ndarray) -> np.ndarray:
        from .delays.line import sample

        if len(self.line.laps) == 0:
            raise InvalidInput("time", time, f"a motion of one step or more ({self.status})")
        turns = np.floor(time / TURN)
        out = np.empty(time.size)
        sample(self.line, len(self.line.laps), turns, time - TURN * turns, which, out)
        return out


@dataclass(frozen=True, eq=False, repr=False)
class ControlledFlowMotion(Moved):
    """The simulated trajectory of a controlled flow.

    Attributes
    ----------
    system : Flow
        The flow.
    duration : float
        Duration of the motion, from t = 0.
    schedule : tuple of (float, DelayedFeedback or IntervalFeedback or None)
        Start and controller, for each change of control.
    final : ndarray, shape (d,)
        State at the end.
    status : str
        "complete"; "diverged" if a coordinate exceeded a million times its size without control, as
        under too large a gain; "work limit".
    spikes : Impacts or None
        The crossings that an `IntervalFeedback` used; None under delayed feedback.

    See Also
    --------
    Controlled, plot.controlled_flow, results.FlowMotion

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Controlled, DelayedFeedback, flows, simulate
    >>> feedback = DelayedFeedback(0.2, 5.881, signal="y")
    >>> course = simulate(Controlled(flows.rossler(), feedback, start=100), duration=300)
    >>> float(np.abs(course.force(np.linspace(290, 300, 50))).max()) < 0.01
    True
    """

    system: Flow
    duration: float
    schedule: tuple[tuple[float, Any], ...]
    final: np.ndarray
    status: str
    _kept: Kept = field(repr=False)
    spikes: Impacts | None = None

    start: ClassVar[float] = 0.0

    def sample(self, time: Any) -> np.ndarray:
        """States at any times of the span, shape of `time` and (d,).

        Raises
        ------
        InvalidInput
            If a time is outside the span.
        """
        time = times_within(time, 0.0, self.duration)
        return self._kept.states(time.ravel()).reshape(*time.shape, self.system.dimension)

    def force(self, time: Any) -> np.ndarray:
        """Control term at any times of the span, shape of `time`.

        It is added to the rate of the coordinate that is fed back, or to the parameter that is
        moved.

        Raises
        ------
        InvalidInput
            If a time is outside the span.
        """
        time = times_within(time, 0.0, self.duration)
        return self._kept.force(time.ravel()).reshape(time.shape)

    plot = drawn_by("controlled_flow", "the fed-back coordinate over time")

    def __repr__(self) -> str:
        told = "" if self.status == "complete" else f"; {self.status}"
        return f"ControlledFlowMotion({self.system!r}, t = 0 to {self.duration:g}{told})"


def number_of(flow: Flow, signal: str | int) -> int:
    """Index of the coordinate that is fed back.

    Raises
    ------
    InvalidInput
        If there is none of that name.
    """
    try:
        return coordinate_of(flow, signal)
    except InvalidInput:
        names = ", ".join(flow.coordinates)
        raise InvalidInput("signal", signal, f"a coordinate of the flow: {names}") from None


def control_flow(
    flow: Flow,
    phases: tuple[tuple[float, Any], ...],
    length: float,
    initial: Sequence[float] | None,
) -> ControlledFlowMotion:
    """Simulate a flow under a schedule of delayed feedbacks."""
    going = _Going(flow, [own for _, own in phases], initial)
    going.through(phases, length)
    return going.trajectory(phases)


class _Going(LineRun, Running):
    """A flow in progress, with its delay line."""

    def __init__(
        self, flow: Flow, feedbacks: Sequence[Any], initial: Sequence[float] | None
    ) -> None:
        from .delays.rows import COUNTS

        super().__init__(flow, None, initial)
        self.system = flow
        for own in feedbacks:
            self.feedback(own)  # one that is not of this flow is refused, however late it begins
        self._laps = np.max([laps_of(own) for own in feedbacks], axis=0)
        self.clock, self.greatest = np.zeros(3), np.zeros(1)
        self.count = np.zeros(COUNTS, np.int64)
        self.line = self.new_line(ROWS)
        self.room = new_room()
        self.status = "complete"

    def feedback(self, own: DelayedFeedback | None) -> Feedback:
        """The feedback in the kernel's units."""
        from ...simulation.basis.delay import Feedback
        from .delays.flow_run import COORDINATES

        if own is None:
            return Feedback(False, 0.0, 0.0, 0.0, math.inf, math.inf, COORDINATES, 0.0)
        turns = math.floor(own.delay / TURN)
        return Feedback(
            on=own.gain != 0.0,
            gain=own.gain,
            turns=float(turns),
            phase=own.delay - turns * TURN,
            delay=own.delay,
            limit=math.inf if own.limit is None else own.limit,
            signal=COORDINATES + number_of(self.system, own.signal),
            memory=own.memory,
        )

    def new_line(self, rows: int) -> Line:
        """Allocate a delay line of the coordinates."""
        return new_line(rows, self.system.dimension)

    def to(self, until: float, feedback: DelayedFeedback | None) -> None:
        """Advance to a time with a feedback that begins now."""
        from .delays.flow_run import run

        if self.status != "complete":
            return
        fb = self.feedback(feedback)
        self.begin(fb, self._laps)
        turns = math.floor(until / TURN)
        most = AT_LEAST + PER_TIME * until
        for _ in range(1 + int(most / STEPS)):
            found = run(
                tableau(), self.field, self.scratch, self.course, fb, self.line, self.room,
                self._laps, self.clock, self.count, self.greatest, float(turns),
                until - turns * TURN, STEPS,
            )  # fmt: skip
            status = "" if found == LINE_FULL else STATUS[found]
            if found == LINE_FULL:
                self.lengthen()
            elif status != "work limit":
                self.status = status
                return
        self.status = "work limit"

    def trajectory(self, phases: Any) -> ControlledFlowMotion:
        """The result."""
        return ControlledFlowMotion(
            self.system,
            float(self.clock[TURNS] * TURN + self.clock[PHASE]),
            phases,
            self.course.state[: self.system.dimension].copy(),
            self.status,
            KeptLine(self.written(), self.system.dimension, self.status),
        )
