"""Repeat steps from the event rows: samples between them, and peaks of contacts."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import allocating
from ...oscillators.laws import (
    BY_APPROACH,
    EXPONENT,
    HERTZ,
    LAW,
    LOSS,
    PLACE,
    RIGID,
    SIDE,
    STIFFNESS,
)
from ..basis.events import (
    LOW,
    MARK,
    PHASE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_MODE,
    ROW_Q,
    ROW_STOP,
    ROW_V,
    STICK,
    TOUCH,
    TURNS,
)
from ..exact.passing import pass_time, set_clock, time_until
from .rates import PUSHING, approach_loss, hertz_push, open_leg, origin, pull, spring_push, status
from .rest import departure, rigid_at
from .step import stride, take

PARTS = 6  # of a step, in which the greatest force is looked for


@allocating
def recall(p, rows, w, approach):
    """Approach velocities of the contacts in progress at row w, from the rows before it."""
    for k in range(len(p.stops)):
        approach[k] = 0.0
        if p.stops[k, BY_APPROACH] < 0 or p.stops[k, LAW] != HERTZ:
            continue
        if status(p, int(rows[w, ROW_MODE]), k) == PUSHING:
            for r in range(w, -1, -1):
                if rows[r, ROW_STOP] == k and (
                    rows[r, ROW_KIND] == TOUCH or rows[r, ROW_KIND] == MARK
                ):
                    approach[k] = rows[r, ROW_APPROACH]
                    break


@allocating
def mode_of(p, f, s, row, approach):
    """Mode of the motion after a row; that of a start depends on the sliding direction."""
    mode = int(row[ROW_MODE])
    if p.static > 0 and mode % 3 == 0 and row[ROW_KIND] != STICK:
        way = 1 if row[ROW_V] > 0 else -1
        if row[ROW_V] == 0.0:
            leg = open_leg(p, s, row[TURNS], row[PHASE], 0.0, mode, approach, row[ROW_Q], 0.0)
            way, _ = departure(p, f, leg, s, row[ROW_Q], rigid_at(p, leg, row[ROW_Q]))
        if abs(way) == 1:
            mode += 1 if way > 0 else 2
    return mode


@allocating
def sample(p, tab, f, s, rows, where, turns, phase, order, q, v):
    """Position and velocity at instants, each after the row that `where` names.

    `order` has the instants of a row together and in the order of time.
    """
    approach = np.empty(len(p.stops))
    clock = np.empty(3)
    current = -1
    mode = 0
    x = u = a = step = dq = dv = wish = speed = 0.0
    leg = open_leg(p, s, 0.0, 0.0, 0.0, 0, approach, 0.0, 0.0)
    for n in order:
        w = where[n]
        if w != current:
            current = w
            recall(p, rows, w, approach)
            mode = mode_of(p, f, s, rows[w], approach)
            set_clock(clock, rows[w, TURNS], rows[w, PHASE])
            x, u, wish, step = rows[w, ROW_Q], rows[w, ROW_V], 0.0, -1.0
            speed = abs(u)
        while True:
            tau = time_until(clock, turns[n], phase[n])
            if rows[w, ROW_KIND] == STICK or tau <= 0:
                at, velocity = x, u
                break
            if step < 0:
                leg = open_leg(p, s, clock[TURNS], clock[PHASE], clock[LOW], mode, approach, x, u)
                a = pull(f, leg, s, 0.0, x, u)
                step, dq, dv, wish, _ = stride(
                    p, tab, f, leg, s, wish, p.longest, x, u, a, speed
                )  # fmt: skip
            if step == 0.0:
                at, velocity = math.nan, math.nan
                break
            if tau <= step:
                more, faster = take(p.fixed, tab, f, leg, s, tau, x, u, a)
                at, velocity = x + more, u + faster
                break
            x, u = x + dq, u + dv
            speed = max(speed, abs(u))
            pass_time(clock, step)
            step = -1.0
        at += origin(p, mode)
        for k in range(len(p.stops)):
            if p.stops[k, LAW] == RIGID and p.stops[k, SIDE] * (at - p.stops[k, PLACE]) > 0:
                at = p.stops[k, PLACE]
        q[n], v[n] = at, velocity


@allocating
def push_of(p, k, loss, depth, inward):
    """Force per mass of a soft stop."""
    if depth < 0:
        return 0.0
    if p.stops[k, LAW] == HERTZ:
        root = math.sqrt(depth)
        return hertz_push(p.stops[k, STIFFNESS], p.stops[k, EXPONENT], loss, depth, root, inward)
    return spring_push(p.stops[k, STIFFNESS], p.stops[k, LOSS], depth, inward)


@allocating
def peaks(p, tab, f, s, rows, first, last, end_turns, end_phase, out):
    """Greatest force of contacts per mass, each from the row of its touch to that of its end."""
    approach = np.empty(len(p.stops))
    clock = np.empty(3)
    for n in range(len(first)):
        k = int(rows[first[n], ROW_STOP])
        side = p.stops[k, SIDE]
        best = -math.inf
        for w in range(first[n], last[n]):
            recall(p, rows, w, approach)
            row = rows[w]
            mode = mode_of(p, f, s, row, approach)
            loss = p.stops[k, LOSS]
            if p.stops[k, BY_APPROACH] >= 0:
                loss = approach_loss(p.stops[k, BY_APPROACH], approach[k])
            set_clock(clock, row[TURNS], row[PHASE])
            x, u, wish, speed = row[ROW_Q], row[ROW_V], 0.0, abs(row[ROW_V])
            until_turns, until_phase = end_turns, end_phase
            if w + 1 < len(rows):
                until_turns, until_phase = rows[w + 1, TURNS], rows[w + 1, PHASE]
            off = p.stops[k, PLACE] - origin(p, mode)
            best = max(best, push_of(p, k, loss, max(side * (x - off), 0.0), side * u))
            while row[ROW_KIND] != STICK:
                end = time_until(clock, until_turns, until_phase)
                if end <= 0:
                    break
                leg = open_leg(p, s, clock[TURNS], clock[PHASE], clock[LOW], mode, approach, x, u)
                a = pull(f, leg, s, 0.0, x, u)
                step, dq, dv, wish, _ = stride(p, tab, f, leg, s, wish, end, x, u, a, speed)
                if step == 0.0:
                    break
                top, greatest = 0, push_of(p, k, loss, side * (x - off), side * u)
                for i in range(1, PARTS + 1):
                    more, faster = take(p.fixed, tab, f, leg, s, step * i / PARTS, x, u, a)
                    force = push_of(p, k, loss, side * (x + more - off), side * (u + faster))
                    if force > greatest:
                        greatest, top = force, i
                best = max(best, greatest)
                if greatest > 0.9 * best:
                    # The force has one maximum between the neighbours of its greatest value.
                    low = step * max(top - 1, 0) / PARTS
                    high = step * min(top + 1, PARTS) / PARTS
                    for _ in range(40):
                        left = high - 0.6180339887498949 * (high - low)
                        right = low + (high - left)
                        more, faster = take(p.fixed, tab, f, leg, s, left, x, u, a)
                        one = push_of(p, k, loss, side * (x + more - off), side * (u + faster))
                        more, faster = take(p.fixed, tab, f, leg, s, right, x, u, a)
                        two = push_of(p, k, loss, side * (x + more - off), side * (u + faster))
                        best = max(best, one, two)
                        if one < two:
                            low = left
                        else:
                            high = right
                x, u = x + dq, u + dv
                speed = max(speed, abs(u))
                pass_time(clock, step)
        out[n] = best
