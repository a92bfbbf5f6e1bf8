"""Kernel: a flow under delayed feedback.

As `_run`, for any number of coordinates and without impacts. The feedback is added to the rate of
the coordinate that it is of.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from ..simulate._events import DIVERGED, DONE, EXHAUSTED
from ..simulate._flow import TURN
from ..simulate._flow_steps import error_of, weigh
from ..simulate._passing import pass_time
from ..simulate._tableau import DEGREE
from ._line import DISPLACEMENT, read
from ._run import (
    EDGE,
    LAPS,
    LONG,
    REACHED,
    REGION,
    ROWS,
    begin_row,
    cross_limit,
    recall,
    side_of_limit,
)
from ._step import bound, feed

COORDINATES = DISPLACEMENT  # the first of their courses
HUGE = 1e6  # times what it was without control: on its way to infinity


class Scratch(NamedTuple):
    """Room for one step; d is a multiple of 4, as `_flow_steps.weigh` asks."""

    k: np.ndarray  # (16, d)
    state: np.ndarray  # (d,) of a stage
    rate: np.ndarray  # (d,)
    error3: np.ndarray  # (d,)
    error5: np.ndarray  # (d,)
    new: np.ndarray  # (d,)
    stack: np.ndarray


@njit(cache=True, nogil=True, error_model="numpy")
def rates_at(rates, p, fb, line, past, region, t, tau, y, out):
    """Rates of the coordinates, tau after the beginning of the step."""
    rates(t + tau, y.ctypes, p.ctypes, out.ctypes)
    if region != 0:
        out[fb.signal - COORDINATES] += region * fb.limit
    elif fb.on:
        late = read(line, past.step, past.last, past.first, fb.signal, past.offset + tau)
        out[fb.signal - COORDINATES] += fb.gain * (late - y[fb.signal - COORDINATES])


@njit(cache=True, nogil=True, error_model="numpy")
def stages(tab, rates, p, fb, line, past, region, s, first, last, t, h, y):
    """Work out some stages from those before them."""
    for i in range(first, last):
        s.k[i] = 0.0
        weigh(tab.a, i, s.k, i, s.state)
        for n in range(len(y)):
            s.state[n] = y[n] + h * s.state[n]
        rates_at(rates, p, fb, line, past, region, t, tab.c[i] * h, s.state, s.rate)
        s.k[i] = s.rate


@njit(cache=True, nogil=True, error_model="numpy")
def take(tab, rates, p, fb, line, past, region, s, t, h, y):
    """A step of h into `s.new`; stage 0 has been worked out."""
    stages(tab, rates, p, fb, line, past, region, s, 1, 12, t, h, y)
    weigh(tab.a, 12, s.k, 12, s.new)
    for n in range(len(y)):
        s.new[n] = y[n] + h * s.new[n]


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(tab, s, h, y, size, course):
    """Write the courses of the coordinates over the step just taken."""
    for n in range(size):
        own = course[COORDINATES + n]
        gain = s.new[n] - y[n]
        own[:] = y[n]
        for m in range(DEGREE):
            if m == 0:
                part = gain
            elif m == 1:
                part = h * s.k[0, n] - gain
            elif m == 2:
                part = 2 * gain - h * (s.k[12, n] + s.k[0, n])
            else:
                part = 0.0
                for i in range(16):
                    part += tab.d[m - 3, i] * s.k[i, n]
                part *= h
            for i in range(DEGREE + 1):
                own[i] += tab.bernstein[i, m] * part


@njit(cache=True, nogil=True, error_model="numpy")
def run(
    rates, p, size, tab, fb, line, room, s, laps, clock, y, pace, count, end_turns, end_phase, most
):
    """Move to the end; to be called again when the line is full.

    `pace` holds the next step, and the greatest coordinate that there was without control.
    """
    turned = False
    for _ in range(most):
        if count[ROWS] + 1 > len(line.laps):
            return LONG
        end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
        if end <= REACHED:
            clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
            return DONE
        past, smooth = recall(fb, line, count, clock)
        ahead = min(end, smooth)
        region, edge = 0, 0
        if fb.on and fb.limit < math.inf:
            own = y[fb.signal - COORDINATES]
            region, edge = side_of_limit(fb, line, past, count, own, own)
        t = clock[0] * TURN + clock[1] + clock[2]
        rates_at(rates, p, fb, line, past, region, t, 0.0, y, s.rate)
        s.k[0] = s.rate
        wish = pace[0]
        if wish == 0.0:
            wish = 0.01 * np.abs(y).max() / max(np.abs(s.rate).max(), 1e-300)
            wish = wish if wish > 0 else 1e-6
        grow = 6.0
        while True:
            step = min(wish, ahead)
            take(tab, rates, p, fb, line, past, region, s, t, step, y)
            rates_at(rates, p, fb, line, past, region, t, step, s.new, s.rate)
            s.k[12] = s.rate
            error = error_of(tab, s, step, y, size)
            if math.isfinite(error) and error <= 1.0:
                factor = grow if error == 0.0 else min(grow, 0.9 * error**-0.125)
                if step == wish or factor < 1.0:
                    wish = step * factor
                break
            wish = step * (max(0.2, 0.9 * error**-0.125) if math.isfinite(error) else 0.1)
            grow = 1.0
            if wish < 1e-14:
                return DIVERGED
        pace[0] = wish
        begin_row(line, count, clock, step)
        course = line.course[count[ROWS] - 1]
        stages(tab, rates, p, fb, line, past, region, s, 13, 16, t, step, y)
        interpolate(tab, s, step, y, size, course)
        feed(fb, line, past, room, region, step, course)
        h = step
        if fb.on:
            share, side, wrong = bound(fb, room, s, region, edge)
            if wrong and not turned:
                # At the limit the force turned back: the step is taken again on that side of it.
                count[ROWS] -= 1
                count[LAPS] = line.laps[count[ROWS]]
                count[REGION], count[EDGE] = edge if region == 0 else 0, edge
                turned = True
                continue
            turned = False
            if share < 1.0 and side != 0:
                h = share * step
                take(tab, rates, p, fb, line, past, region, s, t, h, y)
                cross_limit(line, laps, count, course, share, region, side)
        for n in range(size):
            y[n] = s.new[n]
            if not fb.on:
                pace[1] = max(pace[1], abs(y[n]))
            if not abs(y[n]) < (HUGE * pace[1] if fb.on else 1e100):
                return DIVERGED
        if h >= end:
            clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
        else:
            pass_time(clock, h)
    return EXHAUSTED
