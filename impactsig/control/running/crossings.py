"""A flow from crossing to crossing of a level, with parameters changed at crossings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...oscillators.flows import Flow
from ...simulation.basis.events import ROUNDED, TIME
from ...simulation.flows.course import Running, coordinate_of


class Crossings:
    """Finds the next upward crossing from a state, with the current parameters.

    Parameters
    ----------
    flow : Flow
        The flow.
    signal : str or int
        The coordinate.
    level : float
        The level that it crosses.
    parameters : sequence of float, optional
        Others than those of the flow.
    """

    def __init__(
        self,
        flow: Flow,
        signal: str | int,
        level: float,
        parameters: Sequence[float] | None = None,
    ) -> None:
        self.signal = coordinate_of(flow, signal)
        self.level = level
        self.across = np.delete(np.arange(flow.dimension), self.signal)
        self._dimension = flow.dimension
        self._finding = Running(flow, self.signal)
        self._moving = Running(flow)
        if parameters is not None:
            self.set(parameters)

    def set(self, parameters: Sequence[float]) -> None:
        """Change the parameters."""
        for running in (self._finding, self._moving):
            running.field.parameters[:] = parameters

    def next(self, state: np.ndarray, time: float, end: float) -> tuple[float, np.ndarray] | None:
        """Time and state of the next crossing; None if there is none before the end."""
        from ...simulation.flows.flow_spikes import Task

        self._begin(self._finding, state, time)
        times, _ = self._finding.spikes(Task(self.level, True, False, end, 1))
        if not len(times):
            return None
        when = float(times[0])
        states = self.between(state, time, np.array([when]))
        if not len(states):
            return None
        states[0, self.signal] = self.level  # not by rounding before it, where it would count again
        return when, states[0]

    def between(self, state: np.ndarray, time: float, instants: np.ndarray) -> np.ndarray:
        """States at ascending instants after a state; fewer if the flow diverges."""
        self._begin(self._moving, state, time)
        return self._moving.sample(instants)[0]

    def _begin(self, running: Running, state: np.ndarray, time: float) -> None:
        course = running.course
        course.state[:] = 0.0
        course.state[: self._dimension] = state
        course.clock[TIME], course.clock[ROUNDED] = time, 0.0
        course.pace[:] = 0.0
