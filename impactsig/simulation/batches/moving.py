"""Machines of one layout under way together: starts, calls of the kernel, and what it leaves."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._running.threads import in_threads
from ...errors import InvalidInput
from ...oscillators import Oscillator
from ..basis.columns import Form
from ..basis.events import (
    COLUMNS,
    CONTACT_COUNT,
    DONE,
    IMPACT_COUNT,
    LEG_COUNT,
    LOST,
    LOW,
    MODE,
    PHASE,
    START,
    STATUS,
    STICK,
    STICK_COUNT,
    STUCK,
    TURN,
    TURNS,
    Q,
    V,
    row_of,
)
from ..exact.exact import ExactEngine, room
from ..exact.modes import Stack
from ..exact.starts import begun, motion_of_base, places
from ..motion import Motion, assemble
from ..run import after, work

ROOM = 16384  # events that are held at a time
SMALLEST, LARGEST = 16, 512  # machines that one call of the kernel moves


class Moving:
    """Machines of one stack on their way.

    Parameters
    ----------
    stack : Stack
        Their tables.
    initial : ndarray, shape (n, 2)
        Displacements and velocities at t = 0, against the ground.
    phase : ndarray, shape (n,)
        Phases of the forcing at t = 0, within a turn.

    Raises
    ------
    InvalidInput
        If one starts beyond a rigid stop.

    Attributes
    ----------
    on_gpu : bool
        Whether a GPU moves them, in place of threads.
    """

    on_gpu = False

    def __init__(self, stack: Stack, initial: np.ndarray, phase: np.ndarray) -> None:
        q, v = places(stack.columns, stack.forcing, initial, phase)
        self._begin(stack, q, v, phase)

    @classmethod
    def at(cls, stack: Stack, points: np.ndarray, phase: np.ndarray) -> Moving:
        """Machines at points in the engine's coordinates and units, shape (n, 2)."""
        moving = cls.__new__(cls)
        q, v = np.ascontiguousarray(points.T)
        moving._begin(stack, q, v, phase)
        return moving

    @classmethod
    def going_on(cls, stack: Stack, phase: np.ndarray, where: list[Any]) -> Moving:
        """Machines from a clock, state and counters each, which are left as they are."""
        moving = cls.__new__(cls)
        clocks, states, counts = (np.stack(parts) for parts in zip(*where, strict=True))
        moving._from(stack, phase, clocks, states, counts)
        moving.forget()
        return moving

    def _begin(self, stack: Stack, q: np.ndarray, v: np.ndarray, phase: np.ndarray) -> None:
        clocks = np.zeros((len(phase), 3))
        clocks[:, PHASE] = phase
        self._from(stack, phase, clocks, *begun(stack, q, v))

    def _from(
        self, stack: Stack, phase: np.ndarray, clocks: np.ndarray, states: np.ndarray,
        counts: np.ndarray,
    ) -> None:  # fmt: skip
        self.stack, self.phase, n = stack, phase, len(phase)
        self.clocks, self.states, self.counts = clocks, states, counts
        self.status = np.full(n, DONE, np.int64)
        self.ends = np.zeros(n, np.int64)
        self.rows: list[np.ndarray] = []  # events of each block
        self.size = n  # machines in a block
        self.first = self.clocks[:, :LOW].copy(), *self._here()

    def _here(self) -> tuple[np.ndarray, np.ndarray]:
        return self.states.copy(), self.counts.copy()

    def per_turn(self, by_time: bool) -> Any:
        """Turns of the reference in the unit of a run: seconds, or forcing periods."""
        if not by_time:
            return 1.0
        return self.stack.forcing.omega / (TURN * self.stack.columns.time_unit)

    def forget(self) -> None:
        """Count from here."""
        self.counts[:, IMPACT_COUNT : CONTACT_COUNT + 1] = 0
        self.states[:, LOST] = 0.0
        self.first = self.clocks[:, :LOW].copy(), *self._here()

    def to(self, turns: Any, keep: bool, threads: int, legs: int | None = None) -> None:
        """Move all to so many turns after their starts, keeping their events if wanted.

        Each may take the work of `legs`, or unless it is given that of `run.work`.
        """
        from .batch_kernels import move_range

        stack, n = self.stack, len(self.phase)
        end_turns, end_phase = (
            np.ascontiguousarray(np.broadcast_to(part, n)) for part in after(self.phase, turns)
        )
        spare = work(end_turns - self.clocks[:, TURNS])
        if legs is not None:
            spare[:] = legs
        self.counts[:, LEG_COUNT] = 0
        if self.on_gpu:
            from .gpu import move

            places = self.clocks, self.states, self.counts, self.status
            rows, self.ends = move(stack, places, (end_turns, end_phase, spare), keep)
            self.rows, self.size = [rows], n
            return
        several = -(-n // (4 * threads)) if threads > 1 else n
        self.size = size = min(LARGEST, max(SMALLEST, several))

        def block(first: int) -> np.ndarray:
            last, at, done, parts = min(first + size, n), first, 0, []
            scratch, rows = room(stack.problem), np.empty((ROOM if keep else 0, COLUMNS))
            while True:
                upto = move_range(
                    stack.problem, scratch, *stack.laws, self.clocks, self.states, self.counts,
                    end_turns, end_phase, spare, self.status, rows, self.ends, at, last,
                )  # fmt: skip
                used = int(self.ends[min(upto, last - 1)])
                if keep:
                    parts.append(rows[:used].copy())
                    self.ends[at : min(upto + 1, last)] += done
                if upto == last:
                    return np.concatenate(parts) if keep else rows
                at, done = upto, done + used

        self.rows = in_threads(block, range(0, n, size), threads)

    def events(self, k: int) -> np.ndarray:
        """Rows of a machine's events."""
        block, first = self.rows[k // self.size], k % self.size == 0
        return block[0 if first else self.ends[k - 1] : self.ends[k]]

    def motion(self, k: int, oscillator: Oscillator, keep: bool) -> Motion:
        """The motion of one, as `simulate` gives it."""
        _, states, counts = self.first
        engine = ExactEngine.of(oscillator, self.stack, k)
        clock = np.array([*self.first[0][k], 0.0])
        kind = STICK if counts[k, STUCK] else START
        first = row_of(kind, clock, states[k], counts[k])
        rows = np.concatenate([[first], self.events(k)]) if keep else np.empty((0, COLUMNS))
        return assemble(
            oscillator, engine, float(self.phase[k]), first, rows, self.clocks[k].copy(),
            self.states[k].copy(), self.counts[k].copy(), STATUS[self.status[k]],
        )  # fmt: skip

    def totals(self) -> dict[str, np.ndarray]:
        """What `Motion` has as numbers, as arrays."""
        columns, forcing = self.stack.columns, self.stack.forcing
        clocks, states, counts = self.clocks, self.states, self.counts
        omega = forcing.omega
        unit = columns.time_unit / omega
        begins, ends = (
            (clock[:, TURNS] * TURN + (clock[:, PHASE] - self.phase)) * unit
            for clock in (self.first[0], clocks)
        )
        at, moving = motion_of_base(columns, self._phase_of_base())
        machine = np.arange(len(clocks))
        q = self.stack.problem.origin[machine, counts[:, MODE]] + states[:, Q]
        return {
            "start": begins,
            "duration": ends - begins,
            "impact_count": counts[:, IMPACT_COUNT],
            "stick_count": counts[:, STICK_COUNT],
            "energy_lost": states[:, LOST] * columns.mass * (omega * omega),
            "displacement": q + at,
            "velocity": states[:, V] * omega + moving,
            "phase": clocks[:, PHASE],
            "status": np.array(STATUS)[self.status],
        }

    def _phase_of_base(self) -> np.ndarray:
        """Phase of the base's own motion where each is."""
        from ..exact.flow import phases_of

        pace, out = self.stack.forcing.pace, np.empty(len(self.clocks))
        turns, phase = (np.ascontiguousarray(self.clocks[:, c]) for c in (TURNS, PHASE))
        for ratio in np.unique(pace):
            mine = pace == ratio
            out[mine] = phases_of(float(ratio), turns[mine], phase[mine])
        return out


def takes(form: Form) -> None:
    """Refuse machines of a form that a GPU cannot move.

    Raises
    ------
    InvalidInput
        If a restitution coefficient is a function.
    """
    for function in form.functions:
        if function is not None:
            raise InvalidInput(
                "restitution", function, "a number for a GPU", 'Else take executor="threads"'
            )
