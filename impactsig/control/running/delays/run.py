"""Kernel for an oscillator under delayed feedback, from event to event.

As `simulation.stepping.stepping`, by the same contacts and rows of events, with the control force
among what acts. Beside the events of the oscillator a step ends where the rows of the delay line
do: see `rows`. Steps are of the Runge-Kutta method or power series: see `_steps`.
"""

from __future__ import annotations

import math

from ...._compiling.compiled import kernel
from ....oscillators.laws import PLACE
from ....simulation.basis.events import (
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
    LOW,
    MODE,
    PHASE,
    RELEASE,
    ROW_COUNT,
    STUCK,
    TURN,
    TURNS,
    Q,
    V,
)
from ....simulation.exact.passing import pass_time, set_clock, time_until
from ....simulation.stepping.contact import advance, hold, note, slide
from ....simulation.stepping.crossing import (
    OF_STOP,
    begin_events,
)
from ....simulation.stepping.rates import open_leg, origin, pull
from ....simulation.stepping.rest import departure, holding, rigid_at, unstick
from ....simulation.stepping.stepping import inside
from ._roots import event_share, meet_limit
from ._settling import settle, under
from ._steps import end_step, rest_row, step_row
from .force import signal_of
from .rows import (
    EDGE,
    LAPS,
    REACHED,
    REGION,
    ROWS,
    cross_limit,
    recall,
    side_of_limit,
)

ROOM = 4  # rows that one pass may write


@kernel
def run(
    p, tab, f, s, fb, line, room, series, laps, clock, state, count, events, end_turns, end_phase,
    most,
):  # fmt: skip
    """Advance to the end phase, writing events and the delay line; call again when they are full.

    `laps` are the delays for which an event, and the reaching of the limit, is a place where what
    is fed back is not smooth.
    """
    # A long body, for the reason that `simulation.stepping.stepping.run` gives.
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
                    rest_row(fb, line, past, room, series, region, count, clock, tau, x)
                    share, side, turned = meet_limit(
                        fb, line, count, room, series, region, edge, turned
                    )
                    if turned:
                        continue
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
                    hold(clock, state, count, events, k)
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
            step, dq, dv, wish, tries = step_row(
                p, tab, acting, leg, s, fb, line, past, room, series, region, clock, state, count,
                ahead, y, v, a,
            )  # fmt: skip
            spent += tries - 1
            count[LEG_COUNT] += tries - 1
            if step == 0.0:
                return BROKEN if p.forced else DIVERGED
            share, side, turned = meet_limit(fb, line, count, room, series, region, edge, turned)
            if turned:
                continue
            for i in range(number):
                at = event_share(s, series, s.events[i])
                if at < min(share, 1.5):
                    due, share = i, at
            h, dq, dv = end_step(
                p, tab, acting, leg, s, line, series, laps, state, count, region, side, due, share,
                step, wish, dq, dv, y, v, a,
            )  # fmt: skip
            advance(p, state, count, dq, dv)
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
            rest_row(fb, line, past, room, series, region, count, clock, left, p.stops[k, PLACE])
            pass_time(clock, left)
            count[LAPS] = laps[0]
            hold(clock, state, count, events, k)
