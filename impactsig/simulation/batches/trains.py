"""Impacts of many machines as arrays: where only these are asked for, no Motion is made of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...oscillators.batch import OscillatorBatch
from ..basis.columns import spread
from ..basis.events import (
    DONE,
    IMPACT,
    PHASE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_STOP,
    TOUCH,
    TURN,
    TURNS,
)
from ..exact.modes import stacks, subset
from ..exact.starts import first_phases
from ..simulation import CHATTER
from .moving import Moving

BLOCK = 64  # machines whose events are held at a time


class Impacting(NamedTuple):
    """Impacts of one machine after another."""

    x: np.ndarray  # forcing periods from the end of the transient
    approach: np.ndarray  # velocities, in the machines' unit
    starts: np.ndarray  # index of the first impact of each machine
    stop: np.ndarray  # which of its stops


def impacts_of_many(
    machines: OscillatorBatch,
    initial: np.ndarray,
    phase: np.ndarray,
    transient: np.ndarray,
    periods: float,
    legs: int,
) -> Impacting:
    """Impacts of machines with one transient each.

    They are those of `simulate`. A machine that takes more work than `legs` after its transient
    has none here.

    Parameters
    ----------
    machines : OscillatorBatch
        With one harmonic force each.
    initial : ndarray, shape (n, 2)
    phase, transient : ndarray, shape (n,)
        The transient in forcing periods.
    periods : float
    legs : int
    """
    n = len(machines)
    phase = first_phases(phase)
    x, approach, stop = [np.empty(0)] * n, [np.empty(0)] * n, [np.empty(0)] * n
    for stack in stacks(spread(machines.columns, n), CHATTER, True):
        for begin in range(0, len(stack.which), BLOCK):
            mine = subset(stack, slice(begin, begin + BLOCK))
            moving = Moving(mine, initial[mine.which], phase[mine.which])
            before = transient[mine.which]
            moving.to(before, False, 1)
            moving.forget()
            moving.to(before + periods, True, 1, legs)
            turns, angle = moving.first[0].T
            for k, machine in enumerate(mine.which.tolist()):
                if moving.status[k] != DONE:
                    continue
                rows = moving.events(k)
                rows = rows[(rows[:, ROW_KIND] == IMPACT) | (rows[:, ROW_KIND] == TOUCH)]
                x[machine] = (rows[:, TURNS] - turns[k]) + (rows[:, PHASE] - angle[k]) / TURN
                approach[machine] = rows[:, ROW_APPROACH] * mine.forcing.omega[k]
                stop[machine] = rows[:, ROW_STOP]
    count = np.array([len(one) for one in x], int)
    return Impacting(
        np.concatenate(x), np.concatenate(approach), np.cumsum(count) - count, np.concatenate(stop)
    )
