"""What follows an event: soft contacts, impacts and chatter, sticking, reversal."""

from __future__ import annotations

import math

from ..._compiling.compiled import kernel
from ...oscillators.laws import LAW, PLACE, PUSHER, RESTITUTION, RIGID, SIDE
from ..basis.delay import pushed_swing
from ..basis.events import (
    APPROACH,
    CONTACT_COUNT,
    FASTEST,
    HOLDER,
    IMPACT,
    IMPACT_COUNT,
    LOST,
    LOW,
    MODE,
    PART,
    PHASE,
    REVERSE,
    SPEED,
    STEP,
    STICK,
    STICK_COUNT,
    STUCK,
    TOUCH,
    TURNS,
    Q,
    V,
)
from ..exact.passing import CALM
from ..exact.passing import note as write
from .crossing import AGAIN, LEAVE, MEANING, OF_STOP, REACH, REST
from .rates import OUT, PUSHING, SLACK, WEIGHT, jerk, open_leg, origin, pull, status
from .rest import departure, rigid_at


@kernel
def become(p, state, count, k, new):
    """Change the digit of a stop in the mode, and the origin of the position."""
    old = origin(p, count[MODE])
    count[MODE] += (new - status(p, count[MODE], k)) * int(p.stops[k, WEIGHT])
    at = origin(p, count[MODE])
    if at != old:
        state[Q] += old - at
    state[STEP] = 0.0


@kernel
def slide(count, direction):
    """Change the digit of sliding in the mode."""
    count[MODE] += (0 if direction == 0 else (1 if direction > 0 else 2)) - count[MODE] % 3


@kernel
def note(events, count, clock, state, kind, k, approach):
    """Write one event."""
    write(events, count, clock, kind, k, count[MODE], state[Q], state[V], approach)


@kernel
def hold(clock, state, count, events, k):
    """Stick, to the rigid stop k or by friction alone (-1)."""
    state[V] = 0.0
    state[STEP] = 0.0
    count[STUCK] = 1
    count[STICK_COUNT] += 1
    count[HOLDER] = k
    slide(count, 0)
    note(events, count, clock, state, STICK, k, 0.0)


@kernel
def rest_or_turn(p, f, s, clock, state, count, events):
    """Handle a sliding mass that comes to rest: it reverses, unless the next pass finds it held."""
    state[V] = 0.0
    slide(count, 0)
    leg = open_leg(
        p, s, clock[TURNS], clock[PHASE], clock[LOW], count[MODE], state[APPROACH:], state[Q], 0.0
    )
    way, _ = departure(p, f, leg, s, state[Q], rigid_at(p, leg, state[Q]))
    if abs(way) == 1:
        slide(count, way)
        note(events, count, clock, state, REVERSE, -1, 0.0)


@kernel
def touched(p, mode):
    """Number of stops in contact."""
    number = 0
    for k in range(len(p.stops)):
        number += status(p, mode, k) == PUSHING
    return number


@kernel
def advance(p, state, count, dq, dv):
    """Take a step: displacement, velocity, the greatest that it was, and what friction takes."""
    state[Q] += dq
    state[V] += dv
    if touched(p, count[MODE]) == 0:  # else it is among what the contact loses
        state[LOST] += p.kinetic * abs(dq)
    state[SPEED] = max(state[SPEED], abs(state[V]))


