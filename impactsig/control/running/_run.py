"""Kernel for an oscillator under delayed feedback, from event to event.

As `simulate._stepping`, by the same steps, contacts and rows of events, with the control force
among what acts. Beside the events of the oscillator a step ends where the rows of the delay line
do: see `_rows`.
"""

from __future__ import annotations

import math

from ..._compiled import inner, kernel
from ...simulate.basis.delay import DISPLACEMENT, VELOCITY
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
    STEP,
    STUCK,
    TURN,
    TURNS,
    Q,
    V,
)
from ...simulate.basis.laws import PLACE
from ...simulate.basis.tableau import DEGREE
from ...simulate.exact.passing import pass_time, set_clock, time_until
from ...simulate.stepping.contact import hold, note, slide, touched
from ...simulate.stepping.crossing import (
    OF_STOP,
    ZEROS,
    begin_events,
    event_root,
    polish,
)
from ...simulate.stepping.rates import open_leg, origin, pull
from ...simulate.stepping.rest import departure, holding, rigid_at, unstick
from ...simulate.stepping.step import interpolate, stride, take
from ...simulate.stepping.stepping import inside
from ._force import bound, feed, signal_of
from ._rows import (
    EDGE,
    LAPS,
    REACHED,
    REGION,
    ROWS,
    begin_row,
    cross_limit,
    end_row,
    recall,
    rest_row,
    side_of_limit,
    turn_back,
)
from ._settling import settle, under

ROOM = 4  # rows that one pass may write


@inner
def write(feedback, line, past, room, region, s, leg, count, h, y, v):
    """Store the polynomials of the last step; `s.q`, `s.v` hold its increments."""
    course = line.course[count[ROWS] - 1]
    for n in range(DEGREE + 1):
        course[DISPLACEMENT, n] = y + s.q[n] + leg.origin
        course[VELOCITY, n] = v + s.v[n]
    feed(feedback, line, past, room, region, h, course)


@kernel
def run(
    p, tab, f, s, fb, line, room, laps, clock, state, count, events, end_turns, end_phase, most
):
    """Advance to the end phase, writing events and the delay line; call again when they are full.

    `laps` are the delays for which an event, and the reaching of the limit, is a place where what
    is fed back is not smooth.
    """
    # A long body, for the reason that `simulate._stepping.run` gives.
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
                    rest_row(fb, line, past, room, region, count, clock, tau, x)
                    share, side, wrong = bound(fb, room, region, edge)
                    if wrong and not turned:
                        turn_back(line, count, region, edge)
                        turned = True
                        continue
                    turned = False
                    if share < 1.0 and side != 0:
                        cross_limit(line, laps, count, share, region, side)
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
            step, dq, dv, wish, tries = stride(
                p, tab, acting, leg, s, state[STEP], ahead, y, v, a, state[SPEED]
            )
            spent += tries - 1
            count[LEG_COUNT] += tries - 1
            if step == 0.0:
                return BROKEN if p.forced else DIVERGED
            begin_row(line, count, clock, step)
            interpolate(tab, acting, leg, s, step, y, v, dq, dv)
            write(fb, line, past, room, region, s, leg, count, step, y, v)
            share, side, wrong = bound(fb, room, region, edge)
            if wrong and not turned:
                turn_back(line, count, region, edge)
                turned = True
                continue
            turned = False
            for i in range(number):
                at = event_root(s, s.events[i], int(s.events[i, ZEROS]))
                if at < min(share, 1.5):
                    due, share = i, at
            h = step
            if due >= 0:
                h, dq, dv = polish(
                    p, tab, acting, leg, s, s.events[due], share * step, step, y, v, a
                )
                if h < step:
                    end_row(line, count, h / step)
                    line.when[count[ROWS] - 1, 2] = h
            elif share < 1.0 and side != 0:
                h = share * step
                dq, dv = take(p.fixed, tab, acting, leg, s, h, y, v, a)
                cross_limit(line, laps, count, share, region, side)
            else:
                state[STEP] = wish
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
            rest_row(fb, line, past, room, region, count, clock, left, p.stops[k, PLACE])
            pass_time(clock, left)
            count[LAPS] = laps[0]
            hold(p, clock, state, count, events, k)
