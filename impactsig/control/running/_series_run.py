"""Kernel for a piecewise linear oscillator under delayed feedback, from event to event.

As `_run`, by the same contacts, rows and events, but with the steps of `_series`.
"""

from __future__ import annotations

import math

from ..._compiled import inlined, inner, kernel
from ...simulate.basis.events import (
    APPROACH,
    BROKEN,
    DIVERGED,
    DONE,
    EXHAUSTED,
    FULL,
    HOLDER,
    LEG_COUNT,
    LENGTH,
    LINE_FULL,
    LOST,
    LOW,
    MODE,
    PHASE,
    RELEASE,
    ROW_COUNT,
    SPEED,
    STUCK,
    TURN,
    TURNS,
    Q,
    V,
)
from ...simulate.basis.laws import PLACE
from ...simulate.exact.passing import pass_time, set_clock, time_until
from ...simulate.stepping.contact import hold, note, slide, touched
from ...simulate.stepping.crossing import OF_STOP, begin_events
from ...simulate.stepping.rates import open_leg, origin, pull
from ...simulate.stepping.rest import departure, holding, rigid_at, unstick
from ...simulate.stepping.stepping import inside
from ._force import signal_of
from ._rows import (
    EDGE,
    LAPS,
    REACHED,
    REGION,
    ROWS,
    begin_row,
    mark_limit,
    recall,
    side_of_limit,
    turn_back,
)
from ._series import (
    delayed_series,
    expand,
    longest_step,
    scale,
    write_series,
)
from ._series_roots import series_bound, series_event
from ._settling import settle, under

ROOM = 4  # rows that one pass may write


@inlined
def gain_of(c, share):
    """Increment of a polynomial over a share of its step."""
    value = 0.0
    for n in range(len(c) - 1, 0, -1):
        value = (value + c[n]) * share
    return value


@inner
def end_series(line, count, share):
    """Cut the row to its first share."""
    row = count[ROWS] - 1
    for m in range(line.course.shape[1]):
        scale(line.course[row, m], share)
    line.when[row, LENGTH] *= share


@inner
def rest_series(feedback, line, past, room, region, count, clock, h, x):
    """Write a row of length h in which the mass is at rest."""
    delayed_series(feedback, line, past, room, h, True)
    room.q[:] = 0.0
    room.v[:] = 0.0
    room.q[0] = x
    begin_row(line, count, clock, h)
    write_series(feedback, line, room, region, count[ROWS] - 1, 0.0)


