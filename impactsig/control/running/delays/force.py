"""Kernels for the control force over a step, as a polynomial."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import inlined, kernel
from ....simulation.basis.delay import FORCE, SIGNAL, VELOCITY, read
from ....simulation.basis.tableau import DEGREE


class Room(NamedTuple):
    """Work arrays for the force over a step."""

    nodes: np.ndarray  # (DEGREE + 1,) shares of a step
    fit: np.ndarray  # (DEGREE + 1, same) from values at the nodes to Bernstein coefficients
    values: np.ndarray  # (DEGREE + 1,)
    gap: np.ndarray  # (DEGREE + 1,) of the control force to its limit
    stack: np.ndarray  # (64, DEGREE + 3) for `first_root`


@inlined
def signal_of(feedback, x, v):
    """The signal of an oscillator that is fed back."""
    return v if feedback.signal == VELOCITY else x


@kernel
def feed(feedback, line, past, room, region, h, course):
    """Compute the delayed signal and the control force over the step.

    What is fed back is the signal and, where there is a memory, the share of it of what was fed
    back one delay before, which is fitted by a polynomial.
    """
    own, signal, push = course[feedback.signal], course[SIGNAL], course[FORCE]
    if not feedback.on:
        for n in range(DEGREE + 1):
            signal[n], push[n] = own[n], 0.0
        return
    for n in range(DEGREE + 1):
        room.values[n] = read(feedback, line, past, room.nodes[n] * h)
    for n in range(DEGREE + 1):
        late = 0.0
        for m in range(DEGREE + 1):
            late += room.fit[n, m] * room.values[m]
        signal[n] = (1 - feedback.memory) * own[n] + feedback.memory * late
        room.gap[n] = feedback.gain * (late - own[n])
        push[n] = region * feedback.limit if region != 0 else room.gap[n]
