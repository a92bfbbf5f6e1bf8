"""Kernels for delayed feedback: its force or rate within a step of an engine.

What a motion did is kept step by step, as polynomials of degree 7 in Bernstein form or of degree 20
in powers (what is fed back, control force, then displacement and velocity, or the coordinates of a
flow). The package
`control` writes these rows, and ends steps where what is fed back is not smooth; so within a step
the force is, and Dormand and Prince's method keeps its order, and so does its interpolant, from
which what is fed back comes one delay later (the conditions of [BellenZennaro2003]_, chapter 6, are
met for order 8). Where nothing is controlled the
engines are compiled with None in place of a `Control`, and know nothing of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from .events import LENGTH
from .tableau import DEGREE

SIGNAL, FORCE, DISPLACEMENT, VELOCITY = range(4)


class Line(NamedTuple):
    """Rows of steps, in the order of time; times as turns and phase of the reference."""

    when: np.ndarray  # (rows, 3): turns, phase, length
    course: np.ndarray  # (rows, 2 + coordinates, DEGREE + 1)
    laps: np.ndarray  # (rows,) of int: delays for which the row's beginning is no smooth place
    powers: object = None  # not None: courses are in powers of the share, not in Bernstein form


class Feedback(NamedTuple):
    """Delayed feedback in the engine's units, per mass."""

    on: bool
    gain: float
    turns: float  # delay, as turns and phase of the reference
    phase: float
    delay: float
    limit: float
    signal: int  # its course in the line
    memory: float


class Past(NamedTuple):
    """Where a step finds the delayed signal; see `read`."""

    step: int
    last: int
    first: int
    offset: float


class Control(NamedTuple):
    """The control force within a step."""

    feedback: Feedback
    line: Line
    past: Past
    region: int  # the limit that the force is beyond, 1 or -1, throughout the step; 0: none


@kernel
def bernstein(c, share):
    """Polynomial in Bernstein form at a share of its step."""
    other = 1.0 - share
    power, binomial = 1.0, 1.0
    value = c[0] * other
    for i in range(1, DEGREE):
        power *= share
        binomial *= (DEGREE - i + 1) / i
        value = (value + power * binomial * c[i]) * other
    return value + power * share * c[DEGREE]


@kernel
def horner(c, share):
    """Polynomial of an even degree in powers, at a share of its step."""
    square = share * share  # even and odd powers apart, as two sums do not wait for each other
    even, odd = c[len(c) - 1], 0.0
    for i in range(len(c) - 2, 0, -2):
        odd = odd * square + c[i]
        even = even * square + c[i - 1]
    return even + odd * share


@inlined
def course_at(line, j, which, share):
    """A course of row j at a share of it."""
    if line.powers is None:
        return bernstein(line.course[j, which], share)
    return horner(line.course[j, which], share)


@kernel
def read(feedback, line, past, tau):
    """The delayed signal, tau after the beginning of the step.

    It is in the row `past.step` or the next ones, but not after `past.last`. From the row
    `past.first` on that is the course SIGNAL, before it the course of the signal itself.
    """
    j, tau = past.step, past.offset + tau
    while j < past.last and tau > line.when[j, LENGTH]:
        tau -= line.when[j, LENGTH]
        j += 1
    share = tau / line.when[j, LENGTH]
    return course_at(line, j, SIGNAL if j >= past.first else feedback.signal, share)


@inlined
def fed(control, tau, own):
    """Control force per mass tau after the beginning of the step; the present signal is `own`.

    Beyond the limit it is constant. That holds for a whole step, so that the force is smooth even
    a little beyond where it ends.
    """
    if control is None:
        return 0.0
    feedback = control.feedback
    if not feedback.on:
        return 0.0
    if control.region != 0:
        return control.region * feedback.limit
    return feedback.gain * (read(feedback, control.line, control.past, tau) - own)


@inlined
def pushed(control, tau, x, v):
    """`fed` for an oscillator at a displacement and velocity."""
    if control is None:
        return 0.0
    return fed(control, tau, v if control.feedback.signal == VELOCITY else x)


@inlined
def pushed_rate(control, x):
    """Rate of the control force on a mass that rests at x; no force is known before the step."""
    if control is None:
        return 0.0
    h = 1e-6
    return (pushed(control, h, x, 0.0) - pushed(control, 0.0, x, 0.0)) / h


@inlined
def pushed_swing(control, tau, x, v):
    """Bound on the change of the force on a mass at rest within tau."""
    if control is None:
        return 0.0
    change = pushed(control, tau, x, 0.0) - pushed(control, 0.0, x, 0.0)
    return abs(change) + abs(control.feedback.gain) * v