@kernel
def run(p, f, s, fb, line, room, laps, clock, state, count, events, end_turns, end_phase, most):
    """Advance to the end phase, writing events and the delay line; call again when they are full.

    `laps` are the delays for which an event, and the reaching of the limit, is a place where what
    is fed back is not smooth.
    """
    # A long body, for the reason that `simulate._stepping.run` gives; rests as in `_run.run`.
    spent = 0
    count[ROW_COUNT] = 0
    turned = False
    approach = state[APPROACH:]
    while True:
        if count[ROW_COUNT] + ROOM > len(events):
            return FULL
        if count[ROWS] + ROOM > len(line.laps):
            return LINE_FULL
        if spent >= most:
            return EXHAUSTED
        end = time_until(clock, end_turns, end_phase)
        if end <= REACHED:
            set_clock(clock, end_turns, end_phase)
            return DONE
        y, v = state[Q], state[V]
        if not (abs(y) < p.far and abs(v) < p.far):
            return DIVERGED
        past, smooth = recall(fb, line, count, clock)
        ahead = min(end, smooth)
        x = y + origin(p, count[MODE])
        region, edge = side_of_limit(fb, line, past, count, signal_of(fb, x, v))
        acting = under(f, fb, line, past, region)
        spent += 1
        count[LEG_COUNT] += 1

        balanced = False
        if v == 0.0:
            rest = count[MODE] - count[MODE] % 3
            leg = open_leg(p, s, clock[TURNS], clock[PHASE], clock[LOW], rest, approach, y, v)
            k = rigid_at(p, leg, y)
            if count[STUCK] != 0:
                low, high = holding(p, count[HOLDER])
                ahead = min(ahead, TURN)
                if fb.on:
                    # Within a row of what is fed back, so that no polynomial is fitted to several.
                    ahead = min(ahead, max(line.when[past.step, LENGTH] - past.offset, REACHED))
                tau, way = unstick(p, acting, leg, s, y, low, high, ahead)
                if way == 2:
                    return BROKEN
                if tau > 0:
                    rest_series(fb, line, past, room, region, count, clock, tau, x)
                    share, side, wrong = series_bound(fb, room, region, edge)
                    if wrong and not turned:
                        turn_back(line, count, region, edge)
                        turned = True
                        continue
                    turned = False
                    if share < 1.0 and side != 0:
                        end_series(line, count, share)
                        mark_limit(laps, count, region, side)
                        pass_time(clock, share * tau)
                        continue
                    pass_time(clock, tau)
                if way == 0:
                    continue
                count[STUCK] = 0
                if p.static > 0:
                    slide(count, way)
                count[LAPS] = laps[0]
                note(events, count, clock, state, RELEASE, count[HOLDER], 0.0)
                past, smooth = recall(fb, line, count, clock)
                ahead = min(end - tau, smooth)
                if ahead <= REACHED:
                    continue
                region, edge = side_of_limit(fb, line, past, count, signal_of(fb, x, v))
                acting = under(f, fb, line, past, region)
                balanced = p.static == p.kinetic
            elif k >= 0 or p.static > 0:
                way, balanced = departure(p, acting, leg, s, y, k)
                if way == 2:
                    return BROKEN
                if way == 0:
                    count[LAPS] = laps[0]
                    count[REGION], count[EDGE] = region, edge
                    hold(p, clock, state, count, events, k)
                    continue
                if p.static > 0:
                    slide(count, way)
        elif p.static > 0 and count[MODE] % 3 == 0:
            slide(count, 1 if v > 0 else -1)

        leg = open_leg(p, s, clock[TURNS], clock[PHASE], clock[LOW], count[MODE], approach, y, v)
        a = pull(acting, leg, s, 0.0, y, v)
        if not math.isfinite(a):
            return BROKEN if p.forced else DIVERGED
        number, due = begin_events(p, acting, leg, s, count[MODE], y, v, a, balanced)
        if due < 0:
            step = min(longest_step(leg, fb, p.fastest), ahead)
            step = delayed_series(fb, line, past, room, step, False)
            expand(leg, s.waves, fb, room, region, step, y, v)
            begin_row(line, count, clock, step)
            row = count[ROWS] - 1
            write_series(fb, line, room, region, row, leg.origin)
            share, side, wrong = series_bound(fb, room, region, edge)
            if wrong and not turned:
                turn_back(line, count, region, edge)
                turned = True
                continue
            turned = False
            for i in range(number):
                at = series_event(room, s.events[i])
                if at < min(share, 1.5):
                    due, share = i, at
            h = step
            if share < 1.0:
                h = share * step
                end_series(line, count, share)
                if due < 0:
                    mark_limit(laps, count, region, side)
            at = min(share, 1.0)
            dq, dv = gain_of(room.q, at), gain_of(room.v, at)
            state[Q], state[V] = y + dq, v + dv
            if touched(p, count[MODE]) == 0:  # else it is among what the contact loses
                state[LOST] += p.kinetic * abs(dq)
            state[SPEED] = max(state[SPEED], abs(state[V]))
            if h >= end:
                set_clock(clock, end_turns, end_phase)
            else:
                pass_time(clock, h)
            if due < 0:
                inside(p, state, count)
                continue
        left, past, region = settle(
            p, f, fb, line, laps, leg, s, clock, state, count, events, due, end_turns, end_phase
        )
        if left < 0:
            return BROKEN
        if left > 0:
            # What is left of a limit that is crossed within is not worth another row.
            k = int(s.events[due, OF_STOP])
            x = p.stops[k, PLACE]
            rest_series(fb, line, past, room, region, count, clock, left, x)
            pass_time(clock, left)
            count[LAPS] = laps[0]
            hold(p, clock, state, count, events, k)
