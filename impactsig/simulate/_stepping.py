"""The stepping engine: Runge-Kutta from event to event, for forces of any kind."""

from __future__ import annotations

import math

from ._contact import (
    APPROACH,
    BEGUN,
    HOLDER,
    SPEED,
    STEP,
    change_contact,
    hold,
    note,
    rebound,
    rest_or_turn,
    slide,
    touched,
)
from ._crossing import REACH, REST, earliest, halve, list_events, polish, zeros_at_start
from ._events import BROKEN, DIVERGED, DONE, EXHAUSTED, FULL, MARK, RELEASE
from ._flow import TURN, inner, kernel
from ._passing import pass_time
from ._rates import HERTZ, LAW, PLACE, PUSHING, RIGID, SIDE, open_leg, origin, pull, status
from ._rest import departure, holding, rigid_at, unstick
from ._step import stride

ROOM = 4  # rows that one pass of `run` may write, besides the first


@kernel
def run(p, tab, f, s, clock, state, count, events, end_turns, end_phase, most_steps):
    """Move to the end phase, writing events as rows; to be called again when they are full."""
    spent = 0
    count[5] = 0
    room = len(events)
    if room > 0 and count[BEGUN] == 0:
        # The loss of a contact under way is by its approach velocity, which a start does not tell.
        for k in range(len(p.stops)):
            if room < len(p.stops) + ROOM:
                return FULL
            if p.stops[k, LAW] == HERTZ and status(p, count[0], k) == PUSHING:
                note(events, count, clock, state, MARK, k, state[APPROACH + k])
        count[BEGUN] = 1
    approach = state[APPROACH:]
    while True:
        if room > 0 and count[5] + ROOM > room:
            return FULL
        if spent >= most_steps:
            return EXHAUSTED
        end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
        if end <= 0:
            return DONE
        y, v = state[0], state[1]
        if not (abs(y) < 1e140 and abs(v) < 1e140):
            return DIVERGED  # their squares would overflow
        balanced = False
        if v == 0.0:
            rest = count[0] - count[0] % 3
            leg = open_leg(p, s, clock[0], clock[1], clock[2], rest, approach, y, v)
            k = rigid_at(p, leg, y)
            if count[1] != 0:
                low, high = holding(p, count[HOLDER])
                wait = min(end, TURN)
                tau, way = unstick(p, f, leg, s, y, low, high, wait)
                if way == 2:
                    return BROKEN
                spent += 1
                count[6] += 1
                if tau >= end:
                    clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                    return DONE
                pass_time(clock, tau)
                if way == 0:
                    continue
                count[1] = 0
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
                    hold(p, clock, state, count, events, k)
                    continue
                if p.static > 0:
                    slide(count, way)
        elif p.static > 0 and count[0] % 3 == 0:
            slide(count, 1 if v > 0 else -1)

        leg = open_leg(p, s, clock[0], clock[1], clock[2], count[0], approach, y, v)
        a = pull(f, leg, s, 0.0, y, v)
        if not math.isfinite(a):
            return BROKEN if p.forced else DIVERGED
        number = list_events(p, s, leg, count[0], y, v)
        due = -1
        for i in range(number):
            zeros = zeros_at_start(p, f, leg, s, s.events[i], y, v, a, balanced)
            s.events[i, 5] = zeros
            if zeros < 0 and due < 0:
                due = i
        if due < 0:
            step, dq, dv, wish, tries = stride(
                p, tab, f, leg, s, state[STEP], end, y, v, a, state[SPEED]
            )
            spent += tries if p.fixed == 0 else 0
            count[6] += tries if p.fixed == 0 else 0
            if step == 0.0:
                return BROKEN if p.forced else DIVERGED
            if p.fixed > 0:
                due, step, dq, dv = halve(p, tab, f, leg, s, number, step, y, v, a, dq, dv)
            else:
                due, at = earliest(p, tab, f, leg, s, number, step, y, v, dq, dv)
                if due >= 0:
                    step, dq, dv = polish(
                        p, tab, f, leg, s, s.events[due], at * step, step, y, v, a
                    )
                else:
                    state[STEP] = wish
            turns = clock[0]
            state[0], state[1] = y + dq, v + dv
            if touched(p, count[0]) == 0:  # else it is among what the contact loses
                state[3] += p.kinetic * abs(dq)
            state[SPEED] = max(state[SPEED], abs(state[1]))
            if due < 0 and step >= end:
                clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                inside(p, state, count)
                return DONE
            pass_time(clock, step)
            if due < 0:
                if clock[0] > turns:
                    # Of the steps of fixed length, a turn's are one piece of work.
                    spent += 1 if p.fixed > 0 else 0
                    count[6] += 1 if p.fixed > 0 else 0
                    note(events, count, clock, state, MARK, -1, 0.0)
                continue
        spent += 1
        count[6] += 1
        end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
        kind, k = int(s.events[due, 3]), int(s.events[due, 4])
        if kind == REST:
            rest_or_turn(p, f, s, clock, state, count, events)
        elif kind == REACH and p.stops[k, LAW] == RIGID:
            state[0] = p.stops[k, PLACE] - leg.origin
            if p.stops[k, SIDE] * state[1] <= 0:  # closed at the very turning point
                state[1] = 0.0
                if p.static > 0:
                    slide(count, 0)
                continue
            left = rebound(p, f, s, clock, state, count, events, k, math.inf)
            if left < 0:
                return BROKEN
            if left > 0:
                if left >= end:
                    clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
                else:
                    pass_time(clock, left)
                hold(p, clock, state, count, events, k)
        else:
            change_contact(p, clock, state, count, events, kind, k)


@inner
def inside(p, state, count):
    """Take back what rounding has put behind a rigid stop."""
    at = origin(p, count[0])
    for k in range(len(p.stops)):
        if (
            p.stops[k, LAW] == RIGID
            and p.stops[k, SIDE] * (state[0] - (p.stops[k, PLACE] - at)) > 0
        ):
            state[0] = p.stops[k, PLACE] - at
