"""What follows an event: soft contacts, impacts and chatter, sticking, and turning.

The state goes on after the contract's entries (see `_events`) with: step, greatest speed, and for
each stop the approach velocity of its last contact. The counters: stop that holds the mass (-1:
friction alone), and whether rows have been written.
"""

from __future__ import annotations

import math

from ._crossing import AGAIN, LEAVE, REACH
from ._delay import pushed_swing
from ._events import IMPACT, PART, REVERSE, STICK, TOUCH
from ._flow import inner
from ._passing import CALM
from ._rates import (
    LAW,
    OUT,
    PLACE,
    PUSHER,
    PUSHING,
    RESTITUTION,
    SIDE,
    SLACK,
    WEIGHT,
    jerk,
    open_leg,
    origin,
    pull,
    status,
)
from ._rest import departure, rigid_at

STEP, SPEED, APPROACH = 4, 5, 6
HOLDER, BEGUN = 7, 8


@inner
def become(p, state, count, k, new):
    """Change the digit of a stop, and count the position from the new origin."""
    old = origin(p, count[0])
    count[0] += (new - status(p, count[0], k)) * int(p.stops[k, WEIGHT])
    at = origin(p, count[0])
    if at != old:
        state[0] += old - at
    state[STEP] = 0.0


@inner
def slide(count, direction):
    """Change the digit of sliding."""
    count[0] += (0 if direction == 0 else (1 if direction > 0 else 2)) - count[0] % 3


@inner
def note(events, count, clock, state, kind, k, approach):
    """Write one event."""
    if len(events) == 0:
        return
    row = events[count[5]]
    row[0], row[1], row[2], row[3] = clock[0], clock[1], kind, k
    row[4], row[5], row[6], row[7] = count[0], state[0], state[1], approach
    count[5] += 1


@inner
def hold(p, clock, state, count, events, k):
    """Stick, to the rigid stop k or by friction alone (-1)."""
    state[1] = 0.0
    state[STEP] = 0.0
    count[1] = 1
    count[3] += 1
    count[HOLDER] = k
    slide(count, 0)
    note(events, count, clock, state, STICK, k, 0.0)


@inner
def rest_or_turn(p, f, s, clock, state, count, events):
    """A sliding mass comes to rest: it turns, unless it is held (which the next pass finds)."""
    state[1] = 0.0
    slide(count, 0)
    leg = open_leg(p, s, clock[0], clock[1], clock[2], count[0], state[APPROACH:], state[0], 0.0)
    way, _ = departure(p, f, leg, s, state[0], rigid_at(p, leg, state[0]))
    if abs(way) == 1:
        slide(count, way)
        note(events, count, clock, state, REVERSE, -1, 0.0)


@inner
def touched(p, mode):
    """How many stops push."""
    number = 0
    for k in range(len(p.stops)):
        number += status(p, mode, k) == PUSHING
    return number


@inner
def change_contact(p, clock, state, count, events, kind, k):
    """Touch a soft stop, or part from it, or pass one left behind.

    The energy lost at stops is the kinetic energy that was there before the first of them was
    touched less that after the last has parted.
    """
    before = touched(p, count[0])
    v = state[1]
    if kind in (REACH, AGAIN):
        become(p, state, count, k, PUSHING)
        if kind == REACH:
            state[0] = p.stops[k, PLACE] - origin(p, count[0])
        count[2] += 1
        count[4] += 1
        state[2] = max(state[2], abs(v))
        state[APPROACH + k] = abs(v)
        state[3] += v * v / 2 if before == 0 else 0.0
        note(events, count, clock, state, TOUCH, k, abs(v))
        return
    if kind == LEAVE and p.stops[k, LAW] == PUSHER:
        depth = p.stops[k, SIDE] * (state[0] - (p.stops[k, PLACE] - origin(p, count[0])))
        become(p, state, count, k, SLACK if depth > 0 else OUT)
    else:
        become(p, state, count, k, OUT)
        state[0] = p.stops[k, PLACE] - origin(p, count[0])
    if kind == LEAVE:
        state[3] -= v * v / 2 if before == 1 else 0.0
        note(events, count, clock, state, PART, k, 0.0)


@inner
def restitution_at(p, f, k, v):
    """Restitution coefficient of a rigid stop at an approach velocity; NaN if it cannot be."""
    if p.stops[k, RESTITUTION] >= 0:
        return p.stops[k, RESTITUTION]
    r = f.upper(v * p.omega) if p.stops[k, SIDE] > 0 else f.lower(v * p.omega)
    return r if 0 <= r <= 1 else math.nan


@inner
def rebound(p, f, s, clock, state, count, events, k, calm):
    """Reset the velocity at a rigid stop.

    Returns how long a chatter takes that is to be summed, and ends in a stick (0: there is none),
    or -1 if the user's restitution is none. It is summed where it ends within `calm`, the time in
    which the forces are smooth, and nothing that presses on the mass changes by much.
    """
    side = p.stops[k, SIDE]
    v = abs(state[1])
    r = restitution_at(p, f, k, v)
    if math.isnan(r):
        return -1.0
    out = r * v
    state[1] = -side * out if out > 0 else 0.0
    state[2] = max(state[2], v)
    free = touched(p, count[0]) == 0
    if free:
        state[3] += (v * v - out * out) / 2
    count[2] += 1
    if p.static > 0:
        slide(count, 0 if out == 0.0 else -side)
    note(events, count, clock, state, IMPACT, k, v)
    if out == 0.0 or out > p.chatter * state[2] or r == 1.0:
        return 0.0
    rest = count[0] - count[0] % 3
    leg = open_leg(
        p, s, clock[0], clock[1], clock[2], rest, state[APPROACH:], state[0], state[1]
    )  # fmt: skip
    pressing = side * pull(f, leg, s, 0.0, state[0], 0.0)
    if not pressing > p.static:
        return 0.0
    # Friction shortens the way out and slows the way back.
    up, down = pressing + p.kinetic, pressing - p.kinetic
    kept = math.sqrt(down / up)
    if p.stops[k, RESTITUTION] >= 0:
        left = out * (1 / up + kept / down) / (1 - r * kept)
    else:
        left, speed = 0.0, out
        for _ in range(100_000):
            part = speed * (1 / up + kept / down)
            left += part
            if part <= 1e-16 * left:
                break
            share = restitution_at(p, f, k, kept * speed)
            if math.isnan(share):
                return -1.0
            speed *= kept * share
    if left >= calm:
        return 0.0
    most = 0.0
    for j in range(len(p.waves)):
        most += abs(p.waves[j, 1]) * p.waves[j, 0] ** 2
    change = abs(jerk(p, f, leg, s, state[0])) + most * left
    change += leg.rate * (pressing * (leg.damping > 0) + leg.rate * out)
    swing = pushed_swing(f.control, left, p.stops[k, PLACE], out)
    if change * left + swing > CALM * (pressing - p.static):
        return 0.0
    if free:
        state[3] += out * out / 2
    return left
