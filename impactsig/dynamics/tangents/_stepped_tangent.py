"""Kernels for the tangent map of a stepped motion, from event to event.

The motion is stepped again from row to row, and the columns with it (`_stepped_variation`). At an
event they jump (`_saltation`); what a Hertz stop with a restitution coefficient loses goes by its
approach velocity, so what that gains by either column is carried as well.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ...oscillators.laws import (
    BY_APPROACH,
    HERTZ,
    LAW,
    LOSS,
    PLACE,
    PUSHER,
    RESTITUTION,
    SIDE,
    SPRING,
)
from ...simulation.basis.events import (
    IMPACT,
    LOW,
    MARK,
    PART,
    PHASE,
    RELEASE,
    REVERSE,
    ROW_APPROACH,
    ROW_KIND,
    ROW_Q,
    ROW_STOP,
    ROW_V,
    START,
    STICK,
    TOUCH,
    TURNS,
    Q,
    V,
)
from ...simulation.exact.passing import pass_time, set_clock, time_until
from ...simulation.stepping.rates import jerk, open_leg, origin, pull
from ...simulation.stepping.retrace import mode_of
from ...simulation.stepping.step import stride
from ._saltation import approach_of, hit, set_off, slope_of_return, stick, turn
from ._stepped_variation import STOPS, SWIFT, WISHED, pull_slopes, vary
from .columns import (
    BY_FRICTION,
    DETERMINANT,
    FIRST,
    FREE,
    HELD,
    IMPACTS,
    IN_MODE,
    LAST,
    NEXT,
    SINGULAR,
    due,
    multiply,
    orthonormalize,
    rescale,
    take,
)

FINE = 1e-8  # of the time that the motion takes: step where a Hertz contact begins or ends


@kernel
def settle(p, motion, columns, totals, orthonormal):
    """Orthonormalise or rescale the columns, together with what depends on them."""
    count = len(p.stops)
    a, b, c, d = columns[0, 0], columns[1, 0], columns[0, 1], columns[1, 1]
    scale = totals[FIRST]
    if not orthonormal:
        rescale(columns, totals)
        share = math.exp(scale - totals[FIRST])
        for n in range(STOPS + count, STOPS + 3 * count):
            motion[n] *= share
        return
    orthonormalize(columns, totals)
    area = a * d - b * c
    norm = math.hypot(a, b)
    for k in range(STOPS + count, STOPS + 3 * count, 2):
        first, second = motion[k], motion[k + 1]
        if area == 0.0 or norm == 0.0:
            motion[k], motion[k + 1] = 0.0, 0.0
            continue
        # The second is what Gram and Schmidt leave of it, over its own length.
        motion[k] = first / norm
        motion[k + 1] = (second - (a * c + b * d) / norm**2 * first) * norm / area


@kernel
def retrace(
    p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
    slopes, by_approach, clock, new, parts,
):  # fmt: skip
    """Repeat the steps of the motion with its columns up to an instant.

    The slope of Hertz' force begins as the root of the depth, which no polynomial follows: steps
    double from where it does, and halve to where it ends (where a contact `parts`).
    """
    set_clock(clock, place[TURNS], place[PHASE])
    mode = int(place[IN_MODE])
    approach = motion[STOPS : STOPS + len(p.stops)]
    while True:
        end = time_until(clock, turns, phase)
        if end <= 0:
            break
        y, v = motion[Q], motion[V]
        leg = open_leg(p, s, clock[TURNS], clock[PHASE], clock[LOW], mode, approach, y, v)
        a = pull(f, leg, s, 0.0, y, v)
        wish = motion[WISHED]
        if leg.hertz > 0 and wish == 0.0:
            wish = FINE / leg.rate
        most = end
        if parts and end * leg.rate > FINE:
            most = end / 2
        step, dq, dv, wish, _ = stride(p, tab, f, leg, s, wish, most, y, v, a, motion[SWIFT])
        if step == 0.0:
            multiply(columns, math.nan, math.nan, math.nan, math.nan)
            break
        trace, error = vary(
            p, tab, f, s, leg, mode, motion, step, y, columns, new, slopes, by_approach
        )
        if error > 1 and step * leg.rate > FINE:
            motion[WISHED] = step * max(0.2, 0.9 * error**-0.125)
            continue
        totals[DETERMINANT] += step * trace
        for j in range(2):
            columns[0, j], columns[1, j] = new[0, j], new[1, j]
        if error > 1e-6:
            wish = min(wish, step * 0.9 * error**-0.125)
        motion[Q], motion[V] = y + dq, v + dv
        motion[WISHED] = min(wish, 2 * step) if leg.hertz > 0 else wish
        motion[SWIFT] = max(motion[SWIFT], abs(motion[V]))
        pass_time(clock, step)
        settle(p, motion, columns, totals, orthonormal)
    place[TURNS], place[PHASE] = turns, phase


@kernel
def pull_in(p, f, s, row, mode, approach, y, v):
    """Acceleration in a mode at the instant of a row, and the leg."""
    leg = open_leg(p, s, row[TURNS], row[PHASE], 0.0, mode, approach, y, v)
    return pull(f, leg, s, 0.0, y, v), leg


@kernel
def jump(p, f, s, row, after, place, motion, columns, totals, collapses, at_once):
    """Saltation at an impact, a change of contact or of the direction of friction."""
    before = int(place[IN_MODE])
    kind, k, q, v = int(row[ROW_KIND]), int(row[ROW_STOP]), row[ROW_Q], row[ROW_V]
    count = len(p.stops)
    approach = motion[STOPS : STOPS + count]
    there = q + origin(p, after) - origin(p, before)
    if kind == IMPACT:
        come = approach_of(row, p.stops[k, SIDE], totals)
        if come == 0.0:
            return
        rho = -v / come
        if p.stops[k, RESTITUTION] < 0:
            law = f.upper if p.stops[k, SIDE] > 0 else f.lower
            rho = slope_of_return(law, abs(come), p.omega)
        a, _ = pull_in(p, f, s, row, before, approach, there, come)
        b, _ = pull_in(p, f, s, row, after, approach, q, v)
        hit(columns, totals, collapses, row, come, rho, a, b)
    elif kind in (TOUCH, PART):
        law = p.stops[k, LAW]
        at_gap = p.stops[k, PLACE] == q + origin(p, after)
        totals[IMPACTS] += kind == TOUCH
        if kind == TOUCH and law == HERTZ and p.stops[k, BY_APPROACH] >= 0 and v != 0.0:
            # What the approach velocity gains: the touch comes earlier or later.
            a, _ = pull_in(p, f, s, row, before, approach, there, v)
            for j in range(2):
                gain = columns[1, j] - a * columns[0, j] / v
                motion[STOPS + count + 2 * k + j] = gain if v > 0 else -gain
        elif law == SPRING or (law == PUSHER and kind == TOUCH and at_gap):
            change = -p.stops[k, LOSS] if kind == TOUCH else p.stops[k, LOSS]
            multiply(columns, 1.0, 0.0, change, 1.0)
        elif law == PUSHER and at_once and place[LAST] == IMPACT and v != 0.0:
            # The impact has turned the velocity, and with it what a stop that only pushes does.
            a, _ = pull_in(p, f, s, row, before, approach, there, v)
            b, _ = pull_in(p, f, s, row, after, approach, q, v)
            multiply(columns, 1.0, 0.0, (b - a) / v, 1.0)
        if kind == PART:
            for j in range(2):
                motion[STOPS + count + 2 * k + j] = 0.0
    elif kind == REVERSE and not (at_once and place[LAST] == START):
        a, _ = pull_in(p, f, s, row, before, approach, there, 0.0)
        b, _ = pull_in(p, f, s, row, after, approach, q, 0.0)
        turn(columns, totals, a, b)


@kernel
def let_go(p, f, s, row, after, motion, columns, totals, orthonormal, by_approach):
    """Saltation when friction releases the mass; the lost column begins anew."""
    q = row[ROW_Q]
    rest = after - after % 3
    approach = motion[STOPS : STOPS + len(p.stops)]
    _, leg = pull_in(p, f, s, row, rest, approach, q, 0.0)
    of_q, _ = pull_slopes(p, f, leg, rest, motion, 0.0, q, 0.0, by_approach)
    of_t = jerk(p, f, leg, s, q)
    if of_t == 0.0:
        totals[SINGULAR] += 1
        return
    off = 0.0
    if p.static != p.kinetic:
        a, _ = pull_in(p, f, s, row, after, approach, q, 0.0)
        off = a * of_q / of_t
    set_off(columns, totals, off, orthonormal)


@kernel
def carry_to(
    p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
    slopes, by_approach, clock, new,
):  # fmt: skip
    """Advance the columns to an instant without an event."""
    if place[HELD] == FREE:
        retrace(
            p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
            slopes, by_approach, clock, new, False,
        )  # fmt: skip
    place[TURNS], place[PHASE] = turns, phase


@kernel
def carry(
    p, tab, f, s, rows, end, instants, taken, place, motion, columns, totals, collapses,
    orthonormal, slopes, by_approach, clock, new,
):  # fmt: skip
    """Advance the columns through events to `end`; take totals at instants."""
    count = len(p.stops)
    approach = motion[STOPS : STOPS + count]
    for w in range(len(rows)):
        row = rows[w]
        kind, k = int(row[ROW_KIND]), int(row[ROW_STOP])
        while due(row[TURNS], row[PHASE], place, instants):
            n = int(place[NEXT])
            carry_to(
                p, tab, f, s, instants[n, TURNS], instants[n, PHASE], place, motion, columns,
                totals, orthonormal, slopes, by_approach, clock, new,
            )  # fmt: skip
            take(taken, place, totals)
        at_once = row[TURNS] == place[TURNS] and row[PHASE] == place[PHASE]
        by_stop = kind == STICK and k >= 0
        if place[HELD] == FREE and not by_stop:
            retrace(
                p, tab, f, s, row[TURNS], row[PHASE], place, motion, columns, totals, orthonormal,
                slopes, by_approach, clock, new, kind == PART and p.stops[k, LAW] == HERTZ,
            )  # fmt: skip
        place[TURNS], place[PHASE] = row[TURNS], row[PHASE]
        if k >= 0 and (kind in (TOUCH, MARK)):
            approach[k] = row[ROW_APPROACH]
        mode = mode_of(p, f, s, row, approach)
        if kind == STICK and place[HELD] == FREE:
            stick(columns, totals, collapses, row, place, by_stop)
        elif kind == RELEASE:
            if place[HELD] == BY_FRICTION:
                let_go(p, f, s, row, mode, motion, columns, totals, orthonormal, by_approach)
            place[HELD] = FREE
        elif kind != MARK:
            jump(p, f, s, row, mode, place, motion, columns, totals, collapses, at_once)
        place[IN_MODE] = mode
        if kind != MARK:
            place[LAST] = kind
            motion[WISHED] = 0.0
        motion[Q], motion[V] = row[ROW_Q], row[ROW_V]
        if kind != RELEASE:
            settle(p, motion, columns, totals, orthonormal)
    while True:
        ends = not due(end[0], end[1], place, instants)
        n = int(place[NEXT])
        turns, phase = (end[0], end[1]) if ends else (instants[n, TURNS], instants[n, PHASE])
        carry_to(
            p, tab, f, s, turns, phase, place, motion, columns, totals, orthonormal,
            slopes, by_approach, clock, new,
        )  # fmt: skip
        if ends:
            break
        take(taken, place, totals)
