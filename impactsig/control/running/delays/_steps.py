"""Kernels for one step of an oscillator under delayed feedback, and its row of the delay line.

By the Runge-Kutta method of the stepping engine or by the power series of `_series`. What the other
needs (`tab` and `room`, or `series`) is None, so that it is not compiled.
"""

from __future__ import annotations

from ...._compiling.compiled import inlined, kernel
from ....simulation.basis.delay import DISPLACEMENT, VELOCITY
from ....simulation.basis.events import LENGTH, SPEED, STEP
from ....simulation.basis.tableau import DEGREE
from ....simulation.stepping.crossing import polish
from ....simulation.stepping.step import interpolate, stride, take
from ._series import delayed_series, expand, longest_step, write_series
from .force import feed
from .rows import ROWS, begin_row, cross_limit, end_row, mark_limit


@kernel
def write(feedback, line, past, room, region, s, leg, count, h, y, v):
    """Store the polynomials of the last step; `s.q`, `s.v` hold its increments."""
    course = line.course[count[ROWS] - 1]
    for n in range(DEGREE + 1):
        course[DISPLACEMENT, n] = y + s.q[n] + leg.origin
        course[VELOCITY, n] = v + s.v[n]
    feed(feedback, line, past, room, region, h, course)


@inlined
def gain_of(c, share):
    """Increment of a polynomial in powers over a share of its step."""
    value = 0.0
    for n in range(len(c) - 1, 0, -1):
        value = (value + c[n]) * share
    return value


@inlined
def rest_row(feedback, line, past, room, series, region, count, clock, h, x):
    """Write a row of length h in which the mass is at rest."""
    if series is not None:
        delayed_series(feedback, line, past, series, h, True)
        series.q[:] = 0.0
        series.v[:] = 0.0
        series.q[0] = x
        begin_row(line, count, clock, h)
        write_series(feedback, line, series, region, count[ROWS] - 1, 0.0)
    if room is not None:
        _rest_step(feedback, line, past, room, region, count, clock, h, x)


@kernel
def _rest_step(feedback, line, past, room, region, count, clock, h, x):
    begin_row(line, count, clock, h)
    course = line.course[count[ROWS] - 1]
    for n in range(DEGREE + 1):
        course[DISPLACEMENT, n], course[VELOCITY, n] = x, 0.0
    feed(feedback, line, past, room, region, h, course)


@inlined
def step_row(
    p, tab, f, leg, s, fb, line, past, room, series, region, clock, state, count, ahead, y, v, a
):
    """Take a step and write its row.

    Returns its length (0 where it fails), the increments where they are known yet, the step to try
    next, and the number of tries.
    """
    step, dq, dv, wish, tries = 0.0, 0.0, 0.0, 0.0, 1
    if series is not None:
        step = min(longest_step(leg, fb, p.fastest), ahead)
        step = delayed_series(fb, line, past, series, step, False)
        expand(leg, s.waves, fb, series, region, step, y, v)
        begin_row(line, count, clock, step)
        write_series(fb, line, series, region, count[ROWS] - 1, leg.origin)
    if room is not None:
        step, dq, dv, wish, tries = stride(
            p, tab, f, leg, s, state[STEP], ahead, y, v, a, state[SPEED]
        )
        if step != 0.0:
            begin_row(line, count, clock, step)
            interpolate(tab, f, leg, s, step, y, v, dq, dv)
            write(fb, line, past, room, region, s, leg, count, step, y, v)
    return step, dq, dv, wish, tries


@inlined
def end_step(
    p, tab, f, leg, s, line, series, laps, state, count, region, side, due, share, step, wish,
    dq, dv, y, v, a,
):  # fmt: skip
    """Cut the step where an event is due or the force is at a limit; its length and increments."""
    h = step
    if series is not None:
        if share < 1.0:
            h = share * step
            end_row(line, count, share)
            if due < 0:
                mark_limit(laps, count, region, side)
        at = min(share, 1.0)
        dq, dv = gain_of(series.q, at), gain_of(series.v, at)
    if tab is not None:
        if due >= 0:
            h, dq, dv = polish(p, tab, f, leg, s, s.events[due], share * step, step, y, v, a)
            if h < step:
                end_row(line, count, h / step)
                line.when[count[ROWS] - 1, LENGTH] = h
        elif share < 1.0 and side != 0:
            h = share * step
            dq, dv = take(p.fixed, tab, f, leg, s, h, y, v, a)
            cross_limit(line, laps, count, share, region, side)
        else:
            state[STEP] = wish
    return h, dq, dv
