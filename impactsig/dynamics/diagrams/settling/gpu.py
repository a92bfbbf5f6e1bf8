"""Strobes of many motions on a GPU, a thread each, by the kernel that CPUs run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...._compiling.compiled import kernel
from ....simulation.basis.events import DONE, LEG_COUNT, STROBE
from ....simulation.batches.batch_kernels import machine
from ....simulation.batches.gpu import by_work, no_law, own, rooms
from ....studies.device_kernels import Each
from .strobing import CAUGHT, CLOSED, STATUS_OF, TAKEN, go_on

if TYPE_CHECKING:
    from ....simulation.exact.flow import Problem

ROUNDS = 16, 64, 256  # periods after which the motions that go on are sorted by their work


@kernel
def follow_one(
    k, slot, many, read, room, clocks, states, counts, strobes, upto, rule, known, found
):
    """Go on with motion k, which is of the machine that `read` names."""
    (which,) = read
    go_on(
        machine(many, which[k]), own(room, slot), no_law, no_law, clocks[k], states[k], counts[k],
        strobes[k][: upto + 1], rule, known, found[k],
    )  # fmt: skip


_follow = Each(follow_one)


def follow(
    many: Problem, which: np.ndarray, clocks: np.ndarray, states: np.ndarray, counts: np.ndarray,
    strobes: np.ndarray, upto: int, rule: tuple[float, int, bool, int], known: Any,
    found: np.ndarray,
) -> None:  # fmt: skip
    """Take strobes up to row `upto`, of machines `which`, as `strobing.follow_machines` does.

    Those whose last period took most work are the first.
    """
    on = (found[:, STATUS_OF] == DONE) & (found[:, CLOSED] == 0) & (found[:, CAUGHT] == 0)
    going = np.flatnonzero(on)
    order = going[by_work(counts[going, LEG_COUNT])]
    _follow(
        order, many, (which,), rooms(many, len(order)), clocks, states, counts, strobes, upto, rule,
        known, found,
    )  # fmt: skip


def follow_starts_of(
    many: Problem, clocks: np.ndarray, states: np.ndarray, counts: np.ndarray, periods: int,
    rule: tuple[float, int, bool, int], known: Any, found: np.ndarray, orbits: np.ndarray,
) -> None:  # fmt: skip
    """Follow starts of one machine, as `strobing.follow_starts` does."""
    n = len(states)
    strobes = np.empty((n, periods + 1, STROBE))
    one = np.zeros(n, np.int64)
    for upto in [*(after for after in ROUNDS if after < periods), periods]:
        follow(many, one, clocks, states, counts, strobes, upto, rule, known, found)
    for k in np.flatnonzero(found[:, CLOSED]).tolist():
        last, m = found[k, TAKEN], found[k, CLOSED]
        orbits[k, :m] = strobes[k, last - m + 1 : last + 1, :3]
