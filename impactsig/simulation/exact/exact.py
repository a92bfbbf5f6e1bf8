"""The exact engine of an oscillator: initial state and calls of the kernels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...oscillators import Oscillator
from .modes import Stack, tables, taken
from .starts import begun

if TYPE_CHECKING:
    from ..basis.contract import Moment
    from .flow import Problem, Scratch


class ExactEngine:
    """The engine of piecewise linear oscillators; implements `contract.Engine`."""

    def __init__(self, oscillator: Oscillator, chatter: float, skip: bool) -> None:
        self.oscillator = oscillator
        self.omega, self.problem, self.laws, self.stack = tables(oscillator, chatter, skip)
        self.scratch = room(self.problem)

    @classmethod
    def of(cls, oscillator: Oscillator, stack: Stack, k: int) -> ExactEngine:
        """The engine of one machine of a stack."""
        engine = cls.__new__(cls)
        engine.oscillator = oscillator
        engine.omega, engine.problem, engine.laws, engine.stack = taken(stack, k)
        engine.scratch = room(engine.problem)
        return engine

    def __reduce__(self) -> tuple[Any, ...]:
        """To other processes: made anew there, since compiled functions cannot go."""
        return ExactEngine, (self.oscillator, self.problem.chatter, self.problem.skip)

    def begin(self, q: float, v: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """State and counters of a start; the stops that are pressed on follow from it."""
        states, counts = begun(self.stack, np.array([q]), np.array([v]))
        return states[0], counts[0]

    def run(self, now: Moment, events: np.ndarray, end: tuple[float, float], legs: int) -> int:
        """Move to the end, writing events until they are full; a status."""
        from .engine import run

        return run(self.problem, self.scratch, *now, events, *end, legs, *self.laws)

    def place(self, mode: Any, q: Any) -> Any:
        """Position in the coordinates of the stops, of positions from the origins of modes."""
        return self.problem.origin[np.asarray(mode, int)] + q

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants, each after the row that `where` names."""
        from .look import sample

        q, v = np.empty(len(turns)), np.empty(len(turns))
        sample(self.problem, self.scratch, rows, where, turns, phase, q, v)
        return q, v

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, from the TOUCH in row `first` to row `last` or the end."""
        from .look import peaks

        stops = self.oscillator.stops
        laws = [stop.law.row() for stop in stops]
        springs = np.array([law.stiffness for law in laws])
        dampers = np.array([law.loss for law in laws]) * self.omega
        positions = np.array([stop.position for stop in stops])
        peak = np.empty(len(first))
        peaks(self.problem, self.scratch, rows, first, last, end, springs, dampers, positions, peak)
        return peak


def piecewise_linear(oscillator: Oscillator) -> bool:
    """Whether the exact engine can simulate an oscillator."""
    return oscillator.law is None and all(stop.law.linear for stop in oscillator.stops)


def room(problem: Problem) -> Scratch:
    """Work arrays for a leg."""
    from .flow import COMPLETE, Scratch

    components, gaps = problem.ratio.shape[-1], problem.gap.shape[-2]
    return Scratch(np.empty((components, 5)), np.empty(COMPLETE + 1), np.empty((gaps, 4)))
