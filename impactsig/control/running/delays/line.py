"""Kernels for the delay line: the motion, step by step, as polynomials.

A step is a row (`simulate._delay.Line`). Steps end where what is fed back is not smooth, one delay
later again, so that no polynomial ever reaches across such a place.
"""

from __future__ import annotations

from ...._compiling.compiled import inlined, kernel
from ....simulation.basis.delay import course_at
from ....simulation.basis.events import LENGTH, PHASE, TURN, TURNS
from ....simulation.basis.tableau import DEGREE


@kernel
def cut(c, share):
    """Restrict a polynomial in Bernstein form to the first share of its step."""
    for n in range(1, DEGREE + 1):
        for i in range(DEGREE, n - 1, -1):
            c[i] = c[i - 1] + share * (c[i] - c[i - 1])


@inlined
def scale(c, share):
    """Reparametrise a polynomial in powers to the first share of its step."""
    power = 1.0
    for n in range(1, len(c)):
        power *= share
        c[n] *= power


@kernel
def since(line, j, turns, phase):
    """Time from the beginning of step j to an instant."""
    return (turns - line.when[j, TURNS]) * TURN + (phase - line.when[j, PHASE])


@kernel
def locate(line, number, turns, phase):
    """Index of the last step that begins at an instant or before it, or 0."""
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
    """Evaluate a coordinate of the delay line at instants, in any order."""
    for n in range(len(turns)):
        j = locate(line, number, turns[n], phase[n])
        share = since(line, j, turns[n], phase[n]) / line.when[j, LENGTH]
        out[n] = course_at(line, j, which, min(max(share, 0.0), 1.0))
