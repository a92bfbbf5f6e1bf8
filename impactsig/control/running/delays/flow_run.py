"""Kernel for a flow under delayed feedback.

As `run`, for any number of coordinates and without impacts, by the steps of
`simulation.flows.flow_steps`. The feedback is added to the rate of the coordinate that it is of.
"""

from __future__ import annotations

from ...._compiling.compiled import kernel
from ....simulation.basis.delay import DISPLACEMENT, Control
from ....simulation.basis.events import (
    DIVERGED,
    DONE,
    EXHAUSTED,
    LINE_FULL,
    LOW,
    PHASE,
    TIME,
    TURN,
    TURNS,
)
from ....simulation.basis.tableau import DEGREE
from ....simulation.exact.passing import pass_time, set_clock, time_until
from ....simulation.flows.flow_steps import Field, finish, rates_at, stride, take
from ....simulation.stepping.step import expand
from ._roots import meet_limit
from .force import feed
from .rows import REACHED, ROWS, begin_row, cross_limit, recall, side_of_limit

COORDINATES = DISPLACEMENT  # the first of their courses
HUGE = 1e6  # times what it was without control: on its way to infinity


@kernel
def write(feedback, line, past, room, region, tab, s, count, h, y, size):
    """Store the polynomials of the last step in the delay line."""
    course = line.course[count[ROWS] - 1]
    for n in range(size):
        own = course[COORDINATES + n]
        expand(tab, h, s.new[n] - y[n], s.k[:, n], own)
        for i in range(DEGREE + 1):
            own[i] += y[n]
    feed(feedback, line, past, room, region, h, course)


@kernel
def run(
    tab, field, s, course, fb, line, room, laps, clock, count, greatest, end_turns, end_phase, most
):
    """Advance to the end; to be called again when the delay line is full.

    `greatest` holds the greatest coordinate that there was without control.
    """
    turned = False
    y = course.state
    for _ in range(most):
        if count[ROWS] + 1 > len(line.laps):
            return LINE_FULL
        end = time_until(clock, end_turns, end_phase)
        if end <= REACHED:
            set_clock(clock, end_turns, end_phase)
            return DONE
        past, smooth = recall(fb, line, count, clock)
        region, edge = side_of_limit(fb, line, past, count, y[fb.signal - COORDINATES])
        own = Field(
            field.rates, field.signal, field.coordinate, field.parameters, field.size,
            field.followed, None, Control(fb, line, past, region),
        )  # fmt: skip
        t = clock[TURNS] * TURN + clock[PHASE] + clock[LOW]
        course.clock[TIME] = t
        rates_at(own, t, 0.0, y, course.rate)
        step = stride(tab, own, s, course, min(end, smooth))
        if step == 0.0:
            return DIVERGED
        begin_row(line, count, clock, step)
        finish(tab, own, s, t, step, y)
        write(fb, line, past, room, region, tab, s, count, step, y, field.size)
        share, side, turned = meet_limit(fb, line, count, room, None, region, edge, turned)
        if turned:
            continue
        h = step
        if share < 1.0 and side != 0:
            h = share * step
            take(tab, own, s, t, h, y, s.new)
            cross_limit(line, laps, count, share, region, side)
        for n in range(field.size):
            y[n] = s.new[n]
            if not fb.on:
                greatest[0] = max(greatest[0], abs(y[n]))
            if not abs(y[n]) < (HUGE * greatest[0] if fb.on else 1e100):
                return DIVERGED
        if h >= end:
            set_clock(clock, end_turns, end_phase)
        else:
            pass_time(clock, h)
    return EXHAUSTED
