"""Simulation of a flow: Flow -> FlowMotion, whose states are computed when asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._arguments import number, times_within
from ..._running.watched import following
from ..._showing import drawn_by
from ...errors import InvalidInput
from ...oscillators.flows import Flow
from ..basis.events import EXHAUSTED, STATUS, TIME
from ..moved import Moved
from ..run import LONGEST
from .course import STEPS, Running

if TYPE_CHECKING:
    from .flow_steps import Course

ENDED = {
    "complete": "",
    "diverged": ", where the flow diverged",
    "work limit": ", where its steps became too short to go on",
}


@dataclass(frozen=True, eq=False, repr=False)
class FlowMotion(Moved):
    """The simulated trajectory of a flow, in its own unit of time.

    Attributes
    ----------
    system : Flow
        The flow.
    start, duration : float
        The span after the transient.
    final : ndarray, shape (d,)
        State at the end; pass it to `simulate` as `initial` to continue.
    status : str
        "complete"; "diverged" if the state overflowed; "work limit" if the steps became too short.
        The span ends before.

    See Also
    --------
    Flow, threshold_crossings, plot.phase_portrait

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import flows, simulate
    >>> lorenz = simulate(flows.lorenz(), duration=20, transient=5)
    >>> lorenz.sample(lorenz.start + 0.04 * np.arange(500)).shape
    (500, 3)
    """

    system: Flow
    start: float
    duration: float
    final: np.ndarray
    status: str
    _marks: tuple[Course, ...] = field(repr=False)
    _end: float = field(repr=False)

    def sample(self, time: Any) -> np.ndarray:
        """States at any times of the span, shape of `time` and (d,).

        The states come from the interpolant of order 7 of the steps, which do not depend on the
        times.

        Raises
        ------
        InvalidInput
            If a time is outside the span.
        """
        asked = times_within(time, self.start, self.stop, ended=ENDED[self.status])
        instants, back = np.unique(np.clip(asked, self.start, self.stop), return_inverse=True)
        out = np.empty((len(instants), self.system.dimension))
        begins = np.array([mark.clock[TIME] for mark in self._marks])
        which = np.searchsorted(begins, instants, side="right") - 1
        for k in np.unique(which):
            own = which == k
            out[own] = self._from(self._marks[k], instants[own])
        return out[back.ravel()].reshape(*asked.shape, self.system.dimension)

    def _from(self, mark: Course, instants: np.ndarray) -> np.ndarray:
        """States at ascending instants, in the steps from a mark to the end of the run."""
        from .flow_steps import states

        running = Running(self.system)
        course = type(mark)(*(part.copy() for part in mark))
        upto = np.append(instants, self._end)
        out, done = np.empty((len(instants), running.field.size)), 0
        while done < len(instants):
            _, done = states(
                running.tableau, running.field, running.scratch, course, upto, out, done, STEPS
            )
        return out

    def stroboscopic(self, phase: float = 0.0) -> Any:
        """Not available for a flow, whose forcing is not known.

        Raises
        ------
        InvalidInput
            Always.
        """
        raise InvalidInput(
            "motion", self, "a motion whose forcing is known",
            "sample(start + n * period) strobes a flow; threshold_crossings cuts it at a level",
        )  # fmt: skip

    plot = drawn_by("phase_portrait", "one coordinate over another")

    def __repr__(self) -> str:
        status = "" if self.status == "complete" else f"; {self.status}"
        return f"FlowMotion({self.system!r}, t = {self.start:g} to {self.stop:g}{status})"


def move(
    flow: Flow,
    *,
    duration: float | None = None,
    transient: float = 0.0,
    initial: Sequence[float] | None = None,
) -> FlowMotion:
    """Integrate a flow by Dormand and Prince's method of order 8, at a tolerance of 1e-13."""
    from .flow_steps import states

    length = number("duration", duration, above=0, most=LONGEST)
    start = number("transient", transient, least=0.0, most=LONGEST)
    running = Running(flow, None, initial)
    course, end = running.course, np.array([start + length])
    marks, done, out = [_copy(course)], 0, np.empty((1, running.field.size))

    def on() -> int:
        nonlocal done
        status, done = states(
            running.tableau, running.field, running.scratch, course, end, out, 0, STEPS
        )
        if status == EXHAUSTED:
            marks.append(_copy(course))
        return int(status)

    with following(start + length, " s", lambda: running.time):
        status = running.until(start + length, on)
    stop = float(end[0]) if done else running.time
    return FlowMotion(
        system=flow,
        start=min(start, stop),
        duration=max(stop - start, 0.0),
        final=course.state[: flow.dimension].copy(),
        status=STATUS[status],
        _marks=tuple(marks),
        _end=float(end[0]),
    )


def _copy(course: Course) -> Course:
    return type(course)(*(part.copy() for part in course))