@kernel
def change_contact(p, clock, state, count, events, kind, k):
    """Enter or leave contact with a soft stop, or pass one left behind.

    The energy lost at stops is the kinetic energy that was there before the first of them was
    touched less that after the last has parted.
    """
    before = touched(p, count[MODE])
    v = state[V]
    if kind in (REACH, AGAIN):
        become(p, state, count, k, PUSHING)
        if kind == REACH:
            state[Q] = p.stops[k, PLACE] - origin(p, count[MODE])
        count[IMPACT_COUNT] += 1
        count[CONTACT_COUNT] += 1
        state[FASTEST] = max(state[FASTEST], abs(v))
        state[APPROACH + k] = abs(v)
        state[LOST] += v * v / 2 if before == 0 else 0.0
        note(events, count, clock, state, TOUCH, k, abs(v))
        return
    if kind == LEAVE and p.stops[k, LAW] == PUSHER:
        depth = p.stops[k, SIDE] * (state[Q] - (p.stops[k, PLACE] - origin(p, count[MODE])))
        become(p, state, count, k, SLACK if depth > 0 else OUT)
    else:
        become(p, state, count, k, OUT)
        state[Q] = p.stops[k, PLACE] - origin(p, count[MODE])
    if kind == LEAVE:
        state[LOST] -= v * v / 2 if before == 1 else 0.0
        note(events, count, clock, state, PART, k, 0.0)


@kernel
def restitution_at(p, f, k, v):
    """Restitution coefficient of a rigid stop at an approach velocity; NaN if it cannot be."""
    if p.stops[k, RESTITUTION] >= 0:
        return p.stops[k, RESTITUTION]
    r = f.upper(v * p.omega) if p.stops[k, SIDE] > 0 else f.lower(v * p.omega)
    return r if 0 <= r <= 1 else math.nan


@kernel
def rebound(p, f, s, clock, state, count, events, k, calm):
    """Reverse the velocity at a rigid stop.

    Returns how long a chatter takes that is to be summed, and ends in a stick (0: there is none),
    or -1 if the user's restitution is none. It is summed where it ends within `calm`, the time in
    which the forces are smooth, and nothing that presses on the mass changes by much.
    """
    side = p.stops[k, SIDE]
    v = abs(state[V])
    r = restitution_at(p, f, k, v)
    if math.isnan(r):
        return -1.0
    out = r * v
    state[V] = -side * out if out > 0 else 0.0
    state[FASTEST] = max(state[FASTEST], v)
    free = touched(p, count[MODE]) == 0
    if free:
        state[LOST] += (v * v - out * out) / 2
    count[IMPACT_COUNT] += 1
    if p.static > 0:
        slide(count, 0 if out == 0.0 else -side)
    note(events, count, clock, state, IMPACT, k, v)
    if out == 0.0 or out > p.chatter * state[FASTEST] or r == 1.0:
        return 0.0
    rest = count[MODE] - count[MODE] % 3
    leg = open_leg(
        p, s, clock[TURNS], clock[PHASE], clock[LOW], rest, state[APPROACH:], state[Q], state[V]
    )  # fmt: skip
    pressing = side * pull(f, leg, s, 0.0, state[Q], 0.0)
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
    change = abs(jerk(p, f, leg, s, state[Q])) + most * left
    change += leg.rate * (pressing * (leg.damping > 0) + leg.rate * out)
    swing = pushed_swing(f.control, left, p.stops[k, PLACE], out)
    if change * left + swing > CALM * (pressing - p.static):
        return 0.0
    if free:
        state[LOST] += out * out / 2
    return left


@kernel
def settle_event(p, f, s, leg, clock, state, count, events, due, calm):
    """Handle the event `due` that a step has ended at.

    Returns, as `rebound` does, how long a chatter takes that ends in a stick at the stop of the
    event (0: there is none), or -1 if the user's restitution is none.
    """
    kind, k = int(s.events[due, MEANING]), int(s.events[due, OF_STOP])
    if kind == REST:
        rest_or_turn(p, f, s, clock, state, count, events)
        return 0.0
    if kind != REACH or p.stops[k, LAW] != RIGID:
        change_contact(p, clock, state, count, events, kind, k)
        return 0.0
    state[Q] = p.stops[k, PLACE] - leg.origin
    if p.stops[k, SIDE] * state[V] <= 0:  # closed at the very turning point
        state[V] = 0.0
        if p.static > 0:
            slide(count, 0)
        return 0.0
    return rebound(p, f, s, clock, state, count, events, k, calm)
