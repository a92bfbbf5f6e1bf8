"""Kernels: the delay line, what a motion did step by step, as polynomials.

A step is a row: when it began and how long it was, polynomials of degree 7 in Bernstein form (what
is fed back, control force, then displacement and velocity, or the coordinates of a flow), and for
how many delays to come the beginning of the step is a place where what is fed back is not smooth.
Steps end at such places, one delay later again, so that no polynomial ever reaches across one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..simulate._flow import TURN, inner, kernel
from ..simulate._tableau import DEGREE

SIGNAL, FORCE, DISPLACEMENT, VELOCITY = range(4)


class Line(NamedTuple):
    """Rows of steps, in the order of time; times as turns and phase of the reference."""

    when: np.ndarray  # (rows, 3): turns, phase, length
    course: np.ndarray  # (rows, 2 + coordinates, DEGREE + 1)
    laps: np.ndarray  # (rows,) of int


@inner
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


@inner
def cut(c, share):
    """Make the polynomial that of the first share of its step."""
    for n in range(1, DEGREE + 1):
        for i in range(DEGREE, n - 1, -1):
            c[i] = c[i - 1] + share * (c[i] - c[i - 1])


@kernel
def since(line, j, turns, phase):
    """Time from the beginning of step j to an instant."""
    return (turns - line.when[j, 0]) * TURN + (phase - line.when[j, 1])


@inner
def read(line, j, last, first, signal, tau):
    """What is fed back, tau after the beginning of step j, in a step no later than `last`.

    From the step `first` on that is the course SIGNAL, before it the course `signal` itself.
    """
    while j < last and tau > line.when[j, 2]:
        tau -= line.when[j, 2]
        j += 1
    share = tau / line.when[j, 2]
    return bernstein(line.course[j, SIGNAL if j >= first else signal], share)


@kernel
def locate(line, number, turns, phase):
    """The last of so many steps that begins at an instant or before it, or 0."""
    low, high = 0, number
    while high - low > 1:
        middle = (low + high) // 2
        if since(line, middle, turns, phase) >= 0:
            low = middle
        else:
            high = middle
    return low


@kernel
def sample(line, number, turns, phase, which, out):
    """A course at instants, in any order, within the steps."""
    for n in range(len(turns)):
        j = locate(line, number, turns[n], phase[n])
        share = since(line, j, turns[n], phase[n]) / line.when[j, 2]
        out[n] = bernstein(line.course[j, which], min(max(share, 0.0), 1.0))
