"""Cells of charts: many oscillators followed side by side until their orbits close."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ....oscillators.laws import RIGID
from ....simulation.basis.columns import Columns
from ....simulation.basis.events import DONE, MODE, STROBE, STROBE_IMPACTS, Q, V
from ....simulation.batches.moving import Moving
from ....simulation.exact.exact import room
from ....simulation.exact.modes import Stack, stacks, subset
from ...tangents.batches.carrying import multiplied_over
from ...tangents.columns import FIRST
from .closing import EXACT, LONGEST, orbits_beside
from .strobing import CLOSED, FOUND, STATUS_OF, TAKEN, follow_machines

LEGS = 100_000  # work in one forcing period after which a motion is given up
CHATTER = 1e-6  # as that of `simulate`
NOTHING_KNOWN = np.empty((0, 2)), np.empty(0, np.int64), np.empty(0)  # of attractors
FIRST_LOOK = 24  # periods, then twice as many: where Newton's method may spare the rest


class Cells(NamedTuple):
    """Outcome of each oscillator: periods and impacts of its orbit, 0 and -1 if none closed."""

    periods: np.ndarray
    impacts: np.ndarray
    followed: np.ndarray
    status: np.ndarray


class Started(NamedTuple):
    """States of oscillators as a kernel takes them."""

    clocks: np.ndarray
    states: np.ndarray
    counts: np.ndarray


def follow_cells(
    columns: Columns, periods: int, initial: np.ndarray, phase: np.ndarray, tolerance: float,
    ends: bool, gpu: bool = False,
) -> Cells:  # fmt: skip
    """Follow machines for so many forcing periods, or if that `ends` until their orbits are known.

    Raises
    ------
    InvalidInput
        If one starts beyond a rigid stop.
    """
    n = columns.n
    found = Cells(*np.zeros((4, n), np.int64))
    found.impacts[:] = -1
    for stack in stacks(columns, CHATTER, True):
        for recurs in np.unique(stack.forcing.recurs).tolist():
            own = np.flatnonzero(stack.forcing.recurs == recurs)
            mine = subset(stack, own)
            which = stack.which[own]
            moving = Moving(mine, initial[which], phase[which])
            start = Started(moving.clocks, moving.states, moving.counts)
            longest = LONGEST if recurs else 0  # else no motion closes
            rule = tolerance, longest, ends, LEGS
            rounds = _rounds(periods) if ends and recurs else [periods]
            own_cells = _followed(mine, start, phase[which], rounds, rule, gpu)
            for column, part in zip(found, own_cells, strict=True):
                column[which] = part
    return found


def _rounds(periods: int) -> list[int]:
    """After how many periods orbits are looked for: ever more, and at the end."""
    rounds = []
    after = FIRST_LOOK
    while 1.5 * after <= periods:
        rounds.append(after)
        after *= 2
    return [*rounds, periods]


def _followed(
    stack: Stack, start: Started, phase: np.ndarray, rounds: list[int],
    rule: tuple[float, int, bool, int], gpu: bool,
) -> Cells:  # fmt: skip
    """Machines of one stack up to the last of the rounds, or until it is known where they end."""
    n = len(phase)
    strobes, ended = np.zeros((n, rounds[-1] + 1, STROBE)), np.zeros((n, FOUND), np.int64)
    beside = np.full(n, -1)  # impacts of the orbit that was found beside it
    for upto in rounds:
        strobe(stack, start, strobes, upto, rule, ended, gpu)
        going = np.flatnonzero((ended[:, CLOSED] == 0) & (ended[:, STATUS_OF] == DONE))
        if rule[1] and len(going):
            orbits = orbits_beside_machines(
                subset(stack, going),
                phase[going],
                strobes[going, : upto + 1],
                ended[going, TAKEN],
                gpu,
            )
            near = orbits.period > 0
            ended[going[near], CLOSED] = orbits.period[near]
            beside[going[near]] = orbits.impacts[near]
    closed, last = ended[:, CLOSED], ended[:, TAKEN]
    back = np.arange(rounds[-1] + 1)
    inside = (back > (last - closed)[:, None]) & (back <= last[:, None])
    impacts = np.where(inside, strobes[:, :, STROBE_IMPACTS], 0.0).sum(axis=1).astype(int)
    impacts[closed == 0] = -1
    return Cells(closed, np.where(beside >= 0, beside, impacts), last, ended[:, STATUS_OF])


def orbits_beside_machines(
    stack: Stack, phase: np.ndarray, strobes: np.ndarray, last: np.ndarray, gpu: bool
) -> Any:
    """`closing.orbits_beside` for oscillators of one stack."""

    def returned(
        which: np.ndarray, points: np.ndarray, m: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return returns(subset(stack, which), points, phase[which], m, gpu)

    def again(which: np.ndarray, points: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
        mine = subset(stack, which)
        moving = Moving.at(mine, points, phase[which])
        start = Started(moving.clocks, moving.states, moving.counts)
        rows, ended = strobed(mine, start, periods, (1e-2, LONGEST, False, LEGS), gpu)
        return rows, (ended[:, STATUS_OF] == DONE) & _inside(mine, points)

    return orbits_beside(strobes, last, returned, again, EXACT)


def strobed(
    stack: Stack,
    start: Started,
    periods: int,
    rule: tuple[float, int, bool, int],
    gpu: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Stroboscopic points of oscillators, shape (n, periods + 1, 4), and their outcomes."""
    n = len(start.states)
    strobes, ended = np.zeros((n, periods + 1, STROBE)), np.zeros((n, FOUND), np.int64)
    strobe(stack, start, strobes, periods, rule, ended, gpu)
    return strobes, ended


def strobe(
    stack: Stack, start: Started, strobes: np.ndarray, upto: int,
    rule: tuple[float, int, bool, int], ended: np.ndarray, gpu: bool,
) -> None:  # fmt: skip
    """Take strobes of machines up to row `upto`, as `follow_machines` does."""
    many = stack.problem
    if gpu:
        from .gpu import follow

        follow(many, np.arange(len(ended)), *start, strobes, upto, rule, NOTHING_KNOWN, ended)
        return
    follow_machines(
        many, room(many), *stack.laws, *start, strobes, upto, rule, NOTHING_KNOWN, ended
    )


def returns(
    stack: Stack, points: np.ndarray, phase: np.ndarray, periods: np.ndarray, gpu: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States so many periods after points, their derivatives, and which succeeded.

    Points, places and derivatives are in the engine's units.
    """
    moving = Moving.at(stack, points, phase)
    moving.on_gpu = gpu
    columns, totals = multiplied_over(moving, periods.astype(float))
    with np.errstate(over="ignore", under="ignore"):
        matrix = columns * np.exp(totals[:, FIRST])[:, None, None]
    machine = np.arange(len(points))
    q = stack.problem.origin[machine, moving.counts[:, MODE]] + moving.states[:, Q]
    came = (moving.status == DONE) & _inside(stack, points)
    return np.stack([q, moving.states[:, V]], axis=1), matrix, came


def _inside(stack: Stack, points: np.ndarray) -> np.ndarray:
    """Mask of points on this side of all rigid stops, up to rounding."""
    inside = np.ones(len(points), bool)
    for (side, kind), stop in zip(stack.columns.form.stops, stack.columns.stops, strict=True):
        if kind == RIGID:
            size = np.abs(points[:, 0]) + np.abs(stop[0])
            inside &= side * (points[:, 0] - stop[0]) <= 1e-12 * size
    return inside
