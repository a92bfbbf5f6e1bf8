"""Event functions of a step: which one vanishes first, and when.

Every event function is linear in position and velocity, so that over a step of Dormand and Prince's
it is a polynomial of degree 7. Its first root is polished by steps that end there, which are more
accurate than the interpolant. Classical steps are halved instead.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined, kernel
from ...oscillators.laws import LAW, LOSS, PLACE, PUSHER, RIGID, SIDE, STIFFNESS
from ..basis.roots import first_root
from ..basis.tableau import DEGREE
from .rates import OUT, SLACK, jerk, pull, spring_push, status
from .step import classical, interpolate, take

# Event functions: a stop out of reach is reached; a stop parts; one left behind is out of reach, or
# pushes again; the sliding mass comes to rest.
REACH, LEAVE, EXIT, AGAIN, REST = range(5)
# Columns of `Scratch.events`: value where the step starts, weights of position and velocity, which
# function of which stop, zeros where the step starts (see `zeros_at_start`).
VALUE, BY_Q, BY_V, MEANING, OF_STOP, ZEROS = range(6)
ROUNDING = 4e-15  # a sum this small beside its terms is 0
STILL = 5  # zeros, where an event function does not move


@kernel
def list_events(p, s, leg, mode, y, v):
    """Write the event functions of a mode, positive while it lasts, to `events`; their number."""
    n = 0
    ahead = 0.0  # the side on which the next stop is found; what stands behind it is reached later
    for k in p.order:
        side, digit = p.stops[k, SIDE], status(p, mode, k)
        if side == ahead:
            continue
        depth = side * (y - (p.stops[k, PLACE] - leg.origin))
        stiffness, loss = p.stops[k, STIFFNESS], p.stops[k, LOSS]
        force = spring_push(stiffness, loss, depth, side * v)
        if digit == OUT:
            enter(s.events, n, -depth, -side, 0.0, REACH, k)
            ahead = side
        elif digit == SLACK:
            enter(s.events, n, depth, side, 0.0, EXIT, k)
            n += 1
            enter(s.events, n, -force, -stiffness * side, -loss * side, AGAIN, k)
        elif p.stops[k, LAW] == PUSHER:
            enter(s.events, n, force, stiffness * side, loss * side, LEAVE, k)
        else:
            enter(s.events, n, depth, side, 0.0, LEAVE, k)
        n += 1
    if mode % 3 != 0:
        sign = 1.0 if mode % 3 == 1 else -1.0
        enter(s.events, n, sign * v, 0.0, sign, REST, -1)
        n += 1
    return n


@inlined
def enter(events, n, at, of_q, of_v, kind, k):
    """Append one event function."""
    row = events[n]
    row[VALUE], row[BY_Q], row[BY_V], row[MEANING], row[OF_STOP] = at, of_q, of_v, kind, k


@kernel
def starts(leg, s, y, a, rate):
    """Order and value of the first nonzero derivative of position of a mass at rest.

    What is no more than the rounding of the forces, and of their derivatives, is 0. The order is 0
    where nothing tells.
    """
    force = abs(leg.constant) + abs(leg.kappa * y) + abs(leg.kappa * leg.origin)
    changes = bends = bend = 0.0
    for j in range(leg.waves):
        ratio, size = s.waves[j, 0], abs(s.waves[j, 1])
        force += size
        changes += ratio * size
        bends += ratio * ratio * size
        bend -= ratio * ratio * s.waves[j, 1] * math.cos(s.waves[j, 2])
    if abs(a) > ROUNDING * force:
        return 2, a
    if abs(rate) > ROUNDING * changes:
        return 3, rate
    if abs(bend) > ROUNDING * bends:
        return 4, bend
    return 0, 0.0


@inlined
def begin_events(p, f, leg, s, mode, y, v, a, balanced):
    """List the event functions of a step, with their zeros where it starts.

    How many there are, and the first that falls from there, or -1.
    """
    number = list_events(p, s, leg, mode, y, v)
    due = -1
    for i in range(number):
        zeros = zeros_at_start(p, f, leg, s, s.events[i], y, v, a, balanced)
        s.events[i, ZEROS] = zeros
        if zeros < 0 and due < 0:
            due = i
    return number, due


@kernel
def zeros_at_start(p, f, leg, s, row, y, v, a, balanced):
    """How many times an event function is zero where the step starts; -1 if it falls from there.

    `balanced`: the mass was just let go where the forces on it cancel, so that what the
    acceleration is but for rounding is known. A mass at rest at a soft stop sets off by the first
    derivative that tells; where none does, the event does not come within the step (`STILL`).
    """
    if row[VALUE] > 0:
        return 0
    if row[MEANING] == REST and v == 0.0:
        return 2 if balanced else 1
    if v == 0.0 and not balanced and p.stops[int(row[OF_STOP]), LAW] != RIGID:
        order, way = starts(leg, s, y, a, jerk(p, f, leg, s, y))
        if order == 0:  # of a law, and of control, further derivatives are not known
            return 3 if p.forced or f.control is not None else STILL
        if row[BY_V] != 0.0:  # a force by the velocity falls one derivative sooner
            order -= 1
            way *= row[BY_V]
        else:
            way *= row[BY_Q]
        return order if way > 0 else -1
    slope = row[BY_Q] * v + row[BY_V] * a
    if slope != 0:
        return 1 if slope > 0 else -1
    if balanced:
        return 3
    bend = row[BY_Q] * a
    if bend != 0:
        return 2 if bend > 0 else -1
    return 3 if row[BY_Q] * jerk(p, f, leg, s, y) >= 0 else -1


@kernel
def event_root(s, row, zeros):
    """First root of an event function over the step, past those where it starts; 2 if none."""
    if zeros == STILL:
        return 2.0
    c = s.stack[0]
    for i in range(DEGREE + 1):
        c[i] = row[VALUE] + row[BY_Q] * s.q[i] + row[BY_V] * s.v[i]
    n = DEGREE
    for _ in range(zeros):
        start = c[0]
        for i in range(n):
            c[i] = (c[i + 1] - start) * n / (i + 1)
        n -= 1
    return first_root(s.stack, n)


@kernel
def earliest(tab, f, leg, s, number, step, y, v, dq, dv):
    """The event that comes first on the interpolant of a step, and its share of the step."""
    due, at = -1, 2.0
    if number > 0:
        interpolate(tab, f, leg, s, step, y, v, dq, dv)
        for i in range(number):
            x = event_root(s, s.events[i], int(s.events[i, ZEROS]))
            if x < at:
                due, at = i, x
    return due, at


@kernel
def polish(p, tab, f, leg, s, row, h, most, y, v, a):
    """Shorten the step so that it ends at the event, from its instant on the interpolant.

    Newton's iteration on the length of the step itself. Where that leads away, the event grazes,
    and the interpolant has the last word.
    """
    first = h
    dq, dv = take(p.fixed, tab, f, leg, s, h, y, v, a)
    last = math.inf
    for _ in range(8):
        at = row[VALUE] + row[BY_Q] * dq + row[BY_V] * dv
        slope = row[BY_Q] * (v + dv)
        if row[BY_V] != 0.0:
            slope += row[BY_V] * pull(f, leg, s, h, y + dq, v + dv)
        if not slope < 0:
            break
        move = -at / slope
        if abs(move) > 1e-3 * first or not abs(move) < last or h + move <= 0 or h + move > most:
            break
        last = abs(move)
        h += move
        dq, dv = take(p.fixed, tab, f, leg, s, h, y, v, a)
        if last <= 4e-16 * h:
            break
    return h, dq, dv


@kernel
def passed(s, number, dq, dv):
    """The first listed event function that is negative after a gain, or -1."""
    for i in range(number):
        row = s.events[i]
        if row[VALUE] + row[BY_Q] * dq + row[BY_V] * dv < 0:
            return i
    return -1


@kernel
def halve(f, leg, s, number, step, y, v, a, dq, dv):
    """The method of the thesis: halve steps that pass an event, down to the tolerance.

    Returns the event (-1: none was passed), and the sum of those halves and of what they gain.
    """
    due = passed(s, number, dq, dv)
    if due < 0:
        return due, step, dq, dv
    t = x = u = 0.0
    part = step
    least = 2e-16 * step
    while part > least:
        part /= 2
        start = pull(f, leg, s, t, y + x, v + u) if t > 0 else a
        more, faster = classical(
            f.law, f.control, leg, s.waves, s.hertz, t, part, y + x, v + u, start
        )  # fmt: skip
        i = passed(s, number, x + more, u + faster)
        if i < 0:
            t, x, u = t + part, x + more, u + faster
        else:
            due = i
    return due, t, x, u
