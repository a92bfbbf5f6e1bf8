"""Simulation of a flow whose parameter changes at crossings of a level."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...impacts import Impacts, exact
from ...oscillators.flows import Flow
from ...simulation.flows.course import state_of
from .crossings import Crossings
from .flow import ControlledFlowMotion
from .listening import Listener


class Spans:
    """A trajectory of a flow whose parameter changes in spans; implements `Kept`."""

    def __init__(self, crossings: Crossings, flow: Flow) -> None:
        self._crossings, self._flow = crossings, flow
        self.begins: list[float] = []
        self._states: list[np.ndarray] = []
        self._parameters: list[Sequence[float]] = []
        self._by: list[float] = []

    def begin(self, time: float, state: np.ndarray, own: Any, by: float) -> None:
        """Begin a span with the parameter changed."""
        moved = self._flow if by == 0.0 else own.nudged(self._flow, by)
        self._crossings.set(moved.parameters)
        self.begins.append(time)
        self._states.append(state)
        self._parameters.append(moved.parameters)
        self._by.append(by)

    def states(self, time: np.ndarray) -> np.ndarray:
        """States at times, shape (n, d)."""
        instants, back = np.unique(time, return_inverse=True)
        out = np.full((len(instants), self._flow.dimension), np.nan)
        which = self._which(instants)
        for k in np.unique(which):
            at = np.flatnonzero(which == k)
            self._crossings.set(self._parameters[k])
            found = self._crossings.between(self._states[k], self.begins[k], instants[at])
            out[at[: len(found)]] = found
        return out[back.ravel()]

    def force(self, time: np.ndarray) -> np.ndarray:
        """Parameter change at times."""
        return np.array(self._by)[self._which(time)]

    def _which(self, time: np.ndarray) -> np.ndarray:
        return np.maximum(np.searchsorted(self.begins, time, side="right") - 1, 0)


def control_flow_by_intervals(
    flow: Flow,
    phases: tuple[tuple[float, Any], ...],
    length: float,
    initial: Sequence[float] | None,
) -> ControlledFlowMotion:
    """Simulate a flow under interval feedback, with one parameter change per crossing."""
    first = next(own for _, own in phases if own is not None)
    crossings = Crossings(flow, first.signal, first.level)
    listener, spans = Listener(phases), Spans(crossings, flow)
    state, now, by = state_of(flow, initial), 0.0, 0.0
    spans.begin(now, state, None, by)
    times: list[float] = []
    while (found := crossings.next(state, now, length)) is not None:
        now, state = found
        if times:
            listener.hear(now - times[-1])
        times.append(now)
        own, by = listener.moved(now)
        spans.begin(now, state, own, by)
    stop, final, status = length, crossings.between(state, now, np.array([length])), "complete"
    if not len(final):
        stop, final, status = now, state[None], "diverged"
    spikes = Impacts(
        np.array(times), **exact(len(times)), start=0.0, duration=stop, threshold=first.level,
        source=flow.name, reason="" if times else f"no crossing came to t = {stop:g}",
    )  # fmt: skip
    return ControlledFlowMotion(flow, stop, phases, final[0], status, spans, spikes)
