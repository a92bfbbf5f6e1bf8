"""Kernels that find the spikes within the steps of a flow.

What spikes are looked for in, the integral of the signal or the signal itself, is made a polynomial
of degree 11 over the step. A root of it is corrected by a step that ends there, which is of order 8
where the interpolant is of 7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ..basis.events import DIVERGED, DONE, ENDLESS, EXHAUSTED, LEVEL_SIDE, ROUNDED, TIME, WISH
from ..basis.tableau import GAUGE_DEGREE
from ._flow_crossings import begin, next_crossing, value_at
from .flow_steps import between, go, interpolate, rates_at, stride, take


class Task(NamedTuple):
    """The level, direction, count and end time of a search for spikes."""

    level: float  # threshold of the integral, or level of the signal
    up: bool
    down: bool
    end: float
    wanted: int  # spikes to find


@kernel
def watched(field):
    """Index of the coordinate that is compared with the level; -1 for a function of the state."""
    return field.coordinate if field.fires is None else field.size


@kernel
def out_of_reach(field, s, h, y, level):
    """Whether the signal cannot reach the level within the step.

    Its rate at none of the 13 stages being more than a quarter of what that would take. A step
    within the tolerance, in which the rate is a polynomial of low degree to 13 digits, cannot hide
    more between stages.
    """
    n = watched(field)
    if n < 0:
        return False
    greatest = 0.0
    for i in range(13):
        greatest = max(greatest, abs(s.k[i, n]))
    return abs(level - y[n]) > 4 * h * greatest


@kernel
def gauge(tab, field, s, y):
    """The signal at the nodes of the step."""
    only = watched(field)
    for j in range(GAUGE_DEGREE + 1):
        share = tab.nodes[j]
        if only >= 0:
            s.gauge[j] = between(s, y, share, only) if j < GAUGE_DEGREE else s.new[only]
            continue
        for n in range(field.size):
            s.stage[n] = between(s, y, share, n) if j < GAUGE_DEGREE else s.new[n]
        s.gauge[j] = field.signal(s.stage.ctypes, -1)


@kernel
def pose(tab, s, level):
    """Bernstein coefficients of signal minus level over the whole step."""
    for i in range(GAUGE_DEGREE + 1):
        total = 0.0
        for j in range(GAUGE_DEGREE + 1):
            total += tab.bernstein[i, j] * (s.gauge[j] - level)
        s.coefficients[i] = total
    # Steps must meet without a jump in which a crossing would be lost.
    s.coefficients[0] = s.gauge[0] - level
    s.coefficients[GAUGE_DEGREE] = s.gauge[GAUGE_DEGREE] - level


@kernel
def correct(tab, field, s, t, h, y, level, share):
    """Correct a root by steps that end there; overwrites stages 1 to 11 of the step."""
    for _ in range(5):
        value, slope = value_at(s.coefficients, s.ladder, share)
        if slope == 0.0:
            break
        take(tab, field, s, t, share * h, y, s.landing)
        if field.fires is not None:
            value = s.landing[field.size] - level
        else:
            value = field.signal(s.landing.ctypes, field.coordinate) - level
        change = value / slope
        if not abs(change) < 1e-3:
            break
        share = min(max(share - change, 0.0), 1.0)
        if abs(change) < 1e-9:
            break
    return share


@allocating
def spikes(tab, field, task, s, course, steps):
    """Spikes in so many steps: how it ended, when they are, and how far the signal was."""
    times = np.empty(min(task.wanted, 256))
    found = 0
    y = course.state
    if course.pace[WISH] == 0.0:
        rates_at(field, course.clock[TIME], 0.0, y, course.rate)
        if field.fires is not None:
            course.pace[LEVEL_SIDE] = -1.0
    for _ in range(steps):
        t = course.clock[TIME]
        if t >= task.end:
            return DONE, times[:found]
        if t > 1e300:  # at rest, steps grow without end
            return ENDLESS, times[:found]
        h = stride(tab, field, s, course, task.end - t)
        if h == 0.0:
            return DIVERGED, times[:found]
        if out_of_reach(field, s, h, y, task.level) and course.pace[LEVEL_SIDE] != 0.0:
            go(s, course, h, task.end)
            continue
        interpolate(tab, field, s, t, h, y)
        gauge(tab, field, s, y)
        for j in range(GAUGE_DEGREE + 1):
            if not math.isfinite(s.gauge[j]):
                return DIVERGED, times[:found]
        level = task.level
        side = course.pace[LEVEL_SIDE]
        while True:
            pose(tab, s, level)
            top = begin(s)
            while top >= 0:
                top, share, side = next_crossing(s, top, side)
                if share < 0 or not (task.up if side > 0 else task.down):
                    continue
                share = correct(tab, field, s, t, h, y, level, share)
                at = t + (share * h + course.clock[ROUNDED])
                if found == len(times):
                    more = np.empty(min(2 * found, task.wanted))
                    for k in range(found):
                        more[k] = times[k]
                    times = more
                # Two crossings within rounding of each other keep their order.
                times[found] = at if found == 0 else max(at, times[found - 1])
                found += 1
                if found == task.wanted:
                    return DONE, times
                if field.fires is not None:
                    break
            if field.fires is None or side < 0:
                break
            # Fired: what is integrated from here on has the next multiple to reach.
            level += task.level
            side = -1.0
        course.pace[LEVEL_SIDE] = side
        go(s, course, h, task.end)
        if field.fires is not None:
            y[field.size] -= level - task.level
    return EXHAUSTED, times[:found]
