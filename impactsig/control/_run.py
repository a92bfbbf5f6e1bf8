"""Kernel: an oscillator under delayed feedback, from event to event.

As `simulate._stepping`, whose modes, contacts and rows of events it shares. Beside the events of
the oscillator a step ends where the control force reaches its limit or comes back from it, and one
delay after each place where what is fed back was not smooth; each time an order smoother, until
the method takes no notice of it.
"""

from __future__ import annotations

import math

from ..simulate._contact import (
    BEGUN,
    HOLDER,
    SPEED,
    STEP,
    change_contact,
    hold,
    note,
    slide,
    touched,
)
from ..simulate._crossing import (
    REACH,
    REST,
    event_root,
    list_events,
    zeros_at_start,
)
from ..simulate._events import BROKEN, DIVERGED, DONE, EXHAUSTED, FULL, RELEASE
from ..simulate._flow import TURN, inner, kernel
from ..simulate._passing import pass_time
from ..simulate._rates import LAW, PLACE, RIGID, SIDE, open_leg, pull
from ..simulate._rest import holding, rigid_at
from ..simulate._stepping import inside
from ..simulate._tableau import DEGREE
from ._line import DISPLACEMENT, VELOCITY, cut, read, since
from ._rest import departure, rebound, rest_or_turn, unstick
from ._step import NONE, Past, bound, feed, force, interpolate, stride, take

LONG = 9  # status: no row of the delay line is left
# Counters after those of `simulate._contact`: rows of the delay line; the row that what is fed
# back now comes from; the first row of the phase; delays for which the beginning of the next row
# is no smooth place; side of the limit that the force is beyond, and that it is at.
ROWS, AT, FIRST, LAPS, REGION, EDGE = range(BEGUN + 1, BEGUN + 7)
COUNTS = EDGE + 1
ROOM = 4  # rows that one pass may write
REACHED = 1e-14  # of the phase: rounding


@inner
def recall(fb, line, count, clock):
    """Where what is fed back is found now, and the time for which it is smooth."""
    number = count[ROWS]
    if not fb.on:
        return Past(0, 0, 0, 0.0), math.inf
    turns, phase = clock[0] - fb.turns, clock[1] - fb.phase
    j = count[AT]
    while j + 1 < number:
        ahead = since(line, j + 1, turns, phase) + clock[2]
        if ahead < -REACHED or (ahead < 0 and line.laps[j + 1] == 0):
            break
        j += 1
        if line.laps[j] > 0:
            count[LAPS] = max(count[LAPS], line.laps[j] - 1)
            count[EDGE] = 0
    count[AT] = j
    last = j
    while last + 1 < number and line.laps[last + 1] == 0:
        last += 1
    smooth = fb.delay
    if last + 1 < number:
        smooth = min(smooth, -since(line, last + 1, turns, phase) - clock[2])
    return Past(j, last, count[FIRST], max(since(line, j, turns, phase) + clock[2], 0.0)), smooth


@inner
def begin_row(line, count, clock, h):
    """A row for a step of h from now; its courses are `line.course[count[ROWS] - 1]`."""
    j = count[ROWS]
    line.when[j, 0], line.when[j, 1], line.when[j, 2] = clock[0], clock[1] + clock[2], h
    line.laps[j] = count[LAPS]
    count[LAPS] = 0
    count[ROWS] = j + 1


@inner
def rest_row(fb, line, past, room, s, laps, count, clock, h, x):
    """A row in which the mass rests, to h or to where the force reaches its limit; its length."""
    region, edge = side_of_limit(fb, line, past, count, x, 0.0)
    begin_row(line, count, clock, h)
    course = line.course[count[ROWS] - 1]
    for n in range(DEGREE + 1):
        course[DISPLACEMENT, n], course[VELOCITY, n] = x, 0.0
    feed(fb, line, past, room, region, h, course)
    if fb.on:
        share, side, wrong = bound(fb, room, s, region, edge)
        if wrong:
            region = edge if region == 0 else 0
            feed(fb, line, past, room, region, h, course)
            share, side, wrong = bound(fb, room, s, region, edge)
        if share < 1.0 and side != 0:
            h *= share
            cross_limit(line, laps, count, course, share, region, side)
    return h


