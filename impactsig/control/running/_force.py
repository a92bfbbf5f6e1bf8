"""Kernels for the control force over a step, as a polynomial, and for reaching its limit."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiled import inlined, inner
from ...simulate.basis.delay import FORCE, SIGNAL, VELOCITY, read
from ...simulate.basis.roots import first_root
from ...simulate.basis.tableau import DEGREE

NONE = 2.0  # a share of a step at which nothing happens


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


@inner
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


@inner
def bound(feedback, room, region, edge):
    """First share of the step at which the force reaches or leaves its limit, and which limit.

    `edge` is the limit at which the step began, which its first root is not. Last it tells whether
    the force goes from there to the other side than the region is.
    """
    at, which, wrong = NONE, 0, False
    if not (feedback.on and feedback.limit < math.inf):
        return at, which, wrong
    for side in (-1, 1):
        if region == -side:
            continue
        sign = side if region == side else -side
        c = room.stack[0]
        for n in range(DEGREE + 1):
            c[n] = feedback.limit * (1 if region == 0 else -1) + sign * room.gap[n]
        degree = DEGREE
        if edge == side:
            start = c[0]
            for n in range(degree):
                c[n] = (c[n + 1] - start) * degree / (n + 1)
            degree -= 1
        if not c[0] > 0:
            wrong = wrong or edge == side
            continue
        share = first_root(room.stack, degree)
        if share < at:
            at, which = share, side
    return at, which, wrong
