"""Kernels: one step of Dormand and Prince's method under delayed feedback.

As `simulate._step`, with the control force beside the oscillator's. A step ends where what is fed
back is not smooth, so within it that is known and smooth: the method keeps its order, and so does
its interpolant, of degree 7, from which what is fed back comes one delay later (the conditions of
[BellenZennaro2003]_, chapter 6, are met for order 8).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..simulate._flow import inlined, inner
from ..simulate._rates import accelerate
from ..simulate._roots import first_root
from ..simulate._step import error, expand, first_step
from ..simulate._tableau import DEGREE
from ._line import DISPLACEMENT, FORCE, SIGNAL, VELOCITY, read

NONE = 2.0  # a share of a step at which nothing happens


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
    """Where a step finds what is fed back: see `_line.read`."""

    step: int
    last: int
    first: int
    offset: float


class Room(NamedTuple):
    """Room for one step, beside that of the engine."""

    late: np.ndarray  # (16,) what is fed back, at the stages
    nodes: np.ndarray  # (DEGREE + 1,) shares of a step
    fit: np.ndarray  # (DEGREE + 1, same) from values at the nodes to Bernstein coefficients
    values: np.ndarray  # (DEGREE + 1,)
    gap: np.ndarray  # (DEGREE + 1,) of the control force to its limit


@inlined
def force(fb, region, late, y, v):
    """Control force per mass; y is the displacement.

    Beyond the limit (region 1 or -1) it is constant. The region holds for a whole step, so that
    the force is smooth even a little beyond where it ends.
    """
    if region != 0:
        return region * fb.limit
    return fb.gain * (late - (v if fb.signal == VELOCITY else y))


@inner
def stages(tab, law, leg, s, fb, region, late, first, last, h, y, v):
    """Work out some stages from those before them."""
    kq, kv = s.kq, s.kv
    for i in range(first, last):
        x = u = 0.0
        for j in range(i):
            x += tab.a[i, j] * kq[j]
            u += tab.a[i, j] * kv[j]
        kq[i] = v + h * u
        kv[i] = accelerate(law, leg, s.waves, s.hertz, tab.c[i] * h, y + h * x, kq[i])
        if fb.on:
            kv[i] += force(fb, region, late[i], y + h * x + leg.origin, kq[i])


@inner
def take(tab, f, leg, s, fb, line, past, room, region, h, y, v, a):
    """What position and velocity gain in a step of h; all of its first 13 stages."""
    s.kq[0], s.kv[0] = v, a
    if fb.on:
        for i in range(1, 13):
            room.late[i] = read(
                line, past.step, past.last, past.first, fb.signal, past.offset + tab.c[i] * h
            )
    stages(tab, f.law, leg, s, fb, region, room.late, 1, 12, h, y, v)
    dq = dv = 0.0
    for i in range(12):
        dq += tab.a[12, i] * s.kq[i]
        dv += tab.a[12, i] * s.kv[i]
    dq, dv = h * dq, h * dv
    s.kq[12] = v + dv
    s.kv[12] = accelerate(f.law, leg, s.waves, s.hertz, h, y + dq, v + dv)
    if fb.on:
        s.kv[12] += force(fb, region, room.late[12], y + dq + leg.origin, v + dv)
    return dq, dv


@inner
def stride(p, tab, f, leg, s, fb, line, past, room, region, wish, end, y, v, a, speed):
    """A step within the tolerance, no longer than `end`; as `simulate._step.stride`."""
    h = wish if wish > 0 else first_step(p, leg, y)
    least = 1e-3 * p.tolerance / leg.rate
    grow = 6.0
    tries = 0
    while True:
        tries += 1
        step = min(h, end)
        dq, dv = take(tab, f, leg, s, fb, line, past, room, region, step, y, v, a)
        size = error(p.tolerance, leg.rate, tab, s, step, y, v, dv, speed)
        if not math.isfinite(size):
            if step <= least:
                return 0.0, dq, dv, h, tries
            h = 0.1 * step
            continue
        factor = min(grow, max(0.2, 0.9 * size**-0.125)) if size > 0 else grow
        if size <= 1 or step <= least:
            return step, dq, dv, h if step < h else min(h * factor, p.longest), tries
        h = step * min(factor, 0.9)
        grow = 1.0


@inner
def interpolate(tab, f, leg, s, fb, line, past, room, region, h, y, v, dq, dv, course):
    """Write the courses of the step just taken; `s.q`, `s.v` hold what they gain."""
    if fb.on:
        for i in range(13, 16):
            room.late[i] = read(
                line, past.step, past.last, past.first, fb.signal, past.offset + tab.c[i] * h
            )
    stages(tab, f.law, leg, s, fb, region, room.late, 13, 16, h, y, v)
    expand(tab, h, dq, s.kq, s.q)
    expand(tab, h, dv, s.kv, s.v)
    for n in range(DEGREE + 1):
        course[DISPLACEMENT, n] = y + s.q[n] + leg.origin
        course[VELOCITY, n] = v + s.v[n]
    feed(fb, line, past, room, region, h, course)


@inner
def feed(fb, line, past, room, region, h, course):
    """Write what is fed back from the step, and the control force in it.

    What is fed back is the signal and, where there is a memory, the share of it of what was fed
    back one delay before, which is fitted by a polynomial.
    """
    own, signal, push = course[fb.signal], course[SIGNAL], course[FORCE]
    if not fb.on:
        for n in range(DEGREE + 1):
            signal[n], push[n] = own[n], 0.0
        return
    for n in range(DEGREE + 1):
        room.values[n] = read(
            line, past.step, past.last, past.first, fb.signal, past.offset + room.nodes[n] * h
        )
    for n in range(DEGREE + 1):
        late = 0.0
        for m in range(DEGREE + 1):
            late += room.fit[n, m] * room.values[m]
        signal[n] = (1 - fb.memory) * own[n] + fb.memory * late
        room.gap[n] = fb.gain * (late - own[n])
        push[n] = region * fb.limit if region != 0 else room.gap[n]


@inner
def bound(fb, room, s, region, edge):
    """Where in the step the force reaches its limit, or comes back from it; and which limit.

    `edge` is the limit at which the step began, which its first root is not. Last it tells whether
    the force goes from there to the other side than the region is.
    """
    at, which, wrong = NONE, 0, False
    if not fb.limit < math.inf:
        return at, which, wrong
    for side in (-1, 1):
        if region == -side:
            continue
        sign = side if region == side else -side
        c = s.stack[0]
        for n in range(DEGREE + 1):
            c[n] = fb.limit * (1 if region == 0 else -1) + sign * room.gap[n]
        degree = DEGREE
        if edge == side:
            start = c[0]
            for n in range(degree):
                c[n] = (c[n + 1] - start) * degree / (n + 1)
            degree -= 1
        if not c[0] > 0:
            wrong = wrong or edge == side
            continue
        share = first_root(s.stack, degree)
        if share < at:
            at, which = share, side
    return at, which, wrong