@inner
def side_of_limit(fb, line, past, count, y, v):
    """The limit that the force is beyond, or 0; and the limit that it is just at, or 0."""
    region, edge = 0, 0
    if fb.on:
        late = read(line, past.step, past.last, past.first, fb.signal, past.offset)
        control = force(fb, 0, late, y, v)
        edge = count[EDGE]
        if edge != 0:
            region = count[REGION]
        elif abs(control) > fb.limit:
            region = 1 if control > 0 else -1
        count[EDGE] = 0
    return region, edge


@inner
def cross_limit(line, laps, count, course, share, region, side):
    """End the row where the force reaches a limit, or comes back from it."""
    for m in range(len(course)):
        cut(course[m], share)
    line.when[count[ROWS] - 1, 2] *= share
    count[EDGE] = side
    count[REGION] = side if region == 0 else 0
    count[LAPS] = laps[1]


@kernel
def run(
    p, tab, f, s, fb, line, room, laps, clock, state, count, events, end_turns, end_phase, most
):
    """Move to the end phase, writing events and the delay line; to be called again when full.

    `laps` are the delays for which an event, and the reaching of the limit, is a place where what
    is fed back is not smooth.
    """
    spent = 0
    count[5] = 0
    turned = False
    approach = state[SPEED + 1 :]
    while True:
        if count[5] + ROOM > len(events):
            return FULL
        if count[ROWS] + ROOM > len(line.laps):
            return LONG
        if spent >= most:
            return EXHAUSTED
        end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
        if end <= REACHED:
            clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
            return DONE
        y, v = state[0], state[1]
        if not (abs(y) < 1e140 and abs(v) < 1e140):
            return DIVERGED  # their squares would overflow
        past, smooth = recall(fb, line, count, clock)
        ahead = min(end, smooth)
        spent += 1
        count[6] += 1

        balanced = False
        if v == 0.0:
            rest = count[0] - count[0] % 3
            leg = open_leg(p, s, clock[0], clock[1], clock[2], rest, approach, y, v)
            k = rigid_at(p, leg, y)
            if count[1] != 0:
                low, high = holding(p, count[HOLDER])
                ahead = min(ahead, TURN)
                if fb.on:
                    # Within a row of what is fed back, so that no polynomial is fitted to several.
                    ahead = min(ahead, max(line.when[past.step, 2] - past.offset, REACHED))
                tau, way = unstick(p, f, leg, s, fb, line, past, y, low, high, ahead)
                if way == 2:
                    return BROKEN
                if tau > 0:
                    h = rest_row(
                        fb, line, past, room, s, laps, count, clock, tau, y + leg.origin
                    )  # fmt: skip
                    pass_time(clock, h)
                    if h < tau:
                        continue
                if way == 0:
                    continue
                count[1] = 0
                if p.static > 0:
                    slide(count, way)
                count[LAPS] = laps[0]
                note(events, count, clock, state, RELEASE, count[HOLDER], 0.0)
                past, smooth = recall(fb, line, count, clock)
                ahead = min(end - tau, smooth)
                if ahead <= REACHED:
                    continue
                balanced = p.static == p.kinetic
            elif k >= 0 or p.static > 0:
                way, balanced = departure(p, f, leg, s, fb, line, past, y, k)
                if way == 2:
                    return BROKEN
                if way == 0:
                    count[LAPS] = laps[0]
                    hold(p, clock, state, count, events, k)
                    continue
                if p.static > 0:
                    slide(count, way)
        elif p.static > 0 and count[0] % 3 == 0:
            slide(count, 1 if v > 0 else -1)

        leg = open_leg(p, s, clock[0], clock[1], clock[2], count[0], approach, y, v)
        a = pull(f, leg, s, 0.0, y, v)
        region, edge = side_of_limit(fb, line, past, count, y + leg.origin, v)
        if fb.on:
            late = read(line, past.step, past.last, past.first, fb.signal, past.offset)
            a += force(fb, region, late, y + leg.origin, v)
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
                p, tab, f, leg, s, fb, line, past, room, region, state[STEP], ahead, y, v, a,
                state[SPEED],
            )  # fmt: skip
            spent += tries - 1
            count[6] += tries - 1
            if step == 0.0:
                return BROKEN if p.forced else DIVERGED
            begin_row(line, count, clock, step)
            course = line.course[count[ROWS] - 1]
            interpolate(
                tab, f, leg, s, fb, line, past, room, region, step, y, v, dq, dv, course
            )  # fmt: skip
            share, side, wrong = NONE, 0, False
            if fb.on:
                share, side, wrong = bound(fb, room, s, region, edge)
            if wrong and not turned:
                # At the limit the force turned back: the step is taken again on that side of it.
                count[ROWS] -= 1
                count[LAPS] = line.laps[count[ROWS]]
                count[REGION], count[EDGE] = edge if region == 0 else 0, edge
                turned = True
                continue
            turned = False
            for i in range(number):
                x = event_root(s, s.events[i], int(s.events[i, 5]))
                if x < min(share, 1.5):
                    due, share = i, x
            h = step
            if due >= 0:
                h, dq, dv = polish(
                    tab, f, leg, s, fb, line, past, room, region, s.events[due], share * step,
                    step, y, v, a,
                )  # fmt: skip
                count[LAPS] = laps[0]
            elif share < 1.0 and side != 0:
                h = share * step
                dq, dv = take(tab, f, leg, s, fb, line, past, room, region, h, y, v, a)
                cross_limit(line, laps, count, course, share, region, side)
            else:
                state[STEP] = wish
            if due >= 0 and h < step:
                for m in range(len(course)):
                    cut(course[m], h / step)
                line.when[count[ROWS] - 1, 2] = h
            state[0], state[1] = y + dq, v + dv
            if touched(p, count[0]) == 0:  # else it is among what the contact loses
                state[3] += p.kinetic * abs(dq)
            state[SPEED] = max(state[SPEED], abs(state[1]))
            if h >= end:
                clock[0], clock[1], clock[2] = end_turns, end_phase, 0.0
            else:
                pass_time(clock, h)
            if due < 0:
                inside(p, state, count)
                continue
        kind, k = int(s.events[due, 3]), int(s.events[due, 4])
        count[LAPS] = laps[0]
        if kind == REST:
            past, smooth = recall(fb, line, count, clock)
            rest_or_turn(p, f, s, fb, line, past, clock, state, count, events)
        elif kind == REACH and p.stops[k, LAW] == RIGID:
            state[0] = p.stops[k, PLACE] - leg.origin
            if p.stops[k, SIDE] * state[1] <= 0:  # closed at the very turning point
                state[1] = 0.0
                if p.static > 0:
                    slide(count, 0)
                continue
            past, smooth = recall(fb, line, count, clock)
            end = (end_turns - clock[0]) * TURN + (end_phase - clock[1]) - clock[2]
            left = rebound(
                p, f, s, fb, line, past, clock, state, count, events, k, min(end, smooth)
            )  # fmt: skip
            if left < 0:
                return BROKEN
            if left > 0:
                # What is left of a limit that is crossed within is not worth another row.
                rest_row(fb, line, past, room, s, laps, count, clock, left, p.stops[k, PLACE])
                line.when[count[ROWS] - 1, 2] = left
                pass_time(clock, left)
                count[LAPS] = laps[0]
                hold(p, clock, state, count, events, k)
        else:
            change_contact(p, clock, state, count, events, kind, k)


@inner
def polish(tab, f, leg, s, fb, line, past, room, region, row, h, most, y, v, a):
    """The step that ends at an event, from its instant on the interpolant.

    As `simulate._crossing.polish`: Newton's iteration on the length of the step itself. Where that
    leads away, the event grazes, and the interpolant has the last word.
    """
    first = h
    dq, dv = take(tab, f, leg, s, fb, line, past, room, region, h, y, v, a)
    last = math.inf
    for _ in range(8):
        at = row[0] + row[1] * dq + row[2] * dv
        slope = row[1] * (v + dv) + row[2] * s.kv[12]
        if not slope < 0:
            break
        move = -at / slope
        if abs(move) > 1e-3 * first or not abs(move) < last or h + move <= 0 or h + move > most:
            break
        last = abs(move)
        h += move
        dq, dv = take(tab, f, leg, s, fb, line, past, room, region, h, y, v, a)
        if last <= 4e-16 * h:
            break
    return h, dq, dv
