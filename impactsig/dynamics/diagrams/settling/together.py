"""Follow many runs past their transients side by side, for diagrams and responses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...._running.threads import in_threads
from ....oscillators import Oscillator
from ....simulation import Motion
from ....simulation.basis.columns import columns_of, form_of
from ....simulation.basis.contract import Moment
from ....simulation.basis.events import DONE, STATUS, STROBE
from ....simulation.basis.frame import first_phase, place_of
from ....simulation.batches.course import Course
from ....simulation.batches.moving import Moving
from ....simulation.exact.exact import piecewise_linear
from ....simulation.exact.modes import Stack, stacks, subset
from ....simulation.exact.starts import motion_of_base
from ....simulation.run import span
from ...tangents.batches.tangent_maps import maps_of
from .cells import CHATTER, LEGS, Started, strobed
from .closing import LONGEST, orbits_beside
from .settling import Settled, settle
from .strobing import CLOSED, STATUS_OF, TAKEN

TOGETHER = 256  # machines that one call of the kernel follows
STROBES = 100_000  # and how many strobes they may take, which are kept until it is done


def settles(system: Any) -> bool:
    """Whether a system is followed by strobes: an oscillator without noise."""
    return isinstance(system, Oscillator) and system.noise is None


def in_blocks(
    task: Callable[[list[int]], list[Any]], systems: Sequence[Any], periods: int, threads: int
) -> list[Any]:
    """Results of a task over systems, in order; oscillators in blocks, others one by one."""
    some = max(1, min(TOGETHER, STROBES // periods))
    able = [k for k, one in enumerate(systems) if settles(one)]
    # Every so many, as work differs from one part of a range to another.
    parts = min(max(-(-len(able) // some), threads), len(able))
    blocks = [able[at::parts] for at in range(parts)]
    blocks += [[k] for k, one in enumerate(systems) if not settles(one)]
    done = in_threads(task, blocks, threads)
    found: dict[int, Any] = {}
    for block, own in zip(blocks, done, strict=True):
        found.update(zip(block, own, strict=True))
    return [found[k] for k in range(len(systems))]


class Settling:
    """Runs in progress, each equal to that of `settling.settle` to the last bit.

    Those that the exact engine moves go by one call of the kernel for each layout of their tables;
    any other goes alone.

    Parameters
    ----------
    machines : sequence of Oscillator
        What moves, without noise.
    periods, tolerance, ends, initial, phase
        As for `settle`.

    Attributes
    ----------
    settled : list of Settled
        Where each is.
    """

    def __init__(
        self,
        machines: Sequence[Oscillator],
        periods: int,
        *,
        tolerance: float,
        ends: bool = True,
        initial: tuple[float, float] = (0.0, 0.0),
        phase: float = 0.0,
    ) -> None:
        start: dict[str, Any] = {"initial": initial, "phase": phase}
        self._first = first_phase(phase)
        self._groups: list[tuple[Stack, list[int]]] = []
        settled: dict[int, Settled] = {}
        forms: dict[Any, list[int]] = {}
        for k, machine in enumerate(machines):
            if piecewise_linear(machine):
                span(periods, None, 0.0, bool(machine.angular_frequencies))
                forms.setdefault(form_of(machine), []).append(k)
            else:
                settled[k] = settle(machine, periods, tolerance=tolerance, ends=ends, **start)
        for own in forms.values():
            for stack in stacks(columns_of(machines[k] for k in own), CHATTER, True):
                for recurs in np.unique(stack.forcing.recurs).tolist():
                    mine = np.flatnonzero(stack.forcing.recurs == recurs)
                    which = [own[k] for k in stack.which[mine].tolist()]
                    group = subset(stack, mine)
                    rule = float(tolerance), LONGEST if recurs else 0, ends, LEGS
                    self._groups.append((group, which))
                    for k, one in zip(
                        which, self._followed(group, machines, which, start, periods, rule),
                        strict=True,
                    ):  # fmt: skip
                        settled[k] = one
        self.settled = [settled[k] for k in range(len(machines))]

    def _followed(
        self, stack: Stack, machines: Sequence[Oscillator], which: list[int],
        start: dict[str, Any], periods: int, rule: tuple[float, int, bool, int],
    ) -> list[Settled]:  # fmt: skip
        """Follow oscillators of one stack until their orbits close."""
        n = len(which)
        places = np.broadcast_to(np.array(place_of(start["initial"])), (n, 2))
        moving = Moving(stack, places, np.full(n, self._first))
        begun = Started(moving.clocks, moving.states, moving.counts)
        strobes, ended = strobed(stack, begun, periods, rule)
        return [
            Settled(
                machines[which[k]], start, strobes[k, : ended[k, TAKEN] + 1].copy(),
                int(ended[k, CLOSED]), STATUS[ended[k, STATUS_OF]], _moment(begun, k),
            )
            for k in range(n)
        ]  # fmt: skip

    def close(self) -> None:
        """Find the orbits near those that have not closed (`Settled.closing`)."""
        alone = set(range(len(self.settled)))
        for stack, which in self._groups:
            self._close(stack, which)
            alone -= set(which)
        for k in alone:
            self.settled[k] = self.settled[k].closing()

    def _close(self, whole: Stack, which: list[int]) -> None:
        """Move oscillators of one stack to the orbits that their motions converge to."""
        open_ones = [
            j for j, k in enumerate(which)
            if not self.settled[k].closed and self.settled[k].status == STATUS[DONE]
        ]  # fmt: skip
        if not open_ones or not whole.forcing.recurs[0]:
            return
        stack, own = subset(whole, np.array(open_ones)), [which[j] for j in open_ones]
        last = np.array([len(self.settled[k].strobes) - 1 for k in own])
        strobes = np.zeros((len(own), last.max() + 1, STROBE))
        for row, k in zip(strobes, own, strict=True):
            row[: len(self.settled[k].strobes)] = self.settled[k].strobes
        phase = np.full(len(own), self._first)
        origin = np.stack(motion_of_base(stack.columns, stack.forcing.pace * phase), axis=1)
        unit = np.stack([np.ones(len(own)), stack.forcing.omega], axis=1)
        again: dict[int, Settled] = {}

        def returned(
            some: np.ndarray, points: np.ndarray, periods: np.ndarray
        ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            starts = origin[some] + unit[some] * points
            places, matrices = points.copy(), np.zeros((len(some), 2, 2))
            came = np.zeros(len(some), bool)
            found = maps_of(subset(stack, some), starts, phase[some], periods)
            for k, there in enumerate(found):
                if there is not None:
                    places[k], matrices[k], came[k] = there.final[:2], there.matrix, True
            places[came] = (places[came] - origin[some[came]]) / unit[some[came]]
            return places, matrices * unit[some][:, None] / unit[some][:, :, None], came

        def strobed_again(
            some: np.ndarray, points: np.ndarray, periods: int
        ) -> tuple[np.ndarray, np.ndarray]:
            moving = Moving(subset(stack, some), origin[some] + unit[some] * points, phase[some])
            begun = Started(moving.clocks, moving.states, moving.counts)
            rows, ended = strobed(moving.stack, begun, periods, (1e-2, LONGEST, False, LEGS))
            for j, k in enumerate(some.tolist()):
                before = self.settled[own[k]]
                again[k] = replace(before, strobes=rows[j], where=_moment(begun, j))
            return rows, ended[:, STATUS_OF] == DONE

        orbits = orbits_beside(strobes, last, returned, strobed_again)
        for k in np.flatnonzero(orbits.period).tolist():
            self.settled[own[k]] = replace(again[k], closed=int(orbits.period[k]))

    def on(
        self, periods: Sequence[int]
    ) -> tuple[list[tuple[list[int], Course]], dict[int, Motion]]:
        """Go on for so many periods each: oscillators of each layout together, and the others.

        Whatever has ended early is among the others.
        """
        courses = []
        alone = dict.fromkeys(range(len(self.settled)))
        for stack, which in self._groups:
            able = [j for j, k in enumerate(which) if self.settled[k].status == STATUS[DONE]]
            if not able:
                continue
            numbers = [which[j] for j in able]
            own = [self.settled[k] for k in numbers]
            mine = subset(stack, np.array(able))
            moving = Moving.going_on(mine, np.full(len(own), self._first), [k.where for k in own])
            before = np.array([float(len(one.strobes) - 1) for one in own])
            moving.to(before + np.array([float(periods[k]) for k in numbers]), True, 1)
            courses.append((numbers, Course(moving)))
            for k in numbers:
                del alone[k]
        return courses, {k: self.settled[k].motion(periods[k]) for k in alone}


def _moment(started: Started, k: int) -> Moment:
    """Clock, state and counters of one of many, as its own."""
    return Moment(*(part[k].copy() for part in started))
