"""Kernels for the first event within a step, and for the control force at its limit.

A step is of the Runge-Kutta method, as polynomials in Bernstein form, or a power series; the work
arrays of the other, `room` or `series`, are None.
"""

from __future__ import annotations

import math

from ...._compiling.compiled import inlined, kernel
from ....simulation.basis.roots import first_root
from ....simulation.basis.tableau import DEGREE
from ....simulation.stepping.crossing import BY_Q, BY_V, STILL, VALUE, ZEROS, event_root
from .rows import turn_back
from .series import ORDER

NONE = 2.0  # a share of a step at which nothing happens


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


@kernel
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
def event_share(s, series, row):
    """First root of an event function over the step, past those at its start."""
    zeros = int(row[ZEROS])
    if series is not None:
        if zeros == STILL:
            return NONE
        c = series.c
        c[0] = row[VALUE]
        for n in range(1, ORDER + 1):
            c[n] = row[BY_Q] * series.q[n] + row[BY_V] * series.v[n]
        return root_of(c, series.stack, series.bernstein, zeros)
    return event_root(s, row, zeros)


@inlined
def _bound(feedback, room, series, region, edge):
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
        level = feedback.limit * (1 if region == 0 else -1)
        zeros = 1 if edge == side else 0
        share = 0.0
        if series is not None:
            share = _share_of_series(series, sign, level, zeros)
        if room is not None:
            share = _share_of_step(room, sign, level, zeros)
        if share < 0:
            wrong = wrong or edge == side
        elif share < at:
            at, which = share, side
    return at, which, wrong


@inlined
def meet_limit(feedback, line, count, room, series, region, edge, turned):
    """As `_bound`, but last whether the force turned back at its limit: the row is discarded then.

    So it is once: a row that was, as `turned` tells, is kept the next time.
    """
    share, side, wrong = _bound(feedback, room, series, region, edge)
    back = wrong and not turned
    if back:
        turn_back(line, count, region, edge)
    return share, side, back


@kernel
def _share_of_step(room, sign, level, zeros):
    """First root of the gap to a limit; -1 where it begins beyond that."""
    c = room.stack[0]
    for n in range(DEGREE + 1):
        c[n] = level + sign * room.gap[n]
    if zeros == 1:
        start = c[0]
        for n in range(DEGREE):
            c[n] = (c[n + 1] - start) * DEGREE / (n + 1)
    return first_root(room.stack, DEGREE - zeros) if c[0] > 0 else -1.0


@inlined
def _share_of_series(series, sign, level, zeros):
    """As `_share_of_step`, of a power series."""
    c = series.c
    for n in range(ORDER + 1):
        c[n] = sign * series.gap[n]
    c[0] += level
    return root_of(c, series.stack, series.bernstein, zeros) if c[zeros] > 0 else -1.0
