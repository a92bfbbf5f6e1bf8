"""Integration of a flow: its state between calls of the kernels, and why it ended."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._arguments import entries, instance, number
from ..._running.watched import following
from ...errors import InvalidInput
from ...oscillators.flows import Flow
from ..basis.events import DIVERGED, DONE, ENDLESS, EXHAUSTED, TIME
from ..basis.tableau import GAUGE_DEGREE, flow_tableau

if TYPE_CHECKING:
    from .flow_spikes import Task

WITH_STOPS = (
    "What has stops is simulated: its motion has impacts, and displacement_section finds where it "
    "passes a level"
)
OF_A_FLOW = "threshold_crossings and integrate_and_fire make the train of a flow"
STEPS = 50_000  # in a call of a kernel, so that a run can be interrupted
PATIENCE = 20  # calls without a spike, or at a creep, after which none is waited for
CREEP = 1e-7  # of the time to the end: calls that get no further would take days


class Running:
    """The integration of a flow from its initial state on.

    Parameters
    ----------
    flow : Flow
        The flow.
    signal : callable, str or int, optional
        A function of the state, or the name or number of a coordinate; by default the first.
    initial : sequence of float, optional
        Another state to start from.
    fires : bool
        Whether the integral of the signal is followed as well.
    """

    def __init__(
        self,
        flow: Flow,
        signal: Callable[[Any], float] | str | int | None = None,
        initial: Sequence[float] | None = None,
        fires: bool = False,
    ) -> None:
        from ._fields import coordinate, rates_of, signal_of
        from ._flow_crossings import DEPTH
        from .flow_steps import Course, Field, Scratch

        start = state_of(flow, initial)
        native, number = coordinate, 0
        if callable(signal):
            native, number = signal_of(signal, flow.dimension), -1
        elif signal is not None:
            number = coordinate_of(flow, signal)
        parameters = np.array(flow.parameters, float)
        rates = rates_of(flow.function, flow.dimension, len(parameters))
        followed = flow.dimension + fires
        self.field = Field(
            rates, native, number, parameters, flow.dimension, followed, fires or None
        )
        _check_rates(flow, start)
        self.tableau = flow_tableau()
        d = -(-followed // 4) * 4
        self.course = Course(np.zeros(2), np.zeros(d), np.zeros(d), np.zeros(2))
        self.course.state[: flow.dimension] = start
        self.scratch = Scratch(
            k=np.zeros((16, d)),
            stage=np.zeros(d),
            rate=np.zeros(d),
            error3=np.zeros(d),
            error5=np.zeros(d),
            new=np.zeros(d),
            landing=np.zeros(d),
            dense=np.zeros((7, d)),
            gauge=np.zeros(GAUGE_DEGREE + 1),
            stack=np.zeros((DEPTH + 2, GAUGE_DEGREE + 3)),
            coefficients=np.zeros(GAUGE_DEGREE + 1),
            ladder=np.zeros(GAUGE_DEGREE + 1),
        )

    @property
    def time(self) -> float:
        """Time that has been reached."""
        return float(self.course.clock[TIME])

    def sample(self, instants: np.ndarray) -> tuple[np.ndarray, str]:
        """States at instants, ascending, and why there are no more."""
        from .flow_steps import states

        out, done = np.empty((len(instants), self.field.size)), 0

        def on() -> int:
            nonlocal done
            status, done = states(
                self.tableau, self.field, self.scratch, self.course, instants, out, done, STEPS
            )
            return int(status)

        end = float(np.max(instants, initial=0.0))
        with following(end, " s", lambda: self.time):
            status = self.until(end, on) if len(instants) else DONE
        return out[:done], "" if status == DONE else self._why(status)

    def until(self, end: float, on: Callable[[], int]) -> int:
        """Call a kernel until it is done or no longer gets on; its status.

        Before a pole, and where a flow has become too stiff, steps shrink without end.
        """
        status, slow = EXHAUSTED, 0
        while status == EXHAUSTED and slow < PATIENCE:
            since = self.time
            status = on()
            slow = slow + 1 if self.time - since <= CREEP * end else 0
        return status

    def spikes(self, task: Task) -> tuple[np.ndarray, str]:
        """Instants of the spikes, and why there are no more."""
        from .flow_spikes import spikes

        found: list[np.ndarray] = []
        timed, silent = math.isfinite(task.end), 0

        def on() -> int:
            nonlocal task, silent
            status, times = spikes(self.tableau, self.field, task, self.scratch, self.course, STEPS)
            found.append(times)
            task = task._replace(wanted=task.wanted - len(times))
            silent = 0 if len(times) else silent + 1
            return ENDLESS if silent == PATIENCE and not timed else int(status)

        with following(
            task.end if timed else float(task.wanted),
            " s" if timed else " spikes",
            lambda: self.time if timed else float(sum(map(len, found))),
        ):
            status = self.until(task.end if timed else 0.0, on)
        times = np.concatenate(found)
        if status == ENDLESS:
            return times, f"no further spike came to t = {self.time:g}"
        return times, "" if status == DONE else self._why(status)

    def _why(self, status: int) -> str:
        """Why a run did not come to its end."""
        if status == DIVERGED:
            return f"the flow, or its signal, left the finite numbers at t = {self.time:g}"
        return f"the steps became too short to go on at t = {self.time:g}"


def _check_rates(flow: Flow, state: np.ndarray) -> None:
    """Check outside the kernels that the flow returns a rate for every coordinate."""
    try:
        with np.errstate(all="ignore"):
            rates = np.shape(flow.function(0.0, state, *flow.parameters))
    except Exception:  # where it raises the run ends, and says so
        return
    if rates != (flow.dimension,):
        required = f"{flow.dimension} rates, one for every coordinate"
        raise InvalidInput("function", f"rates of shape {rates}", required)


def state_of(flow: Flow, initial: Sequence[float] | None) -> np.ndarray:
    """Validate the initial state.

    Raises
    ------
    InvalidInput
        If it is not a finite number for every coordinate.
    """
    instance("flow", flow, Flow, "a Flow, as impactsig.flows has", WITH_STOPS)
    if initial is None:
        return np.array(flow.initial)
    required = f"{flow.dimension} finite numbers"
    given = [number("initial", value, required) for value in entries("initial", initial, required)]
    if len(given) != flow.dimension:
        raise InvalidInput("initial", initial, required)
    return np.array(given)


def coordinate_of(flow: Flow, name: Any) -> int:
    """Number of a coordinate by its name or number.

    Raises
    ------
    InvalidInput
        If the flow has no such coordinate.
    """
    if isinstance(name, str) and name in flow.coordinates:
        return flow.coordinates.index(name)
    whole = isinstance(name, (int, np.integer)) and not isinstance(name, bool)
    if whole and 0 <= name < flow.dimension:
        return int(name)
    raise InvalidInput(
        "signal", name, f"a function of the state, or one of {', '.join(flow.coordinates)}"
    )
