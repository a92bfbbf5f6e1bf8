"""Kernels for a piecewise linear oscillator under delayed feedback, by power series.

Between the places where what is fed back is not smooth the equation of motion is linear, and what
is fed back is a polynomial, as it comes from such a step one delay before. So a step is the Taylor
series of the motion ([HairerNorsettWanner1993]_, section I.8) with the delayed polynomial among
what acts, by a recursion that is exact but for the terms that are left out and for rounding: the
method of steps of `tests/naive_control.py`, in 21 terms. Courses are kept in powers of the share of
their row. What comes from several rows is fitted through Chebyshev nodes, if it is smooth enough.
"""

from __future__ import annotations

import math

from ...._compiling.compiled import inlined
from ....simulation.basis.delay import DISPLACEMENT, FORCE, SIGNAL, VELOCITY
from ....simulation.basis.events import LENGTH
from .line import scale
from .rows import REACHED
from .series import FIT, ORDER, REACH

SMOOTH = 4e-15  # last coefficients of a fit, relative to the greatest value: no more than rounding
NEAR = 1e-12  # share of a step whose powers do not underflow


@inlined
def delayed_series(feedback, line, past, room, h, whole):
    """Write the delayed signal of the step to `room.late`; returns the step, perhaps shortened.

    A step within one row takes that row's polynomial as it is. One over several is fitted, and made
    shorter where that is no good; unless it is to be taken `whole`.
    """
    late = room.late
    if not feedback.on:
        late[:] = 0.0
        return h
    j, offset = past.step, past.offset
    while j < past.last and line.when[j, LENGTH] - offset <= REACHED:
        offset = max(offset - line.when[j, LENGTH], 0.0)
        j += 1
    while True:
        rest = line.when[j, LENGTH] - offset
        within = j >= past.last or h <= rest + REACHED
        if within or (2 * rest >= h and not whole):
            h = h if within else rest
            row = line.course[j, SIGNAL if j >= past.first else feedback.signal]
            part(room, row, offset / line.when[j, LENGTH], h / line.when[j, LENGTH], late)
            return h
        if fitted(feedback, line, past, room, h) or whole:
            return h
        h /= 2


@inlined
def part(room, c, start, length, out):
    """Reparametrise a polynomial to a part of its step."""
    for n in range(ORDER + 1):
        out[n] = c[n]
    if start > NEAR:
        # By binomials rather than by Horner's scheme, whose steps wait for each other.
        scale(out, start)
        for n in range(ORDER + 1):
            room.c[n] = 0.0
        for m in range(ORDER + 1):
            for n in range(m + 1):
                room.c[n] += room.binomial[m, n] * out[m]
        for n in range(ORDER + 1):
            out[n] = room.c[n]
        scale(out, length / start)
        return
    if start > 0.0:
        for i in range(ORDER):
            for n in range(ORDER - 1, i - 1, -1):
                out[n] += start * out[n + 1]
    if length != 1.0:
        scale(out, length)


@inlined
def fitted(feedback, line, past, room, h):
    """Fit `room.late` to the delayed signal within h; whether it is accurate to rounding."""
    values, terms, late = room.values[0], room.values[1], room.late
    # All nodes within a row at once.
    j, begun, first = past.step, -past.offset, 0
    while first <= FIT:
        length = line.when[j, LENGTH]
        last = first
        while last <= FIT and (j >= past.last or room.nodes[last] * h - begun <= length):
            terms[last] = (room.nodes[last] * h - begun) / length
            values[last] = 0.0
            last += 1
        c = line.course[j, SIGNAL if j >= past.first else feedback.signal]
        for i in range(ORDER, -1, -1):
            for n in range(first, last):
                values[n] = values[n] * terms[n] + c[i]
        j, begun, first = j + 1, begun + length, last
    greatest = 0.0
    for n in range(FIT + 1):
        greatest = max(greatest, abs(values[n]))
        terms[n] = 0.0
    for m in range(FIT + 1):
        for n in range(FIT + 1):
            terms[n] += room.fit[m, n] * values[m]
    for n in range(ORDER + 1):
        late[n] = 0.0
    for m in range(FIT + 1):
        for n in range(m + 1):
            late[n] += room.shifted[m, n] * terms[m]
    return abs(terms[FIT]) + abs(terms[FIT - 1]) <= SMOOTH * greatest


@inlined
def longest_step(leg, feedback, fastest):
    """Longest step over which the truncated series is accurate."""
    stiffness, damping = leg.kappa, leg.damping
    if feedback.on:
        if feedback.signal == VELOCITY:
            damping += abs(feedback.gain)
        else:
            stiffness += abs(feedback.gain)
    return REACH / max(damping / 2 + math.sqrt(damping * damping / 4 + stiffness), fastest)


@inlined
def expand(leg, waves, feedback, room, region, h, y, v):
    """Power series of position and velocity over a step of h."""
    q, u = room.q, room.v
    stiffness, damping, gain = leg.kappa, leg.damping, 0.0
    constant = leg.constant
    if feedback.on and region != 0:
        constant += region * feedback.limit
    elif feedback.on:
        gain = feedback.gain
        if feedback.signal == VELOCITY:
            damping += gain
        else:
            stiffness += gain
            constant -= gain * leg.origin
    for n in range(ORDER + 1):
        u[n] = gain * room.late[n]
    u[0] += constant
    for j in range(leg.waves):
        size, pace = waves[j, 1], waves[j, 0] * h
        cosine, sine = math.cos(waves[j, 2]), math.sin(waves[j, 2])
        for n in range(0, ORDER - 1, 2):
            u[n] += size * cosine
            size *= pace * room.inverse[n]
            u[n + 1] -= size * sine
            size *= -pace * room.inverse[n + 1]
        u[ORDER] += size * cosine
    # So far the force; each of its terms gives way to the velocity's.
    for n in range(ORDER):
        push, share = u[n], h * room.inverse[n]
        q[n], u[n] = y, v
        later = (share * push - share * stiffness * y) - share * damping * v
        y, v = share * v, later
    q[ORDER], u[ORDER] = y, v


@inlined
def write_series(feedback, line, room, region, row, place):
    """Store the polynomials of a row; positions are relative to `place`."""
    course = line.course[row]
    x, u, signal, push = course[DISPLACEMENT], course[VELOCITY], course[SIGNAL], course[FORCE]
    for n in range(ORDER + 1):
        x[n], u[n] = room.q[n], room.v[n]
    x[0] += place
    own = u if feedback.signal == VELOCITY else x
    if not feedback.on:
        for n in range(ORDER + 1):
            signal[n], push[n] = own[n], 0.0
        return
    for n in range(ORDER + 1):
        signal[n] = (1 - feedback.memory) * own[n] + feedback.memory * room.late[n]
        room.gap[n] = feedback.gain * (room.late[n] - own[n])
        push[n] = room.gap[n]
    if region != 0:
        push[:] = 0.0
        push[0] = region * feedback.limit
