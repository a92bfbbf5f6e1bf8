"""The exact engine for an oscillator: where it starts, and calls of the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..oscillators import Hertz, KelvinVoigt, Oscillator, Rigid
from ._events import COUNTERS, MODE
from ._frame import reference_frequency
from ._laws import spring_push
from ._layout import Layout, layout, only_pushes, structure
from ._modes import problems, tables

if TYPE_CHECKING:
    from ._flow import Problem, Scratch


class ExactEngine:
    """Moves a piecewise linear oscillator; fulfils `_contract.Engine`."""

    def __init__(self, oscillator: Oscillator, chatter: float, skip: bool) -> None:
        self.oscillator = oscillator
        self.omega, self.layout, self.problem, self.laws = tables(oscillator, chatter, skip)
        self.scratch = room(self.problem)

    def __reduce__(self) -> tuple[Any, ...]:
        """To other processes: made anew there, since compiled functions cannot go."""
        return ExactEngine, (self.oscillator, self.problem.chatter, self.problem.skip)

    def begin(self, q: float, v: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """State and counters of a start; the stops that are pressed on follow from it."""
        p = self.problem
        return begun(self.oscillator, self.layout, p.origin, float(p.force_bound[0]), q, v)

    def run(
        self,
        clock: np.ndarray,
        state: np.ndarray,
        count: np.ndarray,
        events: np.ndarray,
        end_turns: float,
        end_phase: float,
        legs: int,
    ) -> int:
        """Move to the end, writing events until they are full; a status."""
        from ._engine import run

        return run(
            self.problem, self.scratch, clock, state, count, events, end_turns, end_phase, legs,
            *self.laws,
        )  # fmt: skip

    def place(self, mode: Any, q: Any) -> Any:
        """Position in the coordinates of the stops, of positions from the origins of modes."""
        return self.problem.origin[np.asarray(mode, int)] + q

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants, each after the row that `where` names."""
        from ._look import sample

        q, v = np.empty(len(turns)), np.empty(len(turns))
        sample(self.problem, self.scratch, rows, where, turns, phase, q, v)
        return q, v

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, from the TOUCH in row `first` to row `last` or the end."""
        from ._look import peaks

        stops = self.oscillator.stops
        soft = [s.law if isinstance(s.law, KelvinVoigt) else KelvinVoigt(1.0) for s in stops]
        springs = np.array([law.stiffness for law in soft])
        dampers = np.array([law.damping for law in soft]) * self.omega
        positions = np.array([stop.position for stop in stops])
        peak = np.empty(len(first))
        peaks(self.problem, self.scratch, rows, first, last, end, springs, dampers, positions, peak)
        return peak


def piecewise_linear(oscillator: Oscillator) -> bool:
    """Whether the exact engine can move it."""
    return not (oscillator.law or any(isinstance(stop.law, Hertz) for stop in oscillator.stops))


def stacked(oscillators: Sequence[Oscillator], chatter: float) -> tuple[Layout, Problem, Scratch]:
    """Layout, tables and room of machines whose tables have the same `shape`."""
    plan = layout(structure(oscillators[0]))
    many = problems(oscillators, plan, chatter, skip=True)
    return plan, many, room(many)


def room(problem: Problem) -> Scratch:
    """Room for a leg."""
    from ._flow import COMPLETE, Scratch

    components, gaps = problem.ratio.shape[-1], problem.gap.shape[-2]
    return Scratch(np.empty((components, 5)), np.empty(COMPLETE + 1), np.empty((gaps, 4)))


def begun(
    oscillator: Oscillator, plan: Layout, origin: np.ndarray, force_bound: float, q: float, v: float
) -> tuple[np.ndarray, np.ndarray]:
    """State and counters of a start; the stops that are pressed on follow from it."""
    omega = reference_frequency(oscillator)
    side, level, lifted = 0, 0, frozenset[int]()
    for name, sign in (("upper", 1), ("lower", -1)):
        for stop in oscillator.stops_on(name):
            depth = sign * (q - stop.position)
            if depth <= 0:
                break
            if isinstance(stop.law, Rigid):
                q = stop.position
                break
            side, level = sign, level + 1
            force = spring_push(stop.law.stiffness, stop.law.damping * omega, depth, sign * v)
            if force < 0 and only_pushes(stop):
                lifted |= {level - 1}
    mode = plan.modes[side, level, lifted]
    if plan.way[mode]:
        mode += v < 0
    count = np.zeros(COUNTERS, np.int64)
    count[MODE] = mode
    # A first touch at next to no speed must not set the scale of chatter.
    slow = 1e-6 * (force_bound + abs(oscillator.load) / (oscillator.mass * omega**2))
    return np.array([q - origin[mode], v, slow, 0.0]), count
