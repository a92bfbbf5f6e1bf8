"""Machines of one layout moved by a GPU, a thread each, by the kernel that moves them on CPUs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ...studies.device_kernels import Each
from ..basis.events import COLUMNS, DONE, LEG_COUNT, TURNS
from ..exact.flow import COMPLETE, Scratch
from ..exact.modes import SHARED, Stack
from .batch_kernels import move_range

if TYPE_CHECKING:
    from ..exact.flow import Problem

TOGETHER = 2**16  # machines of a launch
ROWS = 128  # events of each that are held at a time
TRIED = 16  # part of the turns after which it shows which machines take long


@inlined
def no_law(_velocity):
    """Stands in for a restitution function, which no machine here has."""
    return math.nan


@inlined
def own(room, slot):
    """Work arrays of a thread."""
    return Scratch(room.waves[slot], room.series[slot], room.gaps[slot])


@kernel
def move_one(k, slot, many, room, until, clocks, states, counts, status, rows, ends, full):
    """Move machine k to its end, or until its rows are full."""
    turns, phases, legs = until
    reached = move_range(
        many, own(room, slot), no_law, no_law, clocks, states, counts, turns, phases, legs, status,
        rows[slot], ends, k, k + 1,
    )  # fmt: skip
    full[k] = reached == k


_move = Each(move_one)


def rooms(many: Problem, n: int) -> Scratch:
    """Work arrays for so many threads."""
    components, gaps = many.ratio.shape[-1], many.gap.shape[-2]
    return Scratch(
        np.empty((n, components, 5)), np.empty((n, COMPLETE + 1)), np.empty((n, gaps, 4))
    )


def part_of(many: Problem, part: slice) -> Problem:
    """Tables of some neighbouring machines."""
    arrays = {name: value[part] for name, value in many._asdict().items() if name not in SHARED}
    return many._replace(**arrays)


def by_work(legs: np.ndarray) -> np.ndarray:
    """Machines in the order of their work: neighbours wait for the slowest of 32."""
    return np.argsort(-legs, kind="stable")


def move(
    stack: Stack, places: tuple[np.ndarray, ...], until: tuple[np.ndarray, ...], keep: bool
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Move all machines to their ends; their events one after the other, and where each ends.

    `places` are clocks, states, counters and statuses, which are changed; `until` turns and phases
    of the ends, and the work that each may take.
    """
    n = len(until[0])
    held, owner = [np.empty((0, COLUMNS))], [np.empty(0, np.int64)]
    for first in range(0, n, TOGETHER):
        part = slice(first, min(first + TOGETHER, n))
        many = part_of(stack.problem, part)
        here, end = tuple(one[part] for one in places), tuple(one[part] for one in until)
        order = _tried(many, here, end)
        while len(order):
            rows, ends, full = _launched(many, order, here, end, ROWS if keep else 0)
            filled = np.arange(rows.shape[1]) < ends[order, None]
            held.append(rows[filled])
            owner.append(first + np.repeat(order, ends[order]))
            order = order[full[order] != 0]
    machine = np.concatenate(owner)
    events = np.concatenate(held)[np.argsort(machine, kind="stable")]
    return events, np.cumsum(np.bincount(machine, minlength=n))


def _tried(
    many: Any, places: tuple[np.ndarray, ...], until: tuple[np.ndarray, ...]
) -> np.ndarray:  # fmt: skip
    """Machines that move, those first that took most work for a part of the way, on copies."""
    clocks, _, counts, status = copies = tuple(one.copy() for one in places)
    order = np.flatnonzero(status == DONE)
    turns, phases, legs = until
    begin = clocks[:, TURNS].copy()
    _launched(many, order, copies, (begin + (turns - begin) // TRIED, phases, legs), 0)
    return order[by_work(counts[order, LEG_COUNT])]


def _launched(
    many: Any, order: np.ndarray, places: tuple[np.ndarray, ...], until: tuple[np.ndarray, ...],
    room: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Rows of each thread, how many each machine has filled, and whether it must go on."""
    rows = np.empty((len(order), room, COLUMNS))
    ends, full = np.zeros(len(until[0]), np.int64), np.zeros(len(until[0]), np.int8)
    _move(order, many, rooms(many, len(order)), until, *places, rows, ends, full)
    return rows, ends, full
