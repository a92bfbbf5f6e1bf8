"""The stepping engine: Runge-Kutta from event to event, for forces of any kind."""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ...oscillators.laws import HERTZ, LAW, PLACE, RIGID, SIDE
from ..basis.events import (
    APPROACH,
    BEGUN,
    BROKEN,
    DIVERGED,
    DONE,
    EXHAUSTED,
    FULL,
    HOLDER,
    LEG_COUNT,
    LOW,
    MARK,
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
from ..exact.passing import pass_time, set_clock, time_until
from .contact import advance, hold, note, settle_event, slide
from .crossing import OF_STOP, begin_events, earliest, halve, polish
from .rates import PUSHING, open_leg, origin, pull, status
from .rest import departure, holding, rigid_at, unstick
from .step import stride

ROOM = 4  # rows that one pass of `run` may write, besides the first


@kernel
def run(p, tab, f, s, clock, state, count, events, end_turns, end_phase, most_steps):
    """Move to the end phase, writing events as rows; to be called again when they are full."""
    # A long body, as what is decided here is so by numbers of the whole pass; what could be taken
    # apart is in `contact`, `crossing`, `rest` and `step`.
    spent = 0
    count[ROW_COUNT] = 0
    room = len(events)
    if room > 0 and count[BEGUN] == 0:
        # The loss of a contact under way is by its approach velocity, which a start does not tell.
        for k in range(len(p.stops)):
            if room < len(p.stops) + ROOM:
                return FULL
            if p.stops[k, LAW] == HERTZ and status(p, count[MODE], k) == PUSHING:
                note(events, count, clock, state, MARK, k, state[APPROACH + k])
        count[BEGUN] = 1
    approach = state[APPROACH:]
    while True:
        if room > 0 and count[ROW_COUNT] + ROOM > room:
            return FULL
        if spent >= most_steps:
            return EXHAUSTED
        end = time_until(clock, end_turns, end_phase)
        if end <= 0:
            return DONE
        y, v = state[Q], state[V]
        if not (abs(y) < p.far and abs(v) < p.far):
            return DIVERGED
        balanced = False
        if v == 0.0:
            rest = count[MODE] - count[MODE] % 3
            leg = open_leg(p, s, clock[TURNS], clock[PHASE], clock[LOW], rest, approach, y, v)
            k = rigid_at(p, leg, y)
            if count[STUCK] != 0:
                low, high = holding(p, count[HOLDER])
                wait = min(end, TURN)
                tau, way = unstick(p, f, leg, s, y, low, high, wait)
                if way == 2:
                    return BROKEN
                spent += 1
                count[LEG_COUNT] += 1
                if tau >= end:
                    set_clock(clock, end_turns, end_phase)
                    return DONE
                pass_time(clock, tau)
                if way == 0:
                    continue
                count[STUCK] = 0
                if p.static > 0:
                    slide(count, way)
                note(events, count, clock, state, RELEASE, count[HOLDER], 0.0)
                end -= tau
                balanced = p.static == p.kinetic
            elif k >= 0 or p.static > 0:
                way, balanced = departure(p, f, leg, s, y, k)
                if way == 2:
                    return BROKEN
                if way == 0:
                    hold(clock, state, count, events, k)
                    continue
                if p.static > 0:
                    slide(count, way)
        elif p.static > 0 and count[MODE] % 3 == 0:
            slide(count, 1 if v > 0 else -1)

        leg = open_leg(p, s, clock[TURNS], clock[PHASE], clock[LOW], count[MODE], approach, y, v)
        a = pull(f, leg, s, 0.0, y, v)
        if not math.isfinite(a):
            return BROKEN if p.forced else DIVERGED
        number, due = begin_events(p, f, leg, s, count[MODE], y, v, a, balanced)
        if due < 0:
            step, dq, dv, wish, tries = stride(
                p, tab, f, leg, s, state[STEP], end, y, v, a, state[SPEED]
            )
            spent += tries if p.fixed == 0 else 0
            count[LEG_COUNT] += tries if p.fixed == 0 else 0
            if step == 0.0:
                return BROKEN if p.forced else DIVERGED
            if p.fixed > 0:
                due, step, dq, dv = halve(f, leg, s, number, step, y, v, a, dq, dv)
            else:
                due, at = earliest(tab, f, leg, s, number, step, y, v, dq, dv)
                if due >= 0:
                    step, dq, dv = polish(
                        p, tab, f, leg, s, s.events[due], at * step, step, y, v, a
                    )
                else:
                    state[STEP] = wish
            turns = clock[TURNS]
            advance(p, state, count, dq, dv)
            if due < 0 and step >= end:
                set_clock(clock, end_turns, end_phase)
                inside(p, state, count)
                return DONE
            pass_time(clock, step)
            if due < 0:
                if clock[TURNS] > turns:
                    # Of the steps of fixed length, a turn's are one piece of work.
                    spent += 1 if p.fixed > 0 else 0
                    count[LEG_COUNT] += 1 if p.fixed > 0 else 0
                    note(events, count, clock, state, MARK, -1, 0.0)
                continue
        spent += 1
        count[LEG_COUNT] += 1
        end = time_until(clock, end_turns, end_phase)
        left = settle_event(p, f, s, leg, clock, state, count, events, due, math.inf)
        if left < 0:
            return BROKEN
        if left > 0:
            if left >= end:
                set_clock(clock, end_turns, end_phase)
            else:
                pass_time(clock, left)
            hold(clock, state, count, events, int(s.events[due, OF_STOP]))


@kernel
def inside(p, state, count):
    """Correct positions that rounding has put behind a rigid stop."""
    at = origin(p, count[MODE])
    for k in range(len(p.stops)):
        if (
            p.stops[k, LAW] == RIGID
            and p.stops[k, SIDE] * (state[Q] - (p.stops[k, PLACE] - at)) > 0
        ):
            state[Q] = p.stops[k, PLACE] - at
