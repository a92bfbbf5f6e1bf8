"""What many machines did, as arrays: for questions of each that need no Motion."""

from __future__ import annotations

import numpy as np

from .._body_energy import energy_gained
from ..basis.events import (
    COLUMNS,
    IMPACT,
    LOW,
    MODE,
    PHASE,
    RELEASE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_STOP,
    START,
    STICK,
    STUCK,
    TOUCH,
    TURN,
    TURNS,
    Q,
    V,
)
from ..exact.exact import room
from ..exact.flow import phases_of
from ..exact.starts import motion_of_base
from .moving import Moving


class Course:
    """Machines of one stack that have just been moved, their events kept.

    Numbers are those of the `Motion` of each, to the last bit.

    Attributes
    ----------
    moving : Moving
        The machines.
    totals : dict of str to ndarray
        See `Moving.totals`.
    rows : ndarray
        Their events, one machine after the other, each begun with where it was at first.
    time : ndarray
        When each was, since the start of the run.
    """

    def __init__(self, moving: Moving) -> None:
        self.moving, self.totals, n = moving, moving.totals(), len(moving.phase)
        lengths = np.array([len(rows) for rows in moving.rows])
        upto = moving.ends + (np.cumsum(lengths) - lengths)[np.arange(n) // moving.size]
        self.ends = upto + np.arange(1, n + 1)
        self._begins = np.append(0, self.ends[:-1])
        self.rows = rows = np.empty((lengths.sum() + n, COLUMNS))
        event = np.ones(len(rows), bool)
        event[self._begins] = False
        rows[event] = np.concatenate(moving.rows)
        clocks, states, counts = moving.first
        kind, none = np.where(counts[:, STUCK], STICK, START), np.zeros(n)
        rows[self._begins] = np.stack(
            [*clocks.T, kind, none - 1, counts[:, MODE], states[:, Q], states[:, V], none], axis=1
        )
        self._owner = np.repeat(np.arange(n), self.ends - self._begins)
        self._per_second = moving.stack.forcing.omega / moving.stack.columns.time_unit
        self.time = np.minimum(
            self._seconds(self._owner, rows[:, TURNS], rows[:, PHASE]),
            self._seconds(np.arange(n), *moving.clocks[:, :LOW].T)[self._owner],
        )

    def _seconds(self, machine: np.ndarray, turns: np.ndarray, phase: np.ndarray) -> np.ndarray:
        moving = self.moving
        unit = moving.stack.columns.time_unit / moving.stack.forcing.omega
        return (turns * TURN + (phase - moving.phase[machine])) * unit[machine]

    def of(self, k: int) -> slice:
        """Rows of a machine."""
        return slice(int(self._begins[k]), int(self.ends[k]))

    def hits(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Instants, approach velocities and stops of the impacts of a machine."""
        rows, time = self.rows[self.of(k)], self.time[self.of(k)]
        hit = (rows[:, ROW_KIND] == IMPACT) | (rows[:, ROW_KIND] == TOUCH)
        approach = rows[hit, ROW_APPROACH] * self.moving.stack.forcing.omega[k]
        return time[hit], approach, rows[hit, ROW_STOP]

    def sticking(self) -> np.ndarray:
        """Share of the time at rest."""
        kind = self.rows[:, ROW_KIND]
        rest = np.zeros(len(self.ends))
        for k in np.unique(self._owner[kind == STICK]).tolist():
            own, time = kind[self.of(k)], self.time[self.of(k)]
            begin, end = time[own == STICK], time[own == RELEASE]
            if len(end) < len(begin):
                clock = self.moving.clocks[k : k + 1]
                end = np.append(end, self._seconds(np.array([k]), clock[:, TURNS], clock[:, PHASE]))
            rest[k] = np.sum(end - begin)
        return rest / self.totals["duration"]

    def kinetic_energy_gained(self) -> np.ndarray:
        """As `Motion.kinetic_energy_gained`."""
        stack = self.moving.stack
        _, base = self._base(self._owner, self.rows[:, TURNS], self.rows[:, PHASE])
        sides = np.array([float(side) for side, _ in stack.columns.form.stops])
        gained = np.empty(len(self.ends))
        with np.errstate(invalid="ignore", over="ignore"):  # of motions that have diverged
            for k, mass in enumerate(stack.columns.mass):
                rows, moving = self.rows[self.of(k)], base[self.of(k)]
                gained[k] = energy_gained(rows, moving, stack.forcing.omega[k], sides, mass)
        return gained

    def strobes(self) -> list[np.ndarray]:
        """Displacement and velocity once a forcing period, at the phase of the end of each."""
        (first, early), (last, late) = self.moving.first[0].T, self.moving.clocks[:, :LOW].T
        phase = np.fmod(late, TURN) % TURN
        low, high = first + (phase < early), last + (phase <= late)
        count = np.maximum(np.ceil(high - low), 0).astype(int)
        machine = np.repeat(np.arange(len(count)), count)
        before = np.cumsum(count) - count
        turns = low[machine] + (np.arange(count.sum()) - before[machine])
        places = np.column_stack(self._at(machine, turns, phase[machine]))
        return np.split(places, before[1:])

    def sample(self, times: list[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Displacement and velocity of each machine at its times, which ascend."""
        count = np.array([len(own) for own in times])
        machine, time = np.repeat(np.arange(len(times)), count), np.concatenate(times)
        passed, phase = time * self._per_second[machine], self.moving.phase[machine]
        turns = np.floor((passed + phase) / TURN)
        x, v = self._at(machine, turns, (passed - TURN * turns) + phase)
        ends = np.cumsum(count)[:-1]
        return list(zip(np.split(x, ends), np.split(v, ends), strict=True))

    def _at(
        self, machine: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity of machines, in ascending order, at instants of each."""
        from .look_kernels import sample_range

        stack, n = self.moving.stack, len(turns)
        lasts = np.searchsorted(machine, np.arange(len(self.ends)), side="right")
        q, v = np.empty(n), np.empty(n)
        sample_range(
            stack.problem, room(stack.problem), self.rows, self.ends, lasts, turns, phase,
            np.empty(n, np.int64), q, v,
        )  # fmt: skip
        at, moving = self._base(machine, turns, phase)
        return q + at, v * stack.forcing.omega[machine] + moving

    def _base(
        self, machine: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacement and velocity of the base of the stops of machines at instants."""
        stack = self.moving.stack
        pace, own = stack.forcing.pace[machine], np.empty(len(turns))
        for ratio in np.unique(pace).tolist():
            mine = pace == ratio
            own[mine] = phases_of(ratio, turns[mine], phase[mine])
        return motion_of_base(stack.columns._replace(base=stack.columns.base[:, machine]), own)
