"""Kernels for the first event within a power series, and for the control force at its limit."""

from __future__ import annotations

import math

from ..._compiled import inlined, inner
from ...simulate.basis.roots import first_root
from ...simulate.stepping.crossing import BY_Q, BY_V, STILL, VALUE, ZEROS
from ._force import NONE
from .series import ORDER


@inlined
def lower_bound(c, zeros):
    """Lower bound of a polynomial from the power `zeros` on: parabola minus all further terms."""
    slope, bend = c[zeros + 1], c[zeros + 2]
    least = min(0.0, slope + bend)
    if bend > 0 and -2 * bend < slope < 0:
        least = -slope * slope / (4 * bend)
    least += c[zeros]
    for n in range(zeros + 3, ORDER + 1):
        least += min(c[n], 0.0)
    return least


@inner
def root_of(c, stack, bernstein, zeros):
    """First root in (0, 1] of a polynomial, past `zeros` roots at 0; or `NONE`."""
    degree = ORDER - zeros
    if lower_bound(c, zeros) > 0:
        return NONE
    top, table = stack[0], bernstein[degree]
    for n in range(degree + 1):
        top[n] = 0.0
    for m in range(degree + 1):
        for n in range(m, degree + 1):
            top[n] += table[m, n] * c[zeros + m]
    at = first_root(stack, degree)
    if at > 1.0 or at == 0.0:
        return at
    for _ in range(4):  # by the powers themselves, which have lost nothing
        y, slope = 0.0, 0.0
        for n in range(degree, -1, -1):
            slope = slope * at + y
            y = y * at + c[zeros + n]
        if not slope < 0:
            break
        new = at - y / slope
        if not abs(new - at) < 1e-6 or not 0 < new <= 1:
            break
        done = abs(new - at) <= 2e-16 * at
        at = new
        if done:
            break
    return at


@inlined
def series_event(room, row):
    """First root of an event function over the step, past those at its start."""
    zeros = int(row[ZEROS])
    if zeros == STILL:
        return NONE
    c = room.c
    c[0] = row[VALUE]
    for n in range(1, ORDER + 1):
        c[n] = row[BY_Q] * room.q[n] + row[BY_V] * room.v[n]
    return root_of(c, room.stack, room.bernstein, zeros)


@inlined
def series_bound(feedback, room, region, edge):
    """As `_force.bound`, for power series."""
    at, which, wrong = NONE, 0, False
    if not (feedback.on and feedback.limit < math.inf):
        return at, which, wrong
    for side in (-1, 1):
        if region == -side:
            continue
        sign = side if region == side else -side
        c = room.c
        for n in range(ORDER + 1):
            c[n] = sign * room.gap[n]
        c[0] += feedback.limit * (1 if region == 0 else -1)
        zeros = 1 if edge == side else 0
        if not c[zeros] > 0:
            wrong = wrong or edge == side
            continue
        share = root_of(c, room.stack, room.bernstein, zeros)
        if share < at:
            at, which = share, side
    return at, which, wrong
