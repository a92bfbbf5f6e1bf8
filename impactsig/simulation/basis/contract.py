"""The protocol of an engine, which `simulate` and `Motion` rely on.

An engine works in the unit of time in which the forcing period (`Oscillator.forcing_period`) is a
turn, 2 pi, and in coordinates in which the stops rest. It is called with arrays that it changes:
a `Moment` and rows of events (`events` names their entries).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from .events import FULL, LEG_COUNT, ROW_COUNT


class Moment(NamedTuple):
    """Where a run is: clock, state and counters."""

    clock: np.ndarray
    state: np.ndarray
    counts: np.ndarray


class Engine(Protocol):
    """The protocol of an engine: begin, run to an instant or event, sample, peaks of contacts."""

    omega: float
    """Angular frequency of the reference, per unit of the oscillator's time."""

    def begin(self, q: float, v: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """State and counters of a start at q, v (in the engine's units) and that phase."""

    def run(self, now: Moment, events: np.ndarray, end: tuple[float, float], legs: int) -> int:
        """Advance to the turns and phase of the end, or until the events are full; a status.

        An `events` without rows is not written to.
        """

    def place(self, mode: Any, q: Any) -> Any:
        """Convert positions from the origins of modes to the coordinates of the stops."""

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants, each after the row that `where` names."""

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, from the TOUCH in row `first` to row `last`.

        A contact that the run cut short, at the turns and phase `end`, has `last` = the number of
        rows.
        """


def run_on(
    run: Callable[[int], int], count: np.ndarray, buffer: np.ndarray, legs: int
) -> tuple[int, list[np.ndarray]]:
    """Call an engine until it is done; its status, and the events of each call.

    `run` is given how many of the legs are left, and returns a status: FULL to be called again.
    """
    parts, found = [], FULL
    count[LEG_COUNT] = 0
    while found == FULL:
        found = run(legs - int(count[LEG_COUNT]))
        parts.append(buffer[: count[ROW_COUNT]].copy())
    return found, parts
